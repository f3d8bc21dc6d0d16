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

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...core.errors import InvalidInput, UnsupportedForm
from ...core.words import helpful
from ...problem.friction import FrictionProblem
from ...problem.nitsche import NitscheProblem
from ...problem.protocol import Problem
from ..model import Model
from ..model.large_deformation import LargeDeformation
from ..model.values import is_number
from ..model.yielding import YieldingProblem
from .bolts import Tightened, lock_times
from .large_steps import LargeSlowModel
from .passage import Crossing
from .slow_model import SlowModel
from .yielding_steps import YieldingSlowModel

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
        if not (is_number(self.step) and np.isfinite(self.step) and self.step > 0):
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


IN_TIME: dict[type[Problem], type[SlowModel | LargeSlowModel]] = {  # by `Model.kind`
    FrictionProblem: SlowModel, NitscheProblem: SlowModel, LargeDeformation: LargeSlowModel,
    YieldingProblem: YieldingSlowModel,
}  # fmt: skip
