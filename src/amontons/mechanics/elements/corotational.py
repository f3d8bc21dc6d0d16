"""Linear elasticity in a frame that turns with the body: small strains, any rotation.

With weights w_a of the nodes, sum 1, c the mean of their places x_a, Y_a = X_a - mean X and

    A = sum_a w_a (x_a - c) Y_a^T = R S,    R a rotation, S symmetric (polar decomposition),

R is the rotation that fits the body best, and d_a = R^T (x_a - c) - Y_a what is left of its
motion.  The stored energy is E = d . K d / 2 with the stiffness K of linear elasticity, which
does not change: rigid motions of any size store nothing, and for small rotations E is that of
linear elasticity.  With g = K d and z_a = R^T (x_a - c), a variation of x turns the frame by

    G theta = sum w_a Y_a x R^T dx_a,   G = tr(S) I - S,      (R^T dA - [theta] S symmetric)

and dd_a = R^T dx_a - theta x z_a, so that the nodal forces, whose sum and moment are zero, are

    f_a = R (g_a - w_a tau x Y_a),      G tau = sum_a z_a x g_a.                          (1)

Between two states, with Q = R0^T R1 = (I - [theta]/2)^-1 (I + [theta]/2) (Cayley), the same
holds for differences, exactly: R1 - R0 = P [theta] with P = (R0 + R1) / 2, and

    d1 - d0 = P^T (x1 - x0) - theta x z,   z = P^T (x0 + x1) / 2,
    G theta = sum w_a Y_a x P^T (x1 - x0)_a,   G = tr(B) I - B,   B = sum w_a z_a Y_a^T.

The forces P (g - w tau x Y), g = K (d0 + d1) / 2, do the work E1 - E0 where G^T tau is the
moment of g about z, and have no moment about the means of both places where tau is made of
y = P^-1 (x0 + x1) / 2 in place of z.  In the plane that is the same.  In space the second is
taken, and what is left of the work, of third order in theta, is done by a share s of the forces
of k = K (d1 - d0):

    f = P (g - w tau x Y + s (k - w tau_k x Y)),   m(g) = G^T tau - sum z x g,            (2)
    s = theta . m(g) / (k . (d1 - d0) - theta . m(k)).

Work E1 - E0, no sum and no moment, to rounding, whatever the step.  With b (d1 - d0) added to
the mean in g bodies lose b (d1 - d0) . k: viscosity that rigid motions do not feel.

The tangent is R K R^T: it leaves out what the stress does in a rotation, of the order of the
strain, and so Newton's method converges linearly, at the rate of the strain.

Every connected piece of a mesh has one frame, in which it may bend by small angles only: a
stone, not a rope.  Hyperelastic laws have no such limit.

[F] C. A. Felippa, B. Haugen, "A unified formulation of small-strain corotational finite
elements", CMAME 194 (2005) 2285-2335; [G] O. Gonzalez, CMAME 190 (2000), for the idea of (2).
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.csgraph import connected_components

from ..meshes.cells import CELLS
from ..meshes.check import determinant
from ..meshes.mesh import Mesh
from .elasticity import LinearElastic
from .linear_body import LinearBody
from .nodal_stress import stress_of

Array = NDArray[np.float64]
Index = NDArray[np.int64]


class Turned(NamedTuple):
    """Where pieces are: rotations R (k, dim, dim), and the motion of nodes in these frames.

    inner (n, dim): R^T (x - c); left (n, dim): what deforms them, d.
    """

    R: Array
    inner: Array
    left: Array


class Frames:
    """The frames that fit the pieces of a mesh best."""

    def __init__(self, mesh: Mesh) -> None:
        self.piece = pieces_of(mesh)  # (n,) of every node
        self.nodes = [np.flatnonzero(self.piece == k) for k in range(self.piece.max() + 1)]
        shares = node_shares(mesh)
        self.w = shares / np.bincount(self.piece, shares)[self.piece]
        self.Y = self.centred(mesh.points)

    def centred(self, x: Array) -> Array:
        """x (n, dim) from the mean of each piece."""
        out = np.empty_like(x)
        for at in self.nodes:
            out[at] = x[at] - self.w[at] @ x[at]
        return out

    def at(self, u: Array) -> Turned:
        """At displacements u (n, dim)."""
        x = self.centred(self.Y + u)
        U, _, Vt = np.linalg.svd(self.moments(x))
        U[:, :, -1] *= np.sign(np.linalg.det(U @ Vt))[:, None]
        R = U @ Vt
        inner = self.seen(x, R)
        return Turned(R, inner, inner - self.Y)

    def moments(self, x: Array) -> Array:
        """sum_a w_a x_a Y_a^T of every piece, (k, dim, dim)."""
        return np.array([(self.w[at, None] * x[at]).T @ self.Y[at] for at in self.nodes])

    def seen(self, x: Array, R: Array) -> Array:
        """R^T x of all nodes, (n, dim)."""
        return np.einsum("aji,aj->ai", R[self.piece], x)

    def turned(self, x: Array, R: Array) -> Array:
        """R x of all nodes, (n, dim)."""
        return np.einsum("aij,aj->ai", R[self.piece], x)

    def without_moment(self, g: Array, z: Array) -> tuple[Array, Array]:
        """g - w tau x Y (n, dim) of forces g at z, and the tau (k, 3) of each piece."""
        dim, out, taus = g.shape[1], g.copy(), np.empty((len(self.nodes), 3))
        for k, (at, B) in enumerate(zip(self.nodes, self.moments(z), strict=True)):
            moment = np.cross(_spatial(z[at]), _spatial(g[at])).sum(axis=0)
            taus[k] = np.linalg.solve(_slope(B).T, moment)
            out[at] -= self.w[at, None] * np.cross(taus[k], _spatial(self.Y[at]))[:, :dim]
        return out, taus

    def missing(self, g: Array, taus: Array, z: Array) -> Array:
        """m(g) of (2), (k, 3)."""
        out = np.empty((len(self.nodes), 3))
        for k, (at, B) in enumerate(zip(self.nodes, self.moments(z), strict=True)):
            out[k] = _slope(B).T @ taus[k] - np.cross(z[at], g[at]).sum(axis=0)
        return out


class CorotationalBody(LinearBody):
    """Nodal forces and tangent of a linear elastic mesh in frames of its own."""

    def __init__(self, mesh: Mesh, material: LinearElastic | Mapping[str, LinearElastic]):
        super().__init__(mesh, material)
        self.frames = Frames(mesh)
        rows = np.repeat(np.arange(len(mesh.points)), np.diff(self.pointers))
        self._piece = self.frames.piece[rows]

    @property
    def stiffness(self) -> sparse.bsr_array:
        """K (dofs, dofs), the same in all frames."""
        return self._K

    def forces(self, u: Array) -> Array:
        """(1) at displacements u (n, dim)."""
        frames, now = self.frames, self.frames.at(u)
        g = super().forces(now.left)
        return frames.turned(frames.without_moment(g, now.inner)[0], now.R)

    def tangent(self, u: Array) -> tuple[Array, Array]:
        """(forces (n, dim), blocks (m, dim, dim) of R K R^T)."""
        R = self.frames.at(u).R[self._piece]
        return self.forces(u), R @ self._blocks @ R.swapaxes(1, 2)

    def energy(self, u: Array) -> float:
        """Stored energy at displacements u (n, dim), unit of work."""
        return super().energy(self.frames.at(u).left)

    def between(self, before: Array, after: Array, viscous: float = 0.0) -> Array:
        """(2) between displacements (n, dim); viscous: b, 0 or more."""
        frames = self.frames
        old, new = frames.at(before), frames.at(after)
        change = new.left - old.left
        g = super().forces(0.5 * (old.left + new.left) + viscous * change)
        P = 0.5 * (old.R + new.R)
        x = frames.centred(frames.Y + 0.5 * (before + after))
        y = frames.seen(x, np.linalg.inv(P).swapaxes(1, 2).astype(float))
        f, tau = frames.without_moment(g, y)
        if before.shape[1] == 3:
            z, k = frames.seen(x, P), super().forces(change)
            along, tau_k = frames.without_moment(k, y)
            turn = np.linalg.solve(P, new.R - old.R)
            theta = np.stack([turn[:, 2, 1], turn[:, 0, 2], turn[:, 1, 0]], axis=1)
            rest = (theta * frames.missing(g, tau, z)).sum(axis=1)
            work = np.bincount(frames.piece, (k * change).sum(axis=1))
            work -= (theta * frames.missing(k, tau_k, z)).sum(axis=1)
            share = np.divide(rest, work, out=np.zeros_like(rest), where=work > 0)
            f = f + share[frames.piece, None] * along
        return frames.turned(f, P)

    def lost(self, before: Array, after: Array, viscous: float) -> float:
        """Energy that the viscous part of `between` takes."""
        change = self.frames.at(after).left - self.frames.at(before).left
        return 2 * viscous * super().energy(change)


def corotated_stress(
    mesh: Mesh, material: Any, u: Array
) -> tuple[Array, Array]:
    """Cauchy stress of cells (c, 3, 3) and nodes (n, 3, 3) at displacements u (n, dim)."""
    frames = Frames(mesh)
    now, dim = frames.at(u), mesh.dim
    R = np.tile(np.eye(3), (len(now.R), 1, 1))
    R[:, :dim, :dim] = now.R
    cells = np.concatenate([frames.piece[block.nodes[:, 0]] for block in mesh.cells])
    found = stress_of(mesh, material, now.left)
    return tuple(
        R[k] @ stress @ R[k].swapaxes(1, 2)
        for stress, k in zip(found, (cells, frames.piece), strict=True)
    )  # type: ignore[return-value]


def _slope(B: Array) -> Array:
    """tr(B) I - B (3, 3) of B (dim, dim)."""
    out = np.trace(B) * np.eye(3)
    out[: len(B), : len(B)] -= B
    return out


def _spatial(a: Array) -> Array:
    """Vectors (n, dim) as (n, 3)."""
    return a if a.shape[1] == 3 else np.column_stack([a, np.zeros(len(a))])


def pieces_of(mesh: Mesh) -> Index:
    """The connected piece (n,) of every node."""
    n = len(mesh.points)
    first = np.concatenate([np.repeat(c.nodes[:, 0], c.nodes.shape[1]) for c in mesh.cells])
    other = np.concatenate([c.nodes.ravel() for c in mesh.cells])
    graph = sparse.coo_array((np.ones(len(other)), (first, other)), shape=(n, n))
    return connected_components(graph, directed=False)[1].astype(np.int64)


def node_shares(mesh: Mesh) -> Array:
    """Volumes (n,) of the nodes, equal shares of each cell."""
    out = np.zeros(len(mesh.points))
    for cells in mesh.cells:
        cell = CELLS[cells.kind]
        volumes = sum(
            weight * determinant(cell.jacobians(mesh.points[cells.nodes], at))
            for at, weight in zip(*cell.gauss, strict=True)
        )
        share = np.asarray(volumes) / cells.nodes.shape[1]
        np.add.at(out, cells.nodes, share[:, None])
    return out
