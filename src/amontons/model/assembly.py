"""From a model to matrices: bodies block by block, supports lifted, contacts in local rows."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ..contact import (
    ContactRows,
    Nitsche,
    NitscheTerms,
    contact_nodes,
    mortar_contact,
    mortar_obstacle,
    nitsche_obstacle,
    nitsche_pair,
    nodal_contact,
    pair_contact,
)
from ..errors import InvalidInput, UnsupportedForm
from ..fem.box import box
from ..fem.elasticity import LinearElastic, body_load, stiffness
from ..fem.mesh import Mesh, unknown
from ..fem.surfaces import surface_load
from ..linear.distributed import DistributedMatrix
from ..linear.grid_matrix import GridMatrix
from ..linear.levels import Levels, continued, free_levels
from .parts import Body, BodyForce, Contact, Fix, Traction
from .rigid import Piece, near_nullspace, pieces
from .values import vector_at

Array = NDArray[np.float64]
Index = NDArray[np.int64]
GRID_FROM = 50_000  # dofs of a box of equal cells from which its stiffness is not stored
SAME = 1e-12  # prescribed values that differ by less, relative to the largest, agree


@dataclass(frozen=True, eq=False)
class Placed:
    """Contacts of one pair: body of the slave, kept (slave nodes,), rows of the kept ones.

    H (dofs, nc d): the rows in the dofs of the whole model, with those of a master body.
    By Nitsche's method Gauss points of the slave take the place of its nodes, and `nitsche`
    holds their tractions, also in the dofs of the whole model.
    """

    body: int
    kept: NDArray[np.bool_]
    all_points: Array
    rows: ContactRows
    H: sparse.csc_array
    nitsche: NitscheTerms | None = None


@dataclass(frozen=True, eq=False)
class Discretisation:
    """All arrays of a model at load factor 1, whatever the friction.

    K (dofs, dofs): stiffness of the whole model, an operator for one large box; free (n,),
    fixed: its dofs; prescribed (dofs,), load (n,): force on the free dofs with the prescribed
    values lifted in; gap (nc,); carried (nc, d): part of the local displacement that the
    supports prescribe; levels: prolongations of the free dofs from coarser meshes, finest first
    (none where K is an operator, which has its own); nodal_levels: of the nodes, body by body.
    """

    offsets: Index
    K: sparse.csr_array | GridMatrix | DistributedMatrix
    free: Index
    fixed: Index
    prescribed: Array
    M: sparse.csc_array | GridMatrix | DistributedMatrix
    H: sparse.csc_array
    load: Array
    gap: Array
    carried: Array
    placed: tuple[Placed, ...]
    parts: list[Piece]
    whole_H: sparse.csc_array
    levels: Levels = ()
    nodal_levels: tuple[Levels, ...] = ()

    def continued(self, prescribed: Array) -> Array | None:
        """Prescribed values (dofs,) continued into the bodies, (n,); None without levels."""
        if not any(self.nodal_levels):
            return None
        counts = np.diff(self.offsets) // self.placed[0].rows.points.shape[1]
        fixed = np.zeros(self.dofs, dtype=bool)
        fixed[self.fixed] = True
        return continued(self.nodal_levels, counts.tolist(), prescribed, fixed)[self.free]

    @property
    def dofs(self) -> int:
        """Free and fixed degrees of freedom."""
        return len(self.prescribed)

    @property
    def stored_stiffness(self) -> sparse.csr_array:
        """K with its entries, also where it is an operator."""
        return sparse.csr_array(self.K.tocsc()) if isinstance(self.K, GridMatrix) else self.K

    @property
    def near_nullspace(self) -> Array:
        """Rigid modes on the free dofs, (n, k)."""
        return near_nullspace(self.parts, self.free, self.dofs)


def discretise(
    bodies: tuple[Body, ...],
    supports: tuple[Fix, ...],
    loads: tuple[Traction | BodyForce, ...],
    contacts: tuple[Contact, ...],
    K: DistributedMatrix | None = None,
) -> Discretisation:
    """Assemble everything that depends on neither friction nor load factor; K if not given."""
    offsets = np.cumsum([0, *(body.mesh.points.size for body in bodies)])
    values = prescribed_values(bodies, supports, offsets)
    is_fixed = ~np.isnan(values)
    free, fixed = np.flatnonzero(~is_fixed), np.flatnonzero(is_fixed)
    if not free.size:
        raise InvalidInput("supports: every degree of freedom is fixed, nothing left to solve")
    if K is None:
        K = _stiffness(bodies)
    prescribed = np.where(is_fixed, values, 0.0)
    placed = tuple(_place(bodies, contact, values, offsets) for contact in contacts)
    _check_once(bodies, contacts, placed)
    whole_H = sparse.hstack([p.H for p in placed], format="csc")
    if not whole_H.shape[1]:
        raise InvalidInput(
            "contacts: every slave node is fixed by a support, no contact is left"
        )
    load = external_load(bodies, loads, offsets)
    d = bodies[0].mesh.dim
    return Discretisation(
        offsets, K, free, fixed, prescribed,
        M=sparse.csc_array(K[free][:, free]) if sparse.issparse(K) else K.on(free),
        H=sparse.csc_array(whole_H.tocsr()[free]),
        load=(load - K @ prescribed)[free],
        gap=np.concatenate([p.rows.gap for p in placed]),
        carried=(whole_H.T @ prescribed).reshape(-1, d),
        placed=placed,
        parts=[
            piece
            for k, body in enumerate(bodies)
            for piece in pieces(body.mesh, body.name, int(offsets[k]))
        ],
        whole_H=whole_H,
        levels=()
        if not sparse.issparse(K)  # operators have their own, or none
        else free_levels(
            [b.mesh.levels for b in bodies], [len(b.mesh.points) for b in bodies], d, is_fixed
        ),
        nodal_levels=tuple(body.mesh.levels for body in bodies),
    )  # fmt: skip


def _stiffness(bodies: tuple[Body, ...]) -> sparse.csr_array | GridMatrix:
    """Of all bodies: stored, or an operator for one large box."""
    grid = _grid(bodies)
    if grid is not None:
        return grid
    parts = [stiffness(body.mesh, body.material).tocsr() for body in bodies]
    return parts[0] if len(parts) == 1 else sparse.block_diag(parts, format="csr")


def _grid(bodies: tuple[Body, ...]) -> GridMatrix | None:
    """The stiffness as an operator for one large box of equal hexahedra, of one material."""
    body, mesh = bodies[0], bodies[0].mesh
    uniform = len(mesh.cells) == 1 and isinstance(body.material, LinearElastic)
    if len(bodies) > 1 or not uniform or mesh.grid is None or mesh.cells[0].kind != "hex":
        return None
    if mesh.points.size < GRID_FROM or not mesh.levels:
        return None
    if mesh.levels[0].shape[1] != np.prod([n // 2 + 1 for n in mesh.grid]):
        return None  # stretched cells, coarsened in some directions only
    low, high = mesh.bounding_box()
    cell = box((high - low) / mesh.grid, cells=1)
    dofs = (cell.cells[0].nodes[0][:, None] * 3 + np.arange(3)).ravel()
    element = stiffness(cell, body.material).toarray()[np.ix_(dofs, dofs)]
    return GridMatrix(mesh.grid, element, np.arange(mesh.points.size), mesh.levels)


def locate(bodies: tuple[Body, ...], on: str) -> tuple[int, str]:
    """(body, surface) of a name "surface" or "body.surface"."""
    found = [k for k, body in enumerate(bodies) if on in body.mesh.surfaces]
    if len(found) == 1:
        return found[0], on
    if len(found) > 1:
        choices = ", ".join(f"{bodies[k].name}.{on}" for k in found)
        raise InvalidInput(f"surface {on!r}: several bodies have it, write one of {choices}")
    for k, body in enumerate(bodies):
        prefix = f"{body.name}."
        if on.startswith(prefix) and on[len(prefix) :] in body.mesh.surfaces:
            return k, on[len(prefix) :]
    names = [s for body in bodies for s in body.mesh.surfaces]
    if len(bodies) > 1:
        names += [f"{body.name}.{s}" for body in bodies for s in body.mesh.surfaces]
    raise InvalidInput(unknown("surface", on, dict.fromkeys(names)))


def prescribed_values(
    bodies: tuple[Body, ...], supports: tuple[Fix, ...], offsets: Index
) -> Array:
    """Prescribed displacement of every dof, NaN where it is free, (dofs,)."""
    values = np.full(int(offsets[-1]), np.nan)
    for support in supports:
        k, surface = locate(bodies, support.on)
        mesh = bodies[k].mesh
        nodes = mesh.surface(surface) and mesh.surface_nodes(surface)
        given = vector_at(
            support.value, mesh.points[nodes], f"fix on {support.on!r}", free=True
        )
        dofs = offsets[k] + nodes[:, None] * mesh.dim + np.arange(mesh.dim)
        _check_agreement(values[dofs], given, mesh.points[nodes], support.on)
        values[dofs] = np.where(np.isnan(given), values[dofs], given)
    return values


def _check_agreement(old: Array, new: Array, points: Array, on: str) -> None:
    """Two supports may meet at a node only if they say the same."""
    with np.errstate(invalid="ignore"):
        size = np.nanmax(np.abs(np.concatenate([old.ravel(), new.ravel(), [0.0]])))
        clash = np.argwhere(np.abs(old - new) > SAME * size)
    if len(clash):
        node, axis = clash[0]
        raise InvalidInput(
            f"fix on {on!r}: component {axis} at {points[node]} is {new[node, axis]}, but "
            f"another support prescribes {old[node, axis]} there"
        )


def external_load(
    bodies: tuple[Body, ...], loads: tuple[Traction | BodyForce, ...], offsets: Index
) -> Array:
    """Nodal forces of tractions and body forces, (dofs,)."""
    out = np.zeros(int(offsets[-1]))
    for load in loads:
        if isinstance(load, Traction):
            k, surface = locate(bodies, load.on)
            mesh = bodies[k].mesh
            facets, nodes = mesh.surface(surface), mesh.surface_nodes(surface)
            traction = np.zeros_like(mesh.points)
            traction[nodes] = vector_at(
                load.value, mesh.points[nodes], f"traction on {load.on!r}"
            )
            out[offsets[k] : offsets[k + 1]] += surface_load(
                mesh.points, facets, traction
            ).ravel()
        else:
            _add_body_force(out, bodies, load, offsets)
    return out


def _add_body_force(
    out: Array, bodies: tuple[Body, ...], load: BodyForce, offsets: Index
) -> None:
    regions = {region for body in bodies for region in body.mesh.regions}
    if load.region is not None and load.region not in regions:
        raise InvalidInput("body force: " + unknown("region", load.region, regions))
    for k, body in enumerate(bodies):
        if load.region is None or load.region in body.mesh.regions:
            force = vector_at(load.value, body.mesh.points, "body force")
            part = body_load(body.mesh, force, load.region)
            out[offsets[k] : offsets[k + 1]] += part.ravel()


def _place(bodies: tuple[Body, ...], contact: Contact, values: Array, offsets: Index) -> Placed:
    """Contacts of one pair without those whose normal the supports prescribe.

    values (dofs,): prescribed displacements, NaN where free.
    """
    is_fixed = ~np.isnan(values)
    k = locate(bodies, contact.slave)[0]
    mesh = bodies[k].mesh
    rows, H, met, points, terms = _met(bodies, contact, values, offsets)
    d = mesh.dim
    normal = sparse.csc_array(H[:, ::d]).multiply(~is_fixed[:, None])
    kept = np.sqrt(np.asarray(normal.power(2).sum(axis=0)).ravel()) > 1e-9
    prescribed = np.where(is_fixed, values, 0.0)
    _check_supported(mesh, contact, rows.at(~kept), (H[:, ::d].T @ prescribed)[~kept])
    kept &= _wanted(contact, points)[met]
    all_kept = met.copy()
    all_kept[met] = kept
    terms = None if terms is None else terms.at(kept)
    return Placed(k, all_kept, points, rows.at(kept), H[:, np.repeat(kept, d)], terms)


def _met(
    bodies: tuple[Body, ...], contact: Contact, values: Array, offsets: Index
) -> tuple[ContactRows, sparse.csc_array, NDArray[np.bool_], Array, NitscheTerms | None]:
    """Contacts of one pair, H in the dofs of the model, which of all points meet, and terms."""
    if contact.nitsche is not None:
        return _met_by_nitsche(bodies, contact, contact.nitsche, offsets)
    k, surface = locate(bodies, contact.slave)
    slave, size = bodies[k].mesh, int(offsets[-1])
    points = slave.points[contact_nodes(slave, surface)[0]]
    mortar = contact.method == "mortar"
    given = [v.reshape(-1, slave.dim) for v in np.split(values, offsets[1:-1])]
    if contact.obstacle is not None:
        rows = nodal_contact(slave, surface, contact.obstacle)
        met = np.ones(len(rows.nodes), dtype=bool)
        if mortar:
            _check_held(slave, contact, rows, given[k][rows.nodes])
            rows, met = mortar_obstacle(slave, surface, contact.obstacle, prescribed=given[k])
        return rows, _shifted(rows.H, int(offsets[k]), size), met, points, None
    assert contact.master is not None
    j, other = locate(bodies, contact.master)
    master = bodies[j].mesh
    if mortar:
        rows, on_master, met = mortar_contact(
            slave, surface, master, other, prescribed=given[k], master_prescribed=given[j]
        )
    else:
        rows, on_master, met = pair_contact(slave, surface, master, other)
    H = _shifted(rows.H, int(offsets[k]), size) + _shifted(on_master, int(offsets[j]), size)
    return rows, sparse.csc_array(H), met, points, None


def _met_by_nitsche(
    bodies: tuple[Body, ...], contact: Contact, options: Nitsche, offsets: Index
) -> tuple[ContactRows, sparse.csc_array, NDArray[np.bool_], Array, NitscheTerms | None]:
    """The same for the Gauss points of Nitsche's method."""
    k, surface = locate(bodies, contact.slave)
    body, first, size = bodies[k], int(offsets[k]), int(offsets[-1])
    if not isinstance(body.material, LinearElastic) and not all(
        isinstance(law, LinearElastic) for law in dict(body.material).values()
    ):
        raise UnsupportedForm(
            f"contact on {contact.slave!r}: Nitsche's method takes the stress from "
            'LinearElastic; use method="nodal"'
        )
    if contact.obstacle is not None:
        rows, terms = nitsche_obstacle(
            body.mesh, surface, contact.obstacle, body.material, options
        )
        met, points = np.ones(len(rows.points), dtype=bool), rows.points
        H = _shifted(rows.H, first, size)
    else:
        assert contact.master is not None
        j, other = locate(bodies, contact.master)
        rows, terms, on_master, met, points = nitsche_pair(
            body.mesh, surface, bodies[j].mesh, other, body.material, options
        )
        H = _shifted(rows.H, first, size) + _shifted(on_master, int(offsets[j]), size)
    terms = replace(terms, traction=_shifted(terms.traction, first, size))
    return rows, sparse.csc_array(H), met, points, terms


