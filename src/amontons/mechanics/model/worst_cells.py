"""Where bodies give way: the cell that is pressed flat, or turned inside out, in words."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..elements.cell_matrices import rule_of
from ..meshes.cells import CELLS
from ..meshes.check import determinant
from ..meshes.linear_cells import ReferenceCell
from ..meshes.mesh import Mesh

Array = NDArray[np.float64]


def flattest(mesh: Mesh, u: Array) -> tuple[float, str]:
    """The least det F at displacements u (n, dim), and the cell that has it, in words."""
    least, told, first = np.inf, "", 0
    for cells in mesh.cells:
        cell, x = CELLS[cells.kind], mesh.points[cells.nodes]
        moved = x + u[cells.nodes]
        for at in rule_of(mesh, cells, finite=True)[0]:
            ratio = determinant(cell.jacobians(moved, at)) / determinant(cell.jacobians(x, at))
            k = int(np.where(np.isfinite(ratio), ratio, -np.inf).argmin())
            if not ratio[k] >= least:
                least, told = float(ratio[k]), cell_in_words(first + k, x[k])
        first += len(cells.nodes)
    return least, told


def turned_corner(
    mesh: Mesh, u: Array, before: Array | None = None, slack: float = 0.0
) -> str:
    """The node of a cell that is turned inside out the most at u (n, dim), in words.

    "" for none.  Integration points may all be in front of it: energies do not feel it.
    Nodes that were so at displacements `before` (n, dim) do not count: det F has to be below
    what it was then, and below 0, by more than `slack`.
    """
    least, told, first = 0.0, "", 0
    for cells in mesh.cells:
        cell, x = CELLS[cells.kind], mesh.points[cells.nodes]
        moved = x + u[cells.nodes]
        for c, at in enumerate(cell.corners if _any_turned(cell, moved) else ()):
            ratio = determinant(cell.jacobians(moved, at)) / determinant(cell.jacobians(x, at))
            if before is not None:
                then = determinant(cell.jacobians(x + before[cells.nodes], at))
                then = np.minimum(then / determinant(cell.jacobians(x, at)), 0.0)
                ratio = np.where(ratio < then - slack, ratio, np.inf)
            k = int(np.where(np.isfinite(ratio), ratio, np.inf).argmin())
            if ratio[k] < least:
                least, place = float(ratio[k]), ", ".join(f"{c:.4g}" for c in x[k, c])
                part = "corner" if c < cell.corner_count else "middle of a side"
                told = (
                    f"the {part} at ({place}) of {cell_in_words(first + k, x[k])} is turned "
                    f"inside out, det F = {least:.3g} there,"
                )
        first += len(cells.nodes)
    return told


def _any_turned(cell: ReferenceCell, x: Array) -> bool:
    """Whether some node of cells at x (k, nodes, dim) is inside out, at one look."""
    if cell.kind == "pyramid":  # has no volume at its tip
        return False
    J = x.swapaxes(1, 2) @ cell.gradient(np.asarray(cell.corners))[:, None]
    return not (determinant(J.reshape(-1, *J.shape[2:])) >= 0).all()


def most_strained(mesh: Mesh, u: Array) -> str:
    """The cell with the largest strain C - 1, in words."""
    most, told, first = -1.0, "", 0
    for cells in mesh.cells:
        cell, x = CELLS[cells.kind], mesh.points[cells.nodes]
        for at in rule_of(mesh, cells, finite=True)[0]:
            slopes = np.einsum("kai,kaj->kij", u[cells.nodes], cell.gradients(x, at))
            F = np.eye(mesh.dim) + slopes
            strain = np.abs(F.swapaxes(1, 2) @ F - np.eye(mesh.dim)).max(axis=(1, 2))
            k = int(strain.argmax())
            if strain[k] > most:
                most, told = float(strain[k]), cell_in_words(first + k, x[k])
        first += len(cells.nodes)
    return told


def cell_in_words(number: int, corners: Array) -> str:
    """A cell by its number and the middle of its nodes (a, dim)."""
    centre = ", ".join(f"{c:.4g}" for c in corners.mean(axis=0))
    return f"cell {number} at ({centre})"
