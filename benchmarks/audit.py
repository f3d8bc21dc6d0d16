"""`python -m benchmarks.audit`: audits of anchors, of own results and of altered ones."""

from __future__ import annotations

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")

import tempfile
import time
import warnings
from dataclasses import dataclass, replace
from pathlib import Path

import click
import numpy as np
from numpy.typing import NDArray

import amontons as am
from amontons.analysis.audit import Answer, Audit, audit_answer
from amontons.io.answers.read import half_units
from amontons.io.decks.written import write_deck

from .audit_models import KINDS, SYSTEMS, Units, deck_in, frd_in, models
from .machine import describe

Array = NDArray[np.float64]
ANCHORS = {"crown_good": "right", "crown_soft_penalty": "wrong", "block_good": "right",
           "fit_nonmatching": "wrong"}  # fmt: skip
ALTERED = ("displacement", "sign of a displacement", "contact force", "sign of a contact force")
CHANGE = 0.01  # of the largest displacement; of a contact force five times as much
SMALL = 0.05  # of the largest: what is smaller is not altered, its sign says nothing
DIGITS = (6, 9, 12, None)
UNKNOWNS = 100_000


# ------------------------------------------------------------------------------ anchors
def anchors(folder: Path) -> list[str]:
    """Rows of the anchors in all systems of units, as they are and exchanged."""
    rows = []
    for name, wanted in ANCHORS.items():
        deck, result = ((folder / f"{name}{end}").read_text() for end in (".inp", ".frd"))
        for units in SYSTEMS:
            said = [_anchor(deck, result, units, exchanged=swap) for swap in (False, True)]
            good = "yes" if all(found.verdict == wanted for found in said) else "**no**"
            failed = ", ".join(_failed(said[0])) or "none"
            rows.append(f"| {name} | {units.name} | {wanted} | {said[0].verdict} | "
                        f"{said[1].verdict} | {failed} | {good} |")  # fmt: skip
            click.echo(rows[-1])
    return rows


def _anchor(deck: str, result: str, units: Units, *, exchanged: bool) -> Audit:
    with tempfile.TemporaryDirectory() as made:
        at = Path(made)
        (at / "a.inp").write_text(deck_in(deck, units, exchanged=exchanged))
        (at / "a.frd").write_text(frd_in(result, units))
        return am.audit(at / "a.inp", at / "a.frd")


def _failed(found: Audit) -> list[str]:
    return [name for name, each in found.findings.items() if each.verdict.value != "right"]


# ------------------------------------------------------------------------------ own results
def own_results() -> tuple[list[str], dict[str, am.ModelSolution]]:
    """Rows of our own answers, as they are and through files; the solutions."""
    rows, solved = [], {}
    for name, model in models().items():
        solution = am.solve(model, tolerance=1e-10)
        found = am.audit(model, solution)
        said = {suffix: _through(model, solution, suffix) for suffix in ("frd", "dat", "vtu")}
        balance = found.findings["balance"].numbers["residual"]
        stated = found.findings["forces"].numbers["difference"]
        good = found.is_right and balance <= 1e-8 and _fit(said)
        rows.append(f"| {name} | {found.verdict} | {balance:.0e} | {stated:.0e} | "
                    + " | ".join(said.values()) + f" | {'yes' if good else '**no**'} |")
        click.echo(rows[-1])
        solved[name] = solution
    return rows, solved


def _fit(said: dict[str, str]) -> bool:
    """Right through all files with all digits, and not wrong in six."""
    return said["dat"] == said["vtu"] == "right" and said["frd"] != "wrong"


def _through(model: am.Model, solution: am.ModelSolution, suffix: str) -> str:
    with tempfile.TemporaryDirectory() as made:
        path = Path(made) / f"solution.{suffix}"
        solution.write(path)
        return am.audit(model, path).verdict


# ------------------------------------------------------------------------------ altered
@dataclass(frozen=True)
class Draw:
    """One altered answer: what was altered, where, and whether the audit said so."""

    model: str
    what: str
    digits: int | None
    node: str
    verdict: str
    named: bool


def altered(solved: dict[str, am.ModelSolution], draws: int, seed: int) -> list[Draw]:
    """Answers with one number altered, of all kinds in turn."""
    names = [name for name in KINDS if name in solved]
    out = []
    for k in range(draws):
        rng = np.random.default_rng([seed, k])
        name = names[k % len(names)]
        what = ALTERED[int(rng.integers(len(ALTERED)))]
        digits = DIGITS[int(rng.integers(len(DIGITS)))]
        out.append(_one_altered(name, solved[name], what, digits, rng))
        if out[-1].verdict != "wrong" or not out[-1].named:
            click.echo(f"draw {k}: {out[-1]}")
    return out


