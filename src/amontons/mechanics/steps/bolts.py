"""Quasi-static steps of bolts that a force tightens, and that then keep their length."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from ...core.clock import NEVER, Deadline
from ...core.errors import InvalidInput
from ...problem.solution import FrictionSolution
from ..model import Model, Pretension

if TYPE_CHECKING:
    from .moreau_jean import Solve
    from .slow_model import SlowModel
    from .state import State, TimeStep

SAME_TIME = 1e-9  # difference of times that is none, relative to the step


def lock_times(model: Model) -> dict[str, float]:
    """When the bolts of a model are locked, by name."""
    return {
        part.name: part.locked for part in model.constraints
        if isinstance(part, Pretension) and part.locked is not None
    }  # fmt: skip


class Tightened:
    """A model without inertia, with other matrices once bolts are locked."""

    def __init__(self, loose: SlowModel) -> None:
        self._loose = self._now = loose
        self._locked: tuple[str, ...] = ()
        self.motion = loose.motion
        self._times = lock_times(loose.motion.model)
        for k, support in enumerate(self.motion.model.supports):
            if support.on in self._times:
                raise InvalidInput(
                    f"pretension {support.on!r} is locked at a time, so no support may "
                    "prescribe its length", ("supports", k), "",
                )  # fmt: skip

    def begin(self, state: State) -> State:
        """The state before the first step."""
        return self._loose.begin(state)

    def advance(
        self, state: State, time: float, solve: Solve, limit: Deadline = NEVER
    ) -> TimeStep:
        """One step, with the bolts locked that are so at its beginning."""
        near = SAME_TIME * (time - state.time)
        for name, t in self._times.items():
            if state.time + near < t < time - near:
                raise InvalidInput(
                    f"pretension {name!r} is locked at {t:g}, inside of the step from "
                    f"{state.time:g} to {time:g}; choose a step that ends there",
                    ("constraints",), "",
                )  # fmt: skip
        locked = tuple(name for name, t in self._times.items() if t <= state.time + near)
        if locked != self._locked:
            self._now, self._locked = self._with(locked, state), locked
        return self._now.advance(state, time, solve, limit)

    def _with(self, locked: tuple[str, ...], state: State) -> SlowModel:
        """The model with these bolts as long as they are in a state."""
        model = self.motion.model
        entries = model.beside.entries
        at = {name: entries[name].dofs[0, 0] for name in locked}
        lengths = {name: float(state.displacement[dof]) for name, dof in at.items()}
        held = [
            replace(part, held=True)
            if isinstance(part, Pretension) and part.name in locked else part
            for part in model.constraints
        ]  # fmt: skip
        tightened = replace(model, constraints=held)
        return type(self._loose)(tightened, self._loose.crossing, lengths)

    def explained(self, solution: FrictionSolution) -> FrictionSolution:
        """As the model of the step has it."""
        return self._now.explained(solution)
