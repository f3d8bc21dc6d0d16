"""Motion and reactions where W is singular or missing: what the verdict says, and its time.

    python benchmarks/hyperstatic.py [NAME ...]

Packings of spheres at rest and spinning, walls and arches of rigid blocks, a wall of elastic
blocks that contact alone holds, the dome; the work of a minute for each.  Rows of other names
stay on the page as they are.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

from classes import arch, spinning, wall
from machine import asked_cases, describe, printed, with_kept

import amontons as am
from amontons.mechanics.ready.packings import SpherePacking

RESULTS = Path(__file__).parent / "results"


def masonry() -> am.Model:
    """Nine elastic blocks and a half under their weight, on a floor."""
    steel = am.LinearElastic(2.2e9, 0.2, density=2000)
    made = am.Wall(3, 3, size=(0.4, 0.2, 0.2), cells=(10, 4, 4), material=steel)
    return made.model([], [am.BodyForce((0, 0, -2000 * 9.81))])


def pressed_wall(aside: float = 0.0) -> am.Model:
    """Five rows of two elastic blocks in running bond, pressed by a steel plate with 30 kN.

    The wall that was the example before that of the paper: 685 contacts, 7 240 unknowns.
    aside: m that the plate is pushed along the wall.
    """
    stone = am.LinearElastic(2.2e9, 0.2, density=2000)
    steel = am.LinearElastic(2.1e11, 0.3, density=7800)
    made = am.Wall(5, 2, size=(0.4, 0.2, 0.2), cells=(8, 4, 4), material=stone,
                   plate=0.05, plate_material=steel)  # fmt: skip
    return made.model([am.Fix("plate.top", (aside, 0, None))],
                      [am.Traction("plate.top", (0, 0, -187500.0))])  # fmt: skip


def spheres(count: int, mu: float, seed: int) -> am.FrictionProblem:
    """A packing at rest, or about to flow."""
    return SpherePacking(count, mu=mu, seed=seed).problem(1e-3)


PACKINGS = ((15, 0.02, 1), (70, 0.02, 1), (70, 0.1, 2), (70, 0.3, 0), (70, 1.0, 0),
            (200, 0.1, 0), (200, 0.5, 0), (200, 1.0, 0), (700, 0.1, 1), (700, 0.5, 0))

CASES: dict[str, Callable[[], Any]] = {
    **{f"{n} spheres, mu {mu}, seed {seed}": partial(spheres, n, mu, seed)
       for n, mu, seed in PACKINGS},
    "200 spheres spinning": lambda: spinning(SpherePacking(200, mu=0.3), 5.0, 0),
    "rigid wall 6x4": lambda: wall(6, 4).problem(0.6),
    "rigid arch 15": lambda: arch(15).problem(0.6),
    "elastic wall": masonry,
    "wall of 685": pressed_wall,
    "wall of 685, sheared": partial(pressed_wall, 1e-4),
    "dome": lambda: am.read_case("example:dome").model,
}


def row(name: str) -> str:
    """One line of the table."""
    problem = CASES[name]()
    began = time.process_time()
    solution = am.solve(problem, time_limit=300, check=False)
    solved = time.process_time() - began
    began = time.process_time()
    found = am.uniqueness(problem, solution)
    seconds = time.process_time() - began
    apart = found.indeterminacy
    if apart is None:
        return (f"| {name} | {solution.r.shape[0]} | {solved:.1f} | {found.reason} | | | | "
                f"{seconds:.1f} |")  # fmt: skip
    bound = "" if apart.bound is None else f"{apart.bound.distance:.2g}"
    bound += " of strains" if apart.bound is not None and apart.bound.strains else ""
    bound += ", no rest" if apart.rest_excluded else ""
    if apart.confined is not None and not apart.confined.everywhere:
        size = apart.confined.within / solution.r[:, 0].max()
        bound += f", alone to {size:.3g} of the largest reaction"
    other = "none" if apart.other is None else f"{apart.other.distance:.1%} away"
    ranges = apart.reactions
    told = apart.reason
    if ranges is not None:
        told = "unique" if apart.reactions_are_unique else (
            f"{int(ranges.open.sum())} contacts, {ranges.dimension} free numbers, by up to "
            f"{ranges.largest:.2g}; {int(ranges.exact.sum())} exact"
        )  # fmt: skip
    return (f"| {name} | {solution.r.shape[0]} | {solved:.1f} | {apart.motion} | {bound} | "
            f"{other} of {apart.starts} | {told} | {seconds:.1f} |")  # fmt: skip


def main() -> None:
    """The page."""
    rows = printed(row, asked_cases(__doc__, CASES))
    rows = with_kept(rows, CASES, RESULTS / "hyperstatic.md")
    where = describe()
    page = f"""# Where W is singular or missing

`python benchmarks/hyperstatic.py`, {where['cpu']}, Python {where['python']}; CPU seconds, the
first with compilation, at most the work of a minute (operations counted) for each verdict.

Bound: how far any other motion can be, relative to the free motion, in the norm of energy; "no
rest": rest is proved to be no solution; "alone": any other has a larger reaction. Other:
another motion, of so many solutions from other starts. Reactions: of how many contacts they are
not unique with this motion, by up to which part of the largest.

| problem | contacts | solve, s | motion | bound | other | reactions | verdict, s |
|---|---|---|---|---|---|---|---|
{chr(10).join(rows)}
"""
    (RESULTS / "hyperstatic.md").write_text(page, encoding="utf-8")


if __name__ == "__main__":
    main()
