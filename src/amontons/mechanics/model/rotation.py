"""How far bodies turn, and the doubt that this casts on small strains.

A linear model turns a body by u = omega x X: every length across the axis grows by 1 / cos of
the angle, without a stress to tell of it, and gravity never changes its lever.  The angle here
is that of the rotation in the polar decomposition F = R S of the mean gradient F of a connected
piece, the one that fits the moved nodes best; strains alone, however large, have R = I.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ...core.warned import ResultWarning
from .fields import ContactFields
from .rigid import Piece

if TYPE_CHECKING:
    from .model import Model

Array = NDArray[np.float64]
Index = NDArray[np.int64]
LIMIT = 3.0  # degrees: from here on the strain that is not there, 1 / cos - 1, passes 0.1 %


@dataclass(frozen=True, eq=False)
class _Fit:
    """Linear fits of the motions of pieces: piece (n,) of every node, and weights (n, d).

    The mean gradient of u is the sum of u (weights) over the nodes of the piece.
    """

    piece: Index
    weights: Array
    names: tuple[str, ...]

    @classmethod
    def of(cls, pieces: list[Piece], points: Array) -> _Fit:
        """Of pieces of a model with nodes at points (n, d)."""
        d = points.shape[1]
        label = np.zeros(len(points), dtype=np.int64)
        weights = np.zeros_like(points)
        for k, piece in enumerate(pieces):
            nodes = piece.dofs[::d] // d
            x = points[nodes] - points[nodes].mean(axis=0)
            label[nodes] = k
            weights[nodes] = x @ np.linalg.pinv(x.T @ x)
        return cls(label, weights, tuple(piece.name for piece in pieces))

    def gradients(self, displacement: Array) -> Array:
        """Mean gradients (pieces, d, d) of displacements (n, d)."""
        count, d = len(self.names), displacement.shape[1]
        parts = (displacement[:, :, None] * self.weights[:, None, :]).reshape(-1, d * d)
        sums = [np.bincount(self.piece, column, minlength=count) for column in parts.T]
        return np.stack(sums, axis=1).reshape(count, d, d)  # type: ignore[return-value]  # numpy types only counts


def angles(gradients: Array) -> Array:
    """Angles (k,) in degrees of the rotations in I + gradients (k, d, d)."""
    F = np.eye(gradients.shape[1]) + gradients
    if F.shape[1] == 2:
        turn, along = F[:, 1, 0] - F[:, 0, 1], F[:, 0, 0] + F[:, 1, 1]
        return np.degrees(np.abs(np.arctan2(turn, along)))
    u, _, vt = np.linalg.svd(F)
    u[:, :, -1] *= np.sign(np.linalg.det(u @ vt))[:, None]
    R = u @ vt
    axis = np.stack([R[:, 2, 1] - R[:, 1, 2], R[:, 0, 2] - R[:, 2, 0],
                     R[:, 1, 0] - R[:, 0, 1]], axis=1)  # fmt: skip
    trace = np.trace(R, axis1=1, axis2=2)
    return np.degrees(np.arctan2(np.linalg.norm(axis, axis=1), trace - 1))


def _finite_strains(model: Model) -> list[int]:
    """The pieces whose law can turn."""
    starts = np.cumsum([body.mesh.points.size for body in model.bodies])
    pieces = model.discretisation.parts
    of = [int(np.searchsorted(starts, piece.dofs[0], side="right")) for piece in pieces]
    return [k for k, body in enumerate(of) if model.bodies[body].turns]


def large_rotation(model: Model, fields: ContactFields) -> list[ResultWarning]:
    """A warning where a body of small strains turns by more than LIMIT."""
    if all(body.turns for body in model.bodies):
        return []
    displacement = np.concatenate(fields.displacement)
    if not np.isfinite(displacement).all():
        return []
    points = np.concatenate([body.mesh.points for body in model.bodies])
    fit = model._shared.once(_Fit.of, (), model.discretisation.parts, points)
    turned = angles(fit.gradients(displacement))
    turned[_finite_strains(model)] = 0.0
    far = np.flatnonzero(turned > LIMIT)
    if not far.size:
        return []
    worst = int(turned.argmax())
    others = f", and {far.size - 1} more by over {LIMIT:g}" if far.size > 1 else ""
    angle = min(float(turned[worst]), 89.9)
    stretch = 100 * (1 / np.cos(np.radians(angle)) - 1)
    return [ResultWarning(
        "large-rotation",
        f"body {fit.names[worst]!r} turns by {turned[worst]:.1f} degrees{others}: small "
        f"strains stretch what turns, here by {stretch:.2g} %{model.formulation.keeps}; "
        "give the bodies corotational=True or a hyperelastic law such as NeoHookean, or "
        f"trust the motion only up to some {LIMIT:g} degrees",
    )]  # fmt: skip