def _one_altered(
    name: str, solution: am.ModelSolution, what: str, digits: int | None,
    rng: np.random.Generator,
) -> Draw:  # fmt: skip
    moved = [part.copy() for part in solution.displacement]
    r = solution.r.copy()
    if "force" in what:
        first = np.abs(r).max(axis=1)
        k = int(rng.choice(np.flatnonzero(first > SMALL * first.max())))
        r[k] = -r[k] if "sign" in what else r[k] * (1 + 5 * CHANGE * rng.choice([-1, 1]))
        node = int(solution.fields.node[k])
        body = solution.model.contacts[0].slave.split(".")[0]  # these have contacts of one body
        where = str(node) if len(moved) == 1 else f"{body}:{node}"
    else:
        body = int(rng.integers(len(moved)))
        where = _move(moved, body, what, rng)
        node = int(where)
        where = where if len(moved) == 1 else f"{solution.model.bodies[body].name}:{node}"
    found = _audited(solution.model, tuple(moved), r, digits)
    named = {n for finding in found.findings.values() for n in finding.nodes}
    return Draw(name, what, digits, where, found.verdict, where in named)


def _move(moved: list[Array], body: int, what: str, rng: np.random.Generator) -> str:
    """Alter one component of one node, in place; the node."""
    size = max(float(np.abs(part).max()) for part in moved)
    part = moved[body]
    if "sign" not in what:
        node, axis = int(rng.integers(len(part))), int(rng.integers(part.shape[1]))
        part[node, axis] += CHANGE * size * float(rng.choice([-1, 1]))
        return str(node)
    large = np.argwhere(np.abs(part) > SMALL * size)
    if not len(large):  # a body that hardly moves
        return _move(moved, body, "displacement", rng)
    node, axis = large[int(rng.integers(len(large)))]
    part[node, axis] = -part[node, axis]
    return str(node)


def _audited(model: am.Model, moved: tuple[Array, ...], r: Array, digits: int | None) -> Audit:
    """The audit of displacements with some digits, and of the forces that come with them."""
    if digits is not None:
        moved = tuple(_rounded(part, digits) for part in moved)
    blur = tuple(half_units(part, digits) for part in moved)
    return audit_answer(model, Answer(moved, blur=blur, reactions=r))


def _rounded(values: Array, digits: int) -> Array:
    text = np.char.mod(f"%.{digits - 1}e", values)
    return text.astype(float)


def controls(solved: dict[str, am.ModelSolution], draws: int, seed: int) -> list[Draw]:
    """Answers as they are but for noise of half a unit of their last digit."""
    names, out = list(solved), []
    for k in range(draws):
        rng = np.random.default_rng([seed, 1, k])
        name = names[k % len(names)]
        solution, digits = solved[name], DIGITS[int(rng.integers(len(DIGITS)))]
        noise = [part + rng.uniform(-1, 1, part.shape) * half_units(part, digits)
                 for part in solution.displacement]  # fmt: skip
        blur = tuple(half_units(part, digits) for part in solution.displacement)
        found = audit_answer(solution.model, Answer(tuple(noise), blur=blur))
        out.append(Draw(name, "noise", digits, "", found.verdict, found.is_right))
        if not found.is_right:
            click.echo(f"control {k}: {out[-1]} {_failed(found)}")
    return out


# ------------------------------------------------------------------------------ speed
def speed() -> list[str]:
    """CPU seconds of an audit of a pair with many unknowns."""
    import resource
    import subprocess
    import sys

    cells = round((UNKNOWNS / 3 / 5) ** (1 / 3))
    steel = am.LinearElastic(1000.0, 0.3)
    low = am.Body(am.box((2, 2, 1), (2 * cells, 2 * cells, cells)), steel, "low")
    high = am.Body(am.box((1, 1, 1), cells - 1, origin=(0.5, 0.5, 1)), steel, "high")
    model = am.Model(
        [low, high], [am.Fix("low.bottom", 0.0), am.Fix("high.top", (0.004, 0, -0.01))],
        [am.Contact("high.bottom", master="low.top", mu=0.3)],
    )  # fmt: skip
    solution = am.solve(model)
    rows = []
    unknowns = sum(part.size for part in solution.displacement)
    for what in ("model assembled, kernels warm", "again"):
        fresh = replace(model, name="fresh")
        start = time.process_time()
        verdict = am.audit(fresh, solution).verdict
        rows.append(f"| `am.audit`, {what} | {unknowns} | {verdict} | "
                    f"{time.process_time() - start:.2f} |")  # fmt: skip
    with tempfile.TemporaryDirectory() as made:
        (Path(made) / "cube.toml").write_text(CUBE)
        run = [sys.executable, "-m", "amontons"]
        subprocess.run([*run, "solve", "cube.toml", "--no-figures", "--quiet"], cwd=made,
                       check=True)  # fmt: skip
        solution.write(Path(made) / "pair.frd")
        write_deck(model, Path(made) / "pair.inp")
        asked = [("cube.toml", "cube-results", 3 * 33**3), ("pair.inp", "pair.frd", unknowns)]
        for source, result, size in asked:
            for what in ("first", "again"):
                before = resource.getrusage(resource.RUSAGE_CHILDREN)
                code = subprocess.run([*run, "audit", source, result, "--quiet"], cwd=made,
                                      check=False).returncode  # fmt: skip
                after = resource.getrusage(resource.RUSAGE_CHILDREN)
                spent = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
                rows.append(f"| `amontons audit {source} {result}`, {what} | {size} | "
                            f"{'right' if code == 0 else 'wrong'} | {spent:.2f} |")  # fmt: skip
    for row in rows:
        click.echo(row)
    return rows


