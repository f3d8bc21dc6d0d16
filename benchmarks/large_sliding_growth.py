"""A load step of ironing in 3D on ever finer meshes: CPU time, and what takes it.

    python benchmarks/large_sliding_growth.py [--fine 1 1.5 2 3]

The die of `large_sliding_models.ironing_in_space` with `fine` times as many cells in each
direction, pressed in the first load step (which also compiles) and on in the second, which is
measured.  Shares by the profiler, functions by the module that they are in.  One thread.
Writes results/large_sliding_growth.md beside this file.
"""

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")

import argparse
import cProfile
import pstats
import resource
import time
from pathlib import Path

import numpy as np
from large_sliding_models import Case, die
from machine import describe

import amontons as am

HERE = Path(__file__).parent
PARTS = {
    "linear solves": ("linear/direct.py",),
    "search": ("contact/facing.py",),
    "pairs": ("contact/current_pairs.py", "contact/current_mortar.py"),
    "elements": ("elements/hyperelasticity.py",),
}
HEAD = """# Ironing in 3D, ever finer

Regenerate: `python benchmarks/large_sliding_growth.py`.

{machine}

One load step of a die pressed into a slab, friction 0.3, finite strains: CPU seconds, Newton
steps, shares of linear solves (a direct factor in every Newton step), of the search of facets,
of the integrals over pairs and their slopes, and of the cells' forces and tangents.

| unknowns | contacts | CPU s | Newton steps | {parts} | rest | peak memory, GB |
|---|---|---|---|{lines}---|---|
"""


def ironing(fine):
    """The case with that many times the cells."""

    def cells(*counts):
        return tuple(round(fine * k) for k in counts)

    slab = am.box((3, 1.6, 1), cells(15, 8, 4))
    upper = die((0.8, 1.0, 0.5), cells(5, 6, 3), (0.9, 1.0, 0.3))
    return Case(slab, upper, (1.0, 10.0), 0.2, 1.0, 0.3, 8, 20)


def shares(profile, total):
    """Parts of the time inside functions of some modules, calls of others included."""
    stats = pstats.Stats(profile).stats
    out = []
    for files in PARTS.values():
        seconds = 0.0
        for (path, _, _), (_, _, _, _, callers) in stats.items():
            if path.endswith(files):  # entered from another module
                others = (c for (at, _, _), c in callers.items() if not at.endswith(files))
                seconds += sum(c[3] for c in others)
        out.append(seconds / total)
    return out


def measured(fine):
    """A row of the page, and unknowns and seconds."""
    model = ironing(fine).model()
    unknowns = sum(body.mesh.points.size for body in model.bodies)
    steps = am.evolve(model, am.QuasiStatic(1.0), until=2)
    next(steps)
    profile = cProfile.Profile(time.process_time)
    began = time.process_time()
    profile.enable()
    step = next(steps)
    profile.disable()
    seconds = time.process_time() - began
    parts = shares(profile, seconds)
    count = len(step.solution.convergence.history)
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6
    cells = " | ".join(f"{part:.0%}" for part in [*parts, 1 - sum(parts)])
    row = (f"| {unknowns} | {len(step.solution.r)} | {seconds:.2f} | {count} | {cells} "
           f"| {peak:.1f} |")  # fmt: skip
    print(row, flush=True)
    return row, unknowns, seconds


def main():
    """Measure and write the page."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--fine", type=float, nargs="+", default=[1, 1.5, 2, 3])
    rows = [measured(fine) for fine in parser.parse_args().fine]
    sizes, seconds = (np.log([row[k] for row in rows]) for k in (1, 2))
    machine = "; ".join(f"{k} {v}" for k, v in describe().items())
    head = HEAD.format(machine=machine, parts=" | ".join(PARTS), lines="---|" * len(PARTS))
    text = head + "\n".join(row[0] for row in rows) + "\n"
    if len(rows) > 1:
        slope = np.polyfit(sizes, seconds, 1)[0]
        text += f"\nCPU time grows as unknowns to the power of {slope:.2f}.\n"
    (HERE / "results/large_sliding_growth.md").write_text(text)


if __name__ == "__main__":
    main()
