"""Joints in a step: their rows, velocities that keep to them, contacts that they decide.

With the rows G_J of the joints in the metric of the masses (`levers_of`), W_JJ = G_J G_J^T:

Velocities that a step begins with are made to keep to the joints where the bodies are, by the
least impulses, r = -W_JJ^+ u_b with u_b = u at the beginning of the step.  What they take is
|G_J^+ u_b|^2 / 2: all that an impact without rebound takes where bodies are jolted, and of
fourth order in the step else, as turning alone makes u_b of second order.

A contact with the row g of its normal hangs on the joints by X = W_JJ^+ G_J g^T; where nothing
is left of it besides, |g|^2 = g G_J^T X, joints decide its motion and it can change nothing: it
is left out, with reactions that would only squeeze (a joint at a corner that stands on a plane
says what the contact says).

W_JJ^+ is (W_JJ + e)^-1 with a small e: rows that say something twice get equal shares.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.linalg import splu

from .bodies import GROUND, RigidBodies
from .rows import Rows, impulses, levers_of, rotations, velocities

Array = NDArray[np.float64]
Index = NDArray[np.int64]
SMALL = 1e-12  # e over the mean of the diagonal of W_JJ
DECIDED = 1e-9  # of |g|^2: what is left of a contact that joints decide; SMALL is in it


def lever_matrix(levers: Array, sides: Index, bodies: int) -> Any:
    """Sparse G (k n, 6 bodies) of levers (n, 2, k, 6) on the bodies sides (n, 2), < 0 none."""
    n, _, k, _ = levers.shape
    contact, side = np.nonzero(sides >= 0)
    shape = len(contact), k, 6
    row = np.broadcast_to((k * contact[:, None] + np.arange(k))[:, :, None], shape)
    column = 6 * sides[contact, side][:, None] + np.arange(6)
    column = np.broadcast_to(column[:, None, :], shape)
    values = levers[contact, side].ravel()
    size = k * n, 6 * bodies
    return sparse.coo_array((values, (row.ravel(), column.ravel())), size).tocsr()


class Hung(NamedTuple):
    """What contacts hang on: X (3 k, nc), and which of them joints do not decide."""

    by: Array
    free: NDArray[np.bool_]


class Joints:
    """The joints of a system; points are fixed to the bodies as they are given."""

    def __init__(self, system: RigidBodies, masses: Array, inverse: Array) -> None:
        self.masses, self.inverse = masses, inverse
        bodies, joints = system.bodies, system.joints
        self.first = np.array([joint.first for joint in joints], dtype=np.int64)
        self.second = np.array([joint.second for joint in joints], dtype=np.int64)
        self.jointed = np.zeros(len(bodies) + 1, dtype=bool)  # the last one is the ground
        self.jointed[self.first] = True
        self.jointed[self.second[self.second != GROUND]] = True
        x = np.array([body.position for body in bodies])
        R = rotations(np.array([body.orientation for body in bodies]))
        point = np.array([joint.point for joint in joints], dtype=float).reshape(-1, 3)
        first, second, on_ground = self.first, self.second, self.second == GROUND
        own = np.einsum("jki,jk->ji", R[first], point - x[first])
        other = np.einsum("jki,jk->ji", R[second], point - x[second])
        self.anchors = own, np.where(on_ground[:, None], point, other)

    def rows(self, x: Array, R: Array) -> tuple[Rows, Array]:
        """Rows of joints of bodies at x, turned by R, and how far sides are apart, (k, 3)."""
        first, second = self.first, self.second
        own = np.einsum("jik,jk->ji", R[first], self.anchors[0])
        other = np.einsum("jik,jk->ji", R[second], self.anchors[1])
        on_ground = (second == GROUND)[:, None]
        fixed = np.where(on_ground, self.anchors[1], x[second] + other)
        axes = np.tile(np.eye(3), (len(first), 1, 1))
        return Rows(first, second, axes, own, other), x[first] + own - fixed

    def _levers(self, rows: Rows, R: Array) -> tuple[Array, Index]:
        inverse = R @ self.inverse @ R.swapaxes(1, 2)
        return levers_of(*rows, self.masses, inverse), np.stack([rows.slave, rows.master], 1)

    def _mobility(self, rows: Rows, R: Array) -> tuple[Any, Any]:
        """G_J, sparse, and W_JJ^+ as factors."""
        G = lever_matrix(*self._levers(rows, R), len(self.masses))
        W = G @ G.T
        e = SMALL * W.diagonal().mean()
        return G, splu((W + e * sparse.eye_array(W.shape[0])).tocsc())

    def kept(
        self, velocity: Array, omega: Array, x: Array, R: Array
    ) -> tuple[Array, Array, Array, float]:
        """Velocities (n, 3) that keep to the joints, impulses (k, 3), and their work."""
        rows, _ = self.rows(x, R)
        before = velocities(rows, velocity, omega)
        r = -self._mobility(rows, R)[1].solve(before.ravel()).reshape(-1, 3)
        push, turn = impulses(rows, r, len(self.masses))
        after = velocity + push / self.masses[:, None]
        turned = np.einsum("bij,bj->bi", R @ self.inverse @ R.swapaxes(1, 2), turn) + omega
        work = 0.5 * float(np.sum(r * (before + velocities(rows, after, turned))))
        return after, turned, r, work

    def hung(self, contacts: Rows, joints: Rows, R: Array) -> Hung | None:
        """What contacts hang on; None where none of them has a jointed body."""
        theirs = self.jointed[contacts.slave] | self.jointed[contacts.master]
        if not theirs.any():
            return None
        G, factors = self._mobility(joints, R)
        levers, sides = self._levers(contacts, R)
        normals = lever_matrix(levers[:, :, :1], sides, len(self.masses))
        shared = (G @ normals.T).toarray()
        by = factors.solve(shared) if shared.size else shared
        whole = normals.multiply(normals).sum(axis=1)
        return Hung(by, whole - (shared * by).sum(axis=0) > DECIDED * whole)
