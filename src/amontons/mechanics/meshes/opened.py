"""A mesh opened along a plane through it: two surfaces where cells were joined before."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ...core.arrays import finite
from ...core.errors import InvalidInput
from .cells import FACET_KIND
from .facets import Cells, Facets, sides
from .mesh import Mesh, unknown

Array = NDArray[np.float64]
Index = NDArray[np.int64]
Mask = NDArray[np.bool_]
ON_PLANE = 1e-6  # distance of nodes from the plane, relative to the mesh, that is none


def opened(
    mesh: Mesh, name: str, point: Sequence[float], normal: Sequence[float],
    region: str | None = None,
) -> Mesh:  # fmt: skip
    """The mesh with the surfaces "NAME-below" and "NAME-above" where a plane cuts it.

    The plane goes through `point`, `normal` leads from below to above; it must follow facets of
    the cells, of those of one region if it is named.  Nodes on it are doubled, the cells above
    take the new ones, and a node set has both.  Raises InvalidInput where it cuts cells.
    """
    at, way = finite("point", point, 1), finite("normal", normal, 1)
    if at.shape != (mesh.dim,) or way.shape != (mesh.dim,) or not way.any():
        raise InvalidInput(
            f"expected a point and a normal of {mesh.dim} numbers, got {at.tolist()} and "
            f"{way.tolist()}"
        )
    if region is not None and region not in mesh.regions:
        raise InvalidInput(unknown("region", region, mesh.regions), ("region",))
    distance = (mesh.points - at) @ (way / np.linalg.norm(way))
    size = float(np.ptp(mesh.points, axis=0).max())
    both = _shared(mesh, distance, region)
    off = np.flatnonzero(both & (np.abs(distance) > ON_PLANE * size))
    if off.size:
        raise InvalidInput(
            f"opened {name!r}: the plane cuts cells, as at the node "
            f"{mesh.points[off[0]].tolist()}, {distance[off[0]]:.3g} from it; it must follow "
            "facets of the mesh", ("point",), "",
        )  # fmt: skip
    if not both.any():
        raise InvalidInput(
            f"opened {name!r}: no cells lie on both sides of the plane", ("point",), ""
        )
    return _doubled(mesh, name, both, distance)


def _is_above(mesh: Mesh, block: Cells, distance: Array) -> Mask:
    return distance[block.nodes].mean(axis=1) > 0


def _shared(mesh: Mesh, distance: Array, region: str | None) -> Mask:
    """Nodes of cells above and of cells below."""
    above, below = (np.zeros(len(mesh.points), dtype=bool) for _ in range(2))
    for block in mesh.cells:
        if region in (None, block.region):
            up = _is_above(mesh, block, distance)
            above[block.nodes[up]] = True
            below[block.nodes[~up]] = True
    return above & below


def _doubled(mesh: Mesh, name: str, both: Mask, distance: Array) -> Mesh:
    old = np.flatnonzero(both)
    new = np.arange(len(mesh.points))
    new[old] = len(mesh.points) + np.arange(len(old))
    up = [_is_above(mesh, block, distance) for block in mesh.cells]
    parts = list(zip(mesh.cells, up, strict=True))
    cells = tuple(
        Cells(block.kind, np.where(is_up[:, None], new[block.nodes], block.nodes), block.region)
        for block, is_up in parts
    )
    upper, lower = (
        sides(tuple(Cells(b.kind, b.nodes[u if want else ~u], b.region) for b, u in parts))
        for want in (True, False)
    )
    surfaces = {
        key: tuple(
            Facets(f.kind, np.where(_moves(f.nodes, upper, lower), new[f.nodes].T, f.nodes.T).T)
            for f in facets
        )
        for key, facets in mesh.surfaces.items()
    }
    section = []
    for count, table in lower.items():
        cut = table[_within(table, upper.get(count)) & both[table].all(axis=1)]
        if len(cut):
            section.append(Facets(FACET_KIND[mesh.dim, count], cut))
    surfaces[f"{name}-below"] = tuple(section)
    surfaces[f"{name}-above"] = tuple(Facets(f.kind, new[f.nodes]) for f in section)
    sets = {
        key: np.concatenate([nodes, new[nodes[both[nodes]]]])
        for key, nodes in mesh.node_sets.items()
    }
    points = np.concatenate([mesh.points, mesh.points[old]])
    return Mesh(points, cells, surfaces, name=mesh.name, node_sets=sets)


def _moves(table: Index, upper: dict[int, Index], lower: dict[int, Index]) -> Mask:
    """Facets of the cells above alone."""
    count = table.shape[1]
    return _within(table, upper.get(count)) & ~_within(table, lower.get(count))


def _within(table: Index, known: Index | None) -> Mask:
    """Which rows have the nodes of a row of another table."""
    if known is None or not len(known):
        return np.zeros(len(table), dtype=bool)
    rows = np.concatenate([np.sort(known, axis=1), np.sort(table, axis=1)])
    _, label = np.unique(rows, axis=0, return_inverse=True)
    label = label.ravel()
    return np.isin(label[len(known) :], label[: len(known)])
