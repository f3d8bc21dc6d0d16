"""Large deformations as a path problem: from one load to another, with the memory between.

Loads and prescribed displacements go linearly from those at p = 0 to those of the step at
p = 1, and the motion that friction speaks of loses its drift,

    load (1 - p) load_0 + p load_1,   s = x - x_before + (1 - p) V,                         (1)

the continuation problem of [LR] section 3: at p = 0 a solution of the last step solves it, with
V the motion of that step where the steps are equally long, and at p = 1 it is the next step.
V = 0 gives the static problem under a growing load.  In 2D slip has two senses.

[LR] T. Ligurský, Y. Renard, CMAME 280 (2014).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from ...core.clock import NEVER, Deadline
from ...core.errors import UnsupportedLaw
from ...mechanics.contact.current import Pieces
from ...mechanics.model import Model
from ...mechanics.model.large_deformation import LargeDeformation, large_step
from ...mechanics.model.nodal_forces import NodalForces
from ...mechanics.steps.system import Motion
from ...problem.law import Coulomb
from .large_path import LargePath, Linear

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class LoadPath(LargePath):
    """The load as parameter: p is the share of the way from one load to that of the step.

    load, prescribed (dofs,): those at p = 0, loads that follow the body as `NodalForces`;
    drift (nc, d): V.
    """

    load: NodalForces | Array
    prescribed: Array
    drift: Array | None = None
    deadline: Deadline = NEVER
    name: ClassVar[str] = "load"

    def __post_init__(self) -> None:
        super().__post_init__()
        if not isinstance(self.step.law, Coulomb):
            raise UnsupportedLaw(f"path: expected Coulomb friction, got {self.step.law.name}")
        if self.drift is None:
            object.__setattr__(self, "drift", np.zeros_like(self.step.drift))

    def at(self, p: float) -> LargeDeformation:
        """The problem at a share p of the load."""
        step = self.step
        return replace(
            step,
            load=self.load + p * (step.load - self.load),
            prescribed=self.prescribed + p * (step.prescribed - self.prescribed),
            drift=step.drift + (1 - p) * self.drift,  # type: ignore[operator]
        )

    def by_parameter(self, here: Linear, pieces: Pieces | None) -> Array:
        """See `LargePath`; `here` knows its pieces."""
        step = self.step
        return here.shifted(
            step.load - self.load,
            step.prescribed - self.prescribed,
            -self.drift,  # type: ignore[operator]
        )

    @property
    def moved(self) -> float:
        """See `LargePath`."""
        return float(np.abs(self.step.prescribed - self.prescribed).max(initial=0.0))


def load_path(model: Model, interval: tuple[float, float]) -> LoadPath:
    """A model in large deformations over its load.

    Loads and supports that depend on the time t are taken at t, and have to be straight lines
    in it; where none does, all of them grow with the parameter as load factor.  Friction speaks
    of the motion from the undeformed state.
    """
    motion = Motion(model)
    if not motion.is_timed:
        interval = (0.0, 1.0)
    a, b = interval
    lines = []
    for first, last in zip(*motion.straight(interval, "follow it in parts"), strict=True):
        slope = (last - first) / (b - a)
        lines.append((first - a * slope, first + (1 - a) * slope))
    (load_0, load_1), (prescribed_0, prescribed_1) = lines
    return LoadPath(large_step(motion.body, load_1, prescribed_1), load_0, prescribed_0)
