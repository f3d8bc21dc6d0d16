"""This version against an earlier one: CPU seconds of the same solves, in turns, one thread.

    git worktree add ../before COMMIT
    python benchmarks/against_before.py ../before/src [--runs 15] [--page redesign.md]

Each run is a process of its own for each version, one after the other, so that a busy machine
slows both; the median of the ratios counts, beside their quartiles.  A process solves every
problem once to compile and to warm up, then again until WORTH seconds are spent, and reports
CPU seconds per solve.  Writes results/against_before.md, or another page.
"""

from __future__ import annotations

import argparse
import inspect
import json
import os
import subprocess
import sys
import time
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path

import numpy as np
from machine import describe

HERE = Path(__file__).parent
TOLERANCES = (1e-3, 1e-6, 1e-8)
WORTH = 0.05  # CPU seconds of solves that are timed together
SLOW = 3.0  # seconds from which a file is left out: its path decides, not its speed
CUBES = (8, 16, 32)  # cells per edge
SMALL = ("Rover", "GFC3D", "FrictionContact3D", "CubeH8", "Confeti-ex13-4")  # under 20 contacts
SUM, BOTH = "in the sum", "and at every contact"  # what converged means


def timed(solve):
    """CPU seconds of a solve, mean of as many as are worth it, after one that is not timed."""
    began = time.process_time()
    solve()
    once = time.process_time() - began
    if once > SLOW:
        return None
    count = int(np.clip(WORTH / max(once, 1e-5), 1, 200))
    began = time.process_time()
    for _ in range(count):
        solve()
    return (time.process_time() - began) / count


def work(folder):
    """Names and CPU seconds of all solves of this process, one line each."""
    import amontons as am

    drive = am.drive  # wherever a version keeps it

    def cube(cells):
        body = am.Body(am.box((1, 1, 1), cells=(cells,) * 3), am.LinearElastic(200, 0.3))
        return am.Model(
            [body], [am.Fix("top", lambda x: (0, 0.2, 0.06 - 0.15 * x[0]))],
            [am.Contact("bottom", am.Plane(normal=(0, 0, 1)), mu=1.0)],
        )  # fmt: skip

    def report(name, problem, limit=None):
        for tolerance in TOLERANCES:
            found = drive(problem, tolerance=tolerance, time_limit=limit)
            if not found.converged:
                continue
            for title, options in variants(drive):
                options["tolerance"] = tolerance
                seconds = timed(lambda o=options: drive(problem, **o))
                print(json.dumps([name, tolerance, title, seconds]), flush=True)

    for cells in CUBES:
        report(f"cube {cells}", cube(cells).assemble())
    for name, run in whole(am):
        print(json.dumps([name, TOLERANCES[1], SUM, timed(run)]), flush=True)
    for path in sorted(Path(folder).glob("*.hdf5"), key=lambda p: p.stat().st_size):
        report(path.stem, am.read_fclib(path).condensed(), SLOW)


def whole(am):
    """Names and computations of many solves: a time step with its matrices, a curve."""
    stone = am.LinearElastic(young=2.2e9, poisson=0.2, density=2000)
    wall = am.Wall(4, 3, (0.4, 0.2, 0.2), (4, 2, 2), stone, plate=0.1)
    push = am.Traction("row 3 block 1.left", (2e4, 0, 0))
    model = wall.model([], [am.Traction("plate.top", (0, 0, -1e5)), push])
    method = am.MoreauJean(step=1e-3, theta=1)
    yield "wall step", lambda: next(am.evolve(model, method, until=1e-3, tolerance=1e-6))
    home = "amontons.mechanics.ready.vee" if find_spec("amontons.mechanics") else "amontons.vee"
    vee = import_module(home).vee(0)
    yield "vee, the curve", lambda: am.follow(vee, "load", (0.0, 1.0))


def variants(drive):
    """Titles and options: with the error of every contact where that is known, and without."""
    if "contact_tolerance" not in inspect.signature(drive).parameters:
        return [(SUM, {})]
    return [(SUM, {"contact_tolerance": np.inf}), (BOTH, {})]


