"""Structured boxes: hexahedra, tetrahedra, quadrilaterals, triangles."""

from __future__ import annotations

from collections.abc import Sequence
from functools import reduce
from itertools import permutations

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ...core.arrays import WHOLE, real
from ...core.errors import InvalidInput, shown
from ...core.words import helpful
from .cells import FACET_KIND
from .check import MIRROR
from .facets import Cells, Facets, sides
from .mesh import Mesh

Array = NDArray[np.float64]
Index = NDArray[np.int64]
KINDS = {2: ("quad", "tri"), 3: ("hex", "tet")}
STRETCHED = 2.0  # from this ratio to the shortest one, a side of a cell is not doubled
SIDES = {2: (("left", "right"), ("bottom", "top")),
         3: (("left", "right"), ("front", "back"), ("bottom", "top"))}  # fmt: skip


@helpful
def box(
    size: Sequence[float],
    cells: int | Sequence[int],
    kind: str | None = None,
    *,
    origin: Sequence[float] | None = None,
) -> Mesh:
    """A rectangle or cuboid of `size` (2 or 3 lengths) with its lowest corner at `origin`.

    cells: number per direction, one for all or one each.  kind: "hex" or "tet", in 2D "quad" or
    "tri" (the first is the default).  Surfaces left/right (x), front/back (y), bottom/top (z);
    in 2D left/right (x), bottom/top (y).  Region "default".  While numbers of cells are even,
    the box of half as many is a coarser level, see `Mesh`: in all directions for cells of equal
    sides, in those of the shorter sides alone where cells are stretched.

    >>> box((1, 1, 1), cells=2).points.shape
    (27, 3)
    """
    lengths, counts, kind = _checked(size, cells, kind)
    dim = len(lengths)
    start = np.zeros(dim) if origin is None else real("origin", origin)
    if start.shape != (dim,) or not np.isfinite(start).all():
        raise InvalidInput(f"origin: expected {dim} finite numbers, got {origin!r}")
    axes = [np.linspace(0, 1, n + 1) for n in counts]
    unit = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
    unit = unit.transpose(*range(dim - 1, -1, -1), dim).reshape(-1, dim)  # x runs fastest
    cube = _cubes(counts)
    nodes = cube if kind in ("hex", "quad") else _simplices(cube, kind)
    block = Cells(kind, nodes)
    surfaces = _sides(unit, block, dim)
    levels = _levels(counts, lengths, kind)
    return Mesh(start + unit * lengths, (block,), surfaces, grid=counts, levels=levels)


def _checked(
    size: Sequence[float], cells: int | Sequence[int], kind: str | None
) -> tuple[Array, tuple[int, ...], str]:
    lengths = real("size", size)
    if lengths.shape not in ((2,), (3,)) or not (np.isfinite(lengths) & (lengths > 0)).all():
        raise InvalidInput(f"size: expected 2 or 3 lengths > 0, got {size!r}")
    dim = len(lengths)
    counts = real("cells", cells)
    counts = np.broadcast_to(counts, dim) if counts.ndim == 0 else counts
    whole = counts.shape == (dim,) and ((counts == np.floor(counts)) & (counts >= 1)).all()
    if not whole or counts.max() > WHOLE:
        raise InvalidInput(
            f"cells: expected one whole number >= 1 or {dim} of them, got {shown(cells)}"
        )
    if np.prod(counts + 1) > np.iinfo(np.int32).max:
        raise InvalidInput(
            f"cells: expected at most {np.iinfo(np.int32).max} nodes, got {cells!r}"
        )
    kind = KINDS[dim][0] if kind is None else kind
    if not isinstance(kind, str) or kind not in KINDS[dim]:
        raise InvalidInput(
            f"kind: expected {' or '.join(KINDS[dim])} for {dim} lengths, got {kind!r}"
        )
    return lengths, tuple(int(c) for c in counts), kind


