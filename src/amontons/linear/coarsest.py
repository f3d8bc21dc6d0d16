"""The inverse of the coarsest matrix of multigrid, which may be at rest in some directions."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .node_blocks import DEAD

Array = NDArray[np.float64]
SURE = 1e-7  # determinant of a block, relative to its size, from which no direction rests
SMALL = 1e-10  # singular values of the coarsest matrix below this part of the largest rest


@dataclass(frozen=True, eq=False)
class Factored:
    """P L U of a matrix, for `inverse @ b`: made in a quarter of the time of the inverse."""

    factor: Array
    pivots: NDArray[np.int32]

    def __matmul__(self, b: Array) -> Array:
        """The solution for b, (n,)."""
        from scipy.linalg import lapack

        return lapack.dgetrs(self.factor, self.pivots, b)[0]


def inverse_at_rest(A: Array, diagonal: Array, size: Array) -> Array:
    """Inverse of A (3 n, 3 n) on the directions in which its diagonal blocks have stiffness.

    diagonal (n, 3, 3); size (n,): their usual size.  A pseudo-inverse where that is singular.
    """
    if not A.size:
        return A
    whole = _held_at_rest(A, diagonal, size)
    out = _inverse(whole)
    regular = out is not None and np.abs(out).max() * np.abs(whole).max() * SMALL < 1
    return out if out is not None and regular else pseudo_inverse(A)


def factored_at_rest(A: Array, diagonal: Array, size: Array) -> Array | Factored:
    """The same to multiply with a few times only."""
    from scipy.linalg import lapack

    if not A.size:
        return A
    whole = np.asfortranarray(_held_at_rest(A, diagonal, size))
    length = np.abs(whole).sum(axis=0).max()
    factor, pivots, singular = lapack.dgetrf(whole, overwrite_a=True)
    regular = not singular and lapack.dgecon(factor, length)[0] > SMALL
    return Factored(factor, pivots) if regular else pseudo_inverse(A)


def _held_at_rest(A: Array, diagonal: Array, size: Array) -> Array:
    """A with a stiffness in the directions in which its diagonal blocks have none."""
    k = np.flatnonzero(~(np.abs(np.linalg.det(diagonal)) > SURE * size**3))
    left, s, right = np.linalg.svd(diagonal[k])
    dead = s <= DEAD * size[k, None]
    whole = A.reshape(len(diagonal), 3, len(diagonal), 3).copy()
    whole[k, :, k, :] += size[k, None, None] * ((left * dead[:, None, :]) @ right)
    return whole.reshape(A.shape)


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
