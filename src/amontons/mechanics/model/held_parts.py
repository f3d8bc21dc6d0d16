"""Bodies that springs hold where they are, of a part of their stiffness K_0 at rest.

The springs add c K_0 (u - u_k) to the inner forces f_int: one implicit step of creeping, see
`solvers.newton.creeping`.
"""

from __future__ import annotations

from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from .nonlinear_parts import NonlinearParts

Array = NDArray[np.float64]


class HeldParts:
    """`NonlinearParts` with other forces: contacts, patterns and what they keep are shared."""

    def __init__(self, parts: NonlinearParts, firmness: float, u: Array) -> None:
        self._parts, self._relaxed = parts, u
        self._blocks = firmness * parts.at_rest
        self._matrix = parts.matrix(self._blocks)

    @classmethod
    def of(cls, parts: NonlinearParts, firmness: float, u: Array) -> NonlinearParts:
        """c: firmness; springs relaxed at displacements u (nodes, d)."""
        return cast(NonlinearParts, cls(parts, firmness, u))

    def __getattr__(self, name: str) -> Any:
        if name == "_parts":  # of copies that are not filled yet
            raise AttributeError(name)
        return getattr(self._parts, name)

    def forces(self, u: Array, pressures: Array | None = None) -> Array:
        """Nodal forces (dofs,), as those of the parts."""
        return self._parts.forces(u, pressures) + self._springs(u)

    def tangent(self, u: Array, pressures: Array | None = None) -> tuple[Array, Array]:
        """(forces (dofs,), node blocks (m, d, d) of their derivative), likewise."""
        forces, blocks = self._parts.tangent(u, pressures)
        return forces + self._springs(u), blocks + self._blocks

    def _springs(self, u: Array) -> Array:
        return self._matrix @ (u - self._relaxed).ravel()
