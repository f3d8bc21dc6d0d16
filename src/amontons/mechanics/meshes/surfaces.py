"""Integrals over surfaces and averaged normals, all from facets."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...core.errors import InvalidInput
from .cells import CELLS
from .facets import Facets

Array = NDArray[np.float64]

ZERO = 1e-12  # weights below this part of the largest are rounding errors


def facet_normals(
    points: Array, facets: Facets, at: Array | None = None, *, axisymmetric: bool = False
) -> Array:
    """Outward normals times area per reference area at a reference point (default: centre).

    Shape (k, dim).  Their length is the ratio of areas ds / d reference; axisymmetric: of the
    area around the axis, 2 pi r times as large.
    """
    cell = CELLS[facets.kind]
    x, where = points[facets.nodes], cell.centre if at is None else at
    normals = outward(cell.jacobians(x, where))
    if axisymmetric:
        normals = normals * (2 * np.pi * x[:, :, 0] @ cell.shape(where))[:, None]
    return normals


def outward(jac: Array) -> Array:
    """The same from the slopes of facets (k, dim, dim - 1) at a reference point each."""
    if jac.shape[1] == 2:
        tangent = jac[:, :, 0]
        return np.stack([tangent[:, 1], -tangent[:, 0]], axis=1)
    return np.cross(jac[:, :, 0], jac[:, :, 1])


def facet_areas(points: Array, facets: Facets, *, axisymmetric: bool = False) -> Array:
    """Area (length in 2D, unless it goes around an axis) of every facet, (k,)."""
    gauss = zip(*CELLS[facets.kind].gauss, strict=True)
    return np.asarray(sum(
        weight
        * np.linalg.norm(facet_normals(points, facets, at, axisymmetric=axisymmetric), axis=1)
        for at, weight in gauss
    ))  # fmt: skip


def nodal_weights(
    points: Array, surface: tuple[Facets, ...], *, axisymmetric: bool = False
) -> Array:
    """Integral of every node's shape function over a surface, (n,), area; 0 elsewhere.

    It is zero also at the corners of triangles of second order, and negative at those of
    quadrilaterals with eight nodes.
    """
    weights = np.zeros(len(points))
    for facets in surface:
        cell = CELLS[facets.kind]
        for at, weight in zip(*cell.gauss, strict=True):
            normals = facet_normals(points, facets, at, axisymmetric=axisymmetric)
            area = weight * np.linalg.norm(normals, axis=1)
            np.add.at(weights, facets.nodes, area[:, None] * cell.shape(at))
    weights[np.abs(weights) < ZERO * weights.max(initial=0.0)] = 0.0
    return weights


def nodal_normals(points: Array, surface: tuple[Facets, ...]) -> Array:
    """Outward unit normals at the nodes, averaged by area, (n, dim); 0 off the surface.

    Raises InvalidInput where the facets around a node cancel.
    """
    normals = np.zeros_like(points)
    for facets in surface:
        cell = CELLS[facets.kind]
        for at, weight in zip(*cell.gauss, strict=True):
            vector = weight * facet_normals(points, facets, at)
            for local, share in enumerate(cell.shape(at)):
                np.add.at(normals, facets.nodes[:, local], share * vector)
    length = np.linalg.norm(normals, axis=1)
    on = nodal_weights(points, surface)
    flat = (on > 0) & (length < 1e-9 * on)
    if flat.any():
        raise InvalidInput(
            f"surface: its facets cancel at point {points[np.flatnonzero(flat)[0]]}, "
            "no outward normal; is it an inner surface, listed from both sides?"
        )
    return normals / np.where(length > 0, length, 1.0)[:, None]


def surface_load(
    points: Array, surface: tuple[Facets, ...], traction: Array, *, axisymmetric: bool = False
) -> Array:
    """Nodal forces (n, dim) of tractions (n, dim) given at the nodes, force per area.

    The traction is interpolated by the shape functions and integrated with Gauss points.
    """
    load = np.zeros_like(points)
    for facets in surface:
        cell = CELLS[facets.kind]
        for at, weight in zip(*cell.gauss, strict=True):
            shape = cell.shape(at)
            normals = facet_normals(points, facets, at, axisymmetric=axisymmetric)
            area = weight * np.linalg.norm(normals, axis=1)
            value = np.einsum("a,kac->kc", shape, traction[facets.nodes]) * area[:, None]
            for local, share in enumerate(shape):
                np.add.at(load, facets.nodes[:, local], share * value)
    return load


def pressure_load(
    points: Array, surface: tuple[Facets, ...], pressure: Array, *, axisymmetric: bool = False
) -> Array:
    """Nodal forces (n, dim) of a pressure (n,) given at the nodes, > 0 into the body."""
    load = np.zeros_like(points)
    for facets in surface:
        cell = CELLS[facets.kind]
        for at, weight in zip(*cell.gauss, strict=True):
            shape = cell.shape(at)
            normals = facet_normals(points, facets, at, axisymmetric=axisymmetric)
            force = -weight * (pressure[facets.nodes] @ shape)[:, None] * normals
            for local, share in enumerate(shape):
                np.add.at(load, facets.nodes[:, local], share * force)
    return load
