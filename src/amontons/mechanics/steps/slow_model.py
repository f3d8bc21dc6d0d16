"""Quasi-static steps of elastic bodies: what one of them is, see `quasi_static`."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...core.clock import NEVER, Deadline
from ...problem.friction import FrictionProblem
from ...problem.law import VaryingFriction
from ...problem.nitsche import NitscheProblem
from ...problem.solution import FrictionSolution
from ..model import Model
from ..model.diagnosis import with_diagnosis
from ..model.reactions import support_forces
from .energy import Energies, Forces, slow_energies
from .moreau_jean import Solve
from .passage import Crossing, taken
from .rubbing import quasi_static_friction, rubbed
from .springs import Springs
from .state import State, TimeStep, undeformed
from .system import Motion
from .undetermined import carried_on

Array = NDArray[np.float64]


class SlowModel:
    """A model without inertia; `advance` makes one step."""

    def __init__(
        self, model: Model, crossing: Crossing | None = None,
        lengths: dict[str, float] | None = None,
    ) -> None:  # fmt: skip
        self.motion, self.crossing = Motion(model, lengths or {}), crossing
        parts = self.motion.parts
        self.springs = Springs.of(self.motion.body.law, parts.carried.shape[1])

    def begin(self, state: State) -> State:
        """The state before the first step: undeformed, also where supports hold the body."""
        return undeformed(state, self.motion)

    def advance(
        self, state: State, time: float, solve: Solve, limit: Deadline = NEVER
    ) -> TimeStep:
        """One step from a state to a time; solve(problem, start) solves its problem.

        limit: of the path to it where that is followed.
        """
        parts = self.motion.parts
        load, prescribed = self.motion.applied(time)
        problem = self._increment(state, load, prescribed)
        if isinstance(problem.law, VaryingFriction):  # of the speed in this step
            lasting = problem.law.lasting(abs(time - state.time) or 1.0)
            problem = replace(problem, law=lasting)
        arrive = None
        if self.crossing is not None:
            steps: Any = self._before(state, time), problem  # the path refuses Nitsche's form
            arrive = partial(self.crossing.between, *steps, state.force, limit)
        solution, passage = taken(
            lambda start: solve(problem, start, None), arrive, state.force, (state.time, time)
        )
        solution = carried_on(solution, state.force)
        assert solution.v is not None
        q1 = parts.spread(solution.v, prescribed)
        dq = q1 - state.displacement
        u = parts.local(q1)
        slip = self.springs.slipped(parts.local(dq), state.force, solution.r)
        work = quasi_static_friction(state.force[:, 1:], solution.r[:, 1:], slip)
        energies = self._energies(state, q1, load, solution.r, float(work.sum()))
        time_step = time - state.time
        velocity = dq / time_step if time_step else np.zeros_like(dq)
        new = State(state.index + 1, time, q1, velocity, solution.r, u[:, 1:],
                    **rubbed(state, slip, solution.sliding, work))  # fmt: skip
        reaction = support_forces(parts, parts.missing(q1, load, solution.r))
        active = np.arange(len(parts.gap))
        return TimeStep(self.motion.body, new, solution, active, energies, parts.gap + u[:, 0],
                        reaction, load, passage=passage)  # fmt: skip

    def _increment(self, state: State, load: Array, prescribed: Array) -> Any:
        """The problem of a step from a state, under nodal forces and values (dofs,)."""
        return self.motion.body.increment(load, prescribed, self._remembered(state))

    def _before(self, state: State, time: float) -> FrictionProblem | NitscheProblem:
        """The problem that the last state solves, slipping as it did: p = 0 of `passage`.

        Its load is what the state balances, so that also a state at rest solves it.
        """
        parts, q = self.motion.parts, state.displacement
        held = np.zeros_like(q)
        held[parts.fixed] = q[parts.fixed]
        held = parts.completed(held)
        load = parts.K @ q - parts.whole_H @ state.force.ravel()
        motion = (parts.whole_H.T @ state.velocity).reshape(parts.carried.shape)
        drift = (time - state.time) * motion[:, 1:]
        return self.motion.body.increment(load, held, self._remembered(state) - drift)

    def _remembered(self, state: State) -> Array:
        """Where friction counts its way from, (nc, d-1)."""
        return self.springs.remembered(state.slip, state.force)

    def explained(self, solution: FrictionSolution) -> FrictionSolution:
        """The same record; one that failed says which bodies give way."""
        return with_diagnosis(solution, self.motion.body, solution.problem.f)

    def _energies(
        self, state: State, q1: Array, load: Array, r: Array, friction: float
    ) -> Energies:
        """The balance of `slow_energies`; r (nc, d): reactions after the step."""
        parts, dq = self.motion.parts, q1 - state.displacement
        before = self._forces(state.displacement, self.motion.load_of(state), state.force)
        after = self._forces(q1, load, r)
        return slow_energies(before, after, dq, parts.held, friction)

    def _forces(self, q: Array, load: Array, r: Array) -> Forces:
        inner, pushed = self.motion.parts.K @ q, self.motion.parts.whole_H @ r.ravel()
        return Forces(inner, load, pushed, float(0.5 * q @ inner), self.springs.energy(r))
