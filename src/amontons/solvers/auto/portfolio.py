"""The portfolio on the Delassus form: what `Auto` runs there, one stage after another.

The table is data: JOINTS, for deformable bodies, and FIRST once, then TURNS again and again.
Every stage starts from the best reaction so far, and is dropped when it does not help; what
each of them earns is measured in `benchmarks/results/ablation.md`.

    JOINTS   accelerated sweeps while they promise an end before Newton would be there; inexact
             Newton with full steps until it stalls, from the start and from the best point;
             from the start with a line search
    FIRST    accelerated sweeps as long as their measured rate promises an end before smoothing
             Newton would be there, or until they have cost as much; where Newton is dear,
             relaxed sweeps in a race (`race`) worth one Newton; semismooth Newton where W is
             dense (deformable bodies), or where the law is not Coulomb's
    TURNS    interior point on the convex relaxation, sweeps from there; smoothing Newton from
             the best point and from zero; proximal point; relaxed sweeps worth the cost of
             Newton so far; every method alone from the start, later from a disturbed reaction;
             under other laws than Coulomb's, which have no cone, those that need none

Where a contact alone gains energy, TURNS do not begin: what their methods minimise has no
bottom there.  Of 107 random problems with such a contact sweeps solved 59, all others none.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...problem.friction import FrictionProblem
from ..contract import Breakdown, Iterate, Target
from .stages import (
    SEMISMOOTH_CONTACTS,
    Stage,
    accelerated_sweeps,
    interior_point,
    matching_sweeps,
    methods_alone,
    newton_from_best,
    newton_from_start,
    newton_is_dear,
    newton_with_line_search,
    proximal_point,
    race,
    semismooth_newton,
    smoothing_newton,
    sweeps_at_joints,
)
from .state import State

Array = NDArray[np.float64]
DENSE = 0.5  # share of blocks of W above which it comes from a mesh
NEARLY = 30.0  # error, in goals, from which Newton alone is the shorter way
MOST_TURNS = 12  # repetitions of the last stages before Auto gives up


def _has_joints(state: State, turn: int) -> bool:
    return state.joints is not None


def _is_dense(state: State, turn: int) -> bool:
    return state.is_coulomb and state.problem.blocks.density > DENSE


def _has_no_cone(state: State, turn: int) -> bool:
    return not state.is_coulomb


def _is_far(state: State, turn: int) -> bool:
    return state.error > NEARLY * state.goal


def _is_small(state: State, turn: int) -> bool:
    return turn > 0 and state.problem.contacts <= SEMISMOOTH_CONTACTS


def _every_other(state: State, turn: int) -> bool:
    return turn % 2 == 0


# fmt: off
JOINTS = (
    Stage("sweeps at joints", sweeps_at_joints, _has_joints, share=1.0),
    Stage("inexact Newton", newton_from_start, _has_joints, patience=8),
    Stage("inexact Newton, best point", newton_from_best, _has_joints, patience=8),
    Stage("inexact Newton, line search", newton_with_line_search, _has_joints, patience=8),
)
FIRST = (
    Stage("accelerated sweeps", accelerated_sweeps, steps=6000, share=1.0),
    Stage("race", race, newton_is_dear, patience=249, share=1.0),  # the driver allows more
    Stage("semismooth Newton, no cone", semismooth_newton, _has_no_cone, steps=60),
    Stage("semismooth Newton, dense", semismooth_newton, _is_dense, steps=15),
)
TURNS = (
    Stage("interior point", interior_point, _is_far, steps=60, patience=3, needs_cone=True),
    Stage("smoothing Newton", smoothing_newton, steps=120, patience=20, needs_cone=True),
    Stage("proximal point", proximal_point, patience=25, needs_cone=True),
    Stage("semismooth Newton, small", semismooth_newton, _is_small, steps=15),
    Stage("matching sweeps", matching_sweeps, steps=2000),
    Stage("methods alone", methods_alone, _every_other),
)
# fmt: on


@dataclass(eq=False)
class Portfolio:
    """One run of a table of stages from a reaction r, (nc, 3)."""

    problem: FrictionProblem
    target: Target
    r: Array
    first: tuple[Stage, ...] = FIRST
    turns: tuple[Stage, ...] = TURNS

    def stages(self) -> Iterator[Iterate]:
        """All stages in the order of the table."""
        state = State(self.problem, self.target, self.r)
        yield from _walk(self.first, state, 0)
        if self.problem.gains_energy:
            raise Breakdown("stopped early")
        for turn in range(MOST_TURNS):
            yield from _walk(self.turns, state, turn)


def _walk(table: tuple[Stage, ...], state: State, turn: int) -> Iterator[Iterate]:
    for stage in table:
        if stage.when(state, turn) and (state.is_coulomb or not stage.needs_cone):
            yield from stage.run(state, stage, turn)
