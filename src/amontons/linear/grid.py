"""The stiffness of a box of equal hexahedra without a matrix: 27 stencils of 3x3x3 blocks.

All nodes of the grid are there, x fastest; components that supports hold are idle and stay
zero.  A product takes the memory traffic of the vectors alone.  The smoother is Chebyshev's
polynomial of degree two in D^-1 A, D the diagonal blocks.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, ClassVar

import numpy as np
from numpy.typing import NDArray

from ..core.threads import FINER, over_rows, shared, split
from .grid_kernels import product_of_lines, scaled, smoothed_lines
from .node_blocks import NodeBlocks, block_inverse

if TYPE_CHECKING:
    from .transfer import Transfer

Array = NDArray[np.float64]
Index = NDArray[np.int64]
# (z, y, x) of the nodes of a cell
CORNERS = ((0, 0, 0), (0, 0, 1), (0, 1, 1), (0, 1, 0),
           (1, 0, 0), (1, 0, 1), (1, 1, 1), (1, 1, 0))  # fmt: skip
SMOOTHED = 0.25  # lower end of the smoothed part of the spectrum, relative to its upper end
POWER_STEPS = 12  # for the upper end
SAFETY = 1.05  # on it
UNSTORED_FROM = 16_000  # nodes of a coarse level from which it is not stored: 27 blocks a node


@dataclass(eq=False)
class GridBlocks:
    """cells (nx, ny, nz); element (24, 24): stiffness of one cell, nodes in VTK order.

    used (nodes, 3): 1 for unknowns, 0 for idle components.
    """

    cells: tuple[int, int, int]
    element: Array
    is_stored: ClassVar[bool] = False
    used: NDArray[np.uint8]
    stencils: Array = field(init=False)
    inverses: Array = field(init=False)

    def __post_init__(self) -> None:
        self.stencils = _stencils(self.element)
        diagonal = self.stencils[:, :, :, 1, 1, 1].reshape(27, 3, 3)
        self.inverses = block_inverse(diagonal, np.abs(diagonal).max(axis=(1, 2)))
        self._terms = _terms(self.stencils)

    @property
    def shape(self) -> tuple[int, int, int]:
        """Nodes along z, y and x."""
        nx, ny, nz = self.cells
        return nz + 1, ny + 1, nx + 1

    @property
    def nodes(self) -> int:
        """Number of nodes."""
        return int(np.prod(self.shape))

    @property
    def _lines(self) -> int:
        """Number of lines of nodes along x, the rows that threads share."""
        return self.shape[0] * self.shape[1]

    # ------------------------------------------------------------------ products
    def times(self, x: Array, out: Array) -> None:
        """out = A x, both (nodes, 3), zero at idle components."""
        self._product(x, x, out, False)

    def residual(self, x: Array, b: Array, out: Array) -> None:
        """out = b - A x."""
        self._product(x, b, out, True)

    def _product(self, x: Array, b: Array, out: Array, rest: bool) -> None:
        reach = self.shape[1] + 1  # lines of others that a part reads on either side
        ranges = split(self._lines, 30.0 * self.nodes, least=4 * reach, finer=FINER)
        arguments = self.shape, *self._terms, self.stencils, self.used, x, b, out, rest
        shared(product_of_lines, ranges, arguments)

    def _scale(self, b: Array, out: Array) -> None:
        """out = D^-1 b at the unknowns."""
        over_rows(scaled, self._lines, 10.0 * self.nodes, self.shape, self.inverses, self.used,
                  b, out)  # fmt: skip

    # ------------------------------------------------------------------ smoothing
    def smooth(self, b: Array, x: Array, held: NDArray[np.bool_], backward: bool) -> None:
        """Two Chebyshev steps on A x = b that leave the nodes held as they are."""
        self._smooth(b, x, held, False)

    def first_smooth(self, b: Array, x: Array, r: Array) -> None:
        """The same from x = 0, and r = b - A x."""
        self.smooth_from_zero(b, x, self._free)
        self.residual(x, b, r)

    def smooth_from_zero(self, b: Array, x: Array, held: NDArray[np.bool_]) -> None:
        """`smooth` of x = 0, whatever x is before."""
        self._smooth(b, x, held, True)

    def _smooth(self, b: Array, x: Array, held: NDArray[np.bool_], from_zero: bool) -> None:
        """Both steps in one pass over the vectors, see `smoothed_lines`."""
        _, ny, nx = self.shape
        reach = 2 * (ny + 1)  # lines that both steps of a line reach to either side
        ranges = split(self._lines, 60.0 * self.nodes, least=2 * reach)
        ends = np.array([first for first, _ in ranges[1:]], dtype=np.int64)
        saved = np.empty((len(ends), 2 * reach * nx, 3))
        if not from_zero:
            for end, lines in zip(ends, saved, strict=True):
                first, last = max(end - reach, 0), min(end + reach, self._lines)
                at = (first - end + reach) * nx
                lines[at : at + (last - first) * nx] = x[first * nx : last * nx]
        arguments = (self.shape, *self._terms, self.stencils, self.inverses, self.used, held,
                     x, b, ends, saved, *self._chebyshev, from_zero)  # fmt: skip
        shared(smoothed_lines, ranges, arguments)

    @cached_property
    def _free(self) -> NDArray[np.bool_]:
        return np.zeros(self.nodes, dtype=bool)

    @cached_property
    def _chebyshev(self) -> tuple[float, float, float]:
        """Factors of both steps: d = first D^-1 r, then d = keep d + second D^-1 r."""
        upper = SAFETY * self._largest_eigenvalue()
        lower = SMOOTHED * upper
        theta, delta = 0.5 * (upper + lower), 0.5 * (upper - lower)
        sigma = theta / delta
        rho = 1 / sigma
        new = 1 / (2 * sigma - rho)
        return 1 / theta, new * rho, 2 * new / delta

    def _largest_eigenvalue(self) -> float:
        """Of D^-1 A, on a grid of at most 8 cells each way: it hardly depends on the size."""
        cells = tuple(min(n, 8) for n in self.cells)
        if cells != self.cells:
            count = int(np.prod([n + 1 for n in cells]))
            small = GridBlocks(cells, self.element, np.ones((count, 3), np.uint8))  # type: ignore[arg-type]
            return small._largest_eigenvalue()
        x = np.cos(np.arange(3.0 * self.nodes)).reshape(-1, 3)
        Ax, size = np.empty_like(x), 1.0
        for _ in range(POWER_STEPS):
            self.times(x, Ax)
            self._scale(Ax, x)
            size = float(np.linalg.norm(x))
            x /= size
        return size

    # ------------------------------------------------------------------ parts of the matrix
    def classes(self, node: Index) -> tuple[Index, ...]:
        """0, 1, 2 for low end, inside, high end, along z, y, x of nodes (k,)."""
        place = np.unravel_index(node, self.shape)
        return tuple(
            np.where(p == 0, 0, np.where(p == n - 1, 2, 1))
            for p, n in zip(place, self.shape, strict=True)
        )

    def rows(self, node: Index) -> NodeBlocks:
        """The block rows of some nodes, (k,), as the rows of a matrix; inverse: of A_pp."""
        z, y, x = np.unravel_index(node, self.shape)
        whole = self.stencils[self.classes(node)].reshape(len(node), 27, 3, 3)
        offsets = np.stack(np.meshgrid(*[[-1, 0, 1]] * 3, indexing="ij"), -1).reshape(27, 3)
        there = np.stack([z, y, x], axis=1)[:, None] + offsets
        inside = ((there >= 0) & (there < self.shape)).all(axis=2)
        there = there[inside]
        indices = np.asarray(np.ravel_multi_index(tuple(there.T), self.shape), dtype=np.int64)
        indptr = np.concatenate([[0], np.cumsum(inside.sum(axis=1))])
        data = np.ascontiguousarray(whole[inside])
        owner = np.repeat(node, np.diff(indptr))
        used = self.used.astype(bool)
        data[~used[owner]] = 0.0
        data.swapaxes(1, 2)[~used[indices]] = 0.0
        own = np.flatnonzero(owner == indices)
        k, a = np.nonzero(~used[node])
        data[own[k], a, a] = 1.0
        size = np.abs(data[own]).max(axis=(1, 2))
        inverse = block_inverse(data[own], size)
        return NodeBlocks(indptr.astype(np.int32), indices.astype(np.int32), data, inverse)

    def coarse(self, P: Transfer) -> GridBlocks | NodeBlocks:
        """The matrix on the grid of half as many cells: that of cells of twice the size."""
        cells = tuple(n // 2 for n in self.cells)
        grid = GridBlocks(cells, 2.0 * self.element, P.coarse_used)  # type: ignore[arg-type]
        return grid if grid.nodes >= UNSTORED_FROM else grid.stored()

    def stored(self) -> NodeBlocks:
        """The whole matrix: 27 blocks a node."""
        return self.rows(np.arange(self.nodes))

    @property
    def is_positive(self) -> bool:
        """True where a node has a stiffness in all directions."""
        return bool((np.einsum("zyxaa->zyxa", self.stencils[:, :, :, 1, 1, 1]) > 0).all())


def _stencils(element: Array) -> Array:
    """[class z, y, x][offset z, y, x][a, b]: the row of a node at an end or inside."""
    blocks = element.reshape(8, 3, 8, 3).swapaxes(1, 2)
    out = np.zeros((3,) * 6 + (3, 3))
    for kind in np.ndindex(3, 3, 3):
        for a, corner in enumerate(CORNERS):
            # the node is corner a of this cell: the cell must not lie outside
            if any(
                (k == 0 and c == 1) or (k == 2 and c == 0)
                for k, c in zip(kind, corner, strict=True)
            ):
                continue
            for b, other in enumerate(CORNERS):
                at = tuple(o - c + 1 for o, c in zip(other, corner, strict=True))
                out[kind][at] += blocks[a, b]
    return out


def _terms(stencils: Array) -> tuple[Array, Index, Index]:
    """Coefficients of inner nodes by (class z, y) and row: value, line, shift; in fours.

    values (9, 3, t), lines (9, 3, t): 3 * (3 dz + dy) + component, shifts (9, 3, t): dx.
    """
    parts = []
    for kind in np.ndindex(3, 3):
        for a in range(3):
            row = stencils[kind][1][..., a, :]  # [dz, dy, dx, b]
            at = np.argwhere(np.abs(row) > 1e-14 * np.abs(row).max())
            value = row[tuple(at.T)]
            parts.append((value, (3 * at[:, 0] + at[:, 1]) * 3 + at[:, 3], at[:, 2] - 1))
    size = max(len(v) for v, _, _ in parts)
    size += -size % 4
    out = [np.zeros((27, size)), np.zeros((27, size), int), np.zeros((27, size), int)]
    for k, part in enumerate(parts):
        for array, values in zip(out, part, strict=True):
            array[k, : len(values)] = values
    shape = (9, 3, size)
    return tuple(array.reshape(shape) for array in out)  # type: ignore[return-value]
