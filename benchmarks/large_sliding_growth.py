"""CPU time of load steps of a die that irons a slab in 3D, over the number of unknowns.

    python benchmarks/large_sliding_growth.py [--fine 1.3 2 3 4.75] [--no-dense]

Both bodies of `large_sliding_models` with that many times the cells in every direction, and one
with as many contacts as a surface can have; the die is pressed in by two load steps and dragged
by one.  The second and the third are measured.  Shares by the profiler, functions by the module
that they are in.  One thread.  Rows are kept in results/large_sliding_growth.json; the page is
written of all.
"""

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")

import argparse
import cProfile
import json
import pstats
import resource
import time
from pathlib import Path

import numpy as np
from large_sliding_models import Case, die
from machine import describe

import amontons as am

HERE = Path(__file__).parent
PARTS = {  # modules by the beginnings of their paths in the package; the rest is the assembly
    "linear solves": ("linear/", "solvers/newton/linear_steps"),
    "search": ("mechanics/contact/facing", "mechanics/contact/segments"),
    "pairs": ("mechanics/contact/",),
    "cells": ("mechanics/elements/",),
}
PASSES = 40  # by which time in other libraries is handed to who called them

DENSE = """
All cells are refined alike but in the last rows, which have as many contacts as 100 000
unknowns will hold."""
HEAD = """# Ironing in 3D, ever finer

Regenerate: `python benchmarks/large_sliding_growth.py`.

{machine}

A die pressed into a slab, then dragged over it, friction 0.3, finite strains, to the default
tolerance: CPU seconds of one load step, Newton steps, shares of linear solves (multigrid from
8 000 unknowns on, below that a direct factor), of the search of facets that face each other, of
the integrals over pairs and their slopes, of forces and tangents of cells, and of the assembly
of the matrix with all else.  Pressing goes 0.025 deep, dragging 0.025 far.{more}

| step | unknowns | contacts | closed | CPU s | Newton steps | {parts} | rest | memory, GB |
|---|---|---|---|---|---|{lines}---|---|
"""


def ironing(fine):
    """The case with that many times the cells."""

    def cells(*counts):
        return tuple(round(fine * k) for k in counts)

    return _ironing(cells(15, 8, 4), cells(5, 6, 3))


def _ironing(of_slab, of_die):
    slab = am.box((3, 1.6, 1), of_slab)
    upper = die((0.8, 1.0, 0.5), of_die, (0.9, 1.0, 0.3))
    return Case(slab, upper, (1.0, 10.0), 0.05, 0.05, 0.3, 2, 2)


def many_contacts():
    """Two thousand contacts of a hundred thousand unknowns."""
    return _ironing((60, 32, 9), (44, 44, 6))


def part_of(path):
    """The number of the part that a module of the package belongs to; None elsewhere."""
    _, inside, module = path.replace(os.sep, "/").rpartition("/amontons/")
    if not inside or "site-packages" in module:
        return None
    for k, starts in enumerate(PARTS.values()):
        if module.startswith(starts):
            return k
    return len(PARTS)


def shares(profile):
    """Parts of the time in functions of PARTS, other libraries counted for their callers."""
    stats = pstats.Stats(profile).stats
    number = {key: k for k, key in enumerate(stats)}
    own = [part_of(path) for path, _, _ in stats]
    of = np.zeros((len(stats), len(PARTS) + 1))
    for k, part in enumerate(own):
        of[k, len(PARTS) if part is None else part] = 1.0
    for _ in range(PASSES):
        before = of.copy()
        for key, (_, _, _, _, callers) in stats.items():
            k = number[key]
            weights = [(c[3], number[caller]) for caller, c in callers.items() if caller != key]
            total = sum(weight for weight, _ in weights)
            if own[k] is None and total > 0:
                of[k] = sum(weight * before[at] for weight, at in weights) / total
    seconds = np.array([entry[2] for entry in stats.values()])
    return seconds @ of / seconds.sum()


def measured(case, kinds=("press", "drag")):
    """Rows of the page, unknowns and seconds of every kind of step."""
    model = case.model()
    unknowns = sum(body.mesh.points.size for body in model.bodies)
    steps = am.evolve(model, am.QuasiStatic(1.0), until=case.presses + 1)
    next(steps)
    rows, seconds = [], []
    for kind in kinds:
        profile = cProfile.Profile(time.process_time)
        began = time.process_time()
        profile.enable()
        step = next(steps)
        profile.disable()
        seconds.append(time.process_time() - began)
        parts = shares(profile)
        count = step.solution.convergence.linear_iterations
        peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6
        cells = " | ".join(f"{part:.0%}" for part in parts)
        closed = int((step.solution.r[:, 0] > 0).sum())
        rows.append(f"| {kind} | {unknowns} | {len(step.solution.r)} | {closed} "
                    f"| {seconds[-1]:.2f} | {count} | {cells} | {peak:.1f} |")  # fmt: skip
        print(rows[-1], flush=True)
    return rows, unknowns, seconds


def main():
    """Measure what is asked for and write the page of all that is stored."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--fine", type=float, nargs="*", default=[1.3, 2.0, 3.0, 4.75])
    parser.add_argument("--dense", action=argparse.BooleanOptionalAction, default=True)
    asked = parser.parse_args()
    measured(ironing(1))  # compiles, and makes what is made once
    stored = HERE / "results/large_sliding_growth.json"
    found = json.loads(stored.read_text()) if stored.exists() else {}
    for name in [*map(str, asked.fine), *["dense"] * asked.dense]:
        case = many_contacts() if name == "dense" else ironing(float(name))
        found[name] = measured(case)
        stored.write_text(json.dumps(found, indent=1) + "\n")
        alike = sorted((name for name in found if name != "dense"), key=float)
        write([found[name] for name in alike],
              [found[name] for name in found if name == "dense"])  # fmt: skip


def write(found, more):
    """The page of what is measured: sizes that are alike, and others."""
    machine = "; ".join(f"{k} {v}" for k, v in describe().items())
    head = HEAD.format(machine=machine, parts=" | ".join(PARTS), lines="---|" * len(PARTS),
                       more=DENSE if more else "")  # fmt: skip
    lines = [row for rows, _, _ in [*found, *more] for row in rows]
    text = head + "\n".join(lines) + "\n"
    for k, kind in enumerate(("pressing", "dragging")):
        some = [(unknowns, seconds[k]) for _, unknowns, seconds in found if len(seconds) > k]
        if len(some) > 1:
            sizes, times = np.log(some).T
            text += (
                f"\nCPU time of {kind} grows as unknowns to the power of "
                f"{np.polyfit(sizes, times, 1)[0]:.2f}\n(least squares from {some[0][0]} to "
                f"{some[-1][0]} unknowns, meshes refined alike).\n"
            )
    (HERE / "results/large_sliding_growth.md").write_text(text)


if __name__ == "__main__":
    main()
