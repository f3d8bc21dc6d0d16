"""Matrices of cells at small strains that the compiled loops do not have.

At a point of integration of volume v the components of the displacement gradient are B u, so
that a cell has the stiffness  sum_q v B^T C B.  C holds the moduli of these components,
d stress / d gradient.

Axisymmetric: with r, z for the axes x, y a fifth component is u_r / r, the strain around, and
v goes around once, 2 pi r times the area.

Incompatible modes ([TBW]): quadrilaterals and hexahedra get displacements 4 x (1 - x) along
each reference axis on their own, for bending.  Their gradients are taken with the Jacobian at
the centre times its determinant over that of the point, so that they do no work on uniform
stresses; they are eliminated cell by cell.

[TBW] R. L. Taylor, P. J. Beresford, E. L. Wilson, "A non-conforming element for stress
analysis", Int. J. Numer. Methods Engrg. 10 (1976) 1211-1219.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from ..meshes.cells import CELLS
from ..meshes.check import determinant
from ..meshes.facets import Cells
from ..meshes.linear_cells import Rule
from ..meshes.mesh import Mesh
from .hybrid import element_formulation, volume_modes, volume_modulus
from .uniform import uniform_stiffness

Array = NDArray[np.float64]
Index = NDArray[np.int64]
AT_ONCE = 2000  # cells, for memory


def rule_of(mesh: Mesh, cells: Cells, *, finite: bool = False) -> Rule:
    """The points at which the stiffness of these cells is summed up.

    finite: at finite strains; more at second order, as their laws are no polynomials.
    """
    cell = CELLS[cells.kind]
    if cells.integration == "reduced" and cell.reduced is not None:
        return cell.reduced
    if finite:
        return cell.stiffness if cell.order == 1 else cell.gauss
    if mesh.axisymmetric and cells.kind == "tri":
        return cell.gauss  # one point does not see how u / r changes
    return cell.stiffness


def components(dim: int, *, axisymmetric: bool) -> list[tuple[int, int]]:
    """(displacement, direction) of the components of the gradient, as rows of B."""
    pairs = [(i, k) for i in range(dim) for k in range(dim)]
    return [*pairs, (2, 2)] if axisymmetric else pairs


def moduli_of(law: object, mesh: Mesh, *, hybrid: bool = False) -> Array:
    """C (s, s) of a law at the components of the gradient; hybrid: without the volume term."""
    pairs = components(mesh.dim, axisymmetric=mesh.axisymmetric)
    moduli = law.shape_moduli if hybrid else law.moduli  # type: ignore[attr-defined]
    T = moduli(3 if mesh.axisymmetric else mesh.dim)
    return np.array([[T[i, j, k, l] for j, l in pairs] for i, k in pairs])


def in_parts(cells: Cells) -> Iterator[Index]:
    """Nodes (k, a) of some of the cells at a time."""
    for first in range(0, len(cells.nodes), AT_ONCE):
        yield cells.nodes[first : first + AT_ONCE]


def gradient_rows(mesh: Mesh, kind: str, nodes: Index, at: Array) -> tuple[Array, Array]:
    """B (k, s, a dim) of cells at one reference point, and volume there, (k,)."""
    cell, x = CELLS[kind], mesh.points[nodes]
    volume = determinant(cell.jacobians(x, at))
    G = cell.gradients(x, at)
    if not mesh.axisymmetric:
        return _rows(G), volume
    shape = cell.shape(at)
    r = x[:, :, 0] @ shape
    hoop = np.zeros((len(nodes), 1, G.shape[1], 2))
    hoop[:, 0, :, 0] = shape / r[:, None]
    rows = np.concatenate([_rows(G), hoop.reshape(len(nodes), 1, -1)], axis=1)
    return rows, 2 * np.pi * r * volume


def _rows(G: Array) -> Array:
    """Rows (k, dim dim, a dim) of the gradients of shape functions (k, a, dim)."""
    k, a, dim = G.shape
    out = np.zeros((k, dim, dim, a, dim))
    for i in range(dim):
        out[:, i, :, :, i] = np.swapaxes(G, 1, 2)
    return out.reshape(k, dim * dim, a * dim)


def cell_stiffness(mesh: Mesh, cells: Cells, law: object) -> Iterator[tuple[Index, Array]]:
    """Nodes (k, a) and stiffness (k, a dim, a dim) of some cells at a time."""
    formulation = element_formulation(mesh, cells, law)
    hybrid = formulation == "hybrid"
    C = moduli_of(law, mesh, hybrid=hybrid)
    rule = rule_of(mesh, cells)
    for nodes in in_parts(cells):
        if formulation == "hybrid-incompatible":
            yield nodes, uniform_stiffness(mesh, Cells(cells.kind, nodes), law)
            continue
        if cells.integration == "incompatible":
            yield nodes, _with_modes(mesh, cells.kind, nodes, rule, C)
            continue
        K = np.zeros((len(nodes), *(nodes.shape[1] * mesh.dim,) * 2))
        for at, weight in zip(*rule, strict=True):
            B, volume = gradient_rows(mesh, cells.kind, nodes, at)
            K += np.swapaxes(B, 1, 2) @ (C @ B) * (weight * volume)[:, None, None]
        if hybrid:
            b = volume_rows(mesh, Cells(cells.kind, nodes), rule)
            K += volume_modulus(law) * np.swapaxes(b, 1, 2) @ b
        yield nodes, K


def volume_rows(mesh: Mesh, cells: Cells, rule: Rule) -> Array:
    """b (k, M, a dim) of `hybrid` at rest: what the changes of volume are of displacements."""
    modes, volumes = volume_modes(mesh, cells, rule)
    pairs = components(mesh.dim, axisymmetric=mesh.axisymmetric)
    trace = np.array([float(i == k) for i, k in pairs])
    b = np.zeros((*modes.shape[:2], cells.nodes.shape[1] * mesh.dim))
    for q, at in enumerate(rule[0]):
        B, _ = gradient_rows(mesh, cells.kind, cells.nodes, at)
        b += (modes[:, :, q] * volumes[:, q, None])[:, :, None] * (trace @ B)[:, None]
    return b


def _with_modes(mesh: Mesh, kind: str, nodes: Index, rule: Rule, C: Array) -> Array:
    """Stiffness of cells whose incompatible modes are eliminated."""
    cell, dim, x = CELLS[kind], mesh.dim, mesh.points[nodes]
    centre = cell.jacobians(x, cell.centre)
    inverse, size = np.linalg.inv(centre), determinant(centre)
    own, more = nodes.shape[1] * dim, dim * dim
    K = np.zeros((len(nodes), own + more, own + more))
    for at, weight in zip(*rule, strict=True):
        B, volume = gradient_rows(mesh, kind, nodes, at)
        modes = (4 - 8 * at)[:, None] * inverse * (size / volume)[:, None, None]
        B = np.concatenate([B, _rows(modes)], axis=2)
        K += np.swapaxes(B, 1, 2) @ (C @ B) * (weight * volume)[:, None, None]
    across = K[:, :own, own:]
    return K[:, :own, :own] - across @ np.linalg.solve(K[:, own:, own:], K[:, own:, :own])


def add_blocks(
    blocks: Array, pattern: tuple[NDArray[np.int32], NDArray[np.int32]],
    parts: Iterator[tuple[Index, Array]],
) -> None:  # fmt: skip
    """Add matrices of cells to the node blocks (m, dim, dim) of a pattern."""
    pointers, columns = pattern
    n, dim = len(pointers) - 1, blocks.shape[1]
    rows = np.repeat(np.arange(n), np.diff(pointers))
    order = rows * n + columns
    for nodes, K in parts:
        k, a = nodes.shape
        pairs = (nodes[:, :, None] * n + nodes[:, None, :]).ravel()
        local = 0.5 * (K + np.swapaxes(K, 1, 2))  # symmetric to the last digit
        local = local.reshape(k, a, dim, a, dim).swapaxes(2, 3).reshape(-1, dim, dim)
        np.add.at(blocks, np.searchsorted(order, pairs), local)
