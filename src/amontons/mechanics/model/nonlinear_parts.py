"""What large deformations compute with: bodies, contacts, the pattern of the tangent.

The tangent of the whole model is a list of node blocks, body after body; its free rows and
columns always have the same pattern, so that they are one `take` away.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ...core.errors import InvertedCells, UnsupportedForm
from ...linear.sums import Rows, rows_of_products
from ..contact.current import CurrentContact
from ..contact.current_mortar import MortarPair
from ..contact.current_pairs import Meetings, between_bodies
from ..elements.corotational import CorotationalBody
from ..elements.hyperelasticity import HyperelasticBody, is_hyperelastic
from ..elements.linear_body import LinearBody
from .finite_checks import chains, check_nodes, check_supported
from .in_each_other import outlines
from .met_pairs import cleared, free_dofs, met_pairs, resistance
from .tangent_structure import Numbering, pattern_of
from .worst_cells import flattest, most_strained

if TYPE_CHECKING:
    from .body import Body
    from .model import Model

Array = NDArray[np.float64]
Index = NDArray[np.int64]
KEPT = 3  # states whose meetings are kept: now, tried, at the end of the last step
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
    names: tuple[str, ...]
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

    def unit_forces(self, u: Array) -> float:
        """Size of the nodal forces of which rounding makes its part at u (nodes, d).

        Of stresses like moduli, and where u is large beside cells of its terms in grad u.
        """
        forces, stiffness = self._of_rounding
        moved = np.linalg.norm(u, axis=1) * stiffness
        return float(np.hypot(np.linalg.norm(forces), np.linalg.norm(moved)))

    @cached_property
    def _of_rounding(self) -> tuple[Array, Array]:
        """`unit_forces` and `unit_stiffness` of the bodies, (nodes,) each."""
        return (np.concatenate([body.unit_forces() for body in self.bodies]),
                np.concatenate([body.unit_stiffness() for body in self.bodies]))  # fmt: skip

    def resolved(self, u: Array) -> tuple[float, float]:
        """Sizes of forces and of lengths that rounding leaves with some eight digits at u."""
        around = self.points - self.X.mean(axis=0)
        length = np.hypot(np.linalg.norm(around), np.linalg.norm(u.ravel()[self.at]))
        return RESOLVED * self.unit_forces(u), RESOLVED * float(length)

    def check_tangent(self) -> None:
        """Raise UnsupportedForm where the tangent is not the derivative of the forces."""
        if any(isinstance(body, CorotationalBody) for body in self.bodies):
            raise UnsupportedForm(
                "corotational bodies have no path: their tangent leaves out what stresses do "
                "in a rotation, on which stability hangs; give them SaintVenantKirchhoff"
            )

    @property
    def dimension(self) -> int:
        """2 or 3."""
        return self.X.shape[1]

    @property
    def has_pairs(self) -> bool:
        """True where two bodies that deform meet."""
        return any(isinstance(pair, MortarPair) for pair in self.contact.pairs)

    @cached_property
    def numbering(self) -> Numbering:
        """What the free dofs are."""
        return Numbering.of(self)

    @cached_property
    def chained(self) -> int:
        """How many pairs follow the first in a chain of slaves that are masters of others."""
        return len(self.contact.pairs) - 1 if any(chains(self.contact.pairs)) else 0

    @property
    def folds(self) -> bool:
        """True where a surface meets itself."""
        return any(isinstance(p, MortarPair) and p.fold is not None for p in self.contact.pairs)

    def divided(self, u: Array) -> NonlinearParts:
        """The same with sides of folds as they are at displacements u (nodes, d)."""
        for known, parts in tuple(self._divisions):
            if np.array_equal(known, u):
                return parts
        pairs = tuple(
            pair.divided(self.X + u) if isinstance(pair, MortarPair) else pair
            for pair in self.contact.pairs
        )
        parts = replace(self, contact=replace(self.contact, pairs=pairs))
        self._divisions.append((u.copy(), parts))
        return parts

    @cached_property
    def _divisions(self) -> deque[tuple[Array, NonlinearParts]]:
        """States, and these parts with the sides of folds there."""
        return deque(maxlen=KEPT)

    @cached_property
    def variants(self) -> deque[tuple[NDArray[np.bool_] | None, NonlinearParts]]:
        """The same with other components held that the law hears, see `rubbed_between`."""
        return deque(maxlen=KEPT)

    def growth(self, u: Array) -> Array | float:
        """Of `contact.grown_areas` at displacements u (nodes, d), (nc,); 1 for all of them."""
        return self.meet(u).growth if self.contact.law.has_stresses else 1.0

    @cached_property
    def outlines(self) -> tuple[tuple, ...]:
        """Boundaries of bodies that meet, see `in_each_other`."""
        return outlines(self)

    def without_fading(self) -> NonlinearParts:
        """The same with nodes that drop out where hardly anything faces them."""
        pairs = tuple(
            replace(pair, areas=None, ridges=None) if isinstance(pair, MortarPair) else pair
            for pair in self.contact.pairs
        )
        return replace(self, contact=replace(self.contact, pairs=pairs))

    @cached_property
    def gathers(self) -> sparse.csr_array:
        """C of `contact.current_mortar`: what contacts need of f_int - f, (nc d, dofs).

        1 at their own nodes, and parts of middles beside these.
        """
        nc, d = self.at.shape
        slaves = self.at[:, 0] // d
        own = (np.ones(nc), (np.arange(nc), slaves))
        out = sparse.csr_array(own, shape=(nc, len(self.X)))
        start = 0
        for pair in self.contact.pairs:
            stop = start + len(pair.slaves)
            mortar = between_bodies(pair)
            if mortar is not None:
                row = np.full(len(self.X), -1)
                row[pair.slaves] = np.arange(start, stop)
                middle, corner, part = mortar.slave.means
                kept = row[corner] >= 0
                entries = (part[kept], (row[corner[kept]], middle[kept]))
                out = out + sparse.csr_array(entries, shape=out.shape)
            start = stop
        return sparse.csr_array(sparse.kron(out, sparse.eye_array(d), format="csr"))

    def meet(self, u: Array) -> Meetings:
        """Where the contact pairs meet at displacements u (nodes, d).

        The last few are kept: one state is asked for its forces, its error and its slopes.
        """
        for known, meeting in tuple(self._met):
            if np.array_equal(known, u):
                return meeting
        meeting = self.contact.meet(self.X + u)
        self._met.append((u.copy(), meeting))
        return meeting

    @cached_property
    def _met(self) -> deque[tuple[Array, Meetings]]:
        """States and where pairs met there."""
        return deque(maxlen=KEPT)

    @cached_property
    def keeps_volume(self) -> tuple[bool, ...]:
        """Of every body: some of its cells have pressures of their own."""
        return tuple(body.keeps_volume for body in self.bodies)

    def pressures(self, u: Array, du: Array) -> Array:
        """Pressures (c,) of hybrid cells at u (nodes, d), to first order at u + du."""
        parts = zip(self.bodies, np.split(u, self.ends), np.split(du, self.ends), strict=True)
        return np.concatenate([body.pressures(*both) for body, *both in parts])

    @cached_property
    def pressure_forces(self) -> Array:
        """Forces (c,) per unit of them by which they are weighed."""
        return np.concatenate([body.pressure_forces for body in self.bodies])

    def _given(self, u: Array, pressures: Array | None) -> Iterator[tuple]:
        """Every body with its displacements and, where given, its pressures."""
        first = 0
        for body, part in zip(self.bodies, np.split(u, self.ends), strict=True):
            if pressures is None or not body.keeps_volume:
                yield body, part
                continue
            last = first + len(body.pressure_forces)
            yield body, part, pressures[first:last]
            first = last

    def _of_each(self, name: str, u: Array, pressures: Array | None) -> list[Any]:
        """What a method of all bodies returns; raises InvertedCells naming body and cell."""
        out = []
        for k, (body, *given) in enumerate(self._given(u, pressures)):
            try:
                out.append(getattr(body, name)(*given))
            except InvertedCells as reason:
                least, cell = flattest(body.mesh, given[0])
                cell = cell if not least > 0 else most_strained(body.mesh, given[0])
                where = f"{cell} of body {self.names[k]!r}"
                raise InvertedCells(f"{reason}, the worst {where}") from reason
        return out

    def forces(self, u: Array, pressures: Array | None = None) -> Array:
        """Nodal forces of the bodies (dofs,) at displacements u (nodes, d).

        pressures (c,): of hybrid cells, else those of the displacements.
        """
        for known, forces in tuple(self._known) if pressures is None else ():
            if np.array_equal(known, u):
                return forces
        forces = np.concatenate([f.ravel() for f in self._of_each("forces", u, pressures)])
        if pressures is None:
            self._keep(u, forces)
        return forces

    @cached_property
    def _known(self) -> deque[tuple[Array, Array]]:
        """States and the forces there: one is asked for its residual and its error."""
        return deque(maxlen=KEPT)

    def _keep(self, u: Array, forces: Array) -> None:
        forces.flags.writeable = False
        self._known.append((u.copy(), forces))

    def tangent(self, u: Array, pressures: Array | None = None) -> tuple[Array, Array]:
        """(forces (dofs,), node blocks (m, d, d) of their derivative) at displacements u."""
        both = self._of_each("tangent", u, pressures)
        forces = np.concatenate([f.ravel() for f, _ in both])
        if pressures is None and not any(np.array_equal(known, u) for known, _ in self._known):
            self._keep(u, forces)
        return forces, np.concatenate([b for _, b in both])

    @cached_property
    def at_rest(self) -> Array:
        """Node blocks (m, d, d) of the stiffness of bodies at rest."""
        return self.tangent(np.zeros_like(self.X))[1]

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

    def gathered(self, blocks: Array) -> Rows:
        """`gathers` times the matrix of node blocks, (nc d, dofs)."""
        pointers, columns, taken, mixing = self._gathering
        shape = len(pointers) - 1, self.X.size
        found = Rows(pointers, columns, blocks.ravel()[taken], shape)
        return found if mixing is None else rows_of_products(
            [(mixing, found)], (self.at.size, self.X.size))  # fmt: skip

    @cached_property
    def _gathering(self) -> tuple[Index, Index, Index, sparse.csr_array | None]:
        """Rows of the matrix of nodes that `gathers` asks for, and C of these, None for 1.

        Pointers, columns, and places of their entries among those of the node blocks.
        """
        d = self.dimension
        alone = self.gathers.nnz == self.at.size  # no middles: 1 at the slaves
        nodes = self.at[:, 0] // d if alone else np.unique(self.gathers.indices // d)
        nodes = nodes.astype(np.int64)
        sizes = np.diff(self.pointers)[nodes]
        first = np.repeat(self.pointers[nodes] - np.cumsum(sizes) + sizes, sizes)
        places = first + np.arange(sizes.sum())  # of their blocks
        numbers = np.arange(len(self.columns) * d * d, dtype=np.int64).reshape(-1, d, d)
        ends = np.concatenate([[0], np.cumsum(sizes)])
        rows = sparse.bsr_array((numbers[places], self.columns[places], ends),
                                shape=(len(nodes) * d, self.X.size)).tocsr()  # fmt: skip
        taken = rows.data.astype(np.int64)
        found = rows.indptr.astype(np.int64), rows.indices.astype(np.int64), taken
        if alone:
            return *found, None
        dofs = (nodes[:, None] * d + np.arange(d)).ravel()
        return *found, sparse.csr_array(self.gathers[:, dofs])

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
    if model.divided_at is not None and parts.folds:
        parts = parts.divided(model.divided_at.reshape(parts.X.shape))
    if parts.contact.law is model.law:
        return parts  # with the meetings that it keeps
    return replace(parts, contact=replace(parts.contact, law=model.law))


def _nonlinear_parts(model: Model) -> NonlinearParts:
    check_supported(model)
    linear = model.discretisation  # of the tangent at rest: same dofs, contacts and checks
    bodies = tuple(
        _kind_of(body)(body.mesh, body.material)  # type: ignore[arg-type]
        for body in model.bodies
    )
    X = np.concatenate([body.mesh.points for body in model.bodies])
    d = X.shape[1]
    slaves = [p.rows.nodes + linear.offsets[p.body] // d for p in linear.placed]
    nodes = np.concatenate([np.zeros(0, dtype=np.int64), *slaves])
    pairs = cleared(model, met_pairs(model, slaves, linear), linear, X)
    check_nodes(pairs, nodes, free_dofs(linear).reshape(-1, d))
    at = nodes[:, None] * d + np.arange(d)
    is_free = free_dofs(linear)
    rows, columns = pattern_of(bodies)
    contact_of = np.full(len(X), -1)
    contact_of[nodes] = np.arange(len(nodes))
    numbers = np.arange(len(rows) * d * d, dtype=np.int64).reshape(-1, d, d)
    pointers = np.searchsorted(rows, np.arange(len(X) + 1))
    taken = _matrix(numbers + 1, columns, pointers).tocsr()[linear.free].tocsc()[:, linear.free]
    taken.sort_indices()
    taken.data -= 1
    contact = CurrentContact(
        pairs,
        model.law,
        resistance(pairs, linear.stored_stiffness, at),
        is_free[at],
    )  # fmt: skip
    names = tuple(body.name for body in model.bodies)
    return NonlinearParts(bodies, names, X, linear.offsets[1:-1] // d, linear.free, contact, at,
                          contact_of[rows], np.flatnonzero(rows == columns)[nodes],
                          columns, pointers, sparse.csc_array(taken))  # fmt: skip


def _kind_of(body: Body) -> type[HyperelasticBody | LinearBody]:
    if body.corotational:
        return CorotationalBody
    return HyperelasticBody if is_hyperelastic(body.material) else LinearBody


def _matrix(blocks: NDArray, columns: Index, pointers: Index) -> sparse.bsr_array:
    """The matrix of node blocks in rows of nodes."""
    size = (len(pointers) - 1) * blocks.shape[1]
    return sparse.bsr_array((blocks, columns, pointers), shape=(size, size))
