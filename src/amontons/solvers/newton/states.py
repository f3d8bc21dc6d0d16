"""The states that Newton's method for problems without one stiffness moves."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ...linear.condensed import Structure

if TYPE_CHECKING:
    from .nonlinear import NonlinearProblem

Array = NDArray[np.float64]


class Linear(Protocol):
    """F and its derivatives at one state."""

    residual: Array
    matrix: sparse.csc_array

    @property
    def structure(self) -> Structure | None:
        """What the matrix consists of, for multigrid; None where that is not known."""
        return None


class States(Protocol):
    """States w that Newton's method moves: v, or v and what is eliminated in every step."""

    start: Array

    def v(self, w: Array) -> Array:
        """v (n,) of a state."""
        ...

    def residual(self, w: Array) -> Array:
        """What has to become zero, unit of force; raises InvertedCells."""
        ...

    def reactions(self, w: Array) -> Array:
        """Contact forces, (nc, d)."""
        ...

    def missing(self, w: Array) -> Array:
        """F (n,) of what steps of v are judged by."""
        ...

    def linearisation(self, w: Array) -> Linear:
        """The linear problem of a step of v."""
        ...

    def size(self, w: Array, here: Linear) -> float:
        """|residual(w)|; here: the linear problem there."""
        ...

    def whole(self, w: Array, step: Array) -> Array:
        """The step of w that belongs to a step (n,) of v."""
        ...


class PlainStates:
    """States that are v."""

    def __init__(self, problem: NonlinearProblem, v: Array) -> None:
        self._problem, self.start = problem, v

    def v(self, w: Array) -> Array:
        """The state itself."""
        return w

    def residual(self, w: Array) -> Array:
        """F (n,)."""
        return self._problem.residual(w)

    missing = residual

    def reactions(self, w: Array) -> Array:
        """Contact forces, (nc, d)."""
        return self._problem.reactions(w)

    def linearisation(self, w: Array) -> Linear:
        """F and its derivatives."""
        return self._problem.linearisation(w)

    def size(self, w: Array, here: Linear) -> float:
        """|F|, which is at hand."""
        return float(np.linalg.norm(here.residual))

    def whole(self, w: Array, step: Array) -> Array:
        """The step itself."""
        return step
