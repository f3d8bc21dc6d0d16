"""What large deformations compute with: bodies, contacts, the pattern of the tangent.

The tangent of the whole model is a list of node blocks, body after body; its free rows and
columns always have the same pattern, so that they are one `take` away.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ...core.errors import UnsupportedForm
from ..contact.current import CurrentContact
from ..contact.current_pairs import Meetings, ObstaclePair
from ..elements.given import GivenMatrices
from ..elements.hyperelasticity import HyperelasticBody, is_hyperelastic
from ..elements.linear_body import LinearBody
from ..elements.rigid import Rigid
from .parts import FINITE

if TYPE_CHECKING:
    from .model import Model

Array = NDArray[np.float64]
Index = NDArray[np.int64]
RESOLVED = 1e-7  # of stresses like moduli, and of displacements like the size


@dataclass(frozen=True, eq=False)
class NonlinearParts:
    """Everything that depends on neither load nor memory.

    X (nodes, d): reference positions; ends: where the nodes of the next body begin; free (n,):
    free dofs; at (nc, d): dofs of the contacts; row_contact (m,): the contact in whose row a
    node block lies, -1 for none; diagonal (nc,): the diagonal block of a contact;
    columns, pointers: all node blocks as rows of a matrix; taken: for every entry of the matrix
    of the free dofs its place in the list of blocks.
    """

    bodies: tuple[HyperelasticBody | LinearBody, ...]
    X: Array
    ends: Index
    free: Index
    contact: CurrentContact
    at: Index
    row_contact: Index
    diagonal: Index
    columns: Index
    pointers: Index
    taken: sparse.csc_array

    @cached_property
    def points(self) -> Array:
        """Reference positions of the contacts, (nc, d)."""
        return self.X.ravel()[self.at]

    @cached_property
    def resolved(self) -> tuple[float, float]:
        """Sizes of forces and of u that rounding leaves with some eight digits."""
        forces = np.concatenate([body.unit_forces() for body in self.bodies])
        around = self.points - self.X.mean(axis=0)
        return (RESOLVED * float(np.linalg.norm(forces)),
                RESOLVED * float(np.linalg.norm(around)))  # fmt: skip

    @property
    def dimension(self) -> int:
        """2 or 3."""
        return self.X.shape[1]

    def meet(self, u: Array) -> Meetings:
        """Where the contact pairs meet at displacements u (nodes, d)."""
        return self.contact.meet(self.X + u)

    def forces(self, u: Array) -> Array:
        """Nodal forces of the bodies (dofs,) at displacements u (nodes, d)."""
        parts = zip(self.bodies, np.split(u, self.ends), strict=True)
        return np.concatenate([body.forces(part).ravel() for body, part in parts])

    def tangent(self, u: Array) -> tuple[Array, Array]:
        """(forces (dofs,), node blocks (m, d, d) of their derivative) at displacements u."""
        parts = zip(self.bodies, np.split(u, self.ends), strict=True)
        both = [body.tangent(part) for body, part in parts]
        return np.concatenate([f.ravel() for f, _ in both]), np.concatenate(
            [b for _, b in both]
        )

    def energy(self, u: Array) -> float:
        """Stored energy at displacements u (nodes, d)."""
        parts = zip(self.bodies, np.split(u, self.ends), strict=True)
        return sum(body.energy(part) for body, part in parts)

    @cached_property
    def _order(self) -> Index:
        """One ascending number per node block."""
        rows = np.repeat(np.arange(len(self.X)), np.diff(self.pointers))
        return rows * len(self.X) + self.columns

    def subtract_inplace(self, blocks: Array, nodes: Index, slopes: Array) -> None:
        """Take derivatives (k, a, a, d, d), at all pairs of nodes (k, a), from node blocks."""
        pairs = nodes[:, :, None] * len(self.X) + nodes[:, None, :]
        places = np.searchsorted(self._order, pairs.ravel())
        np.subtract.at(blocks, places, slopes.reshape(-1, *blocks.shape[1:]))

    def matrix(self, blocks: Array) -> sparse.bsr_array:
        """Node blocks as a matrix (dofs, dofs)."""
        return _matrix(blocks, self.columns, self.pointers)

    def on_free(self, blocks: Array) -> sparse.csc_array:
        """Node blocks as the matrix (n, n) of the free dofs."""
        t = self.taken
        values = blocks.ravel()[np.asarray(t.data, dtype=np.int64)]
        return sparse.csc_array((values, t.indices, t.indptr), shape=t.shape)


def nonlinear_parts(model: Model) -> NonlinearParts:
    """The parts of a model, made once for all its variants.

    Raises UnsupportedForm for what finite strains do not have.
    """
    parts = model._shared.once(_nonlinear_parts, (), model)
    return replace(parts, contact=replace(parts.contact, law=model.law))


def _nonlinear_parts(model: Model) -> NonlinearParts:
    _check_supported(model)
    linear = model.discretisation  # of the tangent at rest: same dofs, contacts and checks
    bodies = tuple(
        (HyperelasticBody if is_hyperelastic(body.material) else LinearBody)(
            body.mesh, body.material  # type: ignore[arg-type]
        )
        for body in model.bodies
    )
    X = np.concatenate([body.mesh.points for body in model.bodies])
    d = X.shape[1]
    slaves = [p.rows.nodes + linear.offsets[p.body] // d for p in linear.placed]
    nodes = np.concatenate(slaves)
    _check_single(nodes)
    at = nodes[:, None] * d + np.arange(d)
    is_free = np.zeros(linear.dofs, dtype=bool)
    is_free[linear.free] = True
    rows, columns = _pattern(bodies)
    contact_of = np.full(len(X), -1)
    contact_of[nodes] = np.arange(len(nodes))
    numbers = np.arange(len(rows) * d * d, dtype=np.int64).reshape(-1, d, d)
    pointers = np.searchsorted(rows, np.arange(len(X) + 1))
    taken = _matrix(numbers + 1, columns, pointers).tocsr()[linear.free].tocsc()[:, linear.free]
    taken.sort_indices()
    taken.data -= 1
    contact = CurrentContact(
        [ObstaclePair(c.obstacle, part)  # type: ignore[arg-type]
         for c, part in zip(model.contacts, slaves, strict=True)],
        model.law,
        _stiffness_at(linear.stored_stiffness, at),
        is_free[at],
    )  # fmt: skip
    return NonlinearParts(bodies, X, linear.offsets[1:-1] // d, linear.free, contact, at,
                          contact_of[rows], np.flatnonzero(rows == columns)[nodes],
                          columns, pointers, sparse.csc_array(taken))  # fmt: skip


def _check_supported(model: Model) -> None:
    if not model.contacts:
        raise UnsupportedForm(
            "finite strains are solved with contacts; got none; add a Contact, which may stay "
            "open, or take LinearElastic", ("contacts",), "",
        )  # fmt: skip
    asked = all(contact.kinematics == FINITE for contact in model.contacts)
    for k, body in enumerate(model.bodies):
        at, what = ("bodies", k, "material"), f"body {body.name!r}"
        if isinstance(body.material, Rigid):
            raise UnsupportedForm(
                f"{what} is rigid, and contact of finite kinematics needs bodies that deform",
                at, "",
            )  # fmt: skip
        if isinstance(body.material, GivenMatrices):
            raise UnsupportedForm(
                f"{what} has a given K, and contact of finite kinematics needs bodies with a "
                "law; give its contacts kinematics='small'", at, "",
            )  # fmt: skip
        if not (asked or is_hyperelastic(body.material)):
            raise UnsupportedForm(
                "others have hyperelastic laws and this one is linear elastic; give all of "
                "them NeoHookean or CiarletGeymonat, or say that it keeps small strains by "
                "kinematics='finite' of the contacts", at, what,
            )  # fmt: skip
    for k, contact in enumerate(model.contacts):
        what = f"contact on {contact.slave!r}"
        if contact.obstacle is None:
            raise UnsupportedForm(
                "finite kinematics has nodal contact with an obstacle only, not between two "
                f"bodies that deform; got the master {contact.master!r}; use an obstacle and "
                "no master, or LinearElastic and kinematics='small'",
                ("contacts", k, "kinematics"), what,
            )  # fmt: skip
        if contact.method != "nodal":
            raise UnsupportedForm(
                "finite kinematics has nodal contact with an obstacle only; use method='nodal'",
                ("contacts", k, "method"), what,
            )  # fmt: skip
        for name in ("gap_slopes", "normal_slopes"):
            if not hasattr(contact.obstacle, name):
                raise UnsupportedForm(
                    f"large deformations need its method {name}, as Plane, Sphere and "
                    f"LevelSet have it; got {contact.obstacle!r}",
                    ("contacts", k, "obstacle"), "obstacle",
                )  # fmt: skip


def _check_single(nodes: Index) -> None:
    if len(np.unique(nodes)) < len(nodes):
        raise UnsupportedForm(
            "a node meets two obstacles, large deformations allow one; join both into one "
            "LevelSet, or leave the node out of one of them (where)", ("contacts",),
        )  # fmt: skip


def _pattern(bodies: Sequence[HyperelasticBody | LinearBody]) -> tuple[Index, Index]:
    """Rows and columns (nodes) of all blocks."""
    rows, columns, start = [], [], 0
    for body in bodies:
        count = len(body.mesh.points)
        rows.append(np.repeat(np.arange(count), np.diff(body.pointers)) + start)
        columns.append(body.columns.astype(np.int64) + start)
        start += count
    return np.concatenate(rows), np.concatenate(columns)


def _matrix(blocks: NDArray, columns: Index, pointers: Index) -> sparse.bsr_array:
    """The matrix of node blocks in rows of nodes."""
    size = (len(pointers) - 1) * blocks.shape[1]
    return sparse.bsr_array((blocks, columns, pointers), shape=(size, size))


def _stiffness_at(K: sparse.csr_array, at: Index) -> Array:
    """Least stiffness of every contact's node with all others held, (nc,), at rest."""
    nc, d = at.shape
    part = K.tocsr()[at.ravel()][:, at.ravel()].tobsr((d, d))
    own = part.indices == np.repeat(np.arange(nc), np.diff(part.indptr))
    return 1.0 / np.linalg.norm(np.linalg.inv(part.data[own]), 2, axis=(1, 2))
