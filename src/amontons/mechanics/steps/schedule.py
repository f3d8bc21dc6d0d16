"""Quasi-static steps of several sizes, through stages with other supports or friction.

A stage has a model of its own, made of the state in which it begins: a support that comes holds
a node where it is then.  Bodies, meshes and contact surfaces are those of all stages.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ...core.errors import InvalidInput
from ..model import Model
from .quasi_static import QuasiStatic
from .state import State
from .system import Motion

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Stage:
    """From when on a model holds, and that model, of the state that is reached then."""

    begin: float
    model: Callable[[State], Model]


@dataclass(frozen=True)
class Schedule(QuasiStatic):
    """Quasi-static steps that end at `times`, > 0 and growing; by default every `step`.

    stages: models that take the place of the first one, in the order in which they begin.
    """

    times: tuple[float, ...] = ()
    stages: tuple[Stage, ...] = ()

    def __post_init__(self) -> None:
        super().__post_init__()
        given = np.array((0.0, *self.times))
        if not np.isfinite(given).all() or (np.diff(given) <= 0).any():
            raise InvalidInput(f"times: expected growing numbers > 0, got {self.times}")
        if sorted(self.stages, key=lambda stage: stage.begin) != list(self.stages):
            raise InvalidInput("stages: expected them in the order in which they begin")

    def after(self, time: float, near: float) -> float | None:
        """The end of the step that begins at a time; None where `times` does not say."""
        later = [t for t in self.times if t > time + near]
        return min(later) if later else None

    def stage_at(self, time: float, near: float) -> Stage | None:
        """The stage in which a step from a time on is; None before the first one."""
        begun = [stage for stage in self.stages if stage.begin <= time + near]
        return begun[-1] if begun else None


def carried_over(state: State, old: Motion, new: Motion) -> State:
    """A state of one stage for the model of the next, whose contacts may be others.

    Supports that come hold nodes whose contacts end, those that go set them free; raises
    InvalidInput where contact surfaces are others.
    """
    before, after = old.parts, new.parts
    if before.dofs != after.dofs or len(before.placed) != len(after.placed):
        raise InvalidInput("stages: expected models of the same bodies and contact pairs")
    kept = [
        np.concatenate([np.zeros(0, dtype=bool), *(p.kept for p in parts.placed)])
        for parts in (before, after)
    ]
    if len(kept[0]) != len(kept[1]):
        raise InvalidInput("stages: expected models with the same contact surfaces")

    def taken(values: Array) -> Array:
        whole = np.zeros((len(kept[0]), *values.shape[1:]))
        whole[kept[0]] = values
        return whole[kept[1]]

    return replace(
        state, force=taken(state.force), slid=taken(state.slid), path=taken(state.path),
        friction_work=taken(state.friction_work),
        growth=1 + taken(state.growth - 1) if state.growth.size else None,
        slip=after.local(state.displacement)[:, 1:],
    )  # fmt: skip
