"""The pairs of a model's contacts in large deformations, and how stiff their nodes are."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ..contact.carried import TiedPair
from ..contact.current_mortar import MortarPair, folded
from ..contact.current_pairs import ObstaclePair, Pair, between_bodies
from ..contact.facing import Skin
from ..contact.free_normals import FreeNormals
from ..contact.geometry import Plane
from ..contact.grown_areas import GrownAreas
from ..contact.overlap import is_itself
from ..contact.ridges import ridges
from .supports import locate

if TYPE_CHECKING:
    from .assembly import Discretisation
    from .model import Model
    from .placing import Placed

Array = NDArray[np.float64]
Index = NDArray[np.int64]


def met_pairs(model: Model, slaves: list[Index], linear: Discretisation) -> list[Pair]:
    """The pairs of the contacts; slaves: nodes of their rows."""
    d = model.dimension
    is_free = free_dofs(linear).reshape(-1, d)
    X = np.concatenate([body.mesh.points for body in model.bodies])
    out: list[Pair] = []
    if not model.contacts:  # a floor that no node can meet
        out.append(ObstaclePair(Plane(np.eye(d)[-1]), np.zeros(0, dtype=np.int64)))
    for contact, nodes, own in zip(model.contacts, slaves, linear.placed, strict=True):
        axes = _axes(own, linear)
        if contact.obstacle is not None:
            side = FreeNormals(contact.obstacle, is_free[nodes])
            obstacle = contact.obstacle if side.free.all() else side
            k, name = locate(model.bodies, contact.slave)
            skin = Skin.of(model.bodies[k].mesh.surface(name), int(linear.offsets[k]) // d)
            grown = GrownAreas(nodes, skin, X)
            out.append(ObstaclePair(obstacle, nodes, axes=axes, areas=grown))
            continue
        skins, meshes = [], []
        for side in (contact.slave, *contact.masters):
            k, name = locate(model.bodies, side)
            facets = model.bodies[k].mesh.surface(name)
            skins.append(Skin.of(facets, int(linear.offsets[k]) // d))
            meshes.append((model.bodies[k].mesh, name))
        names = (contact.slave, ", ".join(contact.masters))
        # a given bound follows the area that is faced, whatever the pressure
        fades = not contact.tied and contact.tresca is None
        areas = areas_around(skins[0], nodes, X) if fades else None
        whole = own.rows.weights
        bent = ridges(skins[0], nodes, X) if fades else None
        bent = None if bent is None or not bent.any() else bent
        if len(meshes) == 2 and is_itself(*meshes[0], *meshes[1]):
            pair = folded(nodes, skins[0], is_free[nodes], X, names)
            out.append(replace(pair, axes=axes, areas=areas, whole=whole, ridges=bent))
            continue
        master = Skin.joined(skins[1:])
        pair = MortarPair(nodes, skins[0], master, is_free[nodes], names, axes=axes)
        if not contact.tied:
            out.append(replace(pair, areas=areas, whole=whole, ridges=bent))
            continue
        blocks = sparse.bsr_array(linear.stored_stiffness, blocksize=(d, d))
        beside = (np.ones(len(blocks.indices)), blocks.indices, blocks.indptr)
        out.append(TiedPair.of(pair, X, sparse.csr_array(beside, shape=(len(X), len(X)))))
    return out


def areas_around(skin: Skin, nodes: Index, X: Array) -> Array:
    """Areas of facets around nodes (nc,), equal parts to corners, at positions X (n, d)."""
    share = np.linalg.norm(skin.areas(X), axis=1) / skin.corners
    share = share[:, None] * skin.real
    found = np.bincount(skin.nodes.ravel(), share.ravel(), minlength=len(X))
    return np.asarray(found[nodes], dtype=np.float64)


def _axes(placed: Placed, linear: Discretisation) -> sparse.csr_array | None:
    """c of `contact.surface_axes` by the nodes of the model, (2 nc, nodes); None for none."""
    if placed.axes is None:
        return None
    rows = placed.axes.rows.tocoo()
    d = placed.axes.frames.shape[1]
    columns = rows.coords[1] + int(linear.offsets[placed.body]) // d
    shape = (rows.shape[0], linear.dofs // d)
    return sparse.coo_array((rows.data, (rows.coords[0], columns)), shape=shape).tocsr()


def cleared(
    model: Model, pairs: list[Pair], linear: Discretisation, X: Array
) -> list[Pair]:
    """The pairs with the gaps at X that contacts are said to have, where nodes meet there."""
    out = []
    for contact, pair, placed in zip(
        model.contacts or [None], pairs, linear.placed or [None], strict=True
    ):
        if contact is not None and placed is not None and contact.clearance is not None:
            found = pair.at(X)
            offset = np.where(found.met, placed.rows.gap - found.gap, 0.0)
            pair = replace(pair, offset=offset)  # type: ignore[type-var]  # noqa: PLW2901
        out.append(pair)
    return out


def free_dofs(linear: Discretisation) -> NDArray[np.bool_]:
    """Dofs (dofs,) that no support holds."""
    out = np.zeros(linear.dofs, dtype=bool)
    out[linear.free] = True
    return out


def resistance(pairs: Sequence[Pair], K: sparse.csr_array, at: Index) -> Array:
    """Stiffness of every contact, (nc,): of its node, in series with a node of the master.

    Of the softer body where they differ: with more, slips of a stiff slave change sign in
    every Newton step.
    """
    own, d, start = _stiffness_at(K, at), at.shape[1], 0
    for pair in pairs:
        mine = slice(start, start + len(pair.slaves))
        start = mine.stop
        mortar = between_bodies(pair)
        if mortar is not None:
            nodes = (mortar.master if mortar.fold is None else mortar.fold.skin).all
            other = np.median(_stiffness_at(K, nodes[:, None] * d + np.arange(d)))
            own[mine] = own[mine] * other / (own[mine] + other)
    return own


def _stiffness_at(K: sparse.csr_array, at: Index) -> Array:
    """Least stiffness of every contact's node with all others held, (nc,), at rest."""
    nc, d = at.shape
    part = K.tocsr()[at.ravel()][:, at.ravel()].tobsr((d, d))
    own = part.indices == np.repeat(np.arange(nc), np.diff(part.indptr))
    return 1.0 / np.linalg.norm(np.linalg.inv(part.data[own]), 2, axis=(1, 2))
