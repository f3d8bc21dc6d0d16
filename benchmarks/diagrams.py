"""Diagrams that are proved complete on the interval of the load, beside brute force.

    python benchmarks/diagrams.py [--problems 20] [--seed 0] [--loads 6]

Random problems of one to three contacts in 2D and 3D: symmetric and not, friction that changes
with the load, contacts without friction, loads that begin at zero.  At random loads all
solutions are found by brute force, which shares no code with the package: every pattern of
statuses, from a grid of slip directions by Newton's method.  A diagram that is whole has to
have each of them, and no more; one that is not has to say at which loads nothing is proved.
3D diagrams are written as certificates and read by the separate checker.
"""

from __future__ import annotations

import argparse
import itertools
import tempfile
import time
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from machine import describe
from numpy.typing import NDArray

import amontons as am

Array = NDArray[np.float64]
RESULTS = Path(__file__).parent / "results"
GRID = {1: 64, 2: 32, 3: 14}  # directions of slip, by the number of contacts that slip
NEWTON, CONVERGED = 14, 1e-9
SAME = 1e-5  # of the largest reaction: two solutions are one


# ------------------------------------------------------------------ brute force
def all_at(W: Array, q: Array, mu: Array) -> list[Array]:
    """All solutions r (nc d,) at one load."""
    nc = len(mu)
    d, found = len(q) // nc, []
    for pattern in itertools.product("fs+-" if d == 2 else "fsl", repeat=nc):
        slip = [i for i, letter in enumerate(pattern) if letter == "l"]
        around = np.arange(GRID.get(len(slip), 1)) * 2 * np.pi / GRID.get(len(slip), 1)
        angles = np.array(list(itertools.product(around, repeat=len(slip))))
        for r in _of_pattern(W, q, mu, pattern, slip, angles):
            if not any(np.abs(r - x).max() < SAME * (1 + np.abs(x).max()) for x in found):
                found.append(r)
    return found


def _of_pattern(
    W: Array, q: Array, mu: Array, pattern: tuple[str, ...], slip: list[int], angles: Array
) -> Array:
    """Solutions of a pattern, from many directions of slip (B, slip)."""

    def across(at: Array) -> tuple[Array, Array, Array]:
        r, u = _reactions(W, q, mu, pattern, slip, at)
        turned = [np.cos(a) * u[:, 3 * i + 2] - np.sin(a) * u[:, 3 * i + 1]
                  for a, i in zip(at.T, slip, strict=True)]  # fmt: skip
        return np.array(turned).reshape(len(slip), len(at)).T, r, u

    for _ in range(NEWTON if slip else 0):
        g = across(angles)[0]
        step = 1e-7 * np.eye(len(slip))
        J = np.stack([(across(angles + one)[0] - g) / 1e-7 for one in step], axis=2)
        fine = np.abs(np.linalg.det(J)) > 1e-13
        turn = np.zeros_like(angles)
        turn[fine] = np.linalg.solve(J[fine], g[fine][:, :, None])[:, :, 0]
        angles = angles - np.clip(turn, -0.5, 0.5)
    g, r, u = across(angles)
    fits, d = np.abs(g).max(axis=1, initial=0.0) < CONVERGED, len(q) // len(mu)
    for i, letter in enumerate(pattern):
        n, T = r[:, d * i], slice(d * i + 1, d * (i + 1))
        if letter == "f":
            fits &= u[:, d * i] >= 0
        elif letter == "s":
            fits &= mu[i] * n >= np.linalg.norm(r[:, T], axis=1)
        elif letter == "l":
            a = angles[:, slip.index(i)]
            fits &= (n >= 0) & (np.cos(a) * u[:, T][:, 0] + np.sin(a) * u[:, T][:, 1] >= 0)
        else:
            fits &= (n >= 0) & ((u[:, d * i + 1] <= 0) == (letter == "+"))
    return r[fits]


