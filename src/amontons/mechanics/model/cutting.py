"""A model cut into parts for the processes of MPI: what each of them is given.

The first process has the whole mesh; it says where supports hold, what loads push and where
contacts are, which needs no matrix, and cuts the nodes of all bodies into compact groups.  A
process gets the nodes of its group, all cells that touch them, and with these the nodes of
others around (*ghosts*): so it assembles complete rows of the stiffness by itself.

Contact is seen on one side and in its frame ([HSW] section 2, see `problem.one_sided`): the
displacement of a slave node s, v_s, is replaced by y_s = F v_s + B' v_m, with the frame F by
rows and the part B' of H of the master's nodes, so that u = y_s + gap n.  Where supports hold a
slave node in some directions, its tangents are turned until these are axes of its frame.

[HSW] S. Hüeber, G. Stadler, B. Wohlmuth, SIAM J. Sci. Comput. 30 (2008).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ...core.errors import InvalidInput, UnsupportedForm, UnsupportedLaw, within
from ...linear.rigid_modes import centre_and_size, modes_about
from ...problem.law import Law
from ..elements.given import GivenMatrices
from ..elements.rigid import Rigid
from ..meshes.mesh import Mesh
from ..meshes.partition import Cut, sorted_by
from .assembly import _check_once, _of_all, _placed
from .held import check_outside
from .laws import law_of_placed
from .model import Model
from .parts import Body
from .placing import refuse_none
from .rigid import Piece, loose_modes, pieces
from .sites import Sites
from .supports import Prescribed, external_load

Array = NDArray[np.float64]
Index = NDArray[np.int64]
Mask = NDArray[np.bool_]
ALONG = 1e-9  # sine of an angle up to which a held direction lies in the contact's plane
SAME = 1e-10  # entries of H that differ by less are the same
RESTS = 1e-13  # motion, relative to the largest, up to which supports drive no contact


@dataclass(frozen=True, eq=False)
class Contacts:
    """Contacts (k,) of one process, or of all: number in the model, slave node, and the rest.

    frames (k, d, d): by rows, tangents turned to what supports hold; turn (k, d, d): from
    there to the frame of the model; able (k, d): directions that no support holds; part (k,):
    1 over what the slave node bears itself of the model's forces, see `contact.mortar`.  Here
    forces are those, and u and gap in proportion, part times those of the model.
    """

    number: Index
    node: Index
    gap: Array
    frames: Array
    turn: Array
    able: Mask
    weights: Array
    law: Law
    part: Array

    def at(self, index: Index, node: Index) -> Contacts:
        """Some of them, whose nodes have other numbers."""
        return Contacts(
            self.number[index], node, self.gap[index], self.frames[index], self.turn[index],
            self.able[index], self.weights[index], self.law.at(index), self.part[index],
        )  # fmt: skip


@dataclass(frozen=True, eq=False)
class Turning:
    """Connected pieces: centres (p, d) about which they turn, and their sizes (p, 1)."""

    centres: Array
    sizes: Array

    @classmethod
    def of(cls, parts: list[Piece], d: int) -> Turning:
        """Those of pieces of a model."""
        known = [centre_and_size(piece.points) for piece in parts]
        centres = np.array([centre for centre, _ in known]).reshape(-1, d)
        return cls(centres, np.array([[size] for _, size in known]))


@dataclass(frozen=True, eq=False)
class Share:
    """What one process is given; l local nodes (its own and ghosts), o of them its own.

    nodes (l,): numbers in the whole model, ascending; number (l,): in PETSc, own ones
    ascending; own (l,); starts (processes + 1,): first numbers of the processes.
    bodies: (number of the body, mesh, material) of its cells, whose nodes follow one another.
    fixed (o, d) in the frames of contacts; prescribed, load (o, d) in global axes; piece (o,):
    connected one of each own node, and about where pieces turn.
    framed (q,): local nodes with a contact, their frames (q, d, d).
    coupling: own dofs (local among own), PETSc's dofs of masters, -B' of both, (c,) each.
    all_contacts: of all processes; coupled: whether any process has a coupling.
    """

    nodes: Index
    number: Index
    own: Mask
    starts: Index
    bodies: list[tuple[int, Mesh, Any]]
    fixed: Mask
    prescribed: Array
    load: Array
    piece: NDArray[np.int32]
    turning: Turning
    framed: Index
    frames: Array
    contacts: Contacts
    coupling: tuple[Index, Index, Array]
    coupled: bool
    all_contacts: int
    counts: tuple[int, ...]

    @property
    def modes(self) -> Array:
        """Rigid motions of own nodes, (o d, 3 or 6) in global axes, made anew at every call."""
        points = np.concatenate([mesh.points for _, mesh, _ in self.bodies])[self.own]
        turning = self.turning
        return modes_about(points - turning.centres[self.piece], turning.sizes[self.piece])


@dataclass(frozen=True, eq=False)
class Whole:
    """The same of the whole model, nodes in its own order; coupling B (dofs, nc d)."""

    bodies: tuple[Body, ...]
    points: Array
    fixed: Mask
    prescribed: Array
    load: Array
    piece: NDArray[np.int32]
    turning: Turning
    contacts: Contacts
    coupling: sparse.csc_array

    @property
    def dim(self) -> int:
        """2 or 3."""
        return self.points.shape[1]


def check_supported(model: Model) -> None:
    """Raise UnsupportedForm for what several processes can not do, and say what can."""
    alone = "solve it on one process"
    if type(model.formulation).__name__ != "Reactions":
        raise UnsupportedForm(
            "model: several processes solve small strains with nodal or mortar contact of the "
            f"undeformed bodies, without plastic flow and Nitsche's method; {alone}"
        )
    for name in ("references", "constraints", "springs"):
        if getattr(model, name):
            raise UnsupportedForm(f"model: several processes take no {name}; {alone}")
    for body in model.bodies:
        if isinstance(body.material, Rigid | GivenMatrices):
            raise UnsupportedForm(
                f"body {body.name!r}: several processes assemble their own cells, of bodies "
                f"that deform; expected a material, got {type(body.material).__name__}; {alone}"
            )
    for k, contact in enumerate(model.contacts):
        if contact.follows is not None:
            raise UnsupportedForm(
                f"several processes take no obstacle that follows a body; {alone}",
                ("contacts", k, "follows"),
            )


def whole(model: Model) -> Whole:
    """Supports, loads and contacts of a model at its load factor, without a matrix."""
    check_supported(model)
    bodies, beside, d = tuple(model.bodies), model.beside, model.dimension
    given = Prescribed.of(bodies, model.supports, beside)
    fixed, factor = given.is_fixed, model.load_factor
    if fixed.all():
        raise InvalidInput("every degree of freedom is fixed, nothing left to solve",
                           ("supports",))  # fmt: skip
    prescribed = factor * np.where(fixed, given.values, 0.0)
    parts = [
        piece for k, body in enumerate(bodies)
        for piece in pieces(body.mesh, body.name, int(beside.offsets[k]), body.material)
    ]  # fmt: skip
    for piece, _ in loose_modes(parts, fixed):
        raise UnsupportedForm(
            f"{piece.name}: supports leave rigid motions free that contact alone can hold; "
            "several processes need bodies held by supports, solve this model on one"
        )
    placed = _placed(bodies, model.contacts, given, None)
    _check_once(bodies, model.contacts, placed)
    H = _of_all([p.H for p in placed], beside)
    if model.contacts and not H.shape[1]:
        refuse_none(model.contacts, placed, bodies, model.supports, beside.offsets, prescribed)
    for k, held in enumerate(p.held for p in placed):
        if held is not None:
            with within("contacts", k):
                check_outside(held, held.left(prescribed), bodies, model.supports,
                              beside.offsets, "")  # fmt: skip
    law = law_of_placed(model.contacts, placed)
    if law.plain is not law or law.varies or law.give is not None or law.cohesion.any():
        raise UnsupportedLaw(
            "contacts: several processes take the laws of Coulomb, Tresca, capped Coulomb and "
            "ties, with numbers that do not follow the state; solve others on one process"
        )
    sites = Sites.of(placed, d)
    gap = np.concatenate([np.zeros(0), *(
        np.zeros_like(p.rows.gap) if contact.tied else p.rows.gap
        for contact, p in zip(model.contacts, placed, strict=True)
    )])  # fmt: skip
    node = beside.offsets[sites.body] // d + sites.node
    fixed, contacts, B = _in_frames(H, sites, node, gap, law, fixed.reshape(-1, d))
    _check_rest(contacts, H, prescribed)
    return Whole(
        bodies, np.concatenate([body.mesh.points for body in bodies]), fixed,
        prescribed.reshape(-1, d),
        factor * external_load(bodies, model.loads, beside).reshape(-1, d),
        _numbers(parts, len(fixed)), Turning.of(parts, d), contacts, B,
    )  # fmt: skip


def _numbers(parts: list[Piece], nodes: int) -> NDArray[np.int32]:
    """The piece of every node, (nodes,)."""
    out = np.empty(nodes, dtype=np.int32)
    for k, piece in enumerate(parts):
        d = piece.points.shape[1]
        out[piece.dofs[::d] // d] = k
    return out


def _in_frames(  # noqa: PLR0913  # what contacts are made of
    H: sparse.csc_array, sites: Sites, node: Index, gap: Array, law: Law, fixed: Mask
) -> tuple[Mask, Contacts, sparse.csc_array]:
    """What is fixed (nodes, d), the contacts, both in frames, and B (dofs, nc d)."""
    nc, d = sites.points.shape
    if len(np.unique(node)) < nc:
        raise UnsupportedForm(
            "contacts: a node is the slave of two contacts; several processes take one for "
            "each node, solve this model on one"
        )
    frames = sites.frames.copy()
    for k in np.flatnonzero(fixed[node].any(axis=1)):
        frames[k] = _turned(frames[k], fixed[node[k]], sites.points[k])
    turn = np.einsum("kai,kbi->kab", sites.frames, frames)
    able = np.all(np.abs(frames) * fixed[node][:, None, :] <= 1 - SAME, axis=2)
    tiles = sparse.bsr_array((turn, np.arange(nc), np.arange(nc + 1)), shape=(nc * d,) * 2)
    turned = sparse.csc_array(H @ tiles.tocsc()).tocoo()
    row, column = turned.coords
    slave = np.full(len(fixed), -1)
    slave[node] = np.arange(nc)
    of = slave[row // d]
    mine = of == column // d
    expected = frames[of[mine], column[mine] % d, row[mine] % d]
    own = np.bincount(of[mine], turned.data[mine] * expected, minlength=nc) / d
    part = 1 / np.where(own > 0, own, 1.0)
    values = turned.data * part[column // d]
    if np.abs(values[mine] - expected).max(initial=0.0) > SAME or (
        (of >= 0) & ~mine & (np.abs(values) > SAME)
    ).any():
        raise UnsupportedForm(
            "contacts: a node is a slave and belongs to the other side of another contact; "
            "several processes need it on one side, solve this model on one"
        )
    others = ~mine & (np.abs(values) > 0)
    held = ~able.ravel()[column] & others
    if (held & ~fixed.ravel()[row]).any():
        raise UnsupportedForm(
            "contacts: a support holds a slave node in a direction in which the other side "
            "moves; several processes can not do this yet, solve this model on one"
        )
    B = sparse.csc_array(
        (values[others], (row[others], column[others])), shape=H.shape
    )
    in_frames = fixed.copy()
    in_frames[node] = ~able
    index = np.arange(nc)
    contacts = Contacts(index, node, gap * part, frames, turn, able, sites.weights,
                        law.scaled(1 / part), part)  # fmt: skip
    return in_frames, contacts, B


def _turned(frame: Array, held: Mask, point: Array) -> Array:
    """A frame (d, d) with the same normal whose axes are the directions that are held."""
    normal, d = frame[0], len(frame)
    axes = np.eye(d)[held]
    if np.abs(axes @ normal).max(initial=0.0) > ALONG:
        raise UnsupportedForm(
            f"contact at {point.round(6).tolist()}: a support holds the node in a direction "
            "that is neither normal nor tangential there; several processes need it along the "
            "axes of the contact, solve this model on one"
        )
    out = np.array(frame)
    out[1] = axes[0] - (axes[0] @ normal) * normal
    out[1] /= np.linalg.norm(out[1])
    if d == 3:
        out[2] = np.cross(normal, out[1])
    return out


def _check_rest(contacts: Contacts, H: sparse.csc_array, prescribed: Array) -> None:
    """Supports that drive a contact along the surface are not taken."""
    if not len(contacts.node) or contacts.able.all():
        return
    d = contacts.able.shape[1]
    carried = (H.T @ prescribed).reshape(-1, d)
    moved = np.einsum("kai,ka->ki", contacts.turn, carried)
    size = RESTS * max(np.abs(prescribed).max(initial=0.0), np.abs(contacts.gap).max(initial=0))
    if (np.abs(moved[~contacts.able]) > size).any():
        raise UnsupportedForm(
            "contacts: a support moves slave nodes along the surface; several processes take "
            "supports that hold them there, or leave them free; solve this model on one"
        )


def shares(given: Whole, owner: Index, processes: int) -> Iterator[tuple[int, Share]]:
    """What each process gets, made one after another.  owner (nodes,).

    The first process, which makes them, comes last: by then others have begun.

    Everything is sorted by process once, so that cutting takes no longer for many of them.
    """
    d, contacts = given.dim, given.contacts
    order, starts = sorted_by(owner, processes)
    number = np.empty(len(owner), dtype=np.int64)
    number[order] = np.arange(len(owner))
    of_contact, contact_starts = sorted_by(owner[contacts.node], processes)
    slave_of = np.full(len(owner), -1)
    slave_of[contacts.node] = np.arange(len(contacts.node))
    B = _whole_blocks(given.coupling, d)
    (row, column), values = B.coords, np.asarray(B.data, dtype=float)
    slave = contacts.node[column // d]
    of_entry, entry_starts = sorted_by(owner[slave], processes)
    counts = tuple(len(body.mesh.points) for body in given.bodies)
    firsts = np.cumsum([0, *counts])
    cuts = [
        Cut(body.mesh, owner[first : first + count], processes)
        for body, first, count in zip(given.bodies, firsts, counts, strict=False)
    ]
    for rank in (*range(1, processes), 0):
        bodies, kept = [], []
        for k, (cut, body) in enumerate(zip(cuts, given.bodies, strict=True)):
            mesh, used = cut.part(rank)
            if mesh is not None:
                bodies.append((k, mesh, _material(body, mesh)))
                kept.append(firsts[k] + used)
        nodes = np.concatenate(kept)
        mine = order[starts[rank] : starts[rank + 1]]
        local = np.flatnonzero(slave_of[nodes] >= 0)
        chosen = of_contact[contact_starts[rank] : contact_starts[rank + 1]]
        here = of_entry[entry_starts[rank] : entry_starts[rank + 1]]
        own_slave = number[slave[here]] - starts[rank]
        yield rank, Share(
            nodes, number[nodes], owner[nodes] == rank, starts, bodies, given.fixed[mine],
            given.prescribed[mine], given.load[mine], given.piece[mine], given.turning,
            local, contacts.frames[slave_of[nodes[local]]],
            contacts.at(chosen, number[contacts.node[chosen]] - starts[rank]),
            (own_slave * d + column[here] % d, number[row[here] // d] * d + row[here] % d,
             -values[here]),
            B.nnz > 0, len(contacts.node), counts,
        )  # fmt: skip


def _whole_blocks(B: sparse.csc_array, d: int) -> sparse.coo_array:
    """The same with all entries of every block, zeros too: rows of a node have one pattern."""
    tiles = sparse.bsr_array(sparse.csr_array(B).tobsr((d, d)))
    where = np.repeat(np.arange(B.shape[0] // d), np.diff(tiles.indptr)), tiles.indices
    i, j = np.mgrid[:d, :d]
    rows, columns = (w[:, None, None] * d + part for w, part in zip(where, (i, j), strict=True))
    entries = tiles.data.ravel(), (rows.ravel(), columns.ravel())
    return sparse.coo_array(entries, shape=B.shape)


def _material(body: Body, mesh: Mesh) -> Any:
    """The laws of the regions that a part of a body has."""
    if not isinstance(body.material, Mapping):
        return body.material
    return {region: body.material[region] for region in mesh.regions}
