"""From a model to matrices: bodies block by block, supports lifted, contacts in local rows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ...core.errors import InvalidInput, within
from ...linear.grid_matrix import GridMatrix
from ...linear.levels import Levels, continued, free_levels
from ...problem.structure import Structure
from ..elements.elasticity import LinearElastic, stiffness
from ..elements.given import GivenMatrices
from ..elements.rigid import Rigid
from ..meshes.box import box
from .beside import Beside
from .constraint_rows import spring_stiffness
from .constraints import Constraint, Reference, Spring
from .elimination import Elimination
from .parts import Body, Contact, Fix, Load
from .placing import Placed, place, refuse_none
from .rigid import Piece, near_nullspace, pieces
from .sites import Sites
from .supports import Prescribed, external_load, locate

Array = NDArray[np.float64]
Index = NDArray[np.int64]
ROUNDING = 1e-14  # of the displacements, up to which their difference is none
SAME_PLACE = 1e-12  # of the largest displacement: what rounding moves of a rigid body
GRID_FROM = 50_000  # dofs of a box of equal cells from which its stiffness is not stored


@dataclass(frozen=True, eq=False)
class Ties:
    """What ties degrees of freedom of a model: references, constraints, springs."""

    references: Sequence[Reference] = ()
    constraints: Sequence[Constraint] = ()
    springs: Sequence[Spring] = ()


NO_TIES = Ties()


@dataclass(frozen=True, eq=False)
class Discretisation:
    """All arrays of a model at load factor 1, whatever the friction.

    K (dofs, dofs): stiffness of the whole model, an operator for one large box; free, fixed:
    its dofs; prescribed (dofs,), load (n,): force on the unknowns with the prescribed values
    lifted in; eliminated: rigid bodies and constraints, None without, when the unknowns (n,)
    are the free dofs; beside: dofs that are no nodes, by name; gap (nc,); carried (nc, d):
    part of the local displacement that the supports prescribe; levels: prolongations of the
    free dofs from coarser meshes, finest first (none where K is an operator, which has its
    own); nodal_levels: of the nodes, body by body; stretched (k, dofs): springs by rows, whose
    product with displacements is their stretch.
    """

    offsets: Index
    K: sparse.csr_array | GridMatrix
    free: Index
    fixed: Index
    prescribed: Array
    M: sparse.csc_array | GridMatrix
    H: sparse.csc_array
    load: Array
    gap: Array
    carried: Array
    placed: tuple[Placed, ...]
    parts: list[Piece]
    whole_H: sparse.csc_array
    levels: Levels = ()
    nodal_levels: tuple[Levels, ...] = ()
    eliminated: Elimination | None = None
    beside: Beside = None  # type: ignore[assignment]  # always given
    stretched: sparse.csr_array = None  # type: ignore[assignment]  # always given

    def continued(self, prescribed: Array) -> Array | None:
        """Prescribed values (dofs,) continued into the bodies, (n,); None without levels."""
        if not any(self.nodal_levels) or self.eliminated is not None:
            return None
        counts = np.diff(self.offsets) // self.carried.shape[1]
        return continued(
            self.nodal_levels, counts.tolist(), prescribed, self.is_fixed
        )[self.free]  # fmt: skip

    @cached_property
    def is_fixed(self) -> NDArray[np.bool_]:
        """Dofs (dofs,) that supports prescribe."""
        out = np.zeros(self.dofs, dtype=bool)
        out[self.fixed] = True
        return out

    @property
    def dofs(self) -> int:
        """Free and fixed degrees of freedom."""
        return len(self.prescribed)

    def local(self, displacement: Array) -> Array:
        """Local displacements (nc, d) of displacements (dofs,), gaps not included.

        Where both sides move by the same they are zero: rounding would tell friction a way.
        """
        return _local(self.whole_H, self._sizes, displacement, self.carried.shape[1])

    @cached_property
    def _sizes(self) -> sparse.csc_array:
        """|H| of the whole model, (dofs, nc d)."""
        return abs(self.whole_H)

    @property
    def stored_stiffness(self) -> sparse.csr_array:
        """K with its entries, also where it is an operator."""
        if isinstance(self.K, GridMatrix):
            return sparse.csr_array(self.K.tocsc())
        return self.K

    @property
    def near_nullspace(self) -> Array | None:
        """Rigid modes on the free dofs, (n, k); None with constraints and of a `GridMatrix`."""
        if self.eliminated is not None or isinstance(self.K, GridMatrix):
            return None
        return near_nullspace(self.parts, self.free, self.dofs)

    @cached_property
    def structure(self) -> Structure | None:
        """Nodes and bodies of the unknowns, slaves of the contacts; None with constraints."""
        if self.eliminated is not None:
            return None
        d = self.carried.shape[1]
        piece = np.empty(int(self.offsets[-1]) // d, dtype=np.int32)
        for k, part in enumerate(self.parts):
            piece[part.dofs[::d] // d] = k
        slave = self.offsets[self.sites.body] // d + self.sites.node
        return Structure(self.free, d, piece, slave)

    @cached_property
    def sites(self) -> Sites:
        """Where the contacts are."""
        return Sites.of(self.placed, self.carried.shape[1])

    # ------------------------------------------------------------------ unknowns
    @property
    def unknowns(self) -> int:
        """Of the discrete problem: free dofs, or what constraints and rigid bodies leave."""
        return len(self.free) if self.eliminated is None else len(self.eliminated.driven)

    @cached_property
    def held(self) -> Index:
        """Dofs with forces of supports, or of constraints, which do no work."""
        if self.eliminated is None:
            return self.fixed
        return np.union1d(self.fixed, self.eliminated.dofs)

    def missing(self, displacement: Array, load: Array, r: Array) -> Array:
        """Forces (dofs,) that loads (dofs,) and reactions r (nc, d) leave to supports."""
        out = self.K @ displacement - load - self.whole_H @ r.ravel()
        ends = np.cumsum([0, *(len(p.rows.nodes) for p in self.placed)])
        for placed, a, b in zip(self.placed, ends[:-1], ends[1:], strict=True):
            out -= placed.besides(displacement, r[a:b])
        return out

    def gathered(self, force: Array) -> Array:
        """Forces on the unknowns (n, ...) of nodal forces (dofs, ...), none on driven ones."""
        return force[self.free] if self.eliminated is None else self.eliminated.gathered(force)

    def reduced(self, whole: sparse.csr_array) -> sparse.csc_array:
        """A matrix (dofs, dofs) in the unknowns, (n, n)."""
        if self.eliminated is not None:
            return self.eliminated.matrix(whole)
        return sparse.csc_array(whole[self.free][:, self.free])

    def with_driven(self, force: Array, M: Any, prescribed: Array) -> Array:
        """Forces (n,) with those that give driven unknowns of M their prescribed values."""
        if self.eliminated is None:
            return force
        values = self.eliminated.driven_values(prescribed)
        return np.where(self.eliminated.driven, M.diagonal() * values, force)

    def spread(self, v: Array, prescribed: Array) -> Array:
        """Values of all dofs (dofs,) of unknowns v (n,), and what is prescribed, completed."""
        if self.eliminated is not None:
            return prescribed + self.eliminated.spread @ v
        out = prescribed.copy()
        out[self.free] = v
        return out

    def moved(self, displacement: Array) -> bool:
        """Whether any dof has gone where supports alone do not bring it, (dofs,)."""
        if self.eliminated is None:
            return bool(displacement[self.free].any())
        held = self.eliminated.completed(np.where(self.is_fixed, displacement, 0.0))
        size = np.abs(displacement).max(initial=0.0)
        return bool(np.abs(displacement - held).max(initial=0.0) > SAME_PLACE * size)

    def completed(self, prescribed: Array) -> Array:
        """Prescribed values (dofs,), continued over what they move."""
        return prescribed if self.eliminated is None else self.eliminated.completed(prescribed)


def discretise(
    bodies: Sequence[Body],
    supports: Sequence[Fix],
    loads: Sequence[Load],
    contacts: Sequence[Contact],
    ties: Ties = NO_TIES,
) -> Discretisation:
    """Assemble everything that depends on neither friction nor load factor."""
    beside = Beside.of(bodies, ties.references, ties.constraints)
    offsets = beside.offsets
    given = Prescribed.of(bodies, supports, beside)
    is_fixed = given.is_fixed
    springs, stretched = spring_stiffness(ties.springs, beside)
    sprung = np.unique(springs.indices).astype(np.int64)
    eliminated = Elimination.of(beside, ties.constraints, is_fixed, sprung)
    fixed = np.flatnonzero(is_fixed)
    free = np.flatnonzero(~is_fixed)
    if not (free.size if eliminated is None else (~eliminated.driven).any()):
        text = "every degree of freedom is fixed, nothing left to solve"
        raise InvalidInput(text, ("supports",))
    stored = eliminated is not None or springs.nnz > 0
    K = _stiffness(bodies, beside, springs, stored=stored)
    prescribed = np.where(is_fixed, given.values, 0.0)
    if eliminated is not None:
        prescribed = eliminated.completed(prescribed)
    placed = _placed(bodies, contacts, given, eliminated)
    _check_once(bodies, contacts, placed)
    whole_H = _of_all([p.H for p in placed], beside)
    if contacts and not whole_H.shape[1]:
        refuse_none(contacts, placed, bodies, supports, offsets, prescribed)
    load = external_load(bodies, loads, beside)
    d = bodies[0].mesh.dim
    M, H, load = _unknowns(K, whole_H, load, prescribed, free, eliminated)
    return Discretisation(
        offsets, K, free, fixed, prescribed, M=M, H=H, load=load,
        gap=np.concatenate([
            np.zeros(0),
            *(np.zeros_like(p.rows.gap) if contact.tied else p.rows.gap
              for contact, p in zip(contacts, placed, strict=True)),
        ]),
        carried=_local(whole_H, abs(whole_H), prescribed, d),
        placed=placed,
        parts=[
            piece
            for k, body in enumerate(bodies)
            for piece in pieces(body.mesh, body.name, int(offsets[k]), body.material)
        ],
        whole_H=whole_H,
        levels=()
        if not sparse.issparse(K) or eliminated is not None  # operators have their own, or none
        else free_levels(
            [b.mesh.levels for b in bodies], [len(b.mesh.points) for b in bodies], d, is_fixed
        ),
        nodal_levels=tuple(body.mesh.levels for body in bodies),
        eliminated=eliminated, beside=beside, stretched=stretched,
    )  # fmt: skip


def _unknowns(
    K: Any, whole_H: sparse.csc_array, load: Array, prescribed: Array, free: Index,
    eliminated: Elimination | None,
) -> tuple[Any, sparse.csc_array, Array]:  # fmt: skip
    """M, H and the load on the unknowns."""
    if eliminated is not None:
        M = eliminated.matrix(K)
        force = eliminated.gathered(load) - eliminated.spread.T @ (K @ prescribed)
        values = M.diagonal() * eliminated.driven_values(prescribed)
        H = sparse.csc_array(eliminated.spread.T @ whole_H)
        return M, H, np.where(eliminated.driven, values, force)
    operator = isinstance(K, GridMatrix)
    M = K.on(free) if operator else sparse.csc_array(K[free][:, free])
    return M, sparse.csc_array(whole_H.tocsr()[free]), (load - K @ prescribed)[free]


def _of_all(blocks: list[sparse.csc_array], beside: Beside) -> sparse.csc_array:
    """Columns of all contacts on all dofs, those beside the nodes too."""
    none = sparse.csc_array((int(beside.offsets[-1]), 0))
    H = sparse.csc_array(sparse.hstack([none, *blocks], format="csc"))
    if not beside.count:
        return H
    none = sparse.csc_array((beside.count, H.shape[1]))
    return sparse.csc_array(sparse.vstack([H, none], format="csc"))


def _placed(
    bodies: Sequence[Body], contacts: Sequence[Contact], given: Prescribed,
    eliminated: Elimination | None,
) -> tuple[Placed, ...]:  # fmt: skip
    """All contacts; errors tell which one could not be placed."""
    found = []
    for k, contact in enumerate(contacts):
        with within("contacts", k):
            found.append(place(bodies, contact, given, eliminated))
    return tuple(found)


def _local(
    H: sparse.csc_array, sizes: sparse.csc_array, displacement: Array, d: int
) -> Array:  # fmt: skip
    """H^T displacement in rows of d, without what rounding leaves of differences; |H|."""
    out = H.T @ displacement
    small = np.abs(out)
    most = ROUNDING * float(np.abs(displacement).max(initial=0.0)) * len(displacement)
    if ((small > 0) & (small <= most)).any():
        out[small <= ROUNDING * (sizes.T @ np.abs(displacement))] = 0.0
    return out.reshape(-1, d)


def _stiffness(
    bodies: Sequence[Body], beside: Beside, springs: sparse.csr_array, *, stored: bool
) -> sparse.csr_array | GridMatrix:
    """Of all bodies and springs: stored, or an operator for one large box."""
    grid = None if stored else _grid(bodies)
    if grid is not None:
        return grid
    parts = [_stiffness_of(body) for body in bodies]
    if len(parts) == 1 and not stored:
        return parts[0]
    if beside.count:
        parts.append(sparse.csr_array((beside.count, beside.count)))
    whole = sparse.csr_array(sparse.block_diag(parts, format="csr"))
    return sparse.csr_array(whole + springs) if springs.nnz else whole


def _stiffness_of(body: Body) -> sparse.csr_array:
    """Of one body; a rigid one resists by its unknowns, not by stiffness."""
    if isinstance(body.material, Rigid):
        return sparse.csr_array((body.mesh.points.size,) * 2)
    if isinstance(body.material, GivenMatrices):
        return body.material.K
    return stiffness(body.mesh, body.material).tocsr()


def _grid(bodies: Sequence[Body]) -> GridMatrix | None:
    """The stiffness as an operator for one large box of equal hexahedra, of one material."""
    body, mesh = bodies[0], bodies[0].mesh
    if type(body.material) is not LinearElastic or len(mesh.cells) != 1:
        return None
    if len(bodies) > 1 or mesh.grid is None or mesh.cells[0].kind != "hex":
        return None
    if mesh.points.size < GRID_FROM or not mesh.levels:
        return None
    if mesh.levels[0].shape[1] != np.prod([n // 2 + 1 for n in mesh.grid]):
        return None  # stretched cells, coarsened in some directions only
    low, high = mesh.bounding_box()
    cell = box(tuple((high - low) / mesh.grid), cells=1)
    own = replace(cell.cells[0], integration=mesh.cells[0].integration)
    cell = replace(cell, cells=(own,))
    dofs = (cell.cells[0].nodes[0][:, None] * 3 + np.arange(3)).ravel()
    element = stiffness(cell, body.material).toarray()[np.ix_(dofs, dofs)]
    every = np.arange(mesh.points.size)
    return GridMatrix(mesh.grid, element, every, mesh.levels, mesh.points)  # type: ignore[arg-type]


def _check_once(
    bodies: Sequence[Body], contacts: Sequence[Contact], placed: tuple[Placed, ...]
) -> None:
    """A pair given twice, also with exchanged sides, would share its load at random."""
    seen: dict[tuple, list[Placed]] = {}
    for k, (contact, found) in enumerate(zip(contacts, placed, strict=True)):
        at, what = ("contacts", k), f"contact on {contact.slave!r}"
        slave = locate(bodies, contact.slave)
        if contact.master is None:
            pair, again = (slave, repr(contact.obstacle)), "with the same obstacle"
        else:
            master = locate(bodies, contact.master)
            pair, again = (slave, master), f"with {contact.master!r}"
            if slave != master and (master, slave) in seen and contact.where is None:
                raise InvalidInput(
                    f"the contact {again} is there already, with slave and master exchanged; "
                    "expected every pair once", at, what,
                )  # fmt: skip
        for other in seen.setdefault(pair, []):
            if both := len(_rows_of(other.rows.points) & _rows_of(found.rows.points)):
                raise InvalidInput(
                    f"{both} of its points have a contact {again} already; expected every "
                    "pair once", at, what,
                )  # fmt: skip
        seen[pair].append(found)


def _rows_of(points: Array) -> set[tuple[float, ...]]:
    """Points as a set."""
    return set(map(tuple, points.tolist()))