def _reactions(
    W: Array, q: Array, mu: Array, pattern: tuple[str, ...], slip: list[int], angles: Array
) -> tuple[Array, Array]:
    """(r, u), (B, m): with the equations of the statuses at these directions of slip."""
    d, unit = len(q) // len(mu), np.eye(len(q))
    rows, columns = [], []
    for i, letter in enumerate(pattern):
        if letter == "s":
            rows += range(d * i, d * (i + 1))
            columns += [np.tile(unit[j], (len(angles), 1)) for j in rows[-d:]]
        elif letter != "f":
            rows.append(d * i)
            column = np.tile(unit[d * i], (len(angles), 1))
            if letter == "l":
                a = angles[:, slip.index(i)]
                column[:, 3 * i + 1] = -mu[i] * np.cos(a)
                column[:, 3 * i + 2] = -mu[i] * np.sin(a)
            else:
                column[:, d * i + 1] = mu[i] * (1 if letter == "+" else -1)
            columns.append(column)
    r = np.zeros((len(angles), len(q)))
    if rows:
        R = np.stack(columns, axis=2)
        y = np.linalg.solve((W @ R)[:, rows], np.tile(-q[rows], (len(angles), 1))[:, :, None])
        r = (R @ y)[:, :, 0]
    return r, r @ W.T + q


# ------------------------------------------------------------------ problems
def problem_of(seed: int, d: int, nc: int) -> tuple[Array, Array, Array]:
    """W (m, m), loads (2, nc, d), coefficients (2, nc).

    Odd seeds couple the normal of a contact with one of its tangents, so that several solutions
    are likely.
    """
    random, m, coupled = np.random.default_rng(seed), d * nc, seed % 2 == 1
    A = random.normal(size=(m, m))
    W = A @ A.T / m + random.choice([0.02, 0.1, 0.5]) * np.eye(m)
    if coupled:
        own = np.eye(d)
        own[0, 1] = own[1, 0] = random.uniform(0.7, 0.95)
        W = np.kron(np.eye(nc), own) + 0.05 * A @ A.T / m
    if seed % 3 == 2:
        S = random.normal(size=W.shape)
        W = W + (0.02 if coupled else 0.2) * (S - S.T)
    most = 3.0 if d == 2 or coupled else 1.2
    mu = np.tile(random.uniform(1.0 if coupled else 0.2, most, nc), (2, 1))
    if seed % 4 == 3 and d == 3:
        mu[1] *= random.uniform(0.3, 2)
    if seed % 7 == 5:
        mu[:, 0] = 0.0
    q = random.normal(size=(2, nc, d))
    q[:, :, 0] -= random.uniform(-0.5 if coupled else 0, 0.5 if coupled else 1.5)
    if seed % 5 == 4:
        q[0] = 0.0
    return W, q, mu


@dataclass
class Row:
    """What came of the problems of one size."""

    count: Counter[str] = field(default_factory=Counter)
    seconds: list[float] = field(default_factory=list)
    checked: list[float] = field(default_factory=list)
    size: list[int] = field(default_factory=list)
    far: float = 0.0


def examine(row: Row, seed: int, d: int, nc: int, loads: int, folder: Path) -> None:
    """One problem: its diagram, brute force at random loads, its certificate."""
    W, q, mu = problem_of(seed, d, nc)
    start, end = (am.FrictionProblem.from_delassus(W, *given)
                  for given in zip(q, mu, strict=True))  # fmt: skip
    began = time.process_time()
    diagram = am.diagram(end, base=start)
    row.seconds.append(time.process_time() - began)
    row.count["problems"] += 1
    row.count["whole"] += diagram.whole is not None
    row.count["loops"] += sum(branch.closed for branch in diagram)
    to_r = diagram.branches[0].problem.to_r if len(diagram) else 1.0
    for t in np.random.default_rng([seed, nc]).uniform(size=loads):
        known = all_at(W, ((1 - t) * q[0] + t * q[1]).ravel(), (1 - t) * mu[0] + t * mu[1])
        got = [np.asarray(y) * to_r for y in diagram.solutions(t)]
        compare(row, diagram, t, known, got)
    if d == 3 and diagram.whole is not None:
        certify(row, diagram, start, end, folder / "c.h5")


