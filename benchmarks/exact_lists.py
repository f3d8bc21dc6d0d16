"""Lists of all solutions and verdicts on uniqueness against exact arithmetic.

    python benchmarks/exact_lists.py [--plane 5000] [--space 300] [--seed 1] [--output FOLDER]
                                     [--kept FILE] [--at-most SECONDS] [--skewed]

With --kept what was done is written to a file after every problem, and a later run goes on
from there; --at-most ends a run after so many CPU seconds, and the page says how far it came.
With --skewed W is unsymmetric in every family, and the page is exact_lists_skewed.md.

Random problems with loads that cancel, W that is nearly singular, contacts of very different
size, and what else makes solutions hard to tell apart.  The truth comes from rational numbers
(`exact_oracle`, `exact_oracle_discs`), not from the package.  Writes exact_lists.md.
"""

from __future__ import annotations

import argparse
import json
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import exact_oracle
import exact_oracle_discs
import numpy as np
from machine import describe
from numpy.typing import NDArray

import amontons as am
from amontons.analysis.certificates.load_multipliers import load_multipliers
from amontons.analysis.certificates.uniqueness import Verdict
from amontons.analysis.scaled import Scaled
from amontons.analysis.solutions.discs.known import NEAR

Array = NDArray[np.float64]
Generator = np.random.Generator
LIMIT = 10.0  # seconds for one question
ROUNDING = 1e-13  # smallest eigenvalue of W, relative, below which a set is one by rounding
Case = tuple[Array, Array, Array]  # W, q, mu
Definite = Callable[[Generator, int], Array]  # a W of so many rows
NOTE = """\
{plane} problems in 2D (up to five contacts) and {space} in 3D (up to two), seed {seed}.
False: a verdict that exact arithmetic refutes, or an entry that is said to be exactly one
solution and is none. Missed: a solution that a complete list lacks, by place or by pattern.
Border: a determinant or sign is zero in exact arithmetic too; there only missed solutions are
counted. By contacts: multipliers of every contact (`load_multipliers`) prove one of the exact
solutions to be the only one; false where it is not. Every other problem of a family has its
contacts in another order, each in units of its own.
"""


# ---------------------------------------------------------------- problems
def _spd(random: Generator, m: int, least: float = 0.05) -> Array:
    A = random.standard_normal((m, m + 1))
    return A @ A.T / m + least * np.eye(m)


def _skewed(random: Generator, m: int) -> Array:
    """A definite matrix with a skew part, from little to as large as the rest."""
    skew = random.standard_normal((m, m))
    return _spd(random, m) + random.uniform(0, 1) / np.sqrt(m) * (skew - skew.T)


def _friction(random: Generator, nc: int) -> Array:
    mu = random.uniform(0.1, 3.0, nc) * 10.0 ** random.uniform(-0.5, 0.5)
    mu[random.random(nc) < 0.05] = 0.0
    return mu


def plain(random: Generator, nc: int, d: int, definite: Definite = _spd) -> Case:
    """Nothing special but strong coupling."""
    return definite(random, nc * d), random.standard_normal((nc, d)), _friction(random, nc)


def several(random: Generator, nc: int, d: int, definite: Definite = _spd) -> Case:
    """Contacts that have three solutions each, weakly coupled."""
    one = np.eye(d)
    one[0, 1] = one[1, 0] = 0.8
    W = np.kron(np.eye(nc), one) + 0.02 * definite(random, nc * d)
    q = np.abs(random.standard_normal((nc, d)))
    return W, q, random.uniform(1.0, 4.0, nc)


def cancelling(random: Generator, nc: int, d: int, definite: Definite = _spd) -> Case:
    """The load of the last contact is the small rest of large terms."""
    family = several if random.random() < 0.7 else plain
    W, q, mu = family(random, nc, d, definite)
    if nc == 1:
        return W, q, mu
    mix = random.standard_normal((d, (nc - 1) * d)) * 0.5
    L = np.eye(nc * d)
    L[-d:, :-d] = mix  # W stays definite, the last contact feels the others
    W = L @ W @ L.T
    pressed = np.zeros((nc, d))
    pressed[:-1, 0] = random.uniform(0.5, 2.0, nc - 1)
    pressed[:-1, 1] = random.uniform(-0.5, 0.5, nc - 1) * mu[:-1] * pressed[:-1, 0]
    small = 10.0 ** random.uniform(-14, -1)
    rest = q.copy()
    rest[:-1] *= random.choice([0.0, 1.0])
    return W, small * rest - (W @ pressed.ravel()).reshape(nc, d), mu


