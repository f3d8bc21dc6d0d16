"""The compiled search for a status pattern whose linear piece has no positive determinant.

A pattern gives every contact a state; its matrix has a row and a column per closed direction:

    free   nothing                        slip   row u_N, column r = (1, m), m = +-mu
    stick  rows u_N, u_T, columns r_N, r_T    tangent  row u_T, column r_T (no state of contact:
                                                       only the P-matrix criterion has it)

The contacts are eliminated one after the other (Schur complements of W), so that the 4^n
patterns share their work: a pattern costs its last pivot.  A determinant is the product of
pivots, and those before the last one make the determinant with all later contacts free; so as
long as no pattern has failed every pivot must be positive.  All entries carry a bound on their
rounding errors: a pivot is positive, negative, or not known.

[Higham] N. J. Higham, "Accuracy and Stability of Numerical Algorithms", 2nd ed. (2002), 3.3.
"""

from __future__ import annotations

import numpy as np

from ...core.compiled import njit
from ..statuses import FREE, MINUS, PLUS, STICK, TANGENT

POSITIVE, NEGATIVE, UNKNOWN, STOPPED = 1, -1, 0, 2
EPSILON = float(np.finfo(float).eps)
ROOM = 1.0 + 1e-9  # rounding within the bounds themselves


@njit(cache=True)
def _eliminate_inplace(S, B, size, row, weight, T, C):
    """Schur complement T of S for the pivot (row 0 or 1, column r = e_row + weight e_T).

    B, C bound the rounding errors of S, T.  row 0, 1 are u_N, u_T of the first contact; T keeps
    all rows and columns.  False where the sign of the pivot is not known or not positive.
    """
    pivot = S[row, row]
    error = B[row, row]
    if weight != 0.0:
        pivot += weight * S[row, 1]
        error += abs(weight) * B[row, 1] + EPSILON * (abs(pivot) + abs(weight * S[row, 1]))
    error *= ROOM
    if not pivot > error:
        return False
    least = pivot - error
    for i in range(size):
        c = S[i, row]
        e = B[i, row]
        if weight != 0.0:
            c += weight * S[i, 1]
            e += abs(weight) * B[i, 1] + EPSILON * (abs(c) + abs(weight * S[i, 1]))
        f = c / pivot
        ef = ((e + abs(f) * error) / least + EPSILON * abs(f)) * ROOM
        for j in range(size):
            b = S[row, j]
            T[i, j] = S[i, j] - f * b
            C[i, j] = ROOM * (
                B[i, j] + abs(f) * B[row, j] + ef * (abs(b) + B[row, j])
                + EPSILON * (2 * abs(f * b) + abs(S[i, j]))
            )  # fmt: skip
    return True


@njit(cache=True)
def _sign(value, error):
    if value > ROOM * error:
        return POSITIVE
    return NEGATIVE if value < -ROOM * error else UNKNOWN


@njit(cache=True)
def _slip_sign(S, B, m):
    value = S[0, 0] + m * S[0, 1]
    error = B[0, 0] + abs(m) * B[0, 1] + EPSILON * (abs(value) + abs(m * S[0, 1]))
    return _sign(value, error)


@njit(cache=True)
def _stick_sign(S, B):
    """Sign of det S / S_NN of the first contact, S_NN being positive."""
    first = _sign(S[0, 0], B[0, 0])
    if first != POSITIVE:
        return first
    f = S[1, 0] / S[0, 0]
    ef = (B[1, 0] + abs(f) * B[0, 0]) / (S[0, 0] - ROOM * B[0, 0]) + EPSILON * abs(f)
    value = S[1, 1] - f * S[0, 1]
    error = (
        B[1, 1] + abs(f) * B[0, 1] + ROOM * ef * (abs(S[0, 1]) + B[0, 1])
        + EPSILON * (2 * abs(f * S[0, 1]) + abs(S[1, 1]))
    )  # fmt: skip
    return _sign(value, error)


@njit(cache=True)
def _state_sign(S, B, state, m):
    """Sign of the pivot of the first contact in a state."""
    if state == FREE:
        return POSITIVE
    if state == PLUS:
        return _slip_sign(S, B, m)
    if state == MINUS:
        return _slip_sign(S, B, -m)
    if state == STICK:
        return _stick_sign(S, B)
    return _sign(S[1, 1], B[1, 1])


@njit(cache=True)
def _enter_inplace(S, B, size, state, m, T, C, X, Y):
    """T, C for the other contacts after the first one got a state whose pivot is positive."""
    if state == FREE:
        for i in range(size - 2):
            for j in range(size - 2):
                T[i, j], C[i, j] = S[i + 2, j + 2], B[i + 2, j + 2]
        return
    if state == TANGENT:
        _eliminate_inplace(S, B, size, 1, 0.0, X, Y)
    elif state == STICK:
        _eliminate_inplace(S, B, size, 0, 0.0, T, C)
        _eliminate_inplace(T, C, size, 1, 0.0, X, Y)
    else:
        _eliminate_inplace(S, B, size, 0, m if state == PLUS else -m, X, Y)
    for i in range(size - 2):
        for j in range(size - 2):
            T[i, j], C[i, j] = X[i + 2, j + 2], Y[i + 2, j + 2]


@njit(cache=True)
def search_inplace(m, allowed, S, B, work, turn, states, level, budget):
    """Go on with the search; (POSITIVE, NEGATIVE, UNKNOWN or STOPPED, level, patterns seen).

    S, B (n + 1, 2 n, 2 n): Schur complements and error bounds of all levels, S[0] = W given.
    work (2, 2 n, 2 n).  m (n,): friction.  allowed (n, 5): states that a contact may have.
    turn (n,): next state to try, states (n,): the pattern so far.
    NEGATIVE, UNKNOWN: the pivot of the last state of `states[: level + 1]` is not positive, or
    not known to be.  STOPPED: more than `budget` pivots were looked at, call again to go on.
    POSITIVE: there is none.
    """
    n = len(m)
    seen = 0
    while level >= 0:
        if turn[level] > TANGENT:
            turn[level] = 0
            level -= 1
            continue
        state = turn[level]
        if not allowed[level, state]:
            turn[level] += 1
            continue
        if seen >= budget:
            return STOPPED, level, seen
        turn[level] += 1
        states[level] = state
        seen += 1
        sign = _state_sign(S[level], B[level], state, m[level])
        if sign != POSITIVE:
            return sign, level, seen
        if level + 1 < n:
            _enter_inplace(S[level], B[level], 2 * (n - level), state, m[level],
                           S[level + 1], B[level + 1], work[0], work[1])  # fmt: skip
            level += 1
            turn[level] = 0
    return POSITIVE, level, seen


@njit(cache=True)
def eliminate(S, B, state, m):
    """(sign of the pivot, Schur complement, error bound) with the first contact in a state."""
    size = len(S)
    T, C, X, Y = np.empty((4, size, size))
    sign = _state_sign(S, B, state, m)
    if sign == POSITIVE:
        _enter_inplace(S, B, size, state, m, T, C, X, Y)
    return sign, T[: size - 2, : size - 2].copy(), C[: size - 2, : size - 2].copy()
