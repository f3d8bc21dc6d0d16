"""The law in frames that the slave's surface carries: orthotropic friction, elastic stick.

In the frame a = [n, t1, t2] of `surface_axes`, or [n, t] in 2D, with the stretch T and the
compliance C of the law (`problem.law.changed`; T = 1 on n, symmetric, constant in the frame),
and q how far the spring of the contact was drawn at the end of the last step, as it is carried
along, q = -C_T r_T then, constant in the frame,

    z_T = (I - n n^T) (T^-1 lambda - rho_T T (s + q + C_T lambda_T)),                       (1)
    law(lambda, x) = lambda - (max(z_N, 0) - c) n - T P(z_T),    z_N, c of `current`.       (2)

(2) is zero where Coulomb's law holds of T^-1 lambda and T (s + q + C_T lambda_T), the part of
the slip that stays: friction opposes it as `problem.law.orthotropic` says, along and across
lines of the slave's material.  With T = 1 and C_T = 0 it is (2) of `current`.  Whatever
rho_T > 0, (2) says the same; 1 / rho_T = 1 / rho + C_T max T^2, node and spring in series, lets
Newton's steps find from slip to the other way to the stick that is between: with rho and soft
springs they would jump across it, to and fro.

As (2) is a law of the components in the frame, turning all of lambda, s and a turns it as well.
With w the spin of the frame, R_lambda and R_s the derivatives of (2) at a fixed frame, and s
without q, which turns with the frame (but where supports hold some of its components: what is
left then changes by these of w x q alone),

    d law = R_lambda (d lambda - w x lambda) + R_s (ds - w x s) + w x law + R_g dg.         (3)
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ...problem.law.law import MU
from .current import ContactPoint, Partials, Pieces
from .surface_axes import twist
from .tied_law import tie_inplace

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class FramedPoint(ContactPoint):
    """Where (2) is evaluated; drawn (nc, d-1): q in the frames."""

    drawn: Array | None = None

    @cached_property
    def _in_plane(self) -> Array:
        """t1(, t2) in global axes, (nc, d-1, d)."""
        return self.meeting.frames[:, 1:]

    def _spread(self, values: Array) -> Array:
        """Tensors (nc, d-1, d-1) of the tangents in global axes, (nc, d, d); none along n."""
        return self._in_plane.swapaxes(1, 2) @ values @ self._in_plane

    @cached_property
    def _tensors(self) -> tuple[Array, Array, Array]:
        """T, and what makes lambda and s to z_T, T^-1 - rho_T T C_T and -rho_T T; tangents."""
        law, (nc, d) = self.contact.law, self.n.shape
        T = np.broadcast_to(np.eye(d - 1), (nc, d - 1, d - 1))
        inverse, most = T, np.ones(nc)
        if law.stretch is not None:
            T, inverse = law.stretch, np.linalg.inv(law.stretch)
            most = np.linalg.eigvalsh(T)[:, -1]
        give = np.zeros(nc) if law.give is None else law.give[:, 1]
        rho = (1 / (1 / self.contact.rho_along + give * most**2))[:, None, None]
        out = T, inverse - rho * give[:, None, None] * T, -rho * T
        return tuple(map(self._spread, out))  # type: ignore[return-value]

    @cached_property
    def _pulled(self) -> Array | None:
        """q, or q' of `fading`, in global axes, (nc, d), of all components."""
        if self.drawn is None:
            return None
        out = np.einsum("pk,pkc->pc", self.drawn, self._in_plane)
        return out if self.mixed is None else self.mixed.weights[:, None] * out

    @cached_property
    def slip(self) -> Array:  # type: ignore[override]  # kept
        """s + q, (nc, d), of components that are heard."""
        pulled = self._pulled
        return self.motion if pulled is None else self.motion + pulled * self.contact.heard

    @cached_property
    def z_tangent(self) -> Array:
        """z_T, (nc, d), in global axes."""
        _, by_force, by_motion = self._tensors
        out = np.einsum("pij,pj->pi", by_force, self.counted * self.force)
        return out + np.einsum("pij,pj->pi", by_motion, self.slip)

    def _released(self, friction: Array) -> Array:
        """T P, (nc, d)."""
        return np.einsum("pij,pj->pi", self._tensors[0], friction)

    def of_all(self, pieces: Pieces | None = None) -> Partials:
        """Derivatives of (2) by lambda, n, g (nc, d), s (nc, d, d), and E (nc, d, 2 d)."""
        pieces = self.pieces if pieces is None else pieces
        n = self.n
        stretch, squeezed, moved = self._tensors
        in_z, in_bound = self._friction(pieces)
        closed = ((pieces > 0) & (pieces < 4)).astype(float)
        law, z = self.contact.law.plain, np.where(closed > 0, self.z_normal, 0.0)[:, None]
        slope = np.where(law.given(z), 0.0, law.parameters[:, MU])
        in_bound = np.einsum("pij,pj->pi", stretch, in_bound) * (slope * closed)[:, None]
        normal = closed[:, None] * n + in_bound  # of the force, per z_N
        pressed = self._stiffness_left[:, None, None] * normal[:, :, None]
        in_z = stretch @ in_z
        by_counted = -in_z @ squeezed
        by_force = np.eye(n.shape[1]) - pressed * n[:, None, :]
        by_force = by_force + by_counted * self.counted[:, None, :]
        by_gap = normal * self.contact.rho[:, None]
        by_motion = -in_z @ moved
        if self.tied.any():
            tie_inplace(self, by_force, np.zeros_like(by_force), by_gap, by_motion)
        by_spin = by_force @ _cross(self.force) + by_motion @ _cross(self.motion)
        if self.held is not None:  # parts of lambda that count do not turn
            turned = self.counted[:, :, None] * _cross(self.force)
            by_spin += by_counted @ (_cross(self.counted * self.force) - turned)
        by_normal, by_axis = self._spun(by_spin, by_motion, self.residual(pieces))
        return by_force, by_normal, by_gap, by_motion, by_axis

    def _spun(self, by_spin: Array, by_motion: Array, law: Array) -> tuple[Array, Array]:
        """What (3) has of the spin, by n (nc, d, d) and by E (nc, d, 2 d).

        by_spin: of lambda and s in it.
        """
        n, d = self.n, self.n.shape[1]
        by_spin = by_spin - _cross(law)
        if self._pulled is not None and not (heard := self.contact.heard).all():
            turned = heard[:, :, None] * _cross(self._pulled)  # what is held does not turn
            by_spin += by_motion @ (_cross(self._pulled * heard) - turned)
        if d == 2:
            return -by_spin * self.meeting.frames[:, 1, None, :], np.zeros((len(n), 2, 0))
        by_normal, by_axis = twist(n, self.meeting.along, self.meeting.frames)
        about = by_spin @ n[:, :, None]
        by_axis = about * by_axis.reshape(len(n), 1, 2 * d)
        return by_spin @ _cross(n) + about * by_normal[:, None, :], by_axis


def _cross(v: Array) -> Array:
    """v (nc, d) as matrices: v x in 3D, (nc, 3, 3); v turned back by 90 degrees in 2D.

    By the spin they are derivatives of -(w x v): (nc, d, 3), or (nc, 2, 1) in 2D.
    """
    if v.shape[1] == 2:
        return np.stack([v[:, 1], -v[:, 0]], axis=1)[:, :, None]
    zero = np.zeros(len(v))
    x, y, z = v.T
    return np.stack([np.stack([zero, -z, y], axis=1), np.stack([z, zero, -x], axis=1),
                     np.stack([-y, x, zero], axis=1)], axis=1)  # fmt: skip
