"""The slow tail: packings and walls that `solve` takes long for, to 1e-8 in a minute.

    python benchmarks/slow_tail.py [NAME ...] [--cap 60] [--variants N]

Spheres at rest that are all alike, thousands of them, spheres that spin and roll at two seeds
each, walls of elastic blocks whose friction is above 1, and the large files of FCLib.  CPU
seconds of one whole solve, one thread, W made before, until the best error in the sum is below
each bound; at most `cap`.
Writes results/slow_tail.md beside this file, where a run of some names leaves other rows alone.
"""

from __future__ import annotations

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")

import argparse
import time
from pathlib import Path

import numpy as np
from classes import spinning
from generated import wall_step
from machine import describe
from scipy import sparse

import amontons as am
from amontons.mechanics.ready.packings import SpherePacking

HERE = Path(__file__).parent
SHARED = Path(os.environ.get("AMONTONS_SHARED", HERE.parents[1] / "shared"))
RESULT = HERE / "results/slow_tail.md"
DISTURBED = 1e-6  # reactions whose velocities are added to q of a variant, relative
BOUNDS = (1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8)
HEAD = """# The slow tail

Regenerate: `python benchmarks/slow_tail.py --cap {cap:g}`.

{machine}

CPU seconds until the best error in the sum is below each bound, one whole solve by Auto,
{cap:g} at most.
"""


def rolling(count, spin, mu, seed):
    """A step of spheres that spin; the seeds are those of `race.py --seed`."""
    return lambda: spinning(SpherePacking(count, mu=mu, seed=seed + count), spin, seed)


def file(name):
    """A file of FCLib."""
    return lambda: am.read_fclib(SHARED / f"data/fclib/{name}.hdf5")


SPREAD = ["problem", "variants", "solved", "median", "worst"]
VARIANTS = """
Variants of a problem (`--variants N NAME ...`: contacts permuted, tangents turned, q disturbed
by a millionth of what reactions do): how many reached 1e-8 within the cap, CPU seconds of the
median and the worst.
"""
CASES = {
    "RockPile_tob1": file("RockPile_tob1"),
    "synthetic-spheres-l10x10x6": file("synthetic-spheres-l10x10x6"),
    "roll 200 spin 5 seed 11": rolling(200, 5.0, 0.3, 11),
    "roll 200 spin 20 seed 11": rolling(200, 20.0, 0.3, 11),
    "roll 600 spin 5 seed 11": rolling(600, 5.0, 0.3, 11),
    "roll 600 spin 20 seed 11": rolling(600, 20.0, 0.3, 11),
    "roll 600 spin 5 seed 23": rolling(600, 5.0, 0.3, 23),
    "roll 600 spin 20 seed 23": rolling(600, 20.0, 0.3, 23),
    "roll 400 spin 10 mu 0.6 seed 7": rolling(400, 10.0, 0.6, 7),
    "roll 400 spin 10 mu 0.6 seed 11": rolling(400, 10.0, 0.6, 11),
    "wall 5x4 mu 1.5, sheared": lambda: wall_step(5, 4, (4, 3, 2), 1.5, shear=2e4),
    "wall 5x4 mu 1.5, pressed": lambda: wall_step(5, 4, (4, 2, 2), 1.5),
    "alike 740 mu 0.3": lambda: SpherePacking(740, mu=0.3, seed=1).problem(),
    "alike 800 mu 0.25": lambda: SpherePacking(800, mu=0.25, seed=3).problem(),
    "alike 8000 mu 0.3": lambda: SpherePacking(8000, mu=0.3, seed=5).problem(),
}  # fmt: skip


