"""The slow tail: packings and walls that `solve` takes long for, to 1e-8 in a minute.

    python benchmarks/slow_tail.py [NAME ...] [--cap 60]

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

from classes import spinning
from generated import wall_step
from machine import describe

import amontons as am
from amontons.mechanics.ready.packings import SpherePacking

HERE = Path(__file__).parent
SHARED = Path(os.environ.get("AMONTONS_SHARED", HERE.parents[1] / "shared"))
RESULT = HERE / "results/slow_tail.md"
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
    cells = [f"{marks[b]:.3g}" if b in marks else "-" for b in BOUNDS]
    last = record.detail if found.converged else f"{record.error:.1e}"
    return [str(problem.contacts), *cells, last]


def kept():
    """Rows of the page as it is, by name."""
    rows = RESULT.read_text().splitlines() if RESULT.exists() else []
    cells = [[c.strip() for c in row.strip("|").split("|")] for row in rows if row[:1] == "|"]
    return {row[0]: row[1:] for row in cells if row[0] in CASES}


def page(rows, cap):
    """The whole page."""
    machine = "; ".join(f"{k} {v}" for k, v in describe().items())
    head = ["problem", "contacts", *(f"{b:g}" for b in BOUNDS), "by, or error left"]
    table = [head, ["---"] * len(head)]
    table += [[name, *rows[name]] for name in CASES if name in rows]
    out = [HEAD.format(cap=cap, machine=machine)]
    out += ["| " + " | ".join(row) + " |" for row in table]
    return "\n".join(out) + "\n"


def main():
    """Run what is asked for and write the page after every row."""
    parser = argparse.ArgumentParser()
    parser.add_argument("names", nargs="*", metavar="NAME")
    parser.add_argument("--cap", type=float, default=60.0)
    chosen = parser.parse_args()
    for name in chosen.names:
        if name not in CASES:
            parser.error(f"no case {name!r}; there are: {', '.join(CASES)}")
    rows = kept()
    for name in chosen.names or CASES:
        problem = CASES[name]().condensed()
        _ = problem.kernel_data, problem.q_norm, problem.blocks.eliminated
        rows[name] = measured(problem, chosen.cap)
        print(name, *rows[name], flush=True)
        RESULT.write_text(page(rows, chosen.cap))


if __name__ == "__main__":
    main()
