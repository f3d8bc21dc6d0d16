"""Quasi-static steps of bodies that yield: each point's history goes from state to state.

Flow acts on a body as a load f_p does (`elements.yielding`).  Its work is booked as damping,
the rest of what the mean of inner forces misses as numerical, see `energy`.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ...core.clock import NEVER, Deadline
from ..elements.yielding import Flown
from ..model.reactions import support_forces
from ..model.yielding import YieldingProblem, yielding_of, yielding_step
from .energy import Energies, Forces, path_work, slow_energies
from .moreau_jean import Solve
from .rubbing import quasi_static_friction
from .slow_model import SlowModel
from .state import State, TimeStep

Array = NDArray[np.float64]


class YieldingSlowModel(SlowModel):
    """A model of bodies that yield and without inertia; `advance` makes one step."""

    def advance(
        self, state: State, time: float, solve: Solve, limit: Deadline = NEVER
    ) -> TimeStep:
        """One step from a state to a time; the state is not changed, and may be tried again."""
        step = super().advance(state, time, solve, limit)
        parts, r, q = self.motion.parts, step.solution.r, step.state.displacement
        before = self._flown(state.displacement, state)
        after = self._flown(q, state)
        rest = parts.missing(q, step.load + after.forces, r)
        slip = self.springs.slipped(
            parts.local(q - state.displacement), state.force, r
        )
        friction = float(quasi_static_friction(state.force[:, 1:], r[:, 1:], slip).sum())
        return replace(
            step, state=replace(step.state, plastic=after.history),
            reaction=support_forces(parts, rest),
            energies=self._balance(state, step, (before, after), friction),
        )  # fmt: skip

    def _increment(
        self, state: State, load: Array, prescribed: Array
    ) -> YieldingProblem:
        parts, known = self.motion.parts, None
        if parts.eliminated is None:
            known_load = known_values = np.zeros_like(state.displacement)
            if not state.is_unloaded:
                known_load, known_values = self.motion.applied(state.time)
            known = known_load, known_values, state.displacement[parts.free]
        return yielding_step(self.motion.body, load, prescribed, self._remembered(state),
                             state.plastic, known)  # fmt: skip

    def _flown(self, q: Array, state: State) -> Flown:
        """The flow at displacements q (dofs,) from the history of a state on."""
        yielding = yielding_of(self.motion.body)
        history = state.plastic if state.plastic.size else np.zeros(yielding.size)
        return yielding.respond(q, history, tangent=False)

    def _balance(
        self, state: State, step: TimeStep, flown: tuple[Flown, Flown], friction: float
    ) -> Energies:
        """The balance of `slow_energies`, the work of the flow as damping."""
        q0, q1 = state.displacement, step.state.displacement
        before = self._with_flow(
            self._forces(q0, self.motion.load_of(state), state.force), flown[0]
        )
        after = self._with_flow(self._forces(q1, step.load, step.solution.r), flown[1])
        path = path_work(before, after, q1 - q0)
        found = slow_energies(before, after, q1 - q0, self.motion.parts.held, friction, path)
        lost = flown[1].lost
        return replace(found, damping=lost, numerical=found.numerical - lost)

    @staticmethod
    def _with_flow(forces: Forces, found: Flown) -> Forces:
        return replace(forces, inner=forces.inner - found.forces,
                       elastic=forces.elastic + found.stored)  # fmt: skip
