"""Checks of cells at the border: shapes, node numbers, orientation, degenerate cells."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...core.arrays import integers, read_only
from ...core.compiled import njit
from ...core.errors import InvalidInput
from .cells import CELLS, FIRST, ReferenceCell

if TYPE_CHECKING:
    from .facets import Cells

Array = NDArray[np.float64]
Index = NDArray[np.int64]
STRAIGHT = 1e-9  # distance from the middle, relative to the largest cell
AT_ONCE = 100_000  # cells whose coordinates are gathered
FLAT = 1e-10  # det / (longest edge)^dim below which a cell counts as degenerate
# node order of the mirrored cell
MIRROR = {
    "tri": [0, 2, 1],
    "quad": [0, 3, 2, 1],
    "tet": [0, 2, 1, 3],
    "hex": [0, 3, 2, 1, 4, 7, 6, 5],
    "wedge": [0, 2, 1, 3, 5, 4],
    "pyramid": [0, 3, 2, 1, 4],
}
for _kind in ("tri6", "quad9", "tet10", "hex27", "quad8", "hex20", "wedge15"):
    _corners, _parents = MIRROR[FIRST[_kind]], [set(p) for p in CELLS[_kind].parents]
    MIRROR[_kind] = _corners + [
        len(_corners) + _parents.index({_corners[k] for k in p}) for p in _parents
    ]


def checked_cells(points: Array, kind: str, nodes: ArrayLike, region: str) -> Index:
    """Read-only node numbers (k, nodes), every cell positive; raises InvalidInput otherwise.

    A cell negative at all its corners is mirrored; one that changes sign is not valid.
    """
    if kind not in CELLS or CELLS[kind].dim != points.shape[1]:
        fitting = [c.kind for c in CELLS.values() if c.dim == points.shape[1]]
        raise InvalidInput(f"cells: expected one of {', '.join(fitting)}, got {kind!r}")
    cell = CELLS[kind]
    table = integers(f"{kind} cells", nodes)
    if table.ndim != 2 or table.shape[1] != cell.nodes:
        raise InvalidInput(f"{kind} cells: expected shape (k, {cell.nodes}), got {table.shape}")
    if table.min() < 0 or table.max() >= len(points):
        raise InvalidInput(
            f"{kind} cells: expected node numbers 0..{len(points) - 1}, "
            f"got {table.min()}..{table.max()}"
        )
    if kind == "tet" and len(table) > AT_ONCE:  # as below, without its arrays
        low = high = tet_determinants(points, table)
    else:
        found = [_determinants(cell, points[part]) for part in parts_of(table)]
        low, high = (np.concatenate(each) for each in zip(*found, strict=True))
    turned = high < -FLAT
    table[turned] = table[np.flatnonzero(turned)[:, None], MIRROR[kind]]
    if turned.any() and not turned.all():
        _check_neighbours(cell, table, turned, points, region)
    bad = np.flatnonzero(~turned & (low <= FLAT))
    if bad.size:
        raise InvalidInput(
            _complaint(kind, region, table[bad[0]], points, int(bad.size), float(low[bad[0]]))
        )
    return read_only(table)


def _check_neighbours(
    cell: ReferenceCell, table: Index, turned: NDArray[np.bool_], points: Array, region: str
) -> None:
    """Raise InvalidInput where mirrored cells lie on the same side of a facet as another one.

    Files may number cells either way round; but of one whose node has moved through its
    opposite side the mirror image overlaps the neighbours, and goes round facets as they do.
    """
    sides = CELLS[FIRST.get(cell.kind, cell.kind)].facets
    rng = np.random.default_rng(0)
    marks = rng.integers(2**63, size=(2, len(points)), dtype=np.uint64)
    # one number for each way round a facet, modulo 2^64: in ascending order these take a sixth
    # of the memory of the facets themselves
    way = np.concatenate([_way_round(marks, table, side) for side in sides])
    ascending = np.sort(way)
    same = np.unique(ascending[1:][ascending[1:] == ascending[:-1]])
    both = np.flatnonzero(np.isin(way, same)) % len(table) if same.size else same
    bad = np.unique(both[turned[both.astype(np.intp)]])
    if bad.size:
        centre = ", ".join(f"{c:.4g}" for c in points[table[bad[0]]].mean(axis=0))
        raise InvalidInput(
            f"mesh: {cell.kind} cell near ({centre}) in region {region!r} is inside out and "
            f"overlaps its neighbours; {bad.size} such cells, expected none"
        )


def _way_round(
    marks: NDArray[np.uint64], table: Index, side: Sequence[int]
) -> NDArray[np.uint64]:
    """A number for the nodes of a side of each cell in their order, from whichever, (k,)."""
    out = np.zeros(len(table), dtype=np.uint64)
    closed = [*side, side[0]] if len(side) > 2 else side
    for one, other in itertools.pairwise(closed):
        out += marks[0, table[:, one]] * marks[1, table[:, other]]
    return out


def check_repeated(points: Array, blocks: Sequence[Cells]) -> None:
    """Raise InvalidInput when cells have the same nodes: their stiffness would count twice."""
    marks = np.random.default_rng(0).integers(2**63, size=len(points), dtype=np.uint64)
    label = np.concatenate([_sum_of(marks, b.nodes) for b in blocks])
    ascending = np.sort(label)
    if not (ascending[1:] == ascending[:-1]).any():
        return
    order = np.argsort(label, kind="stable")
    same = np.flatnonzero(np.diff(label[order]) == 0)
    starts = np.cumsum([0, *(len(b.nodes) for b in blocks)])

    def nodes_of(cell: int) -> Index:
        k = int(np.searchsorted(starts, cell, side="right")) - 1
        return np.sort(blocks[k].nodes[cell - starts[k]])

    same = [k for k in same if np.array_equal(nodes_of(order[k]), nodes_of(order[k + 1]))]
    if same:
        nodes = nodes_of(order[same[0]])
        centre = ", ".join(f"{c:.4g}" for c in points[nodes].mean(axis=0))
        raise InvalidInput(
            f"mesh: two cells near ({centre}) have the same nodes {nodes.tolist()}; "
            f"{len(same)} such pairs, expected every cell once"
        )


def _sum_of(marks: NDArray[np.uint64], nodes: Index) -> NDArray[np.uint64]:
    """Sums of the marks of nodes (k, m), modulo 2^64, (k,)."""
    out = marks[nodes[:, 0]]
    for column in nodes.T[1:]:
        out += marks[column]
    return out


def check_integration(block: Cells) -> None:
    """Raise InvalidInput for an integration that cells of this kind do not have."""
    known = ["auto", "full", "hybrid"]
    if CELLS[block.kind].reduced is not None:
        known.append("reduced")
    if block.kind in ("quad", "hex"):
        known += ["incompatible", "hybrid-incompatible"]
    if block.integration not in known:
        raise InvalidInput(
            f"{block.kind} cells: integration: expected {' or '.join(known)}, got "
            f"{block.integration!r}"
        )


def around(points: Array, *, axisymmetric: bool) -> Array:
    """Length of the way around the axis at points (…, dim): 2 pi r, (…); else 1."""
    return 2 * np.pi * points[..., 0] if axisymmetric else np.ones(points.shape[:-1])


def check_half_section(points: Array) -> None:
    """Raise InvalidInput for points that are no half section (r, z) of a body of revolution."""
    if points.shape[1] != 2:
        raise InvalidInput("axisymmetric: expected a mesh in 2D, of points (r, z), got 3D")
    least = int(points[:, 0].argmin())
    if points[least, 0] < 0:
        raise InvalidInput(
            "axisymmetric: expected points (r, z) with r >= 0, one half of the section; got "
            f"r = {points[least, 0]:.6g} at points[{least}]"
        )


def is_straight(cell: ReferenceCell, coordinates: Array) -> bool:
    """Whether all nodes between corners (k, nodes, dim) are in the middle."""
    first = cell.corner_count
    size = np.ptp(coordinates, axis=1).max(initial=0.0)
    return all(
        np.abs(coordinates[:, first + k] - coordinates[:, list(parents)].mean(axis=1)).max(
            initial=0.0) <= STRAIGHT * size
        for k, parents in enumerate(cell.parents)
    )  # fmt: skip


def parts_of(table: Index) -> Iterator[Index]:
    """The rows of a table some at a time: coordinates of all at once take much memory."""
    for first in range(0, max(len(table), 1), AT_ONCE):
        yield table[first : first + AT_ONCE]


def _determinants(cell: ReferenceCell, coordinates: Array) -> tuple[Array, Array]:
    """Smallest and largest Jacobian determinant of each cell over h^dim, each (k,)."""
    size = _largest_sides(coordinates)
    scale = np.where(size > 0, size, 1.0) ** cell.dim
    where = cell.gauss[0] if cell.kind == "pyramid" else cell.corners
    if cell.kind in ("tri", "tet"):  # the same everywhere
        where = where[:1]
    if cell.order == 2 and not is_straight(cell, coordinates):
        where = np.concatenate([where, cell.gauss[0]])
    found = (
        determinant(np.tensordot(coordinates, cell.gradient(x), axes=(1, 0))) for x in where
    )
    low = high = next(found)
    for values in found:
        low, high = np.minimum(low, values), np.maximum(high, values)
    return low / scale, high / scale


@njit(cache=True)
def tet_determinants(points: Array, table: Index) -> Array:
    """The same of tetrahedra (k, 4), whose determinants are alike everywhere, (k,)."""
    out = np.empty(len(table))
    edges = np.empty((3, 3))
    for cell in range(len(table)):
        size = 0.0
        for j in range(3):
            first = low = high = points[table[cell, 0], j]
            for k in range(3):
                x = points[table[cell, k + 1], j]
                low, high = min(low, x), max(high, x)
                edges[k, j] = x - first
            size = max(size, high - low)
        a, b, c = edges
        volume = (
            a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2])
            + a[2] * (b[0] * c[1] - b[1] * c[0])
        )  # fmt: skip
        out[cell] = volume / size**3 if size > 0 else volume
    return out


def _largest_sides(coordinates: Array) -> Array:
    """Longest side of the box around each cell, coordinates (k, nodes, dim), (k,).

    Node by node: NumPy's reductions along so few numbers take three times as long.
    """
    low, high = coordinates[:, 0].copy(), coordinates[:, 0].copy()
    for k in range(1, coordinates.shape[1]):
        np.minimum(low, coordinates[:, k], out=low)
        np.maximum(high, coordinates[:, k], out=high)
    return np.maximum.reduce(list((high - low).T))


def determinant(matrices: Array) -> Array:
    """Determinants of (k, 2, 2) or (k, 3, 3), (k,): written out, for speed."""
    a = matrices
    if a.shape[1] == 2:
        return a[:, 0, 0] * a[:, 1, 1] - a[:, 0, 1] * a[:, 1, 0]
    return np.einsum("ki,ki->k", a[:, :, 0], np.cross(a[:, :, 1], a[:, :, 2]))


def _complaint(
    kind: str, region: str, nodes: Index, points: Array, count: int, value: float
) -> str:
    centre = ", ".join(f"{c:.4g}" for c in points[nodes].mean(axis=0))
    what = (
        "degenerate (no volume)" if abs(value) <= FLAT else "folded (its Jacobian changes sign)"
    )
    return (
        f"mesh: {kind} cell near ({centre}) in region {region!r} is {what}; "
        f"{count} such cells, expected none"
    )
