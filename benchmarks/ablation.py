"""What every stage of the portfolio on the Delassus form earns: each of them left out in turn.

    python benchmarks/ablation.py [--limit 4]

The problems are the FCLib files of $AMONTONS_SHARED/data/fclib, packings of spheres, the same
with given bounds of friction, time steps of walls of deformable blocks, cubes pressed on a
plane and dragged, and random W with much friction, all in their Delassus form, to 1e-8 within
`limit` CPU seconds.  A stage is left out where it ran at all; elsewhere nothing would change,
as the same problem takes the same path.  Solved: of the problems where the stage ran, with and
without it.  Time: CPU seconds without the stage over those with it, geometric mean over the
problems that both solve; above 1 the stage saves time.  One thread, best of up to five runs,
nothing is prepared before; differences of some ten per cent are noise.
Writes results/ablation.md beside this file.
"""

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")

import argparse
import sys
import time
from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import ClassVar

import numpy as np
from machine import describe

import amontons as am
from amontons.linear.blocks import spatial
from amontons.mechanics.ready.gallery import random_delassus
from amontons.solvers.auto.portfolio import FIRST, JOINTS, TURNS, Portfolio

HERE = Path(__file__).parent
SHARED = Path(os.environ.get("AMONTONS_SHARED", HERE.parents[1] / "shared"))
TOLERANCE = 1e-8
TABLE = JOINTS + FIRST + TURNS
RUNS, ENOUGH = 5, 1.0  # at most so many runs, and CPU seconds for all of them
KINDS = ("FCLib", "packing", "bounds", "wall", "mesh", "random")


@dataclass(frozen=True)
class Without:
    """The portfolio without one stage, which notes the stages that ran."""

    form: ClassVar[am.Form] = am.Form.DELASSUS
    left_out: str = ""
    ran: list[str] = field(default_factory=list)

    def iterates(self, problem, start, target):
        """Iterates of the stages that are left."""
        first, turns = (
            tuple(self.noted(s) for s in table if s.name != self.left_out)
            for table in (JOINTS + FIRST, TURNS)
        )
        return Portfolio(problem, target, spatial(start.r), first, turns).stages()

    def noted(self, stage):
        """The same stage, which notes its name."""

        def run(state, stage, turn) -> Iterator[am.Iterate]:
            self.ran.append(stage.name)
            return given(state, stage, turn)

        given = stage.run
        return replace(stage, run=run)


def problems():
    """(kind, name, problem in Delassus form), one after another."""
    for path in sorted((SHARED / "data/fclib").glob("*.hdf5")):
        yield "FCLib", path.stem, am.read_fclib(path)
    for count, mu, seed in (
        (50, 0.5, 0), (60, 0.5, 4), (60, 1.0, 5), (80, 0.3, 6), (100, 0.3, 1), (100, 1.0, 2),
    ):  # fmt: skip
        made = am.SpherePacking(count, mu=mu, seed=seed).problem().condensed()
        yield "packing", f"{count}, {mu}", made
        size = 0.3 * np.abs(am.drive(made, tolerance=1e-3).r[:, 0])
        yield "bounds", f"{count}, {mu}", replace(made, law=am.Tresca(size))
    stone = am.LinearElastic(young=2.2e9, poisson=0.2, density=2000)
    for rows, blocks in ((2, 2), (3, 2), (6, 4)):
        wall = am.Wall(rows, blocks, (0.4, 0.2, 0.2), (4, 2, 2), stone, plate=0.1)
        push = am.Traction(f"row {rows - 1} block 1.left", (2e4, 0, 0))
        model = wall.model([], [am.Traction("plate.top", (0, 0, -1e5)), push])
        step = next(am.evolve(model, am.MoreauJean(step=1e-3, theta=1), until=1e-3))
        yield "wall", f"{rows} x {blocks}", step.problem
    for cells in (4, 8):
        body = am.Body(am.box((1, 1, 1), cells=cells), am.LinearElastic(200, 0.3))
        pushed = am.Fix("top", lambda x: (0, 0.2, 0.06 - 0.15 * x[0]))
        ground = am.Contact("bottom", am.Plane((0, 0, 1)), mu=1.0)
        yield "mesh", f"{cells} cells", am.Model([body], [pushed], [ground]).assemble()
    for seed in range(4):
        p = random_delassus(seed, 40, rank=60, mu=1.5)
        load = p.q + 0.3 * np.random.default_rng(seed).standard_normal(p.q.shape)
        yield "random", str(seed), p.with_load(load)


