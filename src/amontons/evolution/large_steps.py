"""Quasi-static steps at finite strains: friction on the motion since the last step.

Every step begins from the last state and goes to its load in load steps where it must.
"""

from __future__ import annotations

from functools import partial

import numpy as np
from numpy.typing import NDArray

from ..clock import NEVER, Deadline
from ..contact import frames
from ..model import Model
from ..model.large_deformation import large_step
from ..model.nonlinear_parts import nonlinear_parts
from .energy import Energies
from .moreau_jean import Solve
from .passage import Crossing, taken
from .state import State, TimeStep
from .system import Motion

Array = NDArray[np.float64]


class LargeSlowModel:
    """A model with hyperelastic laws and without inertia; `advance` makes one step."""

    def __init__(self, model: Model, crossing: Crossing | None = None) -> None:
        self.motion, self.crossing = Motion(model), crossing

    def advance(
        self, state: State, time: float, solve: Solve, limit: Deadline = NEVER
    ) -> TimeStep:
        """One step from a state to a time; solve(problem, start) solves its problem.

        limit: of the path to it where that is followed.
        """
        linear = self.motion.parts
        load, prescribed = self.motion.applied(time)
        load_before, prescribed_before = self.motion.applied(state.time)
        q0 = state.displacement
        problem = large_step(
            self.motion.body, load, prescribed, at_contacts(self.motion.body, q0),
            (load_before, prescribed_before, q0[linear.free]),
        )  # fmt: skip
        arrive = None
        if self.crossing is not None:
            drift = (time - state.time) * at_contacts(self.motion.body, state.velocity)
            arrive = partial(self.crossing.along, problem, drift, limit)
        found, passage = taken(
            lambda start: solve(problem, start, None),  # type: ignore[arg-type]
            arrive, state.force, (state.time, time),
        )  # fmt: skip
        solution = problem.solved(found)
        assert solution.v is not None
        q1 = problem.displacement(solution.v).ravel()
        axes = frames(problem.contact_point(solution.v).n)
        pushed = np.zeros_like(q1)
        pushed[problem.parts.at] = np.einsum("pkc,pk->pc", axes, solution.r)
        energies = self._energies(q0, q1, load, pushed)
        passed = time - state.time
        velocity = (q1 - q0) / passed if passed else np.zeros_like(q1)
        slip = state.slip + solution.u[:, 1:]
        new = State(state.index + 1, time, q1, velocity, solution.r, slip)
        active = np.arange(len(slip))
        return TimeStep(self.motion.body, new, solution, active, energies, solution.u[:, 0],
                        axes, passage)  # fmt: skip

    def _energies(self, q0: Array, q1: Array, load: Array, pushed: Array) -> Energies:
        """The balance of a step: all forces of its end times its motion.

        What is left of the work after the gain is that of a path of one step.
        """
        parts, linear = nonlinear_parts(self.motion.body), self.motion.parts
        shape = parts.X.shape
        dq = q1 - q0
        after, before = parts.energy(q1.reshape(shape)), parts.energy(q0.reshape(shape))
        inner = parts.forces(q1.reshape(shape))
        held = np.zeros_like(dq)
        held[linear.fixed] = (inner - load - pushed)[linear.fixed]
        gain = after - before
        return Energies(
            elastic=after, gain=gain, loads=float(load @ dq), supports=float(held @ dq),
            contact=float(pushed @ dq), numerical=float(inner @ dq) - gain,
        )  # fmt: skip


def at_contacts(model: Model, displacement: Array) -> Array:
    """Displacements of the contacts (nc, d) out of those of all dofs (dofs,)."""
    return displacement[nonlinear_parts(model).at]
