"""Collapse of blocks in the plane: how wide the intervals are, and what they take.

    python benchmarks/collapse.py [NAME ...]

Arches against the least of all mechanisms of four hinges; low walls slide at the coefficient of
friction; the walls of Ferris and Tin-Loi (2001), blocks of 0.4 x 0.175 at friction 0.65, half
blocks at the ends of the first course, and slender ones like them.  CPU seconds, at most the
work of a minute (operations counted).  Writes results/collapse.md, where rows of other names
stay as they are.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from machine import asked_cases, describe, printed, with_kept

import amontons as am

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE.parent / "tests" / "unit"))
from block_assemblies import arch, four_hinges, running_bond, sideways  # noqa: E402


def beside_the_crown(k: int, centre: Any, area: float) -> Any:
    """A weight that grows on one voussoir."""
    return ((0.0, -1.0), np.array([-3.0, 9.0])) if k == 8 else ((0.0, 0.0), centre)


def voussoirs(*shape: Any, live: Any = sideways) -> tuple[Any, float]:
    """An arch and its load by hinges."""
    return arch(*shape, 0.7, live), four_hinges(*shape, live)


def wall(rows: int, blocks: int, mu: float = 0.65, known: float | None = None) -> Any:
    """A wall, and its load where that is known."""
    return running_bond(rows, blocks, 0.4, 0.175, mu), known


CASES: dict[str, Callable[[], Any]] = {
    "arch of Oppenheim (1992)": lambda: voussoirs(10, 1.5, np.radians(157.5), 7),
    "semicircle, 9 voussoirs": lambda: voussoirs(10, 2.0, np.pi, 9),
    "arch, weight beside the crown": lambda: voussoirs(10, 2.0, np.radians(120), 12,
                                                       live=beside_the_crown),
    "wall 3 x 2, slides": lambda: wall(3, 2, known=0.65),
    "wall 4 x 2, slides": lambda: wall(4, 2, known=0.65),
    "wall 4 x 3, slides": lambda: wall(4, 3, known=0.65),
    "wall 4 x 1, friction 2": lambda: wall(4, 1, 2.0),
    "wall 3 x 2, friction 2": lambda: wall(3, 2, 2.0),
    "wall 5 x 1": lambda: wall(5, 1),
    "wall 6 x 1": lambda: wall(6, 1),
    "wall 6 x 2": lambda: wall(6, 2),
    "wall 6 x 2, friction 2": lambda: wall(6, 2, 2.0),
    "wall 6 x 5, [FT] 1": lambda: wall(6, 5),
    "wall 10 x 5, [FT] 2": lambda: wall(10, 5),
}


def row(name: str) -> str:
    """One line of the table."""
    (problem, live), known = CASES[name]()
    began = time.process_time()
    found = am.collapse_load(problem, live)
    seconds = time.process_time() - began
    first = found.begins
    assert first is not None
    told = "" if known is None else f"{known:.6f}"
    return (
        f"| {name} | {problem.contacts} | {told} | {first.lower:.6f} | {first.upper:.6f} | "
        f"{100 * first.width:.2g} | {first.violation:.0e} | {first.residual:.0e} | "
        f"{found.upper:.6f} | {found.lower:.4f} | {seconds:.1f} |"
    )


def main() -> None:
    """The page."""
    rows = printed(row, asked_cases(__doc__, CASES))
    rows = with_kept(rows, CASES, HERE / "results" / "collapse.md")
    where = describe()
    page = f"""# Collapse of blocks in the plane

`python benchmarks/collapse.py`, {where['cpu']}, Python {where['python']}; CPU seconds.

Begins: bounds on the least factor at which a motion can begin that the live load drives, with
Coulomb's slip, which does not dilate; width in percent. Misses: by how much the state at the
upper end misses a law, relative; leaves: what the multipliers that prove the lower end leave of
the rows that they combine. Limit analysis: beyond it there is no balance. Nothing moves below:
for motions of any kind. Known: four hinges, or the whole wall slides on its lowest joint.

| case | contacts | known | begins, from | to | width, % | misses | leaves | limit analysis | nothing moves below | s |
|---|---|---|---|---|---|---|---|---|---|---|
{chr(10).join(rows)}

[FT] M. C. Ferris, F. Tin-Loi, Int. J. Mech. Sci. 43 (2001) 209-224; limit analysis of the first
wall is .64286 there, too. From 0: the relaxation takes longer than the work of a minute.
"""  # noqa: E501
    (HERE / "results" / "collapse.md").write_text(page, encoding="utf-8")


if __name__ == "__main__":
    main()
