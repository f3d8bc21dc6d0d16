"""One and two threads: cubes of hueeber2008 by contact multigrid, a packing by sweeps.

    python benchmarks/threads.py [--levels 5,6,7] [--spheres 10000] [--threads 1,2]
        [--repeats 5]

Cubes: `drive(problem, ContactMultigrid())` to 1e-8, what depends on the matrices alone prepared
before.  Packing: 300 accelerated sweeps in the order of approach (`anderson_depth=8`).
Wall seconds are the least of the repeats, with the load of the machine before each (its
processes that want a core: above the number of threads there is not a core for each).
The calling thread takes parts of shared loops that no other has begun with: on a busy machine
its CPU seconds tell how often others came too late.  Regions: loops that were shared.  All runs
of one problem have the same bits, or this ends with an error.

Writes results/threads.md beside this file.
"""

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")

import argparse
import sys
import time
from dataclasses import replace
from pathlib import Path

from machine import describe
from multigrid import cube

import amontons as am
from amontons.core import threads as shared_loops
from amontons.core.team import together
from amontons.solvers.driver import drive
from amontons.solvers.sweeps.kernels import SweepOrder

HERE = Path(__file__).parent
REGIONS = [0]


def cube_solve(level):
    """A solve of the cube, again and again."""
    problem = cube(level).assemble()
    return lambda: drive(replace(problem), am.ContactMultigrid(), tolerance=1e-8)


def packing_sweeps(spheres):
    """Sweeps on a packing, and its contacts."""
    problem = am.SpherePacking(spheres, seed=1).problem().condensed()
    solver = am.GaussSeidel(order=SweepOrder.APPROACH, batch=100, anderson_depth=8)
    return lambda: drive(problem, solver, max_iterations=300), problem.contacts


def _now():
    """Wall and CPU seconds, those of this thread, and regions so far."""
    return time.perf_counter(), time.process_time(), time.thread_time(), REGIONS[0]


def counted(work, parts, threads):
    """`together`, counted."""
    REGIONS[0] += 1
    together(work, parts, threads)


def measure(run, counts, repeats):
    """Per number of threads the least wall, CPU of all and of the caller, regions, load."""
    out, bits = {n: [] for n in counts}, set()
    run()
    for _ in range(repeats):
        for n in counts:
            am.threads(n)
            load = os.getloadavg()[0] if hasattr(os, "getloadavg") else float("nan")
            before = _now()
            found = run()
            after = _now()
            out[n].append((*(b - a for a, b in zip(before, after, strict=True)), load))
            bits.add(found.r.tobytes())
    if len(bits) > 1:
        sys.exit("results differ between numbers of threads")
    return {n: tuple(map(min, zip(*rows, strict=True))) for n, rows in out.items()}


def lines_of(name, found):
    """Rows of the table."""
    first = next(iter(found.values()))
    for n, (wall, cpu, own, regions, load) in found.items():
        yield (
            f"| {name} | {n} | {wall:.3g} | {first[0] / wall:.2f} | {cpu:.3g} | {own:.3g} | "
            f"{first[2] / own:.2f} | {regions} | {load:.1f} |"
        )


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--levels", default="5,6,7")
    parser.add_argument("--spheres", type=int, default=10_000, help="0: no packing")
    parser.add_argument("--threads", default="1,2")
    parser.add_argument("--repeats", type=int, default=5)
    given = parser.parse_args()
    shared_loops.together = counted
    counts = [int(x) for x in given.threads.split(",")]
    rows = []
    for level in [int(x) for x in given.levels.split(",") if x]:
        found = measure(cube_solve(level), counts, given.repeats)
        rows += lines_of(f"cube, level {level}", found)
        print(*rows[-len(counts) :], sep="\n", file=sys.stderr, flush=True)
    if given.spheres:
        run, contacts = packing_sweeps(given.spheres)
        found = measure(run, counts, given.repeats)
        rows += lines_of(f"packing, {contacts} contacts", found)
    machine = "; ".join(f"{k} {v}" for k, v in describe().items())
    text = " ".join(__doc__.split("\n\n")[2].split())
    page = [
        "# Threads", "",
        "Regenerate: `python benchmarks/"
        f"{' '.join([Path(sys.argv[0]).name, *sys.argv[1:]])}`.  "
        f"{machine}.", "", text, "",
        "| problem | threads | wall s | as fast | CPU s | of the caller | less by | regions | "
        "load |",
        "|---|---|---|---|---|---|---|---|---|", *rows,
    ]  # fmt: skip
    (HERE / "results/threads.md").write_text("\n".join(page) + "\n")
    print(*page, sep="\n")


if __name__ == "__main__":
    main()
