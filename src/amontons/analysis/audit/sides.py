"""Contact seen from one side: forces at its nodes, gaps and slips averaged around them.

The side plays the slave of mortar contact, whatever discretisation the answer comes from.  A
nodal force is the integral of the traction with the node's shape function; where facets are of
second order, those of the nodes between corners are shared out to the corners, so that a
pressure >= 0 gives forces >= 0.  Each pair is looked at from both sides: what an average over
the large facets of one hides is seen from the other.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.linalg import lsqr

from ...core.errors import AmontonsError
from ...mechanics.meshes.cells import CELLS
from ...mechanics.model.laws import law_of
from ...mechanics.model.parts import Contact
from ...mechanics.model.placing import Placed, place
from ...mechanics.model.supports import Prescribed, locate
from ...problem.law import Law
from .points import PointGaps, point_gaps

if TYPE_CHECKING:
    from ...mechanics.model import Model
    from .forces import NodalForces

Array = NDArray[np.float64]
Index = NDArray[np.int64]
Mask = NDArray[np.bool_]
HELD = 0.1  # part of an axis along held components from which its force is not known
ROUNDED = 1e-15  # relative error of a point
TURNED = 1e-9  # by which the mean of a frame that turns is shorter than 1
FITTED = 1e-12  # accuracy of forces that several contacts share at a node


@dataclass(frozen=True, eq=False)
class Side:
    """One pair from one side, nc contacts at its nodes.

    contact: with this side as the slave; node (nc,): in the whole model; points (nc, d);
    weight (nc,): area; frame (nc, d, d), rows n, t1(, t2), n into this side.  r (nc, d): force
    on this side in the frame, known (nc, d) where no support acts too, bound (nc, d).
    gap, flat (nc,): of the curved surfaces and of their facets; slip (nc, d-1); blur (nc,) of
    both.  start, start_flat (nc,): gaps at zero displacement.  matrix (dofs, nc d): local
    displacements are its transpose times those of the model.  law: that of these contacts.
    start_points (nc,): gap of the node itself to the facet before it at zero displacement;
    points_gap (nc,): the smallest one now at points around each.  around (nc, nc): which
    contacts have a facet in common.  turned: around an axis.  nodal: of all nodes of the
    surface, points (n, d) and forces (n, d); None where supports or other pairs act on one.
    """

    contact: Contact
    node: Index
    points: Array
    weight: Array
    frame: Array
    r: Array
    known: Mask
    bound: Array
    gap: Array
    flat: Array
    slip: Array
    blur: Array
    start: Array
    start_flat: Array
    matrix: sparse.csc_array
    law: Law
    start_points: Array
    points_gap: Array
    around: sparse.csr_array
    turned: bool
    nodal: tuple[Array, Array] | None = None

    @property
    def force(self) -> Array:
        """On this side, (d,), of what is known."""
        return self._forces[1].sum(axis=0)

    def moment(self) -> Array:
        """Of these forces about the origin, (3,), in 2D (1,)."""
        from ...mechanics.model.wrench import Wrench

        return Wrench.of(*self._forces).moment

    @property
    def _forces(self) -> tuple[Array, Array]:
        """Points and forces; nodes that are hardly covered have no contact, but forces."""
        if self.nodal is not None:
            return self.nodal
        return self.points, np.einsum("pk,pkc->pc", self.r, self.frame)

    def slip_of(self, u: Array) -> Array:
        """Tangential displacement (nc, d-1) of other displacements (dofs,)."""
        return (self.matrix.T @ u).reshape(self.r.shape)[:, 1:]


def sides_of(model: Model, forces: NodalForces, u: Array) -> list[tuple[Side, ...]]:
    """Every contact from one or two sides; from the slave alone with an obstacle."""
    placed = model.discretisation.placed
    given = Prescribed.of(model.bodies, model.supports, model.discretisation.beside)
    turned = [_turned(model, contact, given) for contact in model.contacts]
    near = [point_gaps(model, contact, u) for contact in model.contacts]
    firsts = _seen(model, model.contacts, placed, forces, u, near)
    with_other = [k for k, pair in enumerate(turned) if pair is not None]
    pairs = [turned[k] for k in with_other]
    others = _seen(model, [p[0] for p in pairs if p], [p[1] for p in pairs if p], forces, u,
                   [near[k] for k in with_other])  # fmt: skip
    found: list[tuple[Side, ...]] = [(side,) for side in firsts]
    for k, other in zip(with_other, others, strict=True):
        found[k] = (*found[k], other)
    return found


def _turned(model: Model, contact: Contact, given: Prescribed) -> tuple[Contact, Placed] | None:
    """The contact with its sides exchanged; None where there is one side, or none to be had."""
    if contact.master is None or contact.where is not None:
        return None
    new = replace(contact, slave=contact.master, master=contact.slave)
    try:
        return new, place(model.bodies, new, given, model.discretisation.eliminated)
    except AmontonsError:  # held all over, or no facet in front
        return None


def _seen(
    model: Model, contacts: Sequence[Contact], placed: Sequence[Placed],
    forces: NodalForces, u: Array, near: Sequence[PointGaps | None],
) -> list[Side]:  # fmt: skip
    parts, d = model.discretisation, model.dimension
    points = np.concatenate([body.mesh.points for body in model.bodies]).ravel()
    pairs = [
        _side(model, contact, one, forces, (u, points), gaps)
        for contact, one, gaps in zip(contacts, placed, near, strict=True)
    ]
    shared = _shared(model, contacts)
    if not (shared or any(_turn(model, one) for one in placed)):
        return pairs
    whole = sparse.csr_array(sparse.hstack([p.H for p in placed], format="csr"))
    fixed = parts.is_fixed[: parts.beside.first]
    rows = np.flatnonzero(~fixed & (np.diff(whole.indptr) > 0))
    size = float(np.abs(forces.missing[rows]).max(initial=0.0)) or 1.0
    start = np.concatenate([side.r.ravel() for side in pairs]) / size
    found = lsqr(whole[rows], forces.missing[rows] / size, x0=start, atol=FITTED, btol=FITTED,
                 iter_lim=2000)[0] * size  # fmt: skip
    ends = np.cumsum([side.r.size for side in pairs])[:-1]
    return [
        replace(side, r=np.where(side.known, part.reshape(-1, d), 0.0),
                nodal=None if shared else side.nodal)
        for side, part in zip(pairs, np.split(found, ends), strict=True)
    ]


def _side(
    model: Model, contact: Contact, placed: Placed, forces: NodalForces,
    moved: tuple[Array, Array], near: PointGaps | None,
) -> Side:  # fmt: skip
    """One pair as its slave sees it; moved: displacements and points, (dofs,) each."""
    parts, d, rows = model.discretisation, model.dimension, placed.rows
    first = int(parts.offsets[placed.body]) // d
    node = first + rows.nodes
    share = _to_corners(model, contact, placed, first)
    held = forces.is_held.reshape(-1, d)  # by supports or constraints
    force = np.where(held, 0.0, forces.missing.reshape(-1, d))
    nodal, blur = share @ force, share @ np.where(held, 0.0, forces.known.reshape(-1, d))
    part = _own_parts(placed, share)[:, None]
    r = np.einsum("pkc,pc->pk", rows.frames, nodal) / part
    known = np.abs(np.einsum("pkc,pc->pkc", rows.frames, held[node])).max(axis=2) < HELD
    local = (placed.H.T @ moved[0]).reshape(-1, d)
    start = np.zeros(len(node)) if contact.tied else rows.gap
    flat = start if contact.obstacle is not None or contact.tied else _facets(placed, moved[1])
    at_points = [flat, flat + local[:, 0]]
    if near is not None and not contact.tied:
        at_points = [
            np.where(np.isfinite(gap[node]), gap[node], mean)
            for gap, mean in zip((near.start, near.now), at_points, strict=True)
        ]
    span = ROUNDED * float(np.abs(moved[1]).max(initial=0.0))
    blurred = (abs(placed.H).T @ (forces.blur + span)).reshape(-1, d).max(axis=1, initial=0.0)
    return Side(
        contact, node, rows.points, rows.weights, rows.sums, np.where(known, r, 0.0), known,
        np.einsum("pkc,pc->pk", np.abs(rows.frames), blur) / part, start + local[:, 0],
        flat + local[:, 0], local[:, 1:], blurred, start, flat, placed.H,
        law_of([contact], replace(parts, placed=(placed,))), *at_points,
        _around(model, contact, rows.nodes), model.bodies[placed.body].mesh.axisymmetric,
        _on_surface(model, contact, moved[1].reshape(-1, d), forces),
    )  # fmt: skip


def _around(model: Model, contact: Contact, nodes: Index) -> sparse.csr_array:
    """Which of the contacts at these nodes have a facet in common, (nc, nc)."""
    k, surface = locate(model.bodies, contact.slave)
    mesh, total = model.bodies[k].mesh, len(model.bodies[k].mesh.points)
    on = [block.nodes for block in mesh.surface(surface)]
    of = np.concatenate([np.repeat(np.arange(len(b)), b.shape[1]) for b in on])
    starts = np.repeat(np.cumsum([0, *(len(b) for b in on)])[:-1], [b.size for b in on])
    table = sparse.csr_array(
        (np.ones(len(of)), (of + starts, np.concatenate([b.ravel() for b in on]))),
        shape=(sum(len(b) for b in on), total),
    )[:, nodes]
    return sparse.csr_array(table.T @ table)


def _on_surface(
    model: Model, contact: Contact, points: Array, forces: NodalForces
) -> tuple[Array, Array] | None:  # fmt: skip
    """Points and forces of all nodes of the slave surface; None where supports act on one."""
    k, surface = locate(model.bodies, contact.slave)
    d = model.dimension
    nodes = model.bodies[k].mesh.surface_nodes(surface)
    nodes = int(model.discretisation.offsets[k]) // d + nodes
    if contact.where is not None or forces.is_held.reshape(-1, d)[nodes].any():
        return None
    return points[nodes], forces.missing.reshape(-1, d)[nodes]


def _facets(placed: Placed, points: Array) -> Array:
    """Gaps (nc,) of the facets themselves: the averages of points are linear in them."""
    return np.asarray(placed.H.T @ points).reshape(-1, placed.rows.points.shape[1])[:, 0]


def _to_corners(
    model: Model, contact: Contact, placed: Placed, first: int
) -> sparse.csr_array:  # fmt: skip
    """Who takes the force of which node, (nc, nodes of the model)."""
    total = model.discretisation.beside.first // model.dimension
    nodes = placed.rows.nodes
    entries = [(first + nodes, first + nodes, np.ones(len(nodes)))]
    if contact.method == "mortar":
        k, surface = locate(model.bodies, contact.slave)
        for block in model.bodies[k].mesh.surface(surface):
            entries += _middles(block.kind, first + block.nodes)
    to, of, value = (np.concatenate(column) for column in zip(*entries, strict=True))
    whole = np.unique(np.stack([to, of]), axis=1, return_index=True)[1]  # middles of two facets
    matrix = sparse.csr_array((value[whole], (to[whole], of[whole])), shape=(total, total))
    return matrix[first + nodes]


def _own_parts(placed: Placed, share: sparse.csr_array) -> Array:
    """How much of what each contact bears acts on its node, (nc,).

    All of it but where nodes beside it have no contact of their own.
    """
    nc, d = placed.rows.points.shape
    columns = (sparse.kron(share, np.eye(d), format="csr") @ placed.H).tocoo()
    own = columns.row // d == columns.col // d
    blocks = np.zeros((nc, d, d))
    row, column = columns.row[own], columns.col[own]
    blocks[row // d, row % d, column % d] = columns.data[own]
    size = np.linalg.norm(blocks, 2, axis=(1, 2))  # of a rotation, less what is held
    return np.where(size > 0, size, 1.0)


def _middles(kind: str, nodes: Index) -> list[tuple[Index, Index, Array]]:
    """(corner, node between, share) of facets of second order: bilinear functions there."""
    cell, count = CELLS[kind], len(nodes)
    first = nodes.shape[1] - len(cell.parents)
    return [
        (nodes[:, corner], nodes[:, first + k], np.full(count, 1.0 / len(between)))
        for k, between in enumerate(cell.parents)
        for corner in between
    ]


def _turn(model: Model, placed: Placed) -> bool:
    """True where frames turn over the facets: forces at nodes are then no multiples of them."""
    if model.bodies[placed.body].mesh.order == 1:
        return False
    size = np.linalg.norm(placed.rows.sums, axis=2)
    return bool(((size > HELD) & (np.abs(size - 1) > TURNED)).any())


def _shared(model: Model, contacts: Sequence[Contact]) -> bool:
    """True where a node lies on more than one of all sides."""
    seen: dict[tuple[int, int], int] = {}
    for contact in contacts:
        for name in (contact.slave, contact.master):
            if name is None:
                continue
            k, surface = locate(model.bodies, name)
            for node in model.bodies[k].mesh.surface_nodes(surface).tolist():
                if seen.setdefault((k, node), 0):
                    return True
                seen[k, node] = 1
    return False
