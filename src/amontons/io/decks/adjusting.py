"""Slave nodes of a deck put onto their masters, and those that are tied."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ...core.errors import InvalidInput
from ...mechanics.contact import pair_contact
from ...mechanics.contact.pairs import project
from ...mechanics.meshes import Mesh
from ...mechanics.meshes.facets import linear_parts
from ...mechanics.meshes.surfaces import nodal_normals
from .contacts import Pair
from .scopes import Index
from .tools import faced

Array = NDArray[np.float64]
ROUNDING = 1e-12  # of the coordinates: distances below are none


def adjusted(mesh: Mesh, at: Index, pairs: Sequence[Pair], notes: list[str]) -> Mesh:
    """The mesh with slave nodes put onto their master where a pair asks for it.

    at: number in the mesh of each node of the deck.  Also tells pairs of nodes where these are.
    """
    points = np.array(mesh.points)
    for pair in pairs:
        if pair.tool is not None:
            pair.tool = faced(pair.tool, mesh, pair.slave)
        if pair.adjust is None:
            continue
        try:
            nodes, gap, normals = _distances(replace(mesh, points=points), pair)
        except InvalidInput as reason:
            raise pair.card.error(str(reason)) from reason
        if isinstance(pair.adjust, float):
            chosen = gap <= pair.adjust
        else:
            chosen = np.isin(nodes, at[pair.adjust])
        chosen &= gap != 0.0
        way = gap[chosen]
        points[nodes[chosen]] -= way[:, None] * normals[chosen]
        if len(way):
            notes.append(
                f"{pair.card} (line {pair.card.number}): {len(way)} slave nodes are put onto "
                f"the master, at most {np.abs(way).max():.3g} away"
            )
    if not np.array_equal(points, mesh.points):
        try:
            mesh = replace(mesh, points=points)
        except InvalidInput as reason:
            card = next(pair.card for pair in pairs if pair.adjust is not None)
            raise card.error(f"slave nodes put onto the master: {reason}") from reason
    for pair in pairs:
        if pair.nodes is not None:
            pair.points = mesh.points[at[pair.nodes]]
        if pair.within is not None:
            _glue(pair, mesh)
    return mesh


def _glue(pair: Pair, mesh: Mesh) -> None:
    """Choose the nodes of a tie that are near enough; raises FileFormatError for none."""
    nodes, gap, _ = _distances(mesh, pair)
    near = np.abs(gap) <= pair.within
    if not near.any():
        raise pair.card.error(
            f"no node of {pair.slave} is within {pair.within:.3g} of {pair.master}; give a "
            "POSITION TOLERANCE"
        )
    pair.glued = mesh.points[nodes[near]] if pair.points is None else pair.points


def _distances(mesh: Mesh, pair: Pair) -> tuple[Index, Array, Array]:
    """Slave nodes (k,) with a master in front of them, distances (k,) and normals (k, d)."""
    if pair.tool is not None:
        nodes = mesh.surface_nodes(pair.slave)
        x = mesh.points[nodes]
        return nodes, pair.tool.gap(x), pair.tool.normals(x)
    if mesh.order == 1 and pair.within is None:
        rows, _, _ = pair_contact(mesh, pair.slave, mesh, pair.master)
        return rows.nodes, rows.gap, rows.frames[:, 0]
    slave, master = (linear_parts(mesh.surface(name)) for name in (pair.slave, pair.master))
    nodes = np.unique(np.concatenate([block.nodes.ravel() for block in slave]))
    normals, x = nodal_normals(mesh.points, slave)[nodes], mesh.points[nodes]
    hit = project(x, mesh.points, master, facing=normals, own=nodes)
    if pair.within is not None and not hit.found.any():  # ties of sides that look one way
        hit = project(x, mesh.points, master, own=nodes)
    at = np.flatnonzero(hit.found)
    gap = np.einsum("kc,kc->k", x[at] - hit.closest[at], hit.normal[at])
    gap[np.abs(gap) < ROUNDING * np.abs(mesh.points).max()] = 0.0
    return nodes[at], gap, hit.normal[at]
