"""Interpolation from every second node of a box, x fastest, line by line and without a matrix.

A fine node with an odd number in some directions has the mean of the coarse nodes beside it:
two on an edge, four on a side, eight inside of a cell.
"""

from __future__ import annotations

from ..core.compiled import njit


@njit(cache=True, error_model="numpy", nogil=True)
def add_in_box(begin, end, shape, coarse, fine):
    """fine += P coarse on the lines begin to end of fine nodes along x; both (nodes, 3)."""
    _, ny, nx = shape
    coarse_ny, coarse_nx = ny // 2 + 1, nx // 2 + 1
    for line in range(begin, end):
        z, y = line // ny, line % ny
        w = (0.5 if z % 2 else 1.0) * (0.5 if y % 2 else 1.0)
        for dz in range(1 + z % 2):
            for dy in range(1 + y % 2):
                first = ((z // 2 + dz) * coarse_ny + y // 2 + dy) * coarse_nx
                p = line * nx
                for i in range(coarse_nx - 1):
                    c = first + i
                    for a in range(3):
                        here = w * coarse[c, a]
                        fine[p, a] += here
                        fine[p + 1, a] += 0.5 * (here + w * coarse[c + 1, a])
                    p += 2
                for a in range(3):
                    fine[p, a] += w * coarse[first + coarse_nx - 1, a]


@njit(cache=True, error_model="numpy", nogil=True)
def restrict_in_box(begin, end, shape, fine, coarse):
    """coarse = P^T fine on the lines begin to end of coarse nodes along x."""
    nz, ny, nx = shape
    coarse_ny, coarse_nx = ny // 2 + 1, nx // 2 + 1
    for line in range(begin, end):
        z, y = 2 * (line // coarse_ny), 2 * (line % coarse_ny)
        first = line * coarse_nx
        for c in range(first, first + coarse_nx):
            for a in range(3):
                coarse[c, a] = 0.0
        for dz in range(-1, 2):
            for dy in range(-1, 2):
                if not (0 <= z + dz < nz and 0 <= y + dy < ny):
                    continue
                w = (0.5 if dz else 1.0) * (0.5 if dy else 1.0)
                p = ((z + dz) * ny + y + dy) * nx
                for i in range(coarse_nx):
                    for a in range(3):
                        coarse[first + i, a] += w * fine[p + 2 * i, a]
                for i in range(coarse_nx - 1):
                    for a in range(3):
                        half = 0.5 * w * fine[p + 2 * i + 1, a]
                        coarse[first + i, a] += half
                        coarse[first + i + 1, a] += half
