"""Meshes as plain arrays: points, cells by region, outward facets of named surfaces."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from copy import copy
from dataclasses import MISSING, dataclass, field, fields, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ...core.arrays import LARGEST, integers, read_only, real, squarable
from ...core.errors import InvalidInput, shown
from ...core.locks import KeepsLocks
from ...core.words import near
from ...linear.levels import checked_levels
from .cells import CELLS
from .check import check_half_section, check_integration, check_repeated, checked_cells
from .facets import Cells, Facets, boundary, oriented

Array = NDArray[np.float64]
Index = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Mesh(KeepsLocks):
    """A mesh in 2D or 3D, of first order or, see `second_order`, of second order.

    points (n, dim), unit of length; cells: blocks by kind and region; surfaces: name -> facets.
    Every point belongs to a cell; inverted cells are turned, degenerate and repeated ones
    rejected.
    grid: cells per direction if the mesh is a structured box (multigrid makes use of it).
    levels: prolongations of nodal values, finest first: levels[0] has shape (n, nodes of the
    next coarser mesh), levels[1] leads from the one after that to it, and so on; every coarse
    node is a node of this mesh.  `box`, `refined` and `second_order` fill them.
    node_sets: name -> numbers of points, which may be held and loaded as surfaces are.
    axisymmetric: the points are (r, z) with r >= 0, one half of the section of a body of
    revolution about r = 0; all integrals go around it once, see `turned`.
    """

    points: Array
    cells: tuple[Cells, ...]
    surfaces: dict[str, tuple[Facets, ...]] = field(default_factory=dict)
    grid: tuple[int, ...] | None = None
    name: str = ""
    levels: tuple[sparse.csr_array, ...] = ()
    node_sets: dict[str, Index] = field(default_factory=dict)
    axisymmetric: bool = False

    def __post_init__(self) -> None:
        points = real("points", self.points)
        if points.ndim != 2 or points.shape[1] not in (2, 3):
            raise InvalidInput(f"points: expected shape (n, 2) or (n, 3), got {points.shape}")
        largest = LARGEST ** (1 / (points.shape[1] - 1))  # areas are squared in 3D
        object.__setattr__(self, "points", squarable("points", points, largest))
        _check_parts("cells", self.cells, Cells)
        if not isinstance(self.surfaces, Mapping):
            raise InvalidInput(f"surfaces: expected name -> facets, got {shown(self.surfaces)}")
        for name, facets in self.surfaces.items():
            _check_parts(f"surface {name!r}", facets, Facets)
        blocks = tuple(
            replace(b, nodes=checked_cells(points, b.kind, b.nodes, b.region))
            for b in self.cells
            if len(b.nodes)
        )
        object.__setattr__(self, "cells", blocks)
        self._check_use()
        check_repeated(points, blocks)
        for block in blocks:
            check_integration(block)
        if self.axisymmetric:
            check_half_section(self.points)
        object.__setattr__(self, "surfaces", oriented(blocks, self.surfaces, points))
        object.__setattr__(self, "levels", checked_levels(self.levels, len(points)))
        object.__setattr__(self, "node_sets", self._checked_sets())

    @classmethod
    def of_checked(cls, points: Array, cells: tuple[Cells, ...], *, axisymmetric: bool) -> Mesh:
        """A mesh without names, of cells of another one: what was checked there is not again.

        points: those that cells have, no others; both are locked.
        """
        out = cls.__new__(cls)
        for each in fields(cls):
            made = each.default_factory
            value = each.default if made is MISSING else made()
            object.__setattr__(out, each.name, value)
        for name, value in (("points", read_only(points)), ("cells", cells),
                            ("axisymmetric", axisymmetric)):  # fmt: skip
            object.__setattr__(out, name, value)
        return out

    def _check_use(self) -> None:
        if not self.cells:
            raise InvalidInput(f"mesh: expected cells of dimension {self.dim}, got none")
        used = np.zeros(len(self.points), dtype=bool)
        second = np.zeros(len(self.points), dtype=bool)
        for block in self.cells:
            (second if CELLS[block.kind].order == 2 else used)[block.nodes] = True
        if len(both := np.flatnonzero(used & second)):
            raise InvalidInput(
                f"points[{int(both[0])}]: belongs to cells of first and of second order, which "
                f"would part between their corners; {len(both)} such points; expected parts "
                "of different order to share none, and to be tied or in contact"
            )
        used |= second
        if not used.all():
            raise InvalidInput(
                f"points[{int(np.flatnonzero(~used)[0])}]: belongs to no cell; "
                f"{int((~used).sum())} such points, leave them out and renumber"
            )

    def _checked_sets(self) -> dict[str, Index]:
        """Sorted numbers, once each; raises InvalidInput for those of no point."""
        found = {}
        for name, nodes in self.node_sets.items():
            if name in self.surfaces:
                raise InvalidInput(f"node set {name!r}: a surface has this name too")
            numbers = integers(f"node set {name!r}", nodes).ravel()
            if numbers.size and not 0 <= numbers.min() <= numbers.max() < len(self.points):
                wrong = numbers.min() if numbers.min() < 0 else numbers.max()
                raise InvalidInput(
                    f"node set {name!r}: expected numbers from 0 to {len(self.points) - 1}, "
                    f"got {wrong}"
                )
            found[name] = read_only(np.unique(numbers))
        return found

    def __repr__(self) -> str:
        kinds = ", ".join(f"{len(b.nodes)} {b.kind}" for b in self.cells)
        return (
            f"Mesh({self.dim}D, {len(self.points)} points, {kinds}; regions "
            f"{', '.join(self.regions)}; surfaces {', '.join(self.surfaces) or 'none'})"
        )

    @property
    def dim(self) -> int:
        """2 or 3."""
        return self.points.shape[1]

    @property
    def order(self) -> int:
        """1, or 2 where cells have nodes also in the middle of edges; the larger of parts."""
        return max(CELLS[block.kind].order for block in self.cells)

    @property
    def regions(self) -> tuple[str, ...]:
        """Names of the regions in order of appearance."""
        return tuple(dict.fromkeys(block.region for block in self.cells))

    @property
    def cell_count(self) -> int:
        """Number of cells of all kinds."""
        return sum(len(block.nodes) for block in self.cells)

    def surface(self, name: str) -> tuple[Facets, ...]:
        """Facets of a named surface; a wrong name lists the known ones and the nearest."""
        if name not in self.surfaces:
            raise InvalidInput(unknown("surface", name, self.surfaces))
        facets = self.surfaces[name]
        if not sum(len(block.nodes) for block in facets):
            raise InvalidInput(f"surface {name!r}: holds no facets")
        return facets

    @cached_property
    def boundary(self) -> tuple[Facets, ...]:
        """All facets that belong to one cell only."""
        return boundary(self.cells)

    def surface_nodes(self, name: str) -> Index:
        """Sorted node numbers of a surface, or of a node set, (k,)."""
        if name in self.node_sets:
            return self.node_sets[name]
        return np.unique(np.concatenate([b.nodes.ravel() for b in self.surface(name)]))

    def turned(self) -> Mesh:
        """The same mesh as half of the section of a body of revolution, see `axisymmetric`.

        Raises InvalidInput in 3D, and for points with r < 0.
        """
        if self.axisymmetric:
            return self
        check_half_section(self.points)
        other = copy(self)
        object.__setattr__(other, "axisymmetric", True)
        return other

    def with_surfaces(self, more: Mapping[str, tuple[Facets, ...]]) -> Mesh:
        """The same mesh with more named surfaces, of facets of its `boundary`.

        Raises InvalidInput for a name that is taken.
        """
        for name in more:
            if name in self.surfaces or name in self.node_sets:
                raise InvalidInput(f"surface {name!r}: is there already")
        other = copy(self)
        object.__setattr__(other, "surfaces", {**self.surfaces, **more})
        return other

    def bounding_box(self) -> tuple[Array, Array]:
        """Smallest and largest coordinates, each (dim,)."""
        return self.points.min(axis=0), self.points.max(axis=0)


def _check_parts(name: str, parts: object, kind: type) -> None:
    """Raise InvalidInput for what is no sequence of blocks with tables of nodes."""
    if not isinstance(parts, Sequence) or not all(isinstance(b, kind) for b in parts):
        raise InvalidInput(f"{name}: expected blocks of {kind.__name__}, got {shown(parts)}")
    for block in parts:
        table = block.nodes
        if not isinstance(table, Sequence | np.ndarray) or not getattr(table, "ndim", 1):
            raise InvalidInput(f"{name}: expected a table of nodes, got {shown(block.nodes)}")


def unknown(what: str, name: object, known: object) -> str:
    """A message for a name that does not exist: lists the known ones and the nearest."""
    names = [str(k) for k in known]  # type: ignore[attr-defined]
    if not names:
        return f"{what} {name!r}: not found, there are no named {what}s"
    meant = near(name, names)
    hint = f"; did you mean {meant!r}?" if meant else ""
    return f"{what} {name!r}: not found, known: {', '.join(sorted(names))}{hint}"
