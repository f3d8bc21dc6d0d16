"""Cells of first order with one mean gradient, and a stiffness of its own for bending.

A quadrilateral or hexahedron moves its corners by a linear field, whose gradient is the mean
of the cell, and by a vector h_m = sum_a gamma_ma u_a for each product of two or more of its
reference coordinates in [-1, 1], such as xi eta: the hourglass modes, which bend it ([FB]).
The law is asked at the mean alone.  The modes have the stiffness of a cell with incompatible
modes ([TBW], as in `cell_matrices`) of the moduli C at rest, with gradients taken at the
centre, so that the two parts do not meet:

    energy = v W(F) + 1/2 sum_mn y_m . K_mn y_n,    F = I + sum_a u_a G_a^T,  y_m = F^-1 h_m.

A cell that turns with its modes keeps y, and so its energy.  K is positive definite and has no
part of the stress: no pressure makes the modes give way.  At small strains y = h.

"incompatible" takes all moduli for C: bending is exact with one cell.  "hybrid-incompatible"
takes 2 shear eps alone, as volume is asked of the mean and nothing else: a bent cell may change
its volume along its height.  Linear fields have h = 0, so that both pass the patch test.

[FB] D. P. Flanagan, T. Belytschko, Int. J. Numer. Methods Engrg. 17 (1981) 679-706.
[TBW] see `cell_matrices`; and, for the same at other C, T. Belytschko, L. P. Bindeman, CMAME 88
(1991) 311-340.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..meshes.cells import CELLS
from ..meshes.check import determinant
from ..meshes.facets import Cells
from ..meshes.mesh import Mesh

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Uniform:
    """Mean gradients G (k, a, dim) and volumes (k,) of cells, and gamma (k, m, a).

    gradients (q, k, m, dim): of the modes at the points of integration; own (q, k, dim, dim):
    those of the incompatible ones.
    """

    mean: Array
    volumes: Array
    gamma: Array
    gradients: Array
    own: Array

    def stiffness(self, law: Any, *, whole: bool) -> Array:
        """K (k, m, dim, m, dim); whole: of all moduli, else of 2 shear eps."""
        points, k, m, dim = self.gradients.shape
        eye = np.eye(dim)
        if whole:
            moduli = law.moduli(dim)
        else:
            both = np.einsum("ij,kl->ijkl", eye, eye) + np.einsum("il,jk->ijkl", eye, eye)
            moduli = law.shear * both
        fields = np.concatenate([self.gradients, self.own], axis=2)
        K = np.einsum("qcmk,ijkl,qcnl->cminj", fields, moduli, fields, optimize=True)
        K *= (self.volumes / points)[:, None, None, None, None]
        size, more = m * dim, fields.shape[2] * dim
        K = K.reshape(k, more, more)
        across, inner = K[:, :size, size:], K[:, size:, size:]
        K = K[:, :size, :size] - across @ np.linalg.solve(inner, K[:, size:, :size])
        K = 0.5 * (K + K.swapaxes(1, 2))
        return np.ascontiguousarray(K.reshape(k, m, dim, m, dim))


def uniform(mesh: Mesh, cells: Cells) -> Uniform:
    """Of "quad" or "hex" cells."""
    mean, volumes = mean_gradients(mesh, cells)
    cell, dim, x = CELLS[cells.kind], mesh.dim, mesh.points[cells.nodes]
    products = [
        [axis for axis in range(dim) if number >> axis & 1] for number in range(1, 2**dim)
    ]
    products = [axes for axes in products if len(axes) > 1]
    signs = 2 * cell.corners - 1
    h = np.array([signs[:, axes].prod(axis=1) for axes in products])
    gamma = (h - np.einsum("kac,kbc,mb->kma", mean, x, h, optimize=True)) / 2**dim
    slopes = 2 * np.linalg.inv(cell.jacobians(x, cell.centre))  # of the reference coordinates
    places = 2 * cell.stiffness[0] - 1
    gradients = np.zeros((len(places), len(x), len(products), dim))
    for q, place in enumerate(places):
        for m, axes in enumerate(products):
            for axis in axes:
                others = np.prod([place[other] for other in axes if other != axis])
                gradients[q, :, m] += others * slopes[:, axis]
    own = places[:, None, :, None] * slopes[None]
    return Uniform(mean, volumes, np.ascontiguousarray(gamma), gradients, own)


def mean_gradients(mesh: Mesh, cells: Cells) -> tuple[Array, Array]:
    """Gradients of the shape functions (k, a, dim), the mean of each cell; volumes (k,)."""
    cell, x = CELLS[cells.kind], mesh.points[cells.nodes]
    total, volumes = np.zeros(x.shape), np.zeros(len(x))
    for at, weight in zip(*cell.stiffness, strict=True):
        volume = weight * determinant(cell.jacobians(x, at))
        total += cell.gradients(x, at) * volume[:, None, None]
        volumes += volume
    return total / volumes[:, None, None], volumes


def mean_gradient(mesh: Mesh, cells: Cells, displacement: Array) -> Array:
    """Displacement gradients (k, dim, dim), the mean of each cell."""
    mean, _ = mean_gradients(mesh, cells)
    return np.einsum("kai,kaj->kij", displacement[cells.nodes], mean)


def uniform_stiffness(mesh: Mesh, cells: Cells, law: Any) -> Array:
    """Stiffness (k, a dim, a dim) of "hybrid-incompatible" cells at small strains."""
    parts = uniform(mesh, cells)
    moduli, dim = law.moduli(mesh.dim), mesh.dim
    K = np.einsum("c,cak,ijkl,cbl->caibj", parts.volumes, parts.mean, moduli, parts.mean,
                  optimize=True)  # fmt: skip
    bent = parts.stiffness(law, whole=False)
    K += np.einsum("kma,kminj,knb->kaibj", parts.gamma, bent, parts.gamma, optimize=True)
    size = cells.nodes.shape[1] * dim
    return K.reshape(len(K), size, size)
