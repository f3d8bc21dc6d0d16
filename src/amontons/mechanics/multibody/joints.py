"""Joints in a step: their rows, velocities that keep to them, contacts that they decide.

With the rows G_J of the joints in the metric of the masses (`levers_of`), W_JJ = G_J G_J^T:

Velocities that a step begins with are made to keep to the joints where the bodies are, by the
least impulses, r = -W_JJ^+ u_b with u_b = u at the beginning of the step.  What they take is
|G_J^+ u_b|^2 / 2: all that an impact without rebound takes where bodies are jolted, and of
fourth order in the step else, as turning alone makes u_b of second order.

A contact with the row g of its normal hangs on the joints by X = W_JJ^+ G_J g^T; where nothing
is left of it besides, |g|^2 = g G_J^T X, joints decide the motion along it, and its normal
reaction can change nothing.  Where joints decide its tangents as well, or friction is none, it
is left out (a joint at a corner that stands on a plane says what the contact says).  Else it
can slide, as a turntable on a floor with a hinge about the normal: it takes part, for its
friction, though equilibrium of rigid bodies does not say which part of the load it carries and
which the joints; `undetermined` names it.

W_JJ^+ is (W_JJ + e)^-1 with a small e: rows that say something twice get equal shares.  It
is a part of the mean diagonal of those joints that are linked by bodies, of no others.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.csgraph import connected_components
from scipy.sparse.linalg import SuperLU, splu

from .bodies import GROUND, RigidBodies
from .rows import Rows, impulses, levers_of, rotations, velocities
from .states import Motion

Array = NDArray[np.float64]
Index = NDArray[np.int64]
SMALL = 1e-12  # e over the mean of the diagonal of W_JJ
DECIDED = 1e-9  # of |g|^2: what is left of a contact that joints decide; SMALL is in it
ALIKE = 1e-6  # of the largest principal moment of inertia, moments of an axis of symmetry
AT_ONCE = 64  # contacts whose X are formed together, dense


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
    """How nc contacts hang on k joints.

    shared: G_J g^T, sparse (3 k, nc), of their normals; factors: W_JJ^+; loose (nc,): joints do
    not decide the motion along the normal; idle (nc,): they decide all of it.
    """

    shared: Any
    factors: SuperLU
    loose: NDArray[np.bool_]
    idle: NDArray[np.bool_]

    def only(self, kept: NDArray[np.bool_]) -> Hung:
        """The same without the contacts that are not kept, (nc,)."""
        return self._replace(
            shared=self.shared[:, kept], loose=self.loose[kept], idle=self.idle[kept]
        )

    def pulled(self, u: Array) -> Array:
        """X^T u, (nc,), of velocities u (k, 3) of the joints."""
        return self.shared.T @ self.factors.solve(u.ravel())


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
        pairs = self.first, np.where(self.second == GROUND, self.first, self.second)
        graph = sparse.coo_array((np.ones(len(joints)), pairs), (len(bodies), len(bodies)))
        groups = connected_components(graph, directed=False)[1][self.first]
        self.linked = np.unique(groups, return_inverse=True)[1]  # its group, of each joint
        x = np.array([body.position for body in bodies])
        R = rotations(np.array([body.orientation for body in bodies]))
        point = np.array([joint.point for joint in joints], dtype=float).reshape(-1, 3)
        first, second, on_ground = self.first, self.second, self.second == GROUND
        own = np.einsum("jki,jk->ji", R[first], point - x[first])
        other = np.einsum("jki,jk->ji", R[second], point - x[second])
        self.anchors = own, np.where(on_ground[:, None], point, other)
        self.crosswise = np.array([_crosswise(np.array(body.inertia)) for body in bodies])

    def energy(self, motion: Motion) -> float:
        """Kinetic energy without that of spin about axes of symmetry, which joints leave."""
        turning = np.einsum("bi,bij,bj->", motion.spin, self.crosswise, motion.spin)
        return 0.5 * float(self.masses @ (motion.velocity**2).sum(axis=1) + turning)

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
        own = W.diagonal().reshape(-1, 3).mean(axis=1)
        e = SMALL * np.bincount(self.linked, own) / np.bincount(self.linked)
        return G, splu((W + sparse.diags_array(np.repeat(e[self.linked], 3))).tocsc())

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

    def hung(self, contacts: Rows, joints: Rows, R: Array, mu: float) -> Hung | None:
        """How contacts hang on the joints; None where none of them has a jointed body."""
        theirs = self.jointed[contacts.slave] | self.jointed[contacts.master]
        if not theirs.any():
            return None
        G, factors = self._mobility(joints, R)
        levers, sides = self._levers(contacts, R)
        normals = lever_matrix(levers[:, :, :1], sides, len(self.masses))
        shared = (G @ normals.T).tocsc()
        loose = np.ones(len(theirs), dtype=bool)
        loose[theirs] = _left(normals[theirs], shared[:, theirs], factors)
        idle = ~loose
        if mu > 0 and idle.any():
            tangents = lever_matrix(levers[idle, :, 1:], sides[idle], len(self.masses))
            slides = _left(tangents, (G @ tangents.T).tocsc(), factors).reshape(-1, 2)
            idle[idle] = ~slides.any(axis=1)
        return Hung(shared, factors, loose, idle)


def _crosswise(inertia: Array) -> Array:
    """Inertia (3, 3) without that about the axis of symmetry: none of it where all axes are."""
    values, axes = np.linalg.eigh(inertia)
    low, high = np.diff(values) <= ALIKE * values[-1]  # the lower two alike, the upper two
    kept = values * [not high, not (low and high), not low]
    return (axes * kept) @ axes.T


def _left(rows: Any, shared: Any, factors: SuperLU) -> NDArray[np.bool_]:
    """Of which rows (n, 6 b) joints leave something free, by shared = G_J rows^T."""
    whole = rows.multiply(rows).sum(axis=1)
    decided = np.zeros(len(whole))
    for k in range(0, len(whole), AT_ONCE):
        some = shared[:, k : k + AT_ONCE].toarray()
        decided[k : k + AT_ONCE] = (some * factors.solve(some)).sum(axis=0)
    return whole - decided > DECIDED * whole