def solve(problem, solver, limit):
    """Best CPU seconds of some runs, infinite where it is not solved within the limit."""
    seconds = [_once(problem, solver, limit)]
    while len(seconds) < RUNS and sum(seconds) < ENOUGH:
        seconds.append(_once(problem, solver, limit))
    return min(seconds)


def _once(problem, solver, limit):
    fresh = problem.fresh()
    _ = fresh.kernel_data
    began = time.process_time()

    def late(step, iterate):
        return time.process_time() - began > limit

    found = am.drive(fresh, solver, tolerance=TOLERANCE, callback=late, max_iterations=10**9)
    seconds = time.process_time() - began
    return seconds if found.converged and seconds <= limit else np.inf


def measured(limit):
    """Per stage: (kind, name, CPU s with it, CPU s without) where it ran; and all problems."""
    rows, whole = defaultdict(list), []
    for kind, name, problem in problems():
        problem = problem.condensed()
        all_of_them = Without()
        usual = solve(problem, all_of_them, limit)
        ran = [s.name for s in TABLE if s.name in all_of_them.ran]
        whole.append((kind, name, usual, ran))
        print(kind, name, f"{usual:.3f}", ", ".join(ran), file=sys.stderr, flush=True)
        for stage in ran:
            rows[stage].append((kind, name, usual, solve(problem, Without(stage), limit)))
    return rows, whole


def verdict(found):
    """One row of the page: where it ran, solved with and without, ratio of times."""
    both = [(w, wo) for _, _, w, wo in found if np.isfinite(w) and np.isfinite(wo)]
    ratio = f"{np.exp(np.mean([np.log(wo / w) for w, wo in both])):.2f}" if both else "–"
    lost = [n for _, n, w, wo in found if np.isfinite(w) and not np.isfinite(wo)]
    gained = [n for _, n, w, wo in found if not np.isfinite(w) and np.isfinite(wo)]
    solved = [sum(np.isfinite(f[k]) for f in found) for k in (2, 3)]
    return (str(len(found)), *map(str, solved), ratio,
            "; ".join(lost) or "–", "; ".join(gained) or "–")  # fmt: skip


def page(rows, whole, limit):
    """The results as Markdown."""
    machine = "; ".join(f"{k} {v}" for k, v in describe().items())
    text = " ".join(__doc__.split("\n\n")[2].split("Writes")[0].split())
    lines = [
        "# What every stage of the portfolio earns", "",
        f"Regenerate: `python benchmarks/ablation.py --limit {limit:g}`.  {machine}.", "",
        text.replace("`limit`", f"{limit:g}"), "",
        "| problems | number | solved | CPU s of the solved |", "|---|---|---|---|",
    ]  # fmt: skip
    for kind in KINDS:
        times = np.array([t for k, _, t, _ in whole if k == kind])
        good = np.isfinite(times)
        lines.append(f"| {kind} | {len(times)} | {good.sum()} | {times[good].sum():.2f} |")
    heads = ("stage left out", "ran in", "solved with", "solved without", "time without / with",
             "no longer solved", "solved only without")  # fmt: skip
    lines += ["", "| " + " | ".join(heads) + " |", "|---" * len(heads) + "|"]
    for stage in TABLE:
        if stage.name in rows:
            lines.append("| " + " | ".join((stage.name, *verdict(rows[stage.name]))) + " |")
        else:
            lines.append(f"| {stage.name} | 0 | | | | | |")
    return "\n".join(lines) + "\n"


def main():
    """Measure and write."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("--limit", type=float, default=4.0, help="CPU seconds of a solve")
    limit = parser.parse_args().limit
    rows, whole = measured(limit)
    (HERE / "results/ablation.md").write_text(page(rows, whole, limit))
    print(f"{time.process_time():.0f} CPU s")


if __name__ == "__main__":
    main()
