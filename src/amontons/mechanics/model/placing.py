"""The contacts of one pair, placed in a model: those that can meet and are free to react."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import cast

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ...core.errors import InvalidInput, UnsupportedForm
from ..contact import (
    ContactRows,
    Mismatch,
    Nitsche,
    NitscheTerms,
    contact_nodes,
    current_contact,
    mismatch,
    mortar_contact,
    mortar_nodes,
    mortar_obstacle,
    nitsche_obstacle,
    nitsche_pair,
    nodal_contact,
    pair_contact,
)
from ..contact.segments import Surface
from ..contact.surface_axes import SurfaceAxes
from ..elements.elasticity import LinearElastic, materials_by_region
from ..elements.given import GivenMatrices
from ..elements.rigid import Rigid
from ..meshes.mesh import Mesh
from ..meshes.surfaces import facet_normals
from .elimination import Elimination
from .following import followed, following_columns
from .held import HeldNodes, refuse_held
from .parts import FINITE, Body, Contact, Fix
from .supports import Prescribed, locate

Array = NDArray[np.float64]
Index = NDArray[np.int64]
Mask = NDArray[np.bool_]
AWAY = 0.1  # cosine between outward normal and obstacle's above which a facet looks away
FREE = 1e-9  # free part of a normal up to which supports hold it


@dataclass(frozen=True, eq=False)
class Placed:
    """Contacts of one pair: body of the slave, kept (slave nodes,), rows of the kept ones.

    H (dofs, nc d): the rows in the dofs of the whole model, with those of a master body.
    held: slave nodes without a contact, as supports hold them along the normal.
    By Nitsche's method Gauss points of the slave take the place of its nodes, and `nitsche`
    holds their tractions, also in the dofs of the whole model.
    sides: mesh and surface of slave and master, None with an obstacle.
    axes: tangents that the slave carries, at finite sliding where the law speaks of them.
    """

    body: int
    kept: NDArray[np.bool_]
    all_points: Array
    rows: ContactRows
    H: sparse.csc_array
    held: HeldNodes | None = None
    nitsche: NitscheTerms | None = None
    sides: tuple[Mesh, str, Mesh, str] | None = None
    axes: SurfaceAxes | None = None

    @property
    def each(self) -> str:
        """What its points are, in words."""
        return "slave node" if self.nitsche is None else "Gauss point"

    def besides(self, displacement: Array, r: Array) -> Array | float:
        """Forces (dofs,) of contacts beside H r, at displacements (dofs,) and r (k, d)."""
        if self.nitsche is None:
            return 0.0
        return self.nitsche.symmetric_force(displacement, self.rows.weights, r)

    @cached_property
    def mismatch(self) -> Mismatch:
        """How far the meshes of a nodal pair are from each other, slave nodes as in kept."""
        assert self.sides is not None
        return mismatch(*self.sides)

    @cached_property
    def master(self) -> Surface:
        """Facets of the master."""
        assert self.sides is not None
        _, _, mesh, name = self.sides
        return Surface.on(mesh, name)

    @cached_property
    def narrowest(self) -> float:
        """Length than which no facet of the master is narrower."""
        power = self.master.points.shape[1] - 2
        return float((self.master.area / (2 * self.master.radius) ** power).min())


def place(
    bodies: Sequence[Body], contact: Contact, given: Prescribed,
    eliminated: Elimination | None = None,
) -> Placed:  # fmt: skip
    """Contacts of one pair without those whose normal the supports prescribe."""
    k = locate(bodies, contact.slave)[0]
    d, offsets = bodies[k].mesh.dim, _offsets(bodies)
    held_dofs = _immovable(given, int(offsets[-1]), eliminated)
    rows, H, met, points, terms = _met(bodies, contact, given, offsets)
    rows = _cleared(contact, rows)
    kept = ~_has_held_normal(H, d, held_dofs) & _wanted(contact, points)[met]
    all_kept = met.copy()
    all_kept[met] = kept
    held = _held_nodes(bodies, contact, held_dofs, offsets)
    terms = None if terms is None else terms.at(kept)
    axes = _axes(bodies, contact, rows.nodes[kept])
    return Placed(k, all_kept, points, rows.at(kept), H[:, np.repeat(kept, d)], held, terms,
                  _sides(bodies, contact), axes)  # fmt: skip


def _axes(bodies: Sequence[Body], contact: Contact, nodes: Index) -> SurfaceAxes | None:
    """Tangents that the slave carries where a law in 3D speaks of them; None else."""
    k, surface = locate(bodies, contact.slave)
    speaks = contact.mu_across is not None or (
        contact.stick_stiffness is not None and not contact.tied
    )
    if not (speaks and is_finite(bodies, contact) and bodies[k].mesh.dim == 3):
        return None
    return SurfaceAxes.of(bodies[k].mesh, surface, nodes)


def _offsets(bodies: Sequence[Body]) -> Index:
    return np.cumsum([0, *(body.mesh.points.size for body in bodies)])


def _immovable(given: Prescribed, dofs: int, eliminated: Elimination | None) -> Mask:
    """Dofs of nodes that supports prescribe, by themselves or through constraints."""
    fixed = given.is_fixed[:dofs]
    if eliminated is None or eliminated.only_rigid:
        return fixed
    moves = np.diff(eliminated.spread.tocsr().indptr)[:dofs] > 0
    return fixed | ~moves


def _cleared(contact: Contact, rows: ContactRows) -> ContactRows:
    """The rows with the gap that the contact is said to have."""
    value = contact.clearance
    if value is None:
        return rows
    if not callable(value):
        return replace(rows, gap=np.full(len(rows.gap), float(value)))

    def gap(points: Array) -> Array:
        found = np.asarray(value(points), dtype=float)
        if found.shape not in ((), (len(points),)) or not np.isfinite(found).all():
            raise InvalidInput(
                f"contact on {contact.slave!r}: expected clearance to return ({len(points)},) "
                f"finite numbers for points {points.shape}, got shape {found.shape}"
            )
        return np.broadcast_to(found, len(points)).astype(float)

    return replace(rows, gap=rows.mean(gap))


def _has_held_normal(H: sparse.csc_array, d: int, is_fixed: Mask) -> Mask:
    """Contacts (nc,) whose normal only has dofs that supports prescribe, of both sides."""
    normal = sparse.csc_array(H[:, ::d]).multiply(~is_fixed[:, None])
    return np.sqrt(np.asarray(normal.power(2).sum(axis=0)).ravel()) <= FREE


def _held_nodes(
    bodies: Sequence[Body], contact: Contact, is_fixed: Mask, offsets: Index
) -> HeldNodes | None:
    """Slave nodes that take part and can not move along the normal, whatever the method."""
    k, surface = locate(bodies, contact.slave)
    slave, first, total = bodies[k].mesh, int(offsets[k]), int(offsets[-1])
    nodes = contact_nodes(slave, surface)[0]
    d = slave.dim
    if not is_fixed[first + nodes[:, None] * d + np.arange(d)].any():
        return None
    if contact.obstacle is not None:
        rows = nodal_contact(slave, surface, contact.obstacle)
        H = _with_tool(bodies, contact, rows, offsets)
    else:
        assert contact.master is not None
        j, other = locate(bodies, contact.master)  # of several the first
        try:
            rows, on_master, _ = pair_contact(slave, surface, bodies[j].mesh, other)
        except InvalidInput:
            return None  # no node faces the master: averages may still do
        H = _shifted(rows.H, first, total) + _shifted(on_master, int(offsets[j]), total)
    rows = _cleared(contact, rows)
    held = _has_held_normal(sparse.csc_array(H), d, is_fixed) & _wanted(contact, rows.points)
    if not held.any():
        return None
    size = np.abs(slave.points).max() + np.ptp(slave.points, axis=0).max()
    columns = sparse.csc_array(sparse.csc_array(H)[:, np.repeat(held, d)])
    return HeldNodes.of(contact, rows.at(held), columns, first, size)


def _with_tool(
    bodies: Sequence[Body], contact: Contact, rows: ContactRows, offsets: Index
) -> sparse.csc_array:
    """H of contacts with an obstacle, and with the motion of the body that it follows."""
    k, size = locate(bodies, contact.slave)[0], int(offsets[-1])
    H = _shifted(rows.H, int(offsets[k]), size)
    if contact.follows is None or contact.obstacle is None:
        return H
    j = followed(bodies, contact)
    tool = following_columns(bodies[j], contact.obstacle, rows)
    return sparse.csc_array(H + _shifted(tool, int(offsets[j]), size))


def _sides(bodies: Sequence[Body], contact: Contact) -> tuple[Mesh, str, Mesh, str] | None:
    """Mesh and surface of slave and master; None with several."""
    if contact.master is None or contact.more_masters:
        return None
    (k, surface), (j, other) = (locate(bodies, n) for n in (contact.slave, contact.master))
    return bodies[k].mesh, surface, bodies[j].mesh, other


def _met(
    bodies: Sequence[Body], contact: Contact, given: Prescribed, offsets: Index
) -> tuple[ContactRows, sparse.csc_array, NDArray[np.bool_], Array, NitscheTerms | None]:
    """Contacts of one pair, H in the dofs of the model, which of all points meet, and terms."""
    if contact.nitsche is not None:
        return _met_by_nitsche(bodies, contact, contact.nitsche, offsets)
    k, surface = locate(bodies, contact.slave)
    slave, size = bodies[k].mesh, int(offsets[-1])
    far = slides_far(bodies, contact)
    mortar = is_mortar(slave, surface, contact)
    points = slave.points[
        mortar_nodes(slave, surface) if mortar else contact_nodes(slave, surface)[0]
    ]
    held, lasting = given.by_body(offsets, slave.dim)
    if contact.obstacle is not None:
        rows = nodal_contact(slave, surface, contact.obstacle)
        _check_faces(slave, surface, contact, rows)
        met = np.ones(len(rows.nodes), dtype=bool)
        if mortar:
            rows, met = mortar_obstacle(slave, surface, contact.obstacle, held=held[k])
        return rows, _with_tool(bodies, contact, rows, offsets), met, points, None
    assert contact.master is not None
    j, other = locate(bodies, contact.master)
    master = bodies[j].mesh
    if far:
        sides = [(bodies[i].mesh, name) for i, name in located(bodies, contact)]
        rows, every, met = current_contact(slave, surface, sides, held[k], tied=contact.tied)
        H = _shifted(rows.H, int(offsets[k]), size)
        for (i, _), part in zip(located(bodies, contact), every, strict=True):
            H = H + _shifted(part, int(offsets[i]), size)
        return rows, sparse.csc_array(H), met, points, None
    if mortar:
        rows, on_master, met = mortar_contact(
            slave, surface, master, other, held=held[k], lasting=lasting[k],
            master_lasting=lasting[j], tied=contact.tied,
        )  # fmt: skip
    else:
        rows, on_master, met = pair_contact(slave, surface, master, other)
    H = _shifted(rows.H, int(offsets[k]), size) + _shifted(on_master, int(offsets[j]), size)
    return rows, sparse.csc_array(H), met, points, None


def located(bodies: Sequence[Body], contact: Contact) -> list[tuple[int, str]]:
    """Body and surface of every master."""
    return [locate(bodies, name) for name in contact.masters]


def slides_far(bodies: Sequence[Body], contact: Contact) -> bool:
    """Whether a pair of two bodies meets where they are now."""
    return (is_finite(bodies, contact) and contact.master is not None
            and contact.method == "mortar")  # fmt: skip


def is_finite(bodies: Sequence[Body], contact: Contact) -> bool:
    """Whether a contact is found where the nodes are now."""
    return contact.kinematics == FINITE or any(body.turns for body in bodies)


def is_mortar(mesh: Mesh, surface: str, contact: Contact) -> bool:
    """Whether contacts are averages: asked for, or as corners of facets have no weight.

    The weights of quadrilaterals with eight nodes are negative at their corners.
    """
    eight = any(facets.kind == "quad8" for facets in mesh.surface(surface))
    return contact.method == "mortar" or (eight and contact.master is None)


def _met_by_nitsche(
    bodies: Sequence[Body], contact: Contact, options: Nitsche, offsets: Index
) -> tuple[ContactRows, sparse.csc_array, NDArray[np.bool_], Array, NitscheTerms | None]:
    """The same for the Gauss points of Nitsche's method."""
    k, surface = locate(bodies, contact.slave)
    body, first, size = bodies[k], int(offsets[k]), int(offsets[-1])
    laws = [body.material] if isinstance(body.material, Rigid | GivenMatrices) else (
        materials_by_region(body.mesh, body.material).values()
    )
    if not all(isinstance(law, LinearElastic) for law in laws):
        raise UnsupportedForm(
            f"contact on {contact.slave!r}: Nitsche's method takes the stress from "
            'LinearElastic; use method="nodal"'
        )
    material = cast("LinearElastic | Mapping[str, LinearElastic]", body.material)  # as checked
    if contact.obstacle is not None:
        rows, terms = nitsche_obstacle(
            body.mesh, surface, contact.obstacle, material, options
        )
        H = _shifted(rows.H, first, size)
    else:
        assert contact.master is not None
        j, other = locate(bodies, contact.master)
        rows, terms, on_master = nitsche_pair(
            body.mesh, surface, bodies[j].mesh, other, material, options
        )
        H = _shifted(rows.H, first, size) + _shifted(on_master, int(offsets[j]), size)
    terms = replace(terms, traction=_shifted(terms.traction, first, size))
    met = np.ones(len(rows.points), dtype=bool)
    return rows, sparse.csc_array(H), met, rows.points, terms