CUBE = """[mesh]
box = [1, 1, 1]
cells = 32
[material.default]
young = 200.0
poisson = 0.3
[[fix]]
on = "top"
value = ["0", "0.2", "0.06 - 0.15*x"]
[[contact]]
slave = "bottom"
obstacle = { plane = { point = [0, 0, 0], normal = [0, 0, 1] } }
friction = { coulomb = 1.0 }
"""


# ------------------------------------------------------------------------------ the page
def page(
    parts: dict[str, list[str]], found: list[Draw], noise: list[Draw], command: str
) -> str:  # fmt: skip
    """The page of results."""
    caught = sum(d.verdict == "wrong" for d in found)
    named = sum(d.named for d in found)
    right = sum(d.named for d in noise)
    lines = [
        "# Audits", "", f"`{command}`", "",
        "; ".join(f"{key} {value}" for key, value in describe().items()), "",
        "## Anchors", "",
        "Results of CalculiX, deck and result in five systems of units, as they are and with "
        "slave and master exchanged.", "",
        "| anchor | units | is | said | exchanged | fails | good |", "|" + "---|" * 7,
        *parts["anchors"], "",
        "## Our own results", "",
        "Solved to 1e-10; balance and stated contact forces over the largest nodal force; "
        "and what is said of the same result through files. A .frd has six digits, which leave "
        "nothing of forces where a body moves as a whole: undecided.", "",
        "| model | said | balance | forces | .frd | .dat | .vtu | good |", "|" + "---|" * 8,
        *parts["own"], "",
        "## Altered results", "",
        "One displacement moved by 1 % of the largest, its sign turned, one contact force "
        "scaled by 5 % or turned, at a random place of all kinds of models above, with 6, 9, "
        f"12 or all digits: {caught} of {len(found)} found, the altered node named in {named}. "
        f"Of {len(noise)} results with nothing but rounding noise {right} are called right.",
        "", "| altered | draws | found | named |", "|---|---|---|---|",
    ]  # fmt: skip
    for what in ALTERED:
        of = [d for d in found if d.what == what]
        lines.append(f"| {what} | {len(of)} | {sum(d.verdict == 'wrong' for d in of)} | "
                     f"{sum(d.named for d in of)} |")  # fmt: skip
    missed = [d for d in found if d.verdict != "wrong" or not d.named]
    missed += [d for d in noise if not d.named]
    lines += ["", *(f"- missed: {d}" for d in missed), "", "## CPU seconds", "",
              "| what | unknowns | said | CPU s |", "|---|---|---|---|", *parts["speed"], ""]
    return "\n".join(lines)


@click.command(context_settings={"help_option_names": ["-h", "--help"]})
@click.option("--draws", default=200, show_default=True, help="Altered results, and controls.")
@click.option("--seed", default=1, show_default=True)
@click.option("--output", type=click.Path(path_type=Path), help="Write the page here.")
def main(draws: int, seed: int, output: Path | None) -> None:
    """Audit anchors, our own results, altered ones; needs AMONTONS_SHARED for the anchors."""
    warnings.simplefilter("ignore", am.DoubtWarning)
    folder = Path(os.environ.get("AMONTONS_SHARED", "../shared")) / "data" / "audit"
    own, solved = own_results()
    found = altered(solved, draws, seed)
    noise = controls(solved, draws, seed)
    parts = {"own": own, "anchors": anchors(folder), "speed": speed()}
    command = f"python -m benchmarks.audit --draws {draws} --seed {seed}"
    text = page(parts, found, noise, command)
    click.echo(f"{sum(d.verdict == 'wrong' for d in found)} of {len(found)} found")
    if output is not None:
        output.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
