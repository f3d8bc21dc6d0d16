"""Dual basis functions: biorthogonal to the shape functions of the slave surface.

On every facet psi_q = sum_s A_qs phi_s with A = D M^-1, M_rs = int phi_r phi_s and D_r = int
phi_r, all integrals over that part of the facet that faces the other side ([PW] section 4: the
consistent treatment of the rim).  Nodes without a multiplier leave their share to the others of
the facet: then phi_s + (mean of those left out) takes the place of phi_s.  Always

    int psi_q phi_r = delta_qr int phi_r  for nodes q, r with multiplier,    sum_q psi_q = 1.

[PW] A. Popp, B. Wohlmuth, M. Gee, W. Wall, "Dual quadratic mortar finite element methods for 3D
finite deformation contact", SIAM J. Sci. Comput. 34 (2012) B421-B446.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Index = NDArray[np.int64]
Mask = NDArray[np.bool_]


def dual_functions(mass: Array, kept: Mask, real: Mask) -> Array:
    """Coefficients of psi in phi on every facet, (f, a, a): row q is psi_q, zero if not kept.

    mass (f, a, a): int phi_r phi_s; kept (f, a): nodes with multiplier, at least one on each
    facet; real (f, a): False for the slots that a facet with fewer nodes leaves empty.
    """
    shared = sharing_functions(kept, real)
    both = kept[:, :, None] & kept[:, None, :]
    moment = np.where(both, shared @ mass, 0.0)
    size = np.sqrt(np.where(kept, np.einsum("faa->fa", mass), 1.0))
    scaled = moment / (size[:, :, None] * size[:, None, :])
    scaled += np.eye(mass.shape[1]) * ~kept[:, :, None]
    inverse = np.linalg.inv(scaled)
    # on slivers phi are nearly dependent, and what is left of rounding in a small row of the
    # inverse, taken times the large rows of mass, would be a force: one step of refinement
    inverse += (np.eye(mass.shape[1]) - inverse @ scaled) @ inverse
    inverse /= size[:, :, None] * size[:, None, :]
    weight = np.where(kept, mass.sum(axis=1), 0.0)
    return weight[:, :, None] * np.where(both, inverse, 0.0) @ shared


def sharing_functions(kept: Mask, real: Mask) -> Array:
    """phi of the kept, each with its share of the others, in phi, (f, a, a); their sum is 1."""
    share = (real & ~kept) / np.maximum(kept.sum(axis=1), 1)[:, None]
    return kept[:, :, None] * share[:, None, :] + np.eye(kept.shape[1]) * kept[:, :, None]


def nodes_with_multiplier(
    nodes: Index, real: Mask, held: Mask, hardly: Mask, reached: Array
) -> Mask:
    """Which nodes (n,) carry a multiplier: on each facet that takes part at least one.

    nodes (f, a) of these facets; held (n,) by supports and hardly (n,) covered: unwanted, but
    where facets have no others held ones carry it, else the node with the largest part
    reached (n,) of its weight.
    """
    kept = ~held & ~hardly
    alone = ~(kept[nodes] & real).any(axis=1)
    kept[nodes[alone][(real & ~hardly[nodes])[alone]]] = True
    alone = ~(kept[nodes] & real).any(axis=1)
    best = np.where(real, reached[nodes], -1.0)[alone].argmax(axis=1)
    kept[nodes[alone][np.arange(len(best)), best]] = True
    return kept