def _cubes(counts: tuple[int, ...]) -> Index:
    """Nodes of all quadrilaterals or hexahedra in VTK order, (k, 4 or 8)."""
    strides = np.cumprod([1, *(n + 1 for n in counts[:-1])])
    grids = np.meshgrid(*[np.arange(n) for n in counts], indexing="ij")
    first = np.asarray(sum(g.ravel("F") * s for g, s in zip(grids, strides, strict=True)))
    square = np.array([0, strides[0], strides[0] + strides[1], strides[1]])
    corner = square if len(counts) == 2 else np.concatenate([square, square + strides[2]])
    return first[:, None] + corner


def _simplices(cube: Index, kind: str) -> Index:
    """Each cube cut into dim! simplices along its diagonal (conforming between neighbours)."""
    dim = 2 if kind == "tri" else 3
    position = {2: [0, 1, 3, 2], 3: [0, 1, 3, 2, 4, 5, 7, 6]}[dim]  # bits of (x, y, z) -> VTK
    pieces = []
    for order in permutations(range(dim)):
        path = np.cumsum([0, *(1 << axis for axis in order)])
        nodes = [position[p] for p in path]
        odd = np.linalg.det(np.eye(dim)[list(order)]) < 0  # then its image has positive volume
        pieces += [nodes[k] for k in MIRROR[kind]] if odd else nodes
    return np.take(cube, pieces, axis=1).reshape(-1, dim + 1)


def _levels(counts: tuple[int, ...], lengths: Array, kind: str) -> tuple[sparse.csr_array, ...]:
    """Prolongations between boxes of ever fewer cells, finest first."""
    out = []
    while (halved := _halved(counts, lengths)).any():
        low, high = (
            [_neighbour(n, step, half) for n, half in zip(counts, halved, strict=True)][::-1]
            for step in (0, 1)
        )  # x runs fastest: its factor is the last
        if kind in ("hex", "quad"):
            level = _product([0.5 * (a + b) for a, b in zip(low, high, strict=True)])
        else:  # new nodes halve edges, which all run from low to high corners
            level = 0.5 * (_product(low) + _product(high))
        out.append(_small(sparse.csr_array(level)))
        counts = tuple(n // 2 if half else n for n, half in zip(counts, halved, strict=True))
    return tuple(out)


def _small(level: sparse.csr_array) -> sparse.csr_array:
    """The same with indices of 4 bytes."""
    indices, indptr = level.indices.astype(np.int32), level.indptr.astype(np.int32)
    return sparse.csr_array((level.data, indices, indptr), shape=level.shape)


def _halved(counts: tuple[int, ...], lengths: Array) -> NDArray[np.bool_]:
    """Directions to coarsen: point smoothers leave rough what long sides couple weakly."""
    sides = lengths / counts
    return (np.array(counts) % 2 == 0) & (sides < STRETCHED * sides.min())


def _neighbour(cells: int, step: int, halved: bool) -> sparse.csr_array:
    """On a line: the coarse node below (step 0) or above (1) every fine node."""
    fine = np.arange(cells + 1)
    coarse = (fine + step) // 2 if halved else fine
    entries = (np.ones(cells + 1), (fine, coarse))
    return sparse.coo_array(entries, shape=(cells + 1, coarse[-1] + 1)).tocsr()


def _product(factors: list[sparse.csr_array]) -> sparse.csr_array:
    return reduce(lambda a, b: sparse.csr_array(sparse.kron(a, b, format="csr")), factors)


def _sides(unit: Array, block: Cells, dim: int) -> dict[str, tuple[Facets, ...]]:
    """Facets of the six (four) sides by name; Mesh turns them outwards."""
    on_side = (unit == 0) | (unit == 1)
    ((size, table),) = sides((block,), on_side.any(axis=1)).items()
    out = {}
    for axis, names in enumerate(SIDES[dim]):
        for value, name in zip((0.0, 1.0), names, strict=True):
            on = (unit[table, axis] == value).all(axis=1)
            out[name] = (Facets(FACET_KIND[dim, size], table[on]),)
    return out