def nearly_singular(random: Generator, nc: int, d: int, definite: Definite = _spd) -> Case:
    """Some tiny eigenvalues."""
    m = nc * d
    Q = np.linalg.qr(random.standard_normal((m, m)))[0]
    values = random.uniform(0.05, 2.0, m)
    values[: random.integers(1, max(2, m // 2) + 1)] = 10.0 ** random.uniform(-13, -3)
    W = Q @ np.diag(values) @ Q.T
    W = (W + W.T) / 2
    if definite is not _spd:
        more = definite(random, m)
        W = W + (more - more.T) / 2
    return W, random.standard_normal((nc, d)), _friction(random, nc)


def mixed_scales(random: Generator, nc: int, d: int, definite: Definite = _spd) -> Case:
    """Each contact in units of its own, loads far apart."""
    W, q, mu = (several, plain, cancelling)[random.integers(3)](random, nc, d, definite)
    scale = 10.0 ** random.uniform(-9, 9, nc)
    each = np.repeat(scale, d)
    load = 10.0 ** random.uniform(-5, 0, (nc, 1)) if random.random() < 0.5 else 1.0
    return W * each * each[:, None], q * scale[:, None] * load, mu


def not_symmetric(random: Generator, nc: int, d: int, definite: Definite = _spd) -> Case:
    """A definite W with a skew part that is larger than the rest."""
    W, q, mu = plain(random, nc, d, definite)
    skew = random.standard_normal(W.shape)
    return W + random.uniform(0, 1) * (skew - skew.T), q, mu


def near_border(random: Generator, nc: int, d: int, definite: Definite = _spd) -> Case:
    """A solution next to a border of the law, or on it."""
    W, _, mu = (several if random.random() < 0.5 else plain)(random, nc, d, definite)
    r, u = np.zeros((2, nc, d))
    for i in range(nc):
        kind = random.integers(4)
        if kind == 0:
            u[i, 0] = random.choice([0.0, 1.0])
        else:
            r[i, 0] = random.uniform(0.5, 1.5)
            r[i, 1] = mu[i] * r[i, 0] * (1.0 if kind > 1 else random.uniform(-1, 1))
            u[i, 1] = -random.uniform(0.1, 1) if kind == 3 and mu[i] else 0.0
    q = u - (W @ r.ravel()).reshape(nc, d)
    return W, q + 10.0 ** random.uniform(-16, -6) * random.standard_normal((nc, d)), mu


FAMILIES: dict[str, Callable[[Generator, int, int, Definite], Case]] = {
    "plain": plain, "several": several, "cancelling": cancelling,
    "nearly singular": nearly_singular, "mixed scales": mixed_scales,
    "not symmetric": not_symmetric, "near a border": near_border,
}  # fmt: skip


def draw(number: int, seed: int, d: int, definite: Definite = _spd) -> tuple[str, Case]:
    """Problem `number`: its family, and W, q, mu."""
    random = np.random.default_rng([seed, d, number])
    names = list(FAMILIES)
    name = names[number % len(names)]
    nc = int(random.integers(1, 6 if d == 2 else 3))
    case = FAMILIES[name](random, nc, d, definite)
    return name, case if number // len(names) % 2 else turned(random, case)


def turned(random: Generator, case: Case) -> Case:
    """The same problem, contacts in another order and each in units of its own, 2^-20 to 2^20.

    Powers of two, so that nothing is rounded.
    """
    W, q, mu = case
    nc, d = q.shape
    order = random.permutation(nc)
    rows = (d * order[:, None] + np.arange(d)).ravel()
    scale = 2.0 ** random.integers(-20, 21, nc)
    each = np.repeat(scale, d)
    return W[np.ix_(rows, rows)] * each * each[:, None], q[order] * scale[:, None], mu[order]


# ---------------------------------------------------------------- comparing
@dataclass
class Tally:
    """What one family came to; faults: what was found wrong, in words."""

    problems: int = 0
    complete: int = 0
    solutions: int = 0
    verdicts: Counter = field(default_factory=Counter)
    contacts: int = 0
    border: int = 0
    seconds: float = 0.0
    faults: list[str] = field(default_factory=list)


def compare(case: Case, tally: Tally, label: str) -> None:
    """Ask the package and the oracle, and add what they say."""
    W, q, mu = case
    d = q.shape[1]
    truth = (exact_oracle if d == 2 else exact_oracle_discs).all_exact(W, q, mu)
    problem = am.FrictionProblem.from_delassus(W, q, mu)
    began = time.process_time()
    found = am.all_solutions(problem, time_limit=LIMIT)
    verdict = am.uniqueness(problem, time_limit=LIMIT)
    tally.seconds += time.process_time() - began
    proved = by_contacts(problem, truth)
    tally.contacts += proved > 0
    if proved and (len(truth) != 1 or truth.singular):
        tally.faults.append(f"{label}: false by contacts, {len(truth)} exist")
    tally.problems += 1
    tally.solutions += len(truth)
    tally.complete += found.complete
    tally.verdicts[verdict.verdict.value] += 1
    tally.border += bool(truth.singular)
    tally.faults += [f"{label}: {text}" for text in faults(case, truth, found, verdict)]


def by_contacts(problem: am.FrictionProblem, truth: exact_oracle.Answer) -> int:
    """How many of the exact solutions multipliers of every contact prove to be the only one.

    The distance of a proof is to be less than what the loads of contacts resolve, as in
    `uniqueness`.
    """
    scaled = Scaled.of(problem)
    proved = 0
    for one in truth.solutions:
        r = one.r.reshape(scaled.shape) / scaled.to_r
        found = load_multipliers(scaled, r, near=NEAR * (1 + float(np.abs(r).max())))
        proved += found.proved and scaled.resolves(r)
    return proved


def faults(
    case: Case, truth: exact_oracle.Answer, found: am.Solutions, verdict: am.Uniqueness
) -> list[str]:
    """What the truth refutes."""
    W, q, mu = case
    out = []
    root = np.repeat(np.sqrt(_sizes(W, len(mu))), q.shape[1])
    exact = [root * x.r for x in truth.solutions]
    listed = [(s, root * s.r.ravel()) for s in found.solutions]
    size = max([np.abs(r).max() for r in exact] + [np.abs(r).max() for _, r in listed]
               + [np.linalg.norm(q.ravel() / root)], default=1.0)  # fmt: skip
    reach = 2 * found.resolution * size
    if found.complete:
        for x, r in zip(truth.solutions, exact, strict=True):
            near = [s for s, own in listed if np.abs(own - r).max() <= reach or s.freedom]
            if not near:
                out.append(f"missed {x.pattern}")
            elif not x.border and not any(_has(s, x.pattern) for s in near):
                out.append(f"missed pattern {x.pattern}")
    if truth.singular:
        return out
    for s, own in listed:
        count = sum(np.abs(own - r).max() <= max(reach, 1e-12 * size) for r in exact)
        if s.sole and count < 1:
            out.append(f"extra {s.pattern}")
    several = verdict.verdict is Verdict.NOT_UNIQUE
    by_rounding = several and verdict.other is not None and verdict.other.freedom > 0
    if by_rounding and _lowest(W, root) < ROUNDING:
        return out
    if several and len(truth) < 2:
        out.append(f"false not_unique: {verdict.reason}")
    unique = verdict.verdict in (Verdict.UNIQUE_EVERY_LOAD, Verdict.UNIQUE_THIS_LOAD)
    if unique and len(truth) != 1:
        out.append(f"false {verdict.verdict.value}, {len(truth)} exist")
    return out


def _has(entry: am.PieceSolution, pattern: str) -> bool:
    return bool(entry.freedom) or pattern in (entry.pattern, *entry.touching)


def _sizes(W: Array, nc: int) -> Array:
    d = len(W) // nc
    return np.array([np.linalg.norm(W[d * i : d * i + d, d * i : d * i + d], 2)
                     or 1.0 for i in range(nc)])  # fmt: skip


def _lowest(W: Array, root: Array) -> float:
    values = np.linalg.eigvalsh((W + W.T) / 2 / root / root[:, None])
    return float(values[0] / values[-1])


# ---------------------------------------------------------------- the table
def run(count: int, seed: int, d: int, kept: Kept) -> dict[str, Tally]:
    """Compare `count` problems of dimension d, as far as time allows."""
    tallies = kept.tallies[d]
    while kept.done[d] < count and not kept.is_over:
        number = kept.done[d]
        name, case = draw(number, seed, d, _skewed if kept.skewed else _spd)
        compare(case, tallies[name], f"{d}D {number}")
        kept.done[d] += 1
        kept.write()
    return tallies


@dataclass
class Kept:
    """What is done, on disk where a path is given; is_over after so many CPU seconds."""

    seed: int
    path: Path | None = None
    at_most: float = float("inf")
    skewed: bool = False
    done: dict[int, int] = field(default_factory=lambda: {2: 0, 3: 0})
    tallies: dict[int, dict[str, Tally]] = field(
        default_factory=lambda: {d: {name: Tally() for name in FAMILIES} for d in (2, 3)}
    )

    @property
    def is_over(self) -> bool:
        """Whether time is up."""
        return time.process_time() > self.at_most

    def write(self) -> None:
        """To disk, if it is kept."""
        if self.path is not None:
            tallies = {str(d): {name: vars(t) for name, t in of.items()}
                       for d, of in self.tallies.items()}  # fmt: skip
            text = json.dumps({"seed": self.seed, "skewed": self.skewed, "done": self.done,
                               "tallies": tallies})  # fmt: skip
            new = self.path.with_suffix(".new")
            new.write_text(text)
            new.replace(self.path)  # whole, whenever a run is ended

    def read(self) -> None:
        """What an earlier run of the same seed left."""
        if self.path is None or not self.path.exists():
            return
        found = json.loads(self.path.read_text())
        if found["seed"] != self.seed:
            raise SystemExit(f"{self.path}: of seed {found['seed']}, not {self.seed}")
        if found.get("skewed", False) != self.skewed:
            raise SystemExit(f"{self.path}: of another kind, with --skewed or without")
        self.done = {int(d): n for d, n in found["done"].items()}
        for d, of in found["tallies"].items():
            for name, values in of.items():
                values["verdicts"] = Counter(values["verdicts"])
                self.tallies[int(d)][name] = Tally(**values)


def table(tallies: dict[str, Tally]) -> str:
    """One row per family."""
    head = ["family", "problems", "exact solutions", "lists complete", "every load",
            "this load", "not unique", "undecided", "by contacts", "border",
            "false or missed", "CPU s"]  # fmt: skip
    rows = [" | ".join(head), " | ".join(["---"] * len(head))]
    for name, t in tallies.items():
        counts = [t.verdicts[v.value] for v in Verdict]
        row = [name, t.problems, t.solutions, t.complete, *counts, t.contacts, t.border,
               len(t.faults), f"{t.seconds:.0f}"]  # fmt: skip
        rows.append(" | ".join(map(str, row)))
    return "\n".join(f"| {row} |" for row in rows)


def main() -> None:
    """Run, print what is wrong, write the page."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--plane", type=int, default=5000)
    parser.add_argument("--space", type=int, default=300)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--output", type=Path, default=Path(__file__).parent / "results")
    parser.add_argument("--kept", type=Path)
    parser.add_argument("--at-most", type=float, default=float("inf"))
    parser.add_argument("--skewed", action="store_true")
    options = parser.parse_args()
    kept = Kept(options.seed, options.kept, options.at_most, options.skewed)
    kept.read()
    info = describe()
    skewed = " --skewed" * kept.skewed
    name = "exact_lists_skewed.md" if kept.skewed else "exact_lists.md"
    kind = ", W unsymmetric" * kept.skewed
    lines = [f"# Lists and verdicts against exact arithmetic{kind}", "",
             f"`python benchmarks/exact_lists.py --plane {options.plane} --space "
             f"{options.space} --seed {options.seed}{skewed}`, {info['cores']} cores, Python "
             f"{info['python']}, numpy {info['numpy']}.", "",
             NOTE.format(**vars(options))]  # fmt: skip
    for title, count, d in (("2D", options.plane, 2), ("3D", options.space, 3)):
        tallies = run(count, options.seed, d, kept)
        if kept.done[d] < count:
            title += f", {kept.done[d]} of {count} so far"
        lines += [f"## {title}", "", table(tallies), ""]
        print(table(tallies))
        for tally in tallies.values():
            print(*tally.faults, sep="\n", end="\n" if tally.faults else "")
    kept.write()
    (options.output / name).write_text("\n".join(lines))


if __name__ == "__main__":
    main()
