"""One compiled look at numbers from outside, for what is to be put right in them."""

from __future__ import annotations

import math

from .compiled import njit


@njit(cache=True, error_model="numpy")
def size_of_canonical(indptr, indices, data, lines, width):
    """The largest |entry| of a canonical matrix; -1 where it is none or holds no number.

    Canonical: `lines` rows (or columns) that begin with 0 and never fall, ascending indices
    below `width` in each, and no entry beyond the last.
    """
    if len(indptr) != lines + 1 or indptr[0] != 0 or indptr[lines] != len(indices):
        return -1.0
    if len(data) != len(indices):
        return -1.0
    size = 0.0
    for i in range(lines):
        before = -1
        if indptr[i + 1] < indptr[i] or indptr[i + 1] > len(indices):
            return -1.0
        for k in range(indptr[i], indptr[i + 1]):
            if indices[k] <= before or indices[k] >= width:
                return -1.0
            before = indices[k]
            if not abs(data[k]) < math.inf:
                return -1.0
            size = max(size, abs(data[k]))
    return size


@njit(cache=True, error_model="numpy")
def largest(values):
    """The largest |entry| of values (k,), 0 of none; nan where one is not a number."""
    size = 0.0
    for value in values:
        if not abs(value) <= size:
            size = abs(value)
            if size != size:
                break
    return size


@njit(cache=True, error_model="numpy")
def are_within(values, low, high):
    """True where all values (k,) are numbers from low to high."""
    for value in values:
        if not low <= value <= high:
            return False
    return True
