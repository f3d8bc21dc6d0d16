"""The kernel of a sparse matrix with one column more than rows, without its singular values.

With any row b not orthogonal to the kernel, t = [A; b]^-1 e_last spans it if A has full rank.
The bordered matrix with b = t is then singular exactly where A has not, and inverse iteration
shows a second line: its least singular value is compared with that of A's scaled rows, 1.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.linalg import splu

Array = NDArray[np.float64]
ALONG = 0.1  # cosine between b and the line from which b serves as it is
ROUNDS = 4  # of inverse iteration
BESIDE = 1e-13  # change of a matrix with rows of length 1 that only moves it off a singular one


def sparse_kernel(J: sparse.sparray, Jp: Array, weight: float, singular: float) -> Array:
    """Columns (n + 1, 1 or 2), orthonormal in the weighted norm, with J y' + Jp p' = 0.

    Two where a second singular value, relative to the largest, is below `singular`; a kernel
    may then be larger still.
    """
    root = np.sqrt(weight)
    whole: Any = sparse.hstack([sparse.csr_array(J) / root, sparse.csr_array(Jp[:, None])])
    A = _scaled(whole)
    random = np.random.default_rng(0)
    found = _line(A, random)
    if found is None:
        return np.zeros((A.shape[1], 2))
    t, factor = found
    second, value = _least(factor, random.standard_normal(len(t)))
    lines = t[:, None]
    if value <= singular:
        second -= (second @ t) * t
        lines = np.column_stack([t, second / np.linalg.norm(second)])
    lines[:-1] /= root
    return lines


def _scaled(A: sparse.sparray) -> sparse.csr_array:
    """The matrix with rows of length 1; rows of rounding stay small."""
    A = sparse.csr_array(A)
    size = sparse.linalg.norm(A, axis=1)
    floor = 1e-8 * max(1.0, float(size.max(initial=0.0)))
    return sparse.csr_array(sparse.diags_array(1 / np.maximum(size, floor)) @ A)


def _line(A: sparse.csr_array, random: np.random.Generator) -> tuple[Array, Any] | None:
    """(t, factor of [A; b]), t in the kernel and b along it, or t itself if b was not."""
    n = A.shape[1]
    last = np.zeros(n)
    last[-1] = 1.0
    for border in (last, random.standard_normal(n), random.standard_normal(n)):
        try:
            factor = _bordered(A, border, random)
            t = factor.solve(last)
            line = t / np.linalg.norm(t)
            if 1 / (np.linalg.norm(t) * np.linalg.norm(border)) <= ALONG:
                factor = _bordered(A, line, random)  # singular still with a second line
        except RuntimeError:  # "Factor is exactly singular"
            continue
        if np.isfinite(line).all():
            return line, factor
    return None


def _bordered(A: sparse.csr_array, border: Array, random: np.random.Generator) -> Any:
    """LU factors of [A; b]; of a matrix beside it where it is singular to the last bit."""
    matrix = sparse.csc_array(sparse.vstack([A, sparse.csr_array(border[None, :])]))
    try:
        return splu(matrix, permc_spec="MMD_AT_PLUS_A")
    except RuntimeError:  # "Factor is exactly singular"
        beside = sparse.diags_array(BESIDE * random.uniform(1, 2, len(border)))
        return splu(sparse.csc_array(matrix + beside), permc_spec="MMD_AT_PLUS_A")


def _least(factor: Any, x: Array) -> tuple[Array, float]:
    """(right singular vector, least singular value) of a factorised matrix."""
    value = np.inf
    for _ in range(ROUNDS):
        x = x / np.linalg.norm(x)
        y = factor.solve(x, trans="T")
        x = factor.solve(y)
        value = float(np.linalg.norm(y) / np.linalg.norm(x))
        if not np.isfinite(value) or value == 0:
            return np.zeros_like(x), 0.0
    return x / np.linalg.norm(x), value
