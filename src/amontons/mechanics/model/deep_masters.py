"""A doubt about finite sliding: nodes of the master that lie deep inside the slave.

Gaps are averages over the slave's facets: zero there says nothing of a node of the master
between nodes of a coarser slave, as a sharp corner.  Its force is then at the wrong place: of
a folded strip 16 % less across and 36 % along at .1 of a facet, 24 and 54 % at .33, there in
front of a facet whose other node a support holds, so that all of it has one average.
What overlaps by the law, by springs or a clearance, overlaps at the slave's nodes, too.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ...core.warned import ResultWarning
from ..contact.current_mortar import MortarMeeting
from ..contact.facing import Skin
from ..contact.pairs import project
from ..meshes.facets import Facets
from ..meshes.surfaces import facet_areas
from .fields import ContactFields
from .nonlinear_parts import nonlinear_parts

if TYPE_CHECKING:
    from .model import Model

Array = NDArray[np.float64]
Index = NDArray[np.int64]
DEEP = 1 / 8  # of slave facets: what chords as long as the radius leave of an arc, h^2 / 8R
DUMB = DEEP / 4  # of facets with nodes that carry no force: one average less to tell of them
KINDS = {2: "line", 3: "tri", 4: "quad"}  # by corners


def deep_masters(model: Model, fields: ContactFields) -> list[ResultWarning]:
    """Pairs of which nodes of the master lie deeper in the slave than DEEP of its facets."""
    displacement = np.concatenate(fields.displacement)
    if not np.isfinite(displacement).all():
        return []
    parts = nonlinear_parts(model)
    found = (_deep(meeting, parts.X) for meeting in parts.meet(displacement).parts)
    return [warning for warning in found if warning is not None]


def _deep(meeting: object, X: Array) -> ResultWarning | None:
    if not isinstance(meeting, MortarMeeting):
        return None
    pair, x, shared = meeting.pair, meeting.x, meeting.shared
    bearing = np.asarray(shared.kept.any(axis=1))  # others: `held_facets`
    facing = np.unique(shared.master[bearing[shared.of]])
    if not facing.size:
        return None
    slave, numbers = _blocks(pair.slave, shared.facets[bearing])
    nodes = pair.master.part(facing).all
    normals = _normals(pair.master, x)[nodes]
    every = np.ones(len(nodes), dtype=bool)
    hit = project(x[nodes], x, slave, facing=normals, own=nodes, free=every)
    facet = numbers[hit.facet]
    found = hit.found if pair.fold is None else hit.found & _share(meeting, nodes, facet)
    depth = np.einsum("kc,kc->k", hit.closest - x[nodes], hit.normal)
    by_law = -float((meeting.gap - pair.offset)[meeting.met].min(initial=0.0))
    depth = np.where(found, depth, 0.0) - by_law
    areas = np.concatenate([facet_areas(x, block) for block in slave])
    part = depth / areas[hit.facet] ** (1 / (x.shape[1] - 1))
    without = (meeting.row[pair.slave.nodes] < 0) & pair.slave.real
    dumb = np.asarray(without.any(axis=1))[facet]
    told = part > np.where(dumb, DUMB, DEEP)
    if not told.any():
        return None
    worst = int(np.where(told, part, 0.0).argmax())
    one, other = pair.names
    why = ", some of whose nodes carry no contact force, as where supports hold them"
    what = (
        f"refine {one!r} there" if pair.fold else f"make {other!r} the slave, or refine {one!r}"
    )
    return ResultWarning(
        "master-inside-slave",
        f"contact on {one!r} with {other!r}: {int(told.sum())} nodes of the master "
        f"lie inside the slave, up to {depth[worst]:.3g} or {part[worst]:.2g} of the length "
        f"of its facet there{why if dumb[worst] else ''}, at "
        f"{X[nodes[worst]].round(6).tolist()}: forces are off; {what}",
    )


def _blocks(skin: Skin, some: Index) -> tuple[tuple[Facets, ...], Index]:
    """Some facets between corners, kind after kind, and their numbers in this order."""
    corners = skin.corners[some]
    kinds = [(n, some[corners == n]) for n in np.unique(corners)]
    blocks = tuple(Facets(KINDS[n], skin.nodes[facets, :n]) for n, facets in kinds)
    return blocks, np.concatenate([facets for _, facets in kinds])


def _share(meeting: MortarMeeting, nodes: Index, facet: Index) -> NDArray[np.bool_]:
    """Whether slave facets (k,) share something with a master facet of the nodes (k,).

    A surface that meets itself comes near itself elsewhere, too.
    """
    shared, master = meeting.shared, meeting.pair.master
    own = master.nodes[shared.master]
    pairs = np.stack([np.broadcast_to(shared.slave[:, None], own.shape), own], axis=-1)
    known = pairs.reshape(-1, 2)[master.real[shared.master].ravel()]
    size = len(meeting.x)
    return np.isin(facet * size + nodes, known[:, 0] * size + known[:, 1])


def _normals(skin: Skin, x: Array) -> Array:
    """Outward unit normals at its nodes, by area, (nodes, d); 0 where facets cancel."""
    out, areas = np.zeros(x.shape), skin.areas(x)
    for slot, real in enumerate(skin.real.T):
        np.add.at(out, skin.nodes[real, slot], areas[real])
    size = np.linalg.norm(out, axis=1, keepdims=True)
    return out / np.where(size > 0, size, 1.0)
