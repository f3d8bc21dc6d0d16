"""Displacement and stress at points of a surface, as weights of nodal values.

A point on a facet sees the displacement sum_a N_a v_a of the facet's nodes and, in the cell
behind the facet, the gradient sum_b v_b (x) dN_b/dx, from which the traction sigma nu follows.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ..meshes.cells import CELLS
from ..meshes.check import determinant
from ..meshes.facets import Cells, Facets
from ..meshes.mesh import Mesh
from ..meshes.quadratic_cells import gauss
from ..meshes.surfaces import facet_areas, facet_normals, outward
from .elasticity import LinearElastic, Materials, materials_by_region

Array = NDArray[np.float64]
Index = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class SurfacePoints:
    """Points of a surface; q points, tables padded with weight zero.

    points (q, dim); weights (q,), area; normals (q, dim), unit, outwards; nodes, shape (q, a):
    of the facet; cell_nodes (q, b), slopes (q, b, dim), 1 / length: of the cell behind it;
    hoop (q, b), 1 / length: strain around an axis by radial displacements, zero without one;
    lame_lambda, shear (q,): of that cell; stiffness (q,), stress per length: the smallest c
    with  int_F |sigma nu|^2 <= c int_T sigma : epsilon  for all displacements of the cell T
    with the facet F, or an upper bound of it.
    """

    points: Array
    weights: Array
    normals: Array
    nodes: Index
    shape: Array
    cell_nodes: Index
    slopes: Array
    hoop: Array
    lame_lambda: Array
    shear: Array
    stiffness: Array

    def displacement(self, axes: Array, size: int) -> sparse.csc_array:
        """Columns (size, q dim) whose products with dofs v are displacements along axes.

        axes (q, dim, dim): rows of directions at every point.
        """
        values = np.einsum("qa,qkc->qack", self.shape, axes)
        return node_columns(self.nodes, values, size)

    def traction(self, axes: Array, size: int) -> sparse.csc_array:
        """The same for the traction sigma nu on the body."""
        slope_n = np.einsum("qbc,qc->qb", self.slopes, self.normals)
        slope_k = np.einsum("qbc,qkc->qbk", self.slopes, axes)
        along = np.einsum("qkc,qc->qk", axes, self.normals)
        dilated = self.slopes.copy()
        dilated[:, :, 0] += self.hoop
        values = np.einsum("q,qbc,qk->qbck", self.lame_lambda, dilated, along)
        values += np.einsum("q,qb,qkc->qbck", self.shear, slope_n, axes)
        values += np.einsum("q,qbk,qc->qbck", self.shear, slope_k, self.normals)
        return node_columns(self.cell_nodes, values, size)


def node_columns(nodes: Index, values: Array, size: int) -> sparse.csc_array:
    """Matrix (size, q d): values (q, a, d, d) of nodes (q, a), component of the node first."""
    q, a, d, _ = values.shape
    rows = np.broadcast_to((nodes[:, :, None] * d + np.arange(d))[..., None], values.shape)
    columns = np.arange(q * d).reshape(q, 1, 1, d)
    entries = (rows.ravel(), np.broadcast_to(columns, values.shape).ravel())
    out = sparse.coo_array((values.ravel(), entries), shape=(size, q * d)).tocsc()
    out.eliminate_zeros()
    return out


@dataclass(frozen=True, eq=False)
class FacetPoints:
    """Where on a surface: facet (q,), counted through its blocks, and weight (q,), area.

    at (q, dim - 1): reference coordinates in the facet.
    """

    facet: Index
    at: Array
    weight: Array


def gauss_points(mesh: Mesh, surface: str, count: int) -> FacetPoints:
    """`count` Gauss points per direction on every facet of a surface, facet by facet."""
    parts, before = [], 0
    for facets in mesh.surface(surface):
        side, k = CELLS[facets.kind], len(facets.nodes)
        at, weight = gauss(side.dim, side.corner_count == 3, count)
        area = [
            np.linalg.norm(
                facet_normals(mesh.points, facets, x, axisymmetric=mesh.axisymmetric), axis=1
            )
            for x in at
        ]
        weights = (weight * np.stack(area, axis=1)).ravel()
        parts.append((np.repeat(np.arange(before, before + k), len(at)),
                      np.tile(at, (k, 1)), weights))  # fmt: skip
        before += k
    return FacetPoints(*(np.concatenate(column) for column in zip(*parts, strict=True)))


def surface_points(
    mesh: Mesh, surface: str, material: LinearElastic | Materials, where: FacetPoints
) -> SurfacePoints:
    """Displacement and stress at points of an outer surface, in their order."""
    laws = materials_by_region(mesh, material)
    parts, place, before = [], [], 0
    for facets in mesh.surface(surface):
        for rows, block, cells, local in _behind(mesh, facets):
            row = np.full(before + len(facets.nodes), -1)
            row[before + rows] = np.arange(len(rows))
            mine = np.flatnonzero(where.facet < len(row))
            mine = mine[row[where.facet[mine]] >= 0]
            group = Facets(facets.kind, facets.nodes[rows])
            here = FacetPoints(row[where.facet[mine]], where.at[mine], where.weight[mine])
            law = laws[block.region]
            parts.append(_points(mesh, group, block, cells, local, law, here))
            place.append(mine)
        before += len(facets.nodes)
    order = np.argsort(np.concatenate(place), kind="stable")
    tables = [stacked([getattr(part, f.name) for part in parts]) for f in fields(parts[0])]
    return SurfacePoints(*(table[order] for table in tables))


def facet_traces(mesh: Mesh, surface: str, facet: Index, at: Array) -> tuple[Index, Array]:
    """Nodes and shape functions (q, a) at points of facets, counted as in FacetPoints."""
    tables, place, before = [], [], 0
    for facets in mesh.surface(surface):
        mine = np.flatnonzero((facet >= before) & (facet < before + len(facets.nodes)))
        shape = CELLS[facets.kind].shape(at[mine])
        tables.append((facets.nodes[facet[mine] - before], shape))
        place.append(mine)
        before += len(facets.nodes)
    order = np.argsort(np.concatenate(place), kind="stable")
    nodes, shape = (stacked(list(column))[order] for column in zip(*tables, strict=True))
    return nodes, shape


def stacked(tables: list[NDArray]) -> NDArray:
    """One table of several with different numbers of columns, padded with zeros."""
    width = max((table.shape[1] for table in tables if table.ndim > 1), default=0)
    return np.concatenate([
        table if table.ndim == 1 else
        np.pad(table, [(0, 0), (0, width - table.shape[1])] + [(0, 0)] * (table.ndim - 2))
        for table in tables
    ])  # fmt: skip


def _behind(mesh: Mesh, facets: Facets) -> Iterator[tuple[Index, Cells, Index, Index]]:
    """Groups of facets with alike cells: facets, block, cells (k,), local nodes (a,)."""
    near = np.zeros(len(mesh.points), dtype=bool)
    near[facets.nodes] = True
    keys, owners = [np.sort(facets.nodes, axis=1)], []
    for number, block in enumerate(mesh.cells):
        for side in CELLS[block.kind].facets:
            if len(side) == facets.nodes.shape[1]:
                at = np.flatnonzero(near[block.nodes[:, side]].all(axis=1))
                keys.append(np.sort(block.nodes[at][:, side], axis=1))
                owners.append(np.stack([np.full(len(at), number), at], axis=1))
    _, label = np.unique(np.concatenate(keys), axis=0, return_inverse=True)
    label, owner = label.ravel(), np.concatenate(owners)
    cell_of = np.empty((label.max() + 1, 2), dtype=np.int64)
    cell_of[label[len(facets.nodes) :]] = owner
    found = cell_of[label[: len(facets.nodes)]]
    for number, block in enumerate(mesh.cells):
        mine = np.flatnonzero(found[:, 0] == number)
        cells = found[mine, 1]
        same = block.nodes[cells][:, None, :] == facets.nodes[mine][:, :, None]
        patterns, which = np.unique(same.argmax(axis=2), axis=0, return_inverse=True)
        for k, local in enumerate(patterns):
            chosen = which.ravel() == k
            yield mine[chosen], block, cells[chosen], local


def _points(  # noqa: PLR0913
    mesh: Mesh, facets: Facets, block: Cells, cells: Index, local: Index, law: LinearElastic,
    where: FacetPoints,
) -> SurfacePoints:  # fmt: skip
    """Points of facets whose nodes have the numbers `local` (a,) in their cells."""
    side, cell, row = CELLS[facets.kind], CELLS[block.kind], where.facet
    phi = side.shape(where.at)
    x = mesh.points[facets.nodes[row]]
    normal = outward(side.jacobians(x, where.at))
    inside = phi @ cell.corners[local]  # of the cell
    own = block.nodes[cells[row]]
    slopes = cell.gradient(inside) @ np.linalg.inv(cell.jacobians(mesh.points[own], inside))
    hoop = np.zeros(own.shape)
    if mesh.axisymmetric:
        behind = cell.shape(inside)
        hoop = behind / np.einsum("qb,qb->q", behind, mesh.points[own, 0])[:, None]
    lame, shear = law.lame_lambda(mesh.dim), law.shear
    stiffness = (lame + 2 * shear) * _trace_constant(mesh, facets, block, cells)
    return SurfacePoints(
        np.einsum("qa,qac->qc", phi, x), where.weight,
        normal / np.linalg.norm(normal, axis=1)[:, None], facets.nodes[row], phi, own, slopes,
        hoop, np.full(len(row), lame), np.full(len(row), shear), stiffness[row],
    )  # fmt: skip


def _trace_constant(mesh: Mesh, facets: Facets, block: Cells, cells: Index) -> Array:
    """c, 1 / length, with int_F g^2 <= c int_T g^2 for all gradients g of the cell, (k,).

    Exact on simplices: T. Warburton, J. Hesthaven, "On the constants in hp-finite element
    trace inverse inequalities", Comput. Methods Appl. Mech. Eng. 192 (2003).
    """
    cell, d = CELLS[block.kind], mesh.dim
    coordinates = mesh.points[block.nodes[cells]]
    volume = sum(
        weight * determinant(cell.jacobians(coordinates, at))
        for at, weight in zip(*cell.gauss, strict=True)
    )
    degree = cell.order - 1 if cell.corner_count == d + 1 else cell.order
    factor = (degree + 1) ** 2 if cell.corner_count > d + 1 else (degree + 1) * (degree + d) / d
    return factor * facet_areas(mesh.points, facets) / volume
