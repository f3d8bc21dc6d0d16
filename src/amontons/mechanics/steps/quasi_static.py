"""Quasi-static steps: equilibrium at each time, friction on the slip since the last one.

Loads and supports that depend on time are evaluated, and those beside them that do not are
there in full from the first step on; where none does, all of them grow with the time as load
factor.  The first step goes from the undeformed body to what is applied at its end, and
friction speaks of the whole way: it is what `solve` finds.  Gaps are positions, so nothing
drifts.

A step may have several solutions, or none near the last one: then the body jumps.  A solver
finds any of them; with `crossing` the step is followed from the last state, see `passage`.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...core.clock import NEVER, Deadline
from ...core.errors import InvalidInput, UnsupportedForm
from ...core.words import helpful
from ...problem.friction import FrictionProblem
from ...problem.law import VaryingFriction
from ...problem.nitsche import NitscheProblem
from ...problem.protocol import Problem
from ...problem.solution import FrictionSolution
from ..model import Model
from ..model.diagnosis import with_diagnosis
from ..model.large_deformation import LargeDeformation
from ..model.reactions import support_forces
from .bolts import Tightened, lock_times
from .energy import Energies, Forces, slow_energies
from .large_steps import LargeSlowModel
from .moreau_jean import Solve
from .passage import Crossing, taken
from .rubbing import quasi_static_friction, rubbed
from .springs import Springs
from .state import State, TimeStep, undeformed
from .system import Motion
from .undetermined import carried_on

Array = NDArray[np.float64]


@helpful
@dataclass(frozen=True)
class QuasiStatic:
    """Steps of size `step` in time, or in the load factor where nothing depends on time.

    Where anything depends on time, loads and supports that do not are applied in full in the
    first step: write them as expressions in t (or functions of (x, t)) to let them grow.

    crossing: follows the path of solutions from every step to the next, `PathCrossing()`; the
    steps then say in `passage` whether and when the body jumped.
    """

    step: float
    crossing: Crossing | None = None

    def __post_init__(self) -> None:
        if not (np.isfinite(self.step) and self.step > 0):
            raise InvalidInput(f"expected a number > 0, got {self.step!r}", ("step",))
        if self.crossing is not None and not hasattr(self.crossing, "between"):
            raise InvalidInput(
                f"crossing: expected PathCrossing() or None, got {self.crossing!r}"
            )

    def prepare(self, model: Model, tolerance: float) -> SlowModel | LargeSlowModel | Tightened:
        """The matrices of all steps; equilibrium at the end never creates energy."""
        if self.crossing is not None and model.kind.no_path:
            raise UnsupportedForm(f"crossing: {model.kind.no_path}")
        prepared = IN_TIME[model.kind](model, self.crossing)
        if isinstance(prepared, SlowModel) and lock_times(model):
            return Tightened(prepared)
        return prepared


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
        problem = self.motion.body.increment(load, prescribed, self._remembered(state))
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


IN_TIME: dict[type[Problem], type[SlowModel | LargeSlowModel]] = {  # by `Model.kind`
    FrictionProblem: SlowModel, NitscheProblem: SlowModel, LargeDeformation: LargeSlowModel,
}  # fmt: skip