def variant(problem, seed):
    """The same problem: contacts in another order, tangents turned, q a little disturbed.

    What is added to q is the velocity of some reactions: where W is singular anything else
    may leave no solution, and a floor of the error about as high as the disturbance.
    """
    random, nc = np.random.default_rng(seed), problem.contacts
    order, angle = random.permutation(nc), random.uniform(0, 2 * np.pi, nc)
    turn = np.zeros((nc, 3, 3))
    turn[:, 0, 0], turn[:, 1, 1], turn[:, 2, 2] = 1.0, np.cos(angle), np.cos(angle)
    turn[:, 2, 1], turn[:, 1, 2] = np.sin(angle), -np.sin(angle)
    rows = sparse.csr_array(sparse.bsr_array((turn[order], order, np.arange(nc + 1))))
    given = sparse.csr_array(problem.W)
    size = DISTURBED * problem.rho[:, None] * np.abs(problem.q)
    more = given @ (size * random.standard_normal((nc, 3))).ravel()
    q = problem.q + more.reshape(nc, 3)
    W = rows @ given @ rows.T
    return am.FrictionProblem.from_delassus(
        W, (rows @ q.ravel()).reshape(nc, 3), problem.mu[order]
    )


def prepared(problem):
    """It, with all that is made before a solve."""
    _ = problem.kernel_data, problem.q_norm, problem.blocks.eliminated
    return problem


def spread(problem, count, cap):
    """Cells of a row of variants: how many, solved, median and worst of CPU seconds."""
    rows = [measured(prepared(variant(problem, k)), cap) for k in range(1, count + 1)]
    seconds = [float(row[-2]) if row[-2] != "-" else np.inf for row in rows]
    shown = [f"{t:.3g}" if t < np.inf else "-" for t in (np.median(seconds), max(seconds))]
    return [str(count), str(int(np.isfinite(seconds).sum())), *shown]


def measured(problem, cap):
    """Cells of a row: contacts, CPU seconds to each bound, the last error and who found it."""
    began, marks = time.process_time(), {}

    def late(step, iterate):
        seconds = time.process_time() - began
        for bound in BOUNDS:
            if step.error <= bound:
                marks.setdefault(bound, seconds)
        return seconds > cap

    found = am.drive(problem, tolerance=1e-8, contact_tolerance=float("inf"), callback=late)
    record = found.convergence
    if record.compiling > 0:  # its first time
        return measured(prepared(problem.fresh()), cap)
    cells = [f"{marks[b]:.3g}" if b in marks else "-" for b in BOUNDS]
    last = record.detail if found.converged else f"{record.error:.1e}"
    return [str(problem.contacts), *cells, last]


def kept():
    """Rows of both tables of the page as it is, by name."""
    rows = RESULT.read_text().splitlines() if RESULT.exists() else []
    cells = [[c.strip() for c in row.strip("|").split("|")] for row in rows if row[:1] == "|"]
    known = [row for row in cells if row[0] in CASES]
    return [{row[0]: row[1:] for row in known if (len(row) == len(SPREAD)) is last}
            for last in (False, True)]  # fmt: skip


def table(head, rows):
    """Lines of a table of the cases there are, in their order."""
    lines = [head, ["---"] * len(head)]
    lines += [[name, *rows[name]] for name in CASES if name in rows]
    return ["| " + " | ".join(line) + " |" for line in lines]


def page(rows, spreads, cap):
    """The whole page."""
    machine = "; ".join(f"{k} {v}" for k, v in describe().items())
    head = ["problem", "contacts", *(f"{b:g}" for b in BOUNDS), "by, or error left"]
    out = [HEAD.format(cap=cap, machine=machine), *table(head, rows)]
    if spreads:
        out += [VARIANTS, *table(SPREAD, spreads)]
    return "\n".join(out) + "\n"


def main():
    """Run what is asked for and write the page after every row."""
    parser = argparse.ArgumentParser()
    parser.add_argument("names", nargs="*", metavar="NAME")
    parser.add_argument("--cap", type=float, default=60.0)
    parser.add_argument("--variants", type=int, default=0, metavar="N")
    chosen = parser.parse_args()
    for name in chosen.names:
        if name not in CASES:
            parser.error(f"no case {name!r}; there are: {', '.join(CASES)}")
    rows, spreads = kept()
    for name in chosen.names or CASES:
        problem = prepared(CASES[name]().condensed())
        if chosen.variants:
            spreads[name] = spread(problem, chosen.variants, chosen.cap)
            print(name, *spreads[name], flush=True)
        else:
            rows[name] = measured(problem, chosen.cap)
            print(name, *rows[name], flush=True)
        RESULT.write_text(page(rows, spreads, chosen.cap))


if __name__ == "__main__":
    main()
