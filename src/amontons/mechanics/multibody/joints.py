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

Joints are closed at the end of a step by impulses of its middle, which Newton's method finds
for joints alone from the free turning of their bodies (`bonds.closed_by`), and solves of the
step beside contacts that hang on them (`bonds.aimed`). Of a body that turns
by an angle 2 p about an axis, the arms R_m X get those of the chord, the mean of R0 X and R1 X
by tan(p) / p across the axis: with them a plane motion has u1 = -u_m and closes. In space what
is left gives velocities c, of third order in h, and u1 = c - u_m. (With c = 0 and arms of the
middle, sides part by a third power of h and velocities leave the joints, which is all that a
fast top loses; with c and arms of the middle joints work to and fro by a second power.)
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.csgraph import connected_components

from ...solvers.newton.block_lu import analyse_pattern
from .bodies import GROUND, RigidBodies
from .bonds import aimed, closed_by, joint_rows, kept_to, left_of, pulled_by
from .joint_factor import Pattern, factorised, solved_bonds
from .rows import Rows, delassus, global_inverse, levers_of, rotations
from .states import Motion

Array = NDArray[np.float64]
Index = NDArray[np.int64]
DECIDED = 1e-9  # of |g|^2: what is left of a contact that joints decide
ALIKE = 1e-6  # of the largest principal moment of inertia, moments of an axis of symmetry


class Hung(NamedTuple):
    """How nc contacts hang on k joints.

    normals (nc, 2, 6), sides (nc, 2): levers of their normals on their bodies; bonds: the
    joints, as `bonds.pulled_by` takes them; loose (nc,): joints do not decide the motion along
    the normal; idle (nc,): they decide all of it.
    """

    normals: Array
    sides: Index
    bonds: tuple[Any, ...]
    loose: NDArray[np.bool_]
    idle: NDArray[np.bool_]

    def only(self, kept: NDArray[np.bool_]) -> Hung:
        """The same without the contacts that are not kept, (nc,)."""
        return self._replace(
            normals=self.normals[kept], sides=self.sides[kept], loose=self.loose[kept],
            idle=self.idle[kept],
        )  # fmt: skip

    def pulled(self, u: Array, bodies: int) -> Array:
        """X^T u, (nc,), of velocities u (k, 3) of the joints."""
        return pulled_by(self.normals, self.sides, *self.bonds, u, bodies)


