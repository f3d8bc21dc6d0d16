"""Sparse matrices made dense, where they fit into memory."""

from __future__ import annotations

import os
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..core.errors import InvalidInput

Array = NDArray[np.float64]
DENSE_LIMIT = 4e9  # bytes that W may fill
HALF = 0.5  # of the memory of the machine that dense matrices may take


def dense(matrix: Any, copies: int = 1, name: str = "W") -> Array:
    """A sparse matrix as an array; what is dense already comes back as it is.

    copies: arrays of this size that are needed at a time.  Raises InvalidInput where they
    would take more than DENSE_LIMIT each, or more than HALF of the memory together.
    """
    if isinstance(matrix, np.ndarray):
        return matrix
    rows, columns = matrix.shape
    check_fits(8.0 * rows * columns, copies, f"{name} of {rows} rows")
    return matrix.toarray()


def check_fits(size: float, copies: int, of: str) -> None:
    """Raise InvalidInput where `copies` arrays of so many bytes are too large."""
    if size > DENSE_LIMIT or copies * size > HALF * _memory():
        times = f"{copies} times " if copies > 1 else ""
        raise InvalidInput(
            f"{of} is sparse; what is asked needs it dense, {times}{1e-9 * size:.1f} GB"
        )


def _memory() -> float:
    """Bytes of memory of this machine, infinite where it does not tell."""
    try:
        return float(os.sysconf("SC_PAGE_SIZE")) * os.sysconf("SC_PHYS_PAGES")
    except (AttributeError, ValueError, OSError):  # not a POSIX system
        return np.inf