def _check_supported(mesh: Mesh, contact: Contact, rows: ContactRows, moved: Array) -> None:
    """Raise InvalidInput when supports alone push a node into the obstacle."""
    gap = rows.gap + moved
    size = np.ptp(mesh.points, axis=0).max()
    if gap.size and gap.min() < -SAME * size:
        k = int(gap.argmin())
        raise InvalidInput(
            f"contact on {contact.slave!r}: supports hold the node at "
            f"{rows.points[k].tolist()} and push it {-gap[k]:.3g} into the other side, where "
            "no contact force can act; change the prescribed displacement or free the node"
        )


def _check_held(mesh: Mesh, contact: Contact, rows: ContactRows, given: Array) -> None:
    """The same for nodes that supports hold, before mortar leaves out their multipliers."""
    normal = rows.frames[:, 0]
    held = np.linalg.norm(normal * np.isnan(given), axis=1) < 1e-9
    moved = np.einsum("pc,pc->p", normal, np.nan_to_num(given))
    _check_supported(mesh, contact, rows.at(held), moved[held])


def _check_once(
    bodies: tuple[Body, ...], contacts: tuple[Contact, ...], placed: tuple[Placed, ...]
) -> None:
    """A pair given twice, also with exchanged sides, would share its load at random."""
    seen: dict[tuple, list[Placed]] = {}
    for contact, place in zip(contacts, placed, strict=True):
        slave = locate(bodies, contact.slave)
        if contact.master is None:
            pair, again = (slave, repr(contact.obstacle)), "with the same obstacle"
        else:
            master = locate(bodies, contact.master)
            pair, again = (slave, master), f"with {contact.master!r}"
            if (master, slave) in seen and contact.where is None:
                raise InvalidInput(
                    f"contact on {contact.slave!r}: the contact {again} is there already, with "
                    "slave and master exchanged; expected every pair once"
                )
        for other in seen.setdefault(pair, []):
            if both := len(_rows_of(other.rows.points) & _rows_of(place.rows.points)):
                raise InvalidInput(
                    f"contact on {contact.slave!r}: {both} of its points have a contact "
                    f"{again} already; expected every pair once"
                )
        seen[pair].append(place)


def _rows_of(points: Array) -> set[tuple[float, ...]]:
    """Points as a set."""
    return set(map(tuple, points.tolist()))


def _wanted(contact: Contact, points: Array) -> NDArray[np.bool_]:
    """Which slave nodes a contact asks for, (n,)."""
    if contact.where is None:
        return np.ones(len(points), dtype=bool)
    wanted = np.asarray(contact.where(points))
    if wanted.shape != (len(points),) or wanted.dtype != bool:
        raise InvalidInput(
            f"contact on {contact.slave!r}: expected where to return ({len(points)},) of bool "
            f"for points {points.shape}, got {wanted.dtype} of shape {wanted.shape}"
        )
    return wanted


def _shifted(H: sparse.csc_array, offset: int, size: int) -> sparse.csc_array:
    """Columns on one body in the dofs of the whole model, (size, nc d)."""
    part = H.tocoo()
    entries = (part.data, (part.coords[0] + offset, part.coords[1]))
    return sparse.coo_array(entries, shape=(size, H.shape[1])).tocsc()