class Joints:
    """The joints of a system; points are fixed to the bodies as they are given."""

    def __init__(self, system: RigidBodies, masses: tuple[Array, Array, Array]) -> None:
        self.bodies = masses
        bodies, joints = system.bodies, system.joints
        first = np.array([joint.first for joint in joints], dtype=np.int64)
        self.first = first
        self.second = np.array([joint.second for joint in joints], dtype=np.int64)
        self.jointed = np.zeros(len(bodies) + 1, dtype=bool)  # the last one is the ground
        self.jointed[self.first] = True
        self.jointed[self.second[self.second != GROUND]] = True
        pairs = self.first, np.where(self.second == GROUND, self.first, self.second)
        graph = sparse.coo_array((np.ones(len(joints)), pairs), (len(bodies), len(bodies)))
        groups = connected_components(graph, directed=False)[1]
        linked = np.unique(groups[first], return_inverse=True)[1]  # its part, of each joint
        self.groups = np.append(groups, GROUND)
        light = 1 / np.bincount(groups, masses[0])
        light[groups[first[self.second == GROUND]]] = 0.0
        self.light = np.append(light[groups], 0.0)  # 1 / mass of a body's part, 0 where held
        x = np.array([body.position for body in bodies])
        R = rotations(np.array([body.orientation for body in bodies]))
        point = np.array([joint.point for joint in joints], dtype=float).reshape(-1, 3)
        second, on_ground = self.second, self.second == GROUND
        own = np.einsum("jki,jk->ji", R[first], point - x[first])
        other = np.einsum("jki,jk->ji", R[second], point - x[second])
        self.anchors = own, np.where(on_ground[:, None], point, other)
        rows, _ = joint_rows(first, second, self.anchors, x, R)
        indptr, indices, *_ = delassus(Rows(*rows), masses[0], masses[2])
        order = analyse_pattern(indptr, indices).arrays
        self.pattern = tuple(Pattern(indptr, indices, order, linked))
        self.crosswise = np.array([_crosswise(np.array(body.inertia)) for body in bodies])

    def energy(self, motion: Motion) -> float:
        """Kinetic energy without that of spin about axes of symmetry, which joints leave."""
        turning = np.einsum("bi,bij,bj->", motion.spin, self.crosswise, motion.spin)
        return 0.5 * float(self.bodies[0] @ (motion.velocity**2).sum(axis=1) + turning)

    def rows(self, x: Array, R: Array) -> tuple[Rows, Array]:
        """Rows of joints of bodies at x, turned by R, and how far sides are apart, (k, 3)."""
        rows, apart = joint_rows(self.first, self.second, self.anchors, x, R)
        return Rows(*rows), apart

    def factor(self, rows: Rows, R: Array) -> tuple[tuple[Any, ...], Array]:
        """W_JJ and its factor for bodies turned by R, and their inverse inertia there."""
        inverse = global_inverse(R, self.bodies[2])
        return factorised(tuple(rows), self.pattern, self.bodies[0], inverse), inverse

    def contradicted(self, rows: Rows, inverse: Array, b: Array) -> Array:
        """What of b (k, 3) no impulses of joints with these rows give."""
        factor = factorised(tuple(rows), self.pattern, self.bodies[0], inverse)
        indptr, indices, *_ = self.pattern
        W = sparse.bsr_array((factor[0], indices, indptr), (b.size, b.size))
        return b - (W @ solved_bonds(self.pattern, factor, b).ravel()).reshape(b.shape)

    def kept(self, motion: Motion) -> tuple[Motion, Array, Array, tuple[float, float]]:
        """A motion that keeps to the joints, impulses, sides apart (k, 3), energy and work."""
        R = rotations(motion.orientation)
        rows, apart = self.rows(motion.position, R)
        factor, inverse = self.factor(rows, R)
        v, spin, r, gained, work = kept_to(
            tuple(rows), self.pattern, factor, self.bodies, inverse, R, motion.velocity,
            motion.spin,
        )  # fmt: skip
        return motion._replace(velocity=v, spin=spin), r, apart, (gained, work)

    def closed(
        self, begin: Array, middle: tuple[Any, ...], v: Array, h: float, gravity: Array
    ) -> tuple[Rows, Array, Array]:
        """Rows of a step, impulses r (k, 3) that close joints at its end, and c (k, 3)."""
        rows, r, c = closed_by(
            tuple(self.rows(middle[0], middle[2])[0]), self.pattern, self.anchors, self.bodies,
            rotations(begin), middle, v, h, gravity,
        )  # fmt: skip
        return Rows(*rows), r, c

    def aimed(
        self, at: Rows, r: Array, begin: Array, middle: tuple[Any, ...], v: Array, h: float,
        gravity: Array,
    ) -> tuple[Rows, Array, Array]:  # fmt: skip
        """Rows of chords and c (k, 3) that close joints beside r of all rows; sides apart."""
        rows, c, apart = aimed(
            tuple(at), tuple(self.rows(middle[0], middle[2])[0]), self.pattern, self.anchors,
            self.bodies, rotations(begin), middle, v, h, gravity, r,
        )  # fmt: skip
        return Rows(*rows), c, apart

    def bonds(self, rows: Rows, R: Array) -> tuple[tuple[Any, ...], Array]:
        """What contacts hang on, see `Hung`, and the inverse inertia of bodies turned by R."""
        factor, inverse = self.factor(rows, R)
        levers = levers_of(*rows, self.bodies[0], inverse)
        return (levers, sides_of(rows), self.pattern, factor), inverse

    def hung(self, contacts: Rows, joints: Rows, R: Array, mu: float) -> Hung | None:
        """How contacts hang on the joints; None where none of them has a jointed body."""
        theirs = self.jointed[contacts.slave] | self.jointed[contacts.master]
        if not theirs.any():
            return None
        bonds, inverse = self.bonds(joints, R)
        levers, sides = levers_of(*contacts, self.bodies[0], inverse), sides_of(contacts)
        loose = np.ones(len(theirs), dtype=bool)
        normals, tangents = levers[:, :, :1], levers[:, :, 1:]
        asked = theirs & ~self._carried(contacts, normals)
        loose[asked] = self._left(normals, sides, asked, bonds)[:, 0]
        idle = ~loose
        if mu > 0 and idle.any():
            idle[idle] = ~self._left(tangents, sides, idle, bonds).any(axis=1)
        return Hung(np.ascontiguousarray(normals[:, :, 0]), sides, bonds, loose, idle)

    def _carried(self, contacts: Rows, normals: Array) -> NDArray[np.bool_]:
        """Contacts (n,) whose slave, or master, moves along the normal with all linked to it.

        Joints leave 1 / mass of such a part of |g|^2 at least.
        """
        one, other = contacts.slave, contacts.master
        least = np.maximum(self.light[one], self.light[other])
        whole = np.einsum("nsme,nsme->n", normals, normals)
        return (self.groups[one] != self.groups[other]) & (least > DECIDED * whole)

    def _left(
        self, levers: Array, sides: Index, those: NDArray[np.bool_], bonds: tuple[Any, ...]
    ) -> NDArray[np.bool_]:
        """Where joints leave something of rows (n, 2, m, 6), (those, m)."""
        few = np.ascontiguousarray(levers[those])
        return left_of(few, sides[those], *bonds, len(self.bodies[0])) > DECIDED


def sides_of(rows: Rows) -> Index:
    """Bodies (n, 2) of each row."""
    return np.ascontiguousarray(np.stack([rows.slave, rows.master], axis=1))


def _crosswise(inertia: Array) -> Array:
    """Inertia (3, 3) without that about the axis of symmetry: none of it where all axes are."""
    values, axes = np.linalg.eigh(inertia)
    low, high = np.diff(values) <= ALIKE * values[-1]  # the lower two alike, the upper two
    kept = values * [not high, not (low and high), not low]
    return (axes * kept) @ axes.T