def compare(
    row: Row, diagram: am.Diagram, t: float, known: list[Array], got: list[Any]
) -> None:
    """Whether all that brute force knows is on the branches, and nothing else."""
    silent = not any(low <= t <= high for low, high in diagram.undecided)
    row.count["loads"] += 1
    row.count["several"] += len(known) > 1
    for r in known:
        off = min((np.abs(y.ravel() - r).max() for y in got), default=np.inf)
        off /= 1 + np.abs(r).max()
        if off < SAME:
            row.far = max(row.far, float(off))
        elif diagram.whole is not None or (diagram.undecided and silent):
            row.count["missing"] += 1
        else:
            row.count["missing, said so"] += 1
    row.count["solutions"] += len(known)
    row.count["too many"] += diagram.whole is not None and len(got) > len(known)


def certify(
    row: Row, diagram: am.Diagram, start: am.FrictionProblem, end: am.FrictionProblem,
    path: Path,
) -> None:  # fmt: skip
    """Write a diagram as a certificate, and check it."""
    try:
        am.write_certificate(start, diagram, path, end=end)
    except am.InvalidInput as reason:
        row.count["no certificate"] += 1
        print(reason, flush=True)
        return
    began = time.process_time()
    proved = am.check_certificate(path)
    row.checked.append(time.process_time() - began)
    row.size.append(path.stat().st_size)
    row.count["certificates"] += 1
    row.count["other number of curves"] += f" of {len(diagram)} curves" not in proved


def main() -> None:
    """All sizes, and the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--problems", type=int, default=20)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--loads", type=int, default=6)
    asked = parser.parse_args()
    lines, below = [], []
    with tempfile.TemporaryDirectory() as folder:
        for d, nc in itertools.product((2, 3), (1, 2, 3)):
            row = Row()
            for seed in range(asked.seed, asked.seed + asked.problems):
                examine(row, seed, d, nc, asked.loads, Path(folder))
            c = row.count
            lines.append(
                f"| {d}D | {nc} | {c['problems']} | {c['whole']} | {c['loops']} | "
                f"{c['loads']} | {c['solutions']} | {c['several']} | **{c['missing']}** | "
                f"{c['missing, said so']} | {c['too many']} | {row.far:.0e} | "
                f"{np.median(row.seconds):.2f} | {max(row.seconds):.1f} |"
            )
            if row.checked:
                below.append(
                    f"| {nc} | {c['certificates']} | {c['no certificate']} | "
                    f"{c['other number of curves']} | {np.median(row.size) / 1e3:.0f} | "
                    f"{max(row.size) / 1e3:.0f} | {np.median(row.checked):.2f} | "
                    f"{max(row.checked):.1f} |"
                )
            print(lines[-1], below[-1:], flush=True)
    where = describe()
    page = PAGE.format(problems=asked.problems, seed=asked.seed, loads=asked.loads,
                       cpu=where["cpu"], python=where["python"], rows="\n".join(lines),
                       files="\n".join(below))  # fmt: skip
    (RESULTS / "diagrams.md").write_text(page, encoding="utf-8")


PAGE = """# Diagrams that are complete on the interval of the load

`python benchmarks/diagrams.py --problems {problems} --seed {seed} --loads {loads}`, {cpu},
Python {python}; CPU seconds, kernels compiled in the largest ones.

Random problems (W symmetric or not, friction that changes in 3D, contacts without friction,
loads that begin at zero), each at {loads} random loads beside brute force that shares no code:
every pattern of statuses, from a grid of slip directions by Newton's method.  Missing:
solutions of brute force that are not on a diagram, though it said to be whole, or named other
loads as undecided; said so: others that are not on it.  Too many: loads at which it has one
that brute force does not find.  Of several: loads that have more than one.  Apart: relative.

| | contacts | problems | proved whole | closed branches | loads | solutions | of several |\
 missing | said so | too many | apart | s, median | s, most |
|---|---|---|---|---|---|---|---|---|---|---|---|---|---|
{rows}

Certificates of the 3D diagrams, read by the separate checker (`docs/certificates.md`); refused
ones, and those whose number of curves is another than that of the diagram's branches.

| contacts | accepted | none written | other number | kB, median | kB, most | check s, median |\
 s, most |
|---|---|---|---|---|---|---|---|
{files}
"""


if __name__ == "__main__":
    main()
