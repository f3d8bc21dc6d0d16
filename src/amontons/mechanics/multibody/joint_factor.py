"""W_JJ of joints in a block factorisation whose order and fill are found once, and W_JJ^+.

W_JJ^+ is (W_JJ + e)^-1 refined with W_JJ: rows that say something twice get equal shares.  e is
a part of the mean diagonal of those joints that are linked by bodies, of no others.  What is
left of one null direction after another has an error of rounding over e: the pivot of a weld,
of three joints, may vanish by chance, and with it all digits.  So each factor is tried on a
vector, and e grows where (W + e) does not bring it back.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from ...core.compiled import njit
from ...solvers.newton.block_lu import factorise_inplace, solve_inplace
from .rows import fill_blocks

SMALL = 1e-10  # e over the mean of the diagonal of W_JJ: digits that a null direction costs
LARGEST = 1e-6  # the same where rounding takes a smaller one away
RETURNED = 2.0  # missing of a vector, of 1, at most: rounding is then below 2 e
ROUNDS = 20  # of refinement at most
REFINED = 1e-13  # of the right side, at which it ends
HELPS = 0.999  # of what was left, at most, after a round that another may follow


class Pattern(NamedTuple):
    """W_JJ of k joints in rows of blocks, its symbolic factor, and its parts.

    linked (k,): the part of a joint, those that bodies link.
    """

    indptr: Any
    indices: Any
    symbolic: Any
    linked: Any


@njit(cache=True, error_model="numpy")
def factorised(rows, pattern, masses, inverse):
    """Blocks of W_JJ and its factor, as `solved_bonds` takes them; inverse in global axes.

    Raises LinAlgError where they are no numbers.
    """
    slave, master, axes, arms, others = rows
    indptr, indices, symbolic, linked = pattern
    order, upper_start, upper, lower_start, lower = symbolic
    k = len(slave)
    data, diagonal = np.empty((len(indices), 3, 3)), np.empty(k, np.int32)
    filled = np.empty(len(indices), np.int32)
    fill_blocks(
        slave, master, axes, arms, others, masses, inverse, indptr, filled, data, diagonal
    )
    total, count = np.zeros(k), np.zeros(k)
    for j in range(k):
        W = data[diagonal[j]]
        total[linked[j]] += (W[0, 0] + W[1, 1] + W[2, 2]) / 3
        count[linked[j]] += 1
    extra = np.zeros((k, 3, 3))
    U, L = np.empty((len(upper), 3, 3)), np.empty((len(upper), 3, 3))
    pivots, work = np.empty((k, 3, 3)), np.zeros((k, 3, 3))
    small = SMALL
    while True:
        for j in range(k):
            for i in range(3):
                extra[j, i, i] = small * total[linked[j]] / count[linked[j]]
        regular = factorise_inplace(
            indptr, indices, data, extra, order, upper_start, upper, lower_start, lower,
            U, L, pivots, work,
        )  # fmt: skip
        small *= 10.0
        if regular and _missing(pattern, (data, U, L, pivots), extra) <= RETURNED:
            break
        if small > LARGEST:
            if regular:
                break
            raise np.linalg.LinAlgError("the inertia that joints feel is no number")
    return data, U, L, pivots


@njit(cache=True, error_model="numpy")
def _missing(pattern, factor, extra):
    """What (W + extra) does not bring back of a vector of its factor's making."""
    indptr, indices, symbolic, _ = pattern
    order, upper_start, upper, lower_start, lower = symbolic
    data, U, L, pivots = factor
    k, most = len(extra), 0.0
    tried, back, felt = np.empty((k, 3)), np.empty((k, 3)), np.empty((k, 3))
    for j in range(k):
        for i in range(3):
            tried[j, i] = np.cos(1.0 + 3 * j + i)
    solve_inplace(order, upper_start, upper, lower_start, lower, U, L, pivots, tried, back)
    _felt_inplace(indptr, indices, data, back, felt)
    for j in range(k):
        for i in range(3):
            rest = abs(tried[j, i] - felt[j, i] - extra[j, i, i] * back[j, i])
            if not rest <= most:
                most = rest if rest == rest else np.inf  # noqa: PLR0124
    return most


@njit(cache=True, error_model="numpy")
def solved_bonds(pattern, factor, b):
    """W_JJ^+ b (k, 3), also of b that joints contradict, by (W + e)^-1 W (W + e)^-1.

    (W + e)^-1 alone would give 1 / e of that part in each round.
    """
    indptr, indices, symbolic, _ = pattern
    order, upper_start, upper, lower_start, lower = symbolic
    data, U, L, pivots = factor
    x, part, rest = np.zeros_like(b), np.empty_like(b), b.copy()
    felt, size = np.empty_like(b), np.abs(b).max()
    left = size
    for _ in range(ROUNDS):
        solve_inplace(order, upper_start, upper, lower_start, lower, U, L, pivots, rest, part)
        _felt_inplace(indptr, indices, data, part, felt)
        solve_inplace(order, upper_start, upper, lower_start, lower, U, L, pivots, felt, part)
        x += part
        _felt_inplace(indptr, indices, data, x, felt)
        rest[:] = b - felt
        last, left = left, np.abs(rest).max()
        if not (left > REFINED * size and left <= HELPS * last):
            break
    return x


@njit(cache=True, error_model="numpy")
def _felt_inplace(indptr, indices, data, x, out):
    """out = W x, (k, 3)."""
    for i in range(len(x)):
        for a in range(3):
            out[i, a] = 0.0
            for k in range(indptr[i], indptr[i + 1]):
                for d in range(3):
                    out[i, a] += data[k, a, d] * x[indices[k], d]
