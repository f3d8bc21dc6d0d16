"""Large deformations over the friction: the coefficients keep their ratios, p is the largest.

At a fixed piece of the law the residual is linear in the coefficients, so that its derivative
by p is the difference of two residuals.  Steps of a walk may lead below p = 0, where there is
no such law: there residuals, derivatives and margins go on as those straight lines.
"""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, ClassVar

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ...core.clock import NEVER, Deadline
from ...core.errors import InvalidInput, UnsupportedLaw
from ...mechanics.contact.current import Pieces
from ...mechanics.model.large_deformation import LargeDeformation, large_deformation
from ...problem.law import Coulomb
from .large_path import LargePath, Linear

if TYPE_CHECKING:
    from ...mechanics.model import Model

Array = NDArray[np.float64]
LEAST = 1e-100  # friction at p = 0: the sense of the slip is still told


@dataclass(frozen=True, eq=False)
class RubbingPath(LargePath):
    """The friction as parameter: p is the largest coefficient.

    shape (nc,): the coefficients at p = 1.
    """

    shape: Array
    deadline: Deadline = NEVER
    name: ClassVar[str] = "friction"

    def _with(self, mu: Array) -> LargeDeformation:
        parts = self.step.parts
        contact = replace(parts.contact, law=Coulomb(mu))
        return replace(self.step, parts=replace(parts, contact=contact))

    def at(self, p: float) -> LargeDeformation:
        """The problem with this friction."""
        return self._with(max(p, LEAST) * self.shape)

    # ------------------------------------------------------------ straight on below p = 0
    def _residual(self, y: Array, p: float, states: Pieces | None) -> Array:
        if p >= 0:
            return super()._residual(y, p, states)
        states = self._states_at_zero(y) if states is None else states
        zero, other = (super(RubbingPath, self)._residual(y, q, states) for q in (0.0, -p))
        return 2 * zero - other if np.isfinite(other).all() else other

    def _slopes(
        self, y: Array, p: float, states: Pieces | None
    ) -> tuple[sparse.csc_array, Array]:
        if p >= 0:
            return super()._slopes(y, p, states)
        states = self._states_at_zero(y) if states is None else states
        zero, other = (super(RubbingPath, self)._slopes(y, q, states) for q in (0.0, -p))
        return sparse.csc_array(2 * zero[0] - other[0]), zero[1]

    def margins(self, piece: Hashable, y: Array, p: float) -> Array:
        """See `LargePath`."""
        if p >= 0:
            return super().margins(piece, y, p)
        zero, other = super().margins(piece, y, 0.0), super().margins(piece, y, -p)
        told = np.isfinite(zero) & np.isfinite(other)
        zero[told] = 2 * zero[told] - other[told]
        return zero

    def _states_at_zero(self, y: Array) -> Pieces:
        return self.at(0.0).pieces(y)

    @cached_property
    def _laws(self) -> tuple[Coulomb, Coulomb]:
        return Coulomb(self.shape), Coulomb(LEAST * self.shape)

    def by_parameter(self, here: Linear, pieces: Pieces | None) -> Array:
        """See `LargePath`."""
        point = here.point
        pieces = point.pieces if pieces is None else pieces
        rough, smooth = (
            replace(point, contact=replace(point.contact, law=law)).residual(pieces)
            for law in self._laws
        )
        return here.with_law(rough - smooth)


def rubbing_path(model: Model) -> RubbingPath:
    """A model in large deformations over its friction, at its load; see `large_deformation`."""
    problem = large_deformation(model)
    if not isinstance(problem.law, Coulomb):
        raise UnsupportedLaw(f"friction: expected Coulomb's, this is {problem.law.name}")
    if not problem.contacts:
        raise InvalidInput("problem: expected contacts, got none: there is nothing to follow")
    largest = float(problem.law.mu.max(initial=0.0))
    shape = problem.law.mu / largest if largest > 0 else np.ones(problem.contacts)
    return RubbingPath(problem, shape)