def _check_faces(mesh: Mesh, surface: str, contact: Contact, rows: ContactRows) -> None:
    """Raise InvalidInput when the slave looks away from its obstacle everywhere."""
    normal = np.full(mesh.points.shape, np.nan)
    normal[rows.nodes] = rows.frames[:, 0]
    toward = -1.0
    for facets in mesh.surface(surface):
        outward = facet_normals(mesh.points, facets)
        outward /= np.linalg.norm(outward, axis=1)[:, None]
        cosine = -np.einsum("fc,fkc->fk", outward, normal[facets.nodes])
        toward = max(toward, float(np.where(np.isnan(cosine), -1.0, cosine).max(initial=-1.0)))
    if toward < -AWAY:
        raise InvalidInput(
            f"contact on {contact.slave!r}: no facet of it faces the obstacle; a normal of the "
            f"obstacle points into the body, here it is {rows.frames[0, 0].round(3).tolist()}"
        )


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


def refuse_none(
    contacts: Sequence[Contact], placed: Sequence[Placed], bodies: Sequence[Body],
    supports: Sequence[Fix], offsets: Index, prescribed: Array,
) -> None:  # fmt: skip
    """Raise InvalidInput: no contact is left, by `where` or as supports hold all nodes."""
    for k, (contact, own) in enumerate(zip(contacts, placed, strict=True)):
        points = own.all_points
        if not _wanted(contact, points).any():
            ends = " to ".join(
                f"[{', '.join(f'{c:.6g}' for c in end)}]"
                for end in (points.min(axis=0), points.max(axis=0))
            )
            raise InvalidInput(
                f"expected True for at least one of the {len(points)} {own.each}s, which lie "
                f"from {ends}; got False for all of them: let it select some, in the unit of "
                "the mesh, or leave the contact out", ("contacts", k, "where"),
                f"contact on {contact.slave!r}: where",
            )  # fmt: skip
    refuse_held([own.held for own in placed], bodies, supports, offsets, prescribed,
                between_bodies=any(c.master is not None for c in contacts))  # fmt: skip


def _shifted(H: sparse.csc_array, offset: int, size: int) -> sparse.csc_array:
    """Columns on one body in the dofs of the whole model, (size, nc d)."""
    part = H.tocoo()
    entries = (part.data, (part.coords[0] + offset, part.coords[1]))
    return sparse.coo_array(entries, shape=(size, H.shape[1])).tocsc()
