"""The inverse of the coarsest matrix of multigrid, which may be at rest in some directions."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .node_blocks import DEAD

Array = NDArray[np.float64]
SMALL = 1e-10  # singular values of the coarsest matrix below this part of the largest rest


def inverse_at_rest(A: Array, diagonal: Array, size: Array) -> Array:
    """Inverse of A (3 n, 3 n) on the directions in which its diagonal blocks have stiffness.

    diagonal (n, 3, 3); size (n,): their usual size.  A pseudo-inverse where that is singular.
    """
    if not A.size:
        return A
    left, s, right = np.linalg.svd(diagonal)
    dead = s <= DEAD * size[:, None]
    k = np.arange(len(diagonal))
    whole = A.reshape(len(k), 3, len(k), 3).copy()
    whole[k, :, k, :] += size[:, None, None] * ((left * dead[:, None, :]) @ right)
    whole = whole.reshape(A.shape)
    out = _inverse(whole)
    regular = out is not None and np.abs(out).max() * np.abs(whole).max() * SMALL < 1
    return out if out is not None and regular else pseudo_inverse(A)


def _inverse(A: Array) -> Array | None:
    """A^-1 in half the time of `numpy.linalg.inv`, which solves for ones; None if singular."""
    from scipy.linalg import lapack

    factor, pivots, singular = lapack.dgetrf(A)
    if singular:
        return None
    work = int(lapack.dgetri_lwork(len(A))[0].real)
    return np.ascontiguousarray(lapack.dgetri(factor, pivots, lwork=work)[0])


def pseudo_inverse(A: Array) -> Array:
    """That of A (n, n), without directions in which it has next to no stiffness."""
    return np.linalg.pinv(A, rcond=SMALL).astype(float, copy=False)
