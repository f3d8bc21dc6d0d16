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

from ..core.compiled import njit
from ..core.copies import copy_rows_inplace
from ..core.threads import over_rows
from .node_blocks import NodeBlocks, block_inverse
from .work import Work

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
        self._work = Work(self.nodes)

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
        self._pass(x, x, x, out, 0.0, 0.0, 0, self._free)

    def residual(self, x: Array, b: Array, out: Array) -> None:
        """out = b - A x."""
        self._pass(x, b, x, out, 0.0, 0.0, 1, self._free)

    def _pass(self, x, b, d, out, keep, step, mode, held) -> None:  # noqa: PLR0913
        over_rows(_grid_pass, self._lines, 30.0 * self.nodes, self.shape, *self._terms,
                  self.stencils, self.inverses, self.used, held, x, b, d, out, keep, step,
                  mode)  # fmt: skip

    def _scale(self, b: Array, out: Array, same: Array, factor: float) -> None:
        """out = same = factor D^-1 b at the unknowns."""
        over_rows(_scaled, self._lines, 10.0 * self.nodes, self.shape, self.inverses, self.used,
                  b, out, same, factor)  # fmt: skip

    def rest(self) -> None:
        """Give up the vectors in which this thread works."""
        self._work.rest()

    # ------------------------------------------------------------------ smoothing
    def smooth(self, b: Array, x: Array, held: NDArray[np.bool_], backward: bool) -> None:
        """Two Chebyshev steps on A x = b that leave the nodes held as they are."""
        d, other = self._work.x, self._work.b
        first, keep, second = self._chebyshev
        self._pass(x, b, d, other, 0.0, first, 2, held)
        self._pass(other, b, d, x, keep, second, 2, held)

    def first_smooth(self, b: Array, x: Array, r: Array) -> None:
        """The same from x = 0, and r = b - A x."""
        d, other = self._work.x, self._work.b
        first, keep, second = self._chebyshev
        self._scale(b, d, other, first)
        self._pass(other, b, d, x, keep, second, 2, self._free)
        self.residual(x, b, r)

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
            self._scale(Ax, x, x, 1.0)
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


@njit(cache=True, error_model="numpy", nogil=True)
def _scaled(begin, end, shape, inverses, used, b, out, same, factor):  # noqa: PLR0913
    """out = same = factor D^-1 b at the unknowns of the lines begin to end."""
    nz, ny, nx = shape
    node = begin * nx
    for line in range(begin, end):
        z, y = line // ny, line % ny
        cz = 0 if z == 0 else (2 if z == nz - 1 else 1)
        cy = 0 if y == 0 else (2 if y == ny - 1 else 1)
        for x in range(nx):
            cx = 0 if x == 0 else (2 if x == nx - 1 else 1)
            D = inverses[(cz * 3 + cy) * 3 + cx]
            b0, b1, b2 = b[node, 0], b[node, 1], b[node, 2]
            for a in range(3):
                s = factor * (D[a, 0] * b0 + D[a, 1] * b1 + D[a, 2] * b2) * used[node, a]
                out[node, a], same[node, a] = s, s
            node += 1


@njit(cache=True, error_model="numpy", fastmath={"contract"})
def _line(values, lines, shifts, buffer, acc, width):
    """acc[a, i] = sum of coefficients times shifted lines, inner nodes of one line."""
    for a in range(3):
        target = acc[a]
        target[:] = 0.0
        for t in range(0, values.shape[1], 4):
            v0, v1, v2, v3 = values[a, t], values[a, t + 1], values[a, t + 2], values[a, t + 3]
            o0 = 1 + shifts[a, t]
            o1 = 1 + shifts[a, t + 1]
            o2 = 1 + shifts[a, t + 2]
            o3 = 1 + shifts[a, t + 3]
            x0 = buffer[lines[a, t], o0 : o0 + width]
            x1 = buffer[lines[a, t + 1], o1 : o1 + width]
            x2 = buffer[lines[a, t + 2], o2 : o2 + width]
            x3 = buffer[lines[a, t + 3], o3 : o3 + width]
            for i in range(width):
                target[i] += v0 * x0[i] + v1 * x1[i] + v2 * x2[i] + v3 * x3[i]


@njit(cache=True, error_model="numpy")
def _load(x, node, nx, buffer, line):
    """One line of nodes by components, with a zero at both ends."""
    for i in range(nx):
        for a in range(3):
            buffer[line * 3 + a, i + 1] = x[node + i, a]


@njit(cache=True, error_model="numpy")
def _end(stencil, buffer, i, a):
    """Row a of the product at the end i of a line."""
    s = 0.0
    for dz in range(3):
        for dy in range(3):
            for dx in range(3):
                for b in range(3):
                    s += stencil[dz, dy, dx, a, b] * buffer[(3 * dz + dy) * 3 + b, i + dx]
    return s


@njit(cache=True, error_model="numpy", fastmath={"contract"}, nogil=True)
def _grid_pass(begin, end, shape, values, lines, shifts, stencils, inverses, used, held, x, b,
               d, out, keep, step, mode):  # noqa: PLR0913 # fmt: skip
    """One of three operations on the lines begin to end of nodes along x.

    mode 0: out = A x; 1: out = b - A x; 2: d = keep d + step D^-1 (b - A x), out = x + d.
    """
    nz, ny, nx = shape
    buffer = np.zeros((27, nx + 2))
    acc = np.zeros((3, nx))
    for line in range(begin, end):
        z, y = line // ny, line % ny
        cz = 0 if z == 0 else (2 if z == nz - 1 else 1)
        cy = 0 if y == 0 else (2 if y == ny - 1 else 1)
        for dz in range(3):
            for dy in range(3):
                l = 3 * dz + dy
                inside = 0 <= z + dz - 1 < nz and 0 <= y + dy - 1 < ny
                if not inside:
                    buffer[3 * l : 3 * l + 3] = 0.0
                elif dy < 2 and y > 0 and line > begin:  # was the next line of the one before
                    copy_rows_inplace(buffer[3 * l + 3 : 3 * l + 6], buffer[3 * l : 3 * l + 3])
                else:
                    _load(x, ((z + dz - 1) * ny + y + dy - 1) * nx, nx, buffer, l)
        kind = 3 * cz + cy
        _line(values[kind], lines[kind], shifts[kind], buffer, acc, nx)
        for a in range(3):
            acc[a, 0] = _end(stencils[cz, cy, 0], buffer, 0, a)
            acc[a, nx - 1] = _end(stencils[cz, cy, 2], buffer, nx - 1, a)
        node = (z * ny + y) * nx
        for i in range(nx):
            p = node + i
            if mode == 0:
                for a in range(3):
                    out[p, a] = acc[a, i] * used[p, a]
            elif mode == 1:
                for a in range(3):
                    out[p, a] = (b[p, a] - acc[a, i]) * used[p, a]
            elif held[p]:
                for a in range(3):
                    d[p, a] = 0.0
                    out[p, a] = x[p, a]
            else:
                cx = 0 if i == 0 else (2 if i == nx - 1 else 1)
                D = inverses[3 * kind + cx]
                r0 = (b[p, 0] - acc[0, i]) * used[p, 0]
                r1 = (b[p, 1] - acc[1, i]) * used[p, 1]
                r2 = (b[p, 2] - acc[2, i]) * used[p, 2]
                for a in range(3):
                    s = D[a, 0] * r0 + D[a, 1] * r1 + D[a, 2] * r2
                    s = (keep * d[p, a] + step * s) * used[p, a]
                    d[p, a] = s
                    out[p, a] = x[p, a] + s
