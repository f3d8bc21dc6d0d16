"""Both bodies in time steps, each along its path: whether they jump, and where they begin.

The folds of figures 9 and 12 are those of w = 0 and V = 0: one static problem under a growing
load, friction speaking of the motion from the start.  In an evolution w is the last state.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import amontons as am
from amontons.mechanics.ready.vee import vee as vee_model

from . import block, vee
from .tables import table

STEPS = (0.1, 0.02, 0.005)
FIRST = 0.05  # of the block: with it its corner touches


def run(levels: Sequence[int], out: Path) -> dict[str, Any]:
    """The V-shaped body on the coarsest of its meshes; the block's first step."""
    return {"vee": [vee_row(vee.coarsest(levels), step) for step in STEPS],
            "block": [block_row(True), block_row(False)]}  # fmt: skip


def vee_row(level: int, step: float) -> dict[str, Any]:
    """The whole evolution, every step along its path."""
    method = am.QuasiStatic(step, crossing=am.PathCrossing())
    model = vee_model(vee.mesh(level))
    steps = list(am.evolve(model, method, until=1.0))
    passages = [one.passage for one in steps if one.passage is not None]
    return {
        "triangles": vee.LEVELS[level], "step": step, "steps": len(steps),
        "arrived": sum(passage.arrived for passage in passages),
        "jumps": sum(passage.jumped for passage in passages),
        "corner at the end": _corner(steps[-1]),
    }  # fmt: skip


def _corner(step: am.TimeStep) -> str:
    """The status of the most left contact."""
    return step.solution.pattern[int(step.fields.points[:, 0].argmin())]


def block_row(turned: bool) -> dict[str, Any]:
    """Works (N mm) of the first step from the rotated body, U_0, or from the undeformed one."""
    model = block.block(block.LEVELS[1])
    start = am.at_rest(model, displacement=block.rotated if turned else 0.0)
    (step,) = am.evolve(model, am.QuasiStatic(FIRST), until=FIRST, start=start)
    works = step.energies
    return {"begins": "rotated, U_0" if turned else "undeformed", "supports": works.supports,
            "contact": works.contact, "gain of elastic": works.gain,
            "numerical": works.numerical}  # fmt: skip


def page(found: dict[str, Any]) -> list[str]:
    """Both tables."""
    return ["## In time steps", "", "The V-shaped body, each step along its path:", "",
            *table(found["vee"]),
            f"The first step, {FIRST:g}, of the block on 800 squares (N mm):", "",
            *table(found["block"])]  # fmt: skip
