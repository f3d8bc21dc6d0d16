"""Nodal forces of loads on deformed cells and facets, with their derivatives by the nodes.

A load per area or volume of the deformed body gives, with x(s) = sum_a x_a N_a(s) on the
reference cell and D = dx/ds,

    f_a = integral of N_a h |n| ds,   -N_a p n ds,   N_a f det D ds,    n = D_1 x D_2,      (1)

n being the outward normal times the ratio of areas (D turned by -90 degrees in 2D): with
F = I + grad u these are the integrals of h det F |F^-T n_0|, -p det F F^-T n_0 and f det F over
the undeformed body, [LR] eq. (22).  Densities are interpolated between their values at nodes,
as those of dead loads are; they may depend on where the nodes are.

[LR] T. Ligurský, Y. Renard, CMAME 280 (2014).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..meshes.cells import CELLS
from ..meshes.check import determinant
from ..meshes.surfaces import outward

Array = NDArray[np.float64]
Pair = tuple[Array, Array]
LEVI_CIVITA = np.zeros((3, 3, 3))
LEVI_CIVITA[[0, 1, 2], [1, 2, 0], [2, 0, 1]] = 1.0
LEVI_CIVITA[[0, 2, 1], [2, 1, 0], [1, 0, 2]] = -1.0


def traction_forces(kind: str, x: Array, density: Array, slopes: Array) -> Pair:
    """Forces (k, a, d) on facets with nodes at x (k, a, d), and derivatives (k, a, b, d, d).

    density (k, a, d): force per deformed area at the nodes; slopes (k, a, d, d): by position.
    """
    cell = CELLS[kind]
    forces, blocks = _nothing(x)
    for at, weight in zip(*cell.gauss, strict=True):
        shape = cell.shape(at)
        normal, turned = _normal(x, cell.gradient(at))
        area = np.linalg.norm(normal, axis=1)
        value = np.einsum("a,kac->kc", shape, density)
        stretched = np.einsum("kd,kbde->kbe", normal / area[:, None], turned)
        forces += weight * np.einsum("a,kc,k->kac", shape, value, area)
        blocks += weight * np.einsum("a,kc,kbe->kabce", shape, value, stretched)
        blocks += weight * np.einsum("a,b,kbce,k->kabce", shape, shape, slopes, area)
    return forces, blocks


def pressure_forces(kind: str, x: Array, density: Array, slopes: Array) -> Pair:
    """The same of pressures (k, a), > 0 into the body; slopes (k, a, d)."""
    cell = CELLS[kind]
    forces, blocks = _nothing(x)
    for at, weight in zip(*cell.gauss, strict=True):
        shape = cell.shape(at)
        normal, turned = _normal(x, cell.gradient(at))
        value = -weight * density @ shape
        forces += np.einsum("a,kc,k->kac", shape, normal, value)
        blocks += np.einsum("a,kbce,k->kabce", shape, turned, value)
        blocks -= weight * np.einsum("a,b,kc,kbe->kabce", shape, shape, normal, slopes)
    return forces, blocks


def volume_forces(kind: str, x: Array, density: Array, slopes: Array) -> Pair:
    """The same of forces per deformed volume (k, a, d) in cells; slopes (k, a, d, d)."""
    cell = CELLS[kind]
    forces, blocks = _nothing(x)
    for at, weight in zip(*cell.gauss, strict=True):
        shape, gradient = cell.shape(at), cell.gradient(at)
        D = np.einsum("kac,as->kcs", x, gradient)
        value = np.einsum("a,kac->kc", shape, density)
        volume = determinant(D)
        grown = np.einsum("kcs,bs->kbc", _cofactors(D), gradient)
        forces += weight * np.einsum("a,kc,k->kac", shape, value, volume)
        blocks += weight * np.einsum("a,kc,kbe->kabce", shape, value, grown)
        blocks += weight * np.einsum("a,b,kbce,k->kabce", shape, shape, slopes, volume)
    return forces, blocks


def _nothing(x: Array) -> Pair:
    k, a, d = x.shape
    return np.zeros((k, a, d)), np.zeros((k, a, a, d, d))


def _normal(x: Array, gradient: Array) -> Pair:
    """n (k, d) of (1), and its derivatives by the nodes (k, b, d, d)."""
    D = np.einsum("kac,as->kcs", x, gradient)
    if D.shape[1] == 2:
        turn = np.array([[0.0, 1.0], [-1.0, 0.0]])
        turned = np.broadcast_to(gradient[:, 0, None, None] * turn, (*x.shape, 2))
        return outward(D), turned
    first = np.einsum("b,cef,kf->kbce", gradient[:, 0], LEVI_CIVITA, D[:, :, 1])
    second = np.einsum("b,cfe,kf->kbce", gradient[:, 1], LEVI_CIVITA, D[:, :, 0])
    return outward(D), first + second


def _cofactors(D: Array) -> Array:
    """d det D / dD, (k, d, d): also where D is singular."""
    if D.shape[1] == 2:
        out = np.empty_like(D)
        out[:, 0, 0], out[:, 1, 1] = D[:, 1, 1], D[:, 0, 0]
        out[:, 0, 1], out[:, 1, 0] = -D[:, 1, 0], -D[:, 0, 1]
        return out
    columns = [np.cross(D[:, :, (s + 1) % 3], D[:, :, (s + 2) % 3]) for s in range(3)]
    return np.stack(columns, axis=2)
