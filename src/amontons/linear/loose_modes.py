"""Motions of whole bodies that a singular matrix does not resist."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from .bodies import Bodies

Array = NDArray[np.float64]
RESISTS = 1e-10  # energy of a mode, relative to the largest diagonal entry, that is no rounding
DENSE = 600  # unknowns of a body up to which its modes are found without being told


def loose_modes(M: object, bodies: Bodies, modes: Array | None) -> Array:
    """Orthonormal columns R (n, k) with M R = 0, each on one body.

    M: square, symmetric, positive semidefinite, its blocks being `bodies`; modes (n, k): rigid
    modes to choose from.  Without them only bodies of up to DENSE unknowns are examined.
    """
    from scipy.linalg import eigh

    n = M.shape[0]  # type: ignore[attr-defined]
    found = [np.zeros((n, 0))]
    size = float(np.abs(M.diagonal()).max(initial=0.0))  # type: ignore[attr-defined]
    for members in bodies.members:
        for rows in members:
            basis = _basis(modes[rows]) if modes is not None else None
            if basis is None and len(rows) > DENSE:
                continue
            whole = np.zeros((n, len(rows) if basis is None else basis.shape[1]))
            whole[rows] = np.eye(len(rows)) if basis is None else basis
            resistance = whole.T @ (M @ whole)  # type: ignore[operator]
            energy, vectors = eigh(0.5 * (resistance + resistance.T))
            found.append(whole @ vectors[:, energy <= RESISTS * size])
    return np.concatenate(found, axis=1)


def unresisted(M: Any, modes: Array) -> Array:
    """What the columns of modes (n, k), orthonormal, without energy, span of R^T M = 0.

    All of them where M (n, n) is symmetric and positive semidefinite.  Tangents of bodies under
    stress, and of loads that follow them, resist motions that take no energy.
    """
    forces = M.T @ modes
    size = float(np.abs(M.diagonal()).max(initial=0.0))
    most = RESISTS**0.5 * size  # what energies that are no more than rounding may leave
    if float(np.linalg.norm(forces)) <= most:
        return modes
    _, sizes, right = np.linalg.svd(forces, full_matrices=False)
    return modes @ right[sizes <= most].T


def _basis(modes: Array) -> Array:
    """Orthonormal columns that span those of modes (n, k)."""
    scale = np.linalg.norm(modes, axis=0)
    columns = modes[:, scale > 0] / scale[scale > 0]
    left, size, _ = np.linalg.svd(columns, full_matrices=False)
    return left[:, size > RESISTS**0.5 * size.max(initial=0.0)]
