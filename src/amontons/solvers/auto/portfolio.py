"""The table of `Auto` on the Delassus form: which methods race, and what they try last.

The table is data.  TRACKS race (`race`), each from a state of its own; what each of them earns
is measured in `benchmarks/results/race.md`.

    Anderson            accelerated sweeps; most problems end here
    momentum            sweeps with momentum: packings that roll, statuses that keep changing
    relaxation          1.6 on close packings, 0.9 on rock piles and between meshed bodies
    interior point      more reactions than balances: stacks, walls, arches of rigid blocks
    smoothing Newton    sliding stacks, the last digits
    deep Anderson       from the best reaction of all: the end of what momentum comes near to
    steps and sweeps    Newton's steps and sweeps in turn from the best reaction: long plateaus
    inexact Newton      joints between deformable bodies
    semismooth Newton   where W is full (deformable bodies), or the law is not Coulomb's
    restarts            RESTARTS again and again, from the best reaction: proximal point;
                        every method alone from the start, later from a disturbed reaction

Where a contact alone gains energy sweeps race alone: what the others minimise has no bottom
there.  Of 107 random problems with such a contact sweeps solved 59, all others none.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from ...problem.friction import FrictionProblem
from ..contract import Iterate, Iterates, Target
from ..newton.alternating import SWEEPS
from .race import CALL, FIRST_CHUNKS, SHORTEST, Entry, Race
from .stages import (
    SEMISMOOTH_CONTACTS,
    Stage,
    methods_alone,
    proximal_point,
    semismooth_steps,
)
from .state import DENSE, Begun, State
from .tracks import (
    LEAST,
    alternating,
    anderson,
    inexact_newton,
    interior_point,
    momentum,
    polish,
    relaxed,
    semismooth_newton,
    smoothing_newton,
    staged,
)

Array = NDArray[np.float64]
MOST_TURNS = 12  # repetitions of the restarts before Auto gives up
STEPS_AND_SWEEPS = 10  # steps that Newton and sweeps in turn usually need
DEEP_SWEEPS = 1000  # before which the others may end: it needs a reaction that is near


def _can_end(state: State) -> bool:
    return not state.problem.gains_energy


def _has_cone(state: State) -> bool:
    return state.is_coulomb and _can_end(state)


def _has_packing(state: State) -> bool:
    return _has_cone(state) and state.joints is None and state.problem.blocks.density <= DENSE


def _has_joints(state: State) -> bool:
    return _can_end(state) and state.joints is not None


def _is_small(state: State, turn: int) -> bool:
    return turn > 0 and state.problem.contacts <= SEMISMOOTH_CONTACTS


def _every_other(state: State, turn: int) -> bool:
    return turn % 2 == 0


def _has_steps(state: State) -> bool:
    if not _can_end(state):
        return False
    dense = state.problem.blocks.density > DENSE
    return not state.is_coulomb or (dense and state.problem.contacts <= SEMISMOOTH_CONTACTS)


def _steps(count: float) -> Callable[[State], float]:
    """Nanoseconds of so many Newton steps."""
    return lambda state: count * state.step_cost


def _momentum_chunks(state: State) -> float:
    """Nanoseconds of a chunk more of sweeps with momentum than their rate needs."""
    return (FIRST_CHUNKS + 1) * (max(LEAST * state.momentum_cost, SHORTEST) + CALL)


def _relaxation_steps(state: State) -> float:
    return 20 * state.relaxation_cost


def _dense_steps(state: State) -> float:
    return 3 * state.dense_step_cost


def _deep_sweeps(state: State) -> float:
    return DEEP_SWEEPS * state.deep_cost


def _alternations(state: State) -> float:
    return STEPS_AND_SWEEPS * (state.alternation_cost + SWEEPS * state.sweep_cost)


def _at_joints(state: State) -> float:
    assert state.joints is not None
    return 6 * state.joints.newton_cost(8)


# fmt: off
RESTARTS = (
    Stage("proximal point", proximal_point, patience=25, needs_cone=True),
    Stage("semismooth Newton, small", semismooth_steps, _is_small, steps=15),
    Stage("methods alone", methods_alone, _every_other),
)


def restarts(state: State, stages: tuple[Stage, ...] = RESTARTS) -> Iterator[Iterate]:
    """All stages in the order of the table, some times."""
    for turn in range(MOST_TURNS):
        for stage in stages:
            if stage.when(state, turn) and (state.is_coulomb or not stage.needs_cone):
                yield from stage.run(state, stage, turn)


TRACKS = (
    Entry("Anderson Gauss-Seidel", anderson, 0.02, 1.0),
    Entry("momentum Gauss-Seidel", momentum, 0.1, 3.0, near=1.5, again=3.0,
          trial=_momentum_chunks),
    Entry("Gauss-Seidel, relaxation 1.6", partial(relaxed, 1.6), 0.02, 3.0),
    Entry("Gauss-Seidel, relaxation 0.9", partial(relaxed, 0.9), 0.02, 3.0),
    Entry("interior point", interior_point, 0.05, 1.0, _relaxation_steps, _has_cone, stacked=5,
          waits=_steps(30)),
    Entry("smoothing Newton", smoothing_newton, 0.15, 1.0, _steps(30), _has_cone, again=3.0,
          trial=_steps(30), waits=_steps(30)),
    Entry("Anderson Gauss-Seidel, deep", polish, 0.1, 1.0, _deep_sweeps, _can_end, True),
    Entry("Newton and sweeps", alternating, 0.2, 0.3, _alternations, _has_packing,
          waits=_alternations),
    Entry("inexact Newton", inexact_newton, 0.3, 0.3, _at_joints, _has_joints),
    Entry("semismooth Newton", semismooth_newton, 0.1, 1.0, _dense_steps, _has_steps),
    Entry("restarts", partial(staged, restarts), 0.2, 1.0, _steps(1000), _can_end, True),
)
# fmt: on


@dataclass(eq=False)
class Portfolio:
    """One run of a table of tracks from a reaction r, (nc, 3); begun: what was done from it."""

    problem: FrictionProblem
    target: Target
    r: Array
    table: tuple[Entry, ...] = TRACKS
    begun: Begun | None = None

    def iterates(self) -> Iterates:
        """The best reaction after every chunk of a track."""
        state = State(self.problem, self.target, self.r, begun=self.begun)
        return Race(state, self.table).iterates()
