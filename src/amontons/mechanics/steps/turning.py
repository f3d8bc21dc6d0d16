"""Bodies in frames of their own in dynamics: one factor for all steps.

With T the rotations of all nodes by the frames of their pieces (`elements.corotational`), the
matrix of a step is, but for what the stress does in a rotation,

    M + h/2 C + (h^2/4 + h b/2) T K T^T = T (M + h/2 C + (h^2/4 + h b/2) K) T^T,

b being the stiffness damping: M and C, proportional to it, are the same in all frames.  The
matrix in brackets does not change, whatever turns; contacts see it through T^T H.  Where
supports hold components of nodes, which turn in the frames, it is formed and factorised anew.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ...core.errors import UnsupportedForm
from ...problem.friction import FrictionProblem
from ...problem.law import Law
from ..elements.corotational import CorotationalBody
from ..elements.hyperelasticity import is_hyperelastic
from ..model import Model
from ..model.nonlinear_parts import NonlinearParts

Array = NDArray[np.float64]


def check_turning(method: Any, model: Model) -> None:
    """Raise UnsupportedForm for options and parts that large deformations do not have."""
    for name, wanted in (("theta", 0.5), ("reach", 0.0), ("stiffness_damping", 0.0)):
        framed = name == "stiffness_damping" and all(b.corotational for b in model.bodies)
        if getattr(method, name) != wanted and not framed:
            raise UnsupportedForm(
                f"{name}: expected {wanted:g} in dynamics of large deformations, got "
                f"{getattr(method, name):g}"
            )
    for body in model.bodies:
        if not (body.corotational or is_hyperelastic(body.material)):
            raise UnsupportedForm(
                f"body {body.name!r}: dynamics of large deformations need corotational=True "
                "or a hyperelastic law, or LinearElastic bodies and kinematics='small' of all "
                "contacts"
            )


@dataclass(frozen=True)
class Turning:
    """The forces of a body in its own frames on the way of a step; viscous: b / h."""

    body: CorotationalBody
    viscous: float

    def between(self, before: Array, after: Array) -> Array:
        """Forces (n, dim) of the way between displacements (n, dim)."""
        return self.body.between(before, after, self.viscous)

    def lost(self, before: Array, after: Array) -> float:
        """Energy that viscosity takes on that way."""
        return self.body.lost(before, after, self.viscous)


class InFrames:
    """The matrix in brackets, and where the frames are."""

    def __init__(
        self, parts: NonlinearParts, inertia: Any, step: float, viscous: float
    ) -> None:
        self.bodies: list[CorotationalBody] = list(parts.bodies)  # type: ignore[arg-type]
        self.shape, self.ends = parts.X.shape, parts.ends
        K = sparse.block_diag([body.stiffness for body in self.bodies], format="csr")
        factor = step**2 / 4 + step * viscous / 2
        self.matrix = sparse.csc_array(inertia.M + step / 2 * inertia.C + factor * K)
        self._base: FrictionProblem | None = None

    @classmethod
    def of(cls, parts: NonlinearParts, inertia: Any, method: Any) -> InFrames | None:
        """None where supports hold something, or bodies have no frames."""
        framed = all(isinstance(body, CorotationalBody) for body in parts.bodies)
        if not framed or len(parts.free) < parts.X.size:
            return None
        return cls(parts, inertia, method.step, method.stiffness_damping)

    def at(self, q: Array) -> sparse.bsr_array:
        """T (dofs, dofs) at displacements q (dofs,)."""
        each = zip(self.bodies, np.split(q.reshape(self.shape), self.ends), strict=True)
        R = np.concatenate([
            body.frames.at(u).R[body.frames.piece] for body, u in each
        ])  # fmt: skip
        n, d = self.shape
        return sparse.bsr_array((R, np.arange(n), np.arange(n + 1)), shape=(n * d, n * d))

    def problem(
        self, T: sparse.bsr_array, columns: sparse.csc_array, f: Array, w: Array, law: Law,
        name: str,
    ) -> FrictionProblem:  # fmt: skip
        """The contact problem of a step in the frames; f (dofs,) in global axes."""
        H, f = sparse.csc_array(T.T @ columns), T.T @ f
        if self._base is None:
            self._base = FrictionProblem.from_global(self.matrix, H, f, w, law, name=name)
            return self._base
        return replace(self._base, H=H, f=f, w=w, law=law)

    def product(self, T: sparse.bsr_array, v: Array) -> Array:
        """T matrix T^T v, (dofs,)."""
        return T @ (self.matrix @ (T.T @ v))