def measured(source, folder):
    """CPU seconds by (name, tolerance, what converged means) of one process with a source."""
    environment = os.environ | {"PYTHONPATH": str(source), "OMP_NUM_THREADS": "1"}
    command = [sys.executable, __file__, "--work", str(folder)]
    lines = subprocess.run(
        command, env=environment, check=True, capture_output=True, text=True
    ).stdout.splitlines()
    rows = [json.loads(line) for line in lines]
    return {tuple(key): s for *key, s in rows if s is not None}


def page(pairs, options):
    """Medians and quartiles of now / before, and of now with the second condition / without."""
    machine = "; ".join(f"{key} {value}" for key, value in describe().items())
    lines = [
        "# This version against the one before", "",
        "Regenerate: `python benchmarks/against_before.py BEFORE/src --runs "
        f"{options.runs} --page {options.page}` (before: {options.name}).", "",
        f"{machine}; one thread. CPU seconds, {len(pairs)} pairs of processes in turns: "
        "median (lower and upper quartile) of the ratios. Of all files: the geometric mean in "
        "a pair.",
    ]  # fmt: skip
    lines += ["", f"## Now / before, converged by the error {SUM}", ""]
    lines += _table([_ratios(now, SUM, before) for now, before in pairs])
    lines += ["", f"## Now, converged {BOTH} / {SUM} only", ""]
    lines += _table([_ratios(now, BOTH, now) for now, _ in pairs])
    return "\n".join(lines) + "\n"


def _ratios(run, title, other):
    """Of a run with what converged means by its title, over those of another by the sum."""
    return {
        (name, tolerance): seconds / other[name, tolerance, SUM]
        for (name, tolerance, meaning), seconds in run.items()
        if meaning == title and (name, tolerance, SUM) in other
    }


def _table(ratios):
    lines = ["| problem | " + " | ".join(f"{t:g}" for t in TOLERANCES) + " |"]
    lines += ["|---|" + "---|" * len(TOLERANCES)]
    names = sorted({name for pair in ratios for name, _ in pair})
    own = [name for name in names if name.startswith(("cube ", "wall", "vee"))]
    files = [name for name in names if name not in own]
    small = [name for name in files if name.startswith(SMALL)]
    large = [name for name in files if name not in small]
    groups = {"all FCLib files": files, "those of 20 contacts and more": large}
    groups |= {name: [name] for name in sorted(own, key=lambda n: (len(n), n)) + files}
    for title, members in groups.items():
        cells = [_cell(ratios, members, tolerance) for tolerance in TOLERANCES]
        lines.append(f"| {title} | " + " | ".join(cells) + " |")
    return lines


def _cell(ratios, members, tolerance):
    means = [
        np.exp(np.mean([np.log(pair[n, tolerance]) for n in known]))
        for pair in ratios
        if (known := [n for n in members if (n, tolerance) in pair])
    ]
    if not means:
        return "-"
    low, middle, high = np.percentile(means, [25, 50, 75])
    return f"{middle:.3f} ({low:.3f} – {high:.3f})"


def main():
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    shared = Path(os.environ.get("AMONTONS_SHARED", "../shared"))
    parser.add_argument("before", nargs="?", type=Path, help="source folder of the other one")
    parser.add_argument("--runs", type=int, default=15)
    parser.add_argument("--name", default="the version before", help="of the other one")
    parser.add_argument("--page", default="against_before.md", help="file in results/")
    parser.add_argument("--folder", type=Path, default=shared / "data/fclib")
    parser.add_argument("--work", type=Path, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.work is not None:
        return work(options.work)
    sources = (HERE.parent / "src", options.before.resolve())
    for source in sources:
        measured(source, options.folder)  # compiles
    pairs = []
    for k in range(options.runs):
        order = sources if k % 2 else sources[::-1]
        found = {source: measured(source, options.folder) for source in order}
        pairs.append((found[sources[0]], found[sources[1]]))
        print(f"{k + 1} of {options.runs}", flush=True)
        (HERE / "results" / options.page).write_text(page(pairs, options))
    return None


if __name__ == "__main__":
    main()
