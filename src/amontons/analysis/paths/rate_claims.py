"""Existence and uniqueness of tangents: the conditions of [LR] propositions 7, 8 and 9 on D.

x has first scalar complementarity conditions (pairs), then the normal and then the tangential
rates of contacts at rest with friction mu; C is the cone x >= 0, |x_T| <= mu x_N.

[LR] T. Ligurský, Y. Renard, CMAME 280 (2014), section 3.1.1.
"""

from __future__ import annotations

from collections.abc import Iterator
from enum import Enum

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
ROUNDING = 1e-11  # of values, in units of the largest entry, that may have either sign
SIMPLICES = 20_000  # that are looked at before copositivity is left undecided
PIVOTS = 30_000  # of a recursion over principal minors


class Claim(Enum):
    """What is known of a condition."""

    PROVED = "It holds."
    REFUTED = "It does not hold."
    UNDECIDED = "It is on the border within rounding, or there is too much to look at."


def strictly_copositive(D: Array, pairs: int, mu: Array) -> Claim:
    """x D x > 0 for all x != 0 in C ([LR] (37)).

    On simplices of the cone's edges, cut in two where products of two corners are negative.
    """
    if not len(D) or _definite(D):
        return Claim.PROVED
    edges = _edges(len(D), pairs, mu)
    Q = edges.T @ (D + D.T) @ edges / 2
    size = float(np.abs(Q).max())
    stack, unsure = [np.eye(len(Q))], False
    for _ in range(SIMPLICES):
        if not stack:
            return Claim.UNDECIDED if unsure else Claim.PROVED
        V = stack.pop()
        B = V.T @ Q @ V
        own = np.diagonal(B)
        if (own < -ROUNDING * size).any():
            return Claim.REFUTED
        if (own <= ROUNDING * size).any():
            unsure = True
            continue
        angles = B / np.sqrt(np.outer(own, own))
        i, j = np.unravel_index(int(angles.argmin()), B.shape)
        if angles[i, j] >= 0:
            continue
        share = np.sqrt(own[i]) / (np.sqrt(own[i]) + np.sqrt(own[j]))
        middle = (1 - share) * V[:, i] + share * V[:, j]
        for k in (i, j):
            half = V.copy()
            half[:, k] = middle / np.abs(middle).sum()
            stack.append(half)
    return Claim.UNDECIDED


def _definite(D: Array) -> bool:
    values = np.linalg.eigvalsh((D + D.T) / 2)
    return bool(values[0] > ROUNDING * max(abs(values[-1]), abs(values[0])))


def _edges(n: int, pairs: int, mu: Array) -> Array:
    """Generators of C as columns, (n, pairs + 2 zi); one of a contact whose mu is zero."""
    columns = list(np.eye(n)[:, :pairs].T)
    for k, m in enumerate(mu):
        for sign in (1.0, -1.0) if m > 0 else (1.0,):
            column = np.zeros(n)
            column[pairs + k], column[pairs + len(mu) + k] = 1.0, sign * m
            columns.append(column / np.linalg.norm(column))
    return np.array(columns).T


def is_P_matrix(D: Array, pairs: int, mu: Array) -> Claim:
    """[LR] proposition 8: all principal minors are positive, for all s in [-1, 1].

    D with the columns of x_N less s mu times those of x_T.  Every minor is affine in each s, so
    signs are enough; and by pivots, whose products the minors are.
    """
    sizes = np.abs(D).max(initial=0.0)
    count, unsure = 0, False
    for pivot, scale in _pivots(D, pairs, mu):
        count += 1
        if pivot < -ROUNDING * max(scale, ROUNDING * sizes):
            return Claim.REFUTED
        if pivot <= ROUNDING * max(scale, ROUNDING * sizes):
            unsure = True
        if count > PIVOTS:
            return Claim.PROVED if _definite_for_all_signs(D, pairs, mu) else Claim.UNDECIDED
    return Claim.UNDECIDED if unsure else Claim.PROVED


def _pivots(D: Array, pairs: int, mu: Array) -> Iterator[tuple[float, float]]:
    """All pivots of all ways to eliminate a part of the unknowns, with their scales.

    The first condition is left out, or its unknown is eliminated; a contact at rest is left
    out, slips one way or the other, or is stuck.  Zero pivots end their way.
    """
    stack = [(D, np.abs(D), pairs, mu)]
    while stack:
        A, size, n, friction = stack.pop()
        if not len(A):
            continue
        if n:
            keep = np.arange(1, len(A))
            stack.append((A[np.ix_(keep, keep)], size[np.ix_(keep, keep)], n - 1, friction))
            yield float(A[0, 0]), float(size[0, 0])
            if A[0, 0] != 0:
                stack.append((*_schur(A, size, 0, A[:, 0], keep), n - 1, friction))
            continue
        T, rest = len(friction), friction[1:]
        keep = np.delete(np.arange(len(A)), [0, T])
        stack.append((A[np.ix_(keep, keep)], size[np.ix_(keep, keep)], 0, rest))
        for column in (A[:, 0] - friction[0] * A[:, T], A[:, 0] + friction[0] * A[:, T]):
            yield float(column[0]), float(size[0, 0] + friction[0] * size[0, T])
            if column[0] != 0:
                stack.append((*_schur(A, size, 0, column, keep), 0, rest))
        yield float(A[T, T]), float(size[T, T])
        if A[T, T] == 0:
            continue
        both = np.delete(np.arange(len(A)), T)
        once, grown = _schur(A, size, T, A[:, T], both)
        yield float(once[0, 0]), float(grown[0, 0])
        if once[0, 0] != 0:
            left = np.arange(1, len(once))
            stack.append((*_schur(once, grown, 0, once[:, 0], left), 0, rest))
        stack.append((once[1:, 1:], grown[1:, 1:], 0, rest))  # no piece, but a minor


def _schur(
    A: Array, size: Array, k: int, column: Array, keep: NDArray[np.int64]
) -> tuple[Array, Array]:
    """A on some rows and columns with unknown k eliminated by a column of it, and its scale."""
    change = np.outer(column[keep], A[k, keep]) / column[k]
    return A[np.ix_(keep, keep)] - change, np.maximum(size[np.ix_(keep, keep)], np.abs(change))


def _definite_for_all_signs(D: Array, pairs: int, mu: Array) -> bool:
    """Sufficient for proposition 8: x D(s) x > 0 for all s, by the size of what they change."""
    n, zi = len(D), len(mu)
    S = (D + D.T) / 2
    if not _definite(D):
        return False
    values, vectors = np.linalg.eigh(S)
    half = vectors / np.sqrt(values)
    whole = np.zeros((n, n))
    for k in range(zi):
        change = np.zeros((n, n))
        change[:, pairs + k] = mu[k] * D[:, pairs + zi + k]
        part, parts = np.linalg.eigh(half.T @ (change + change.T) / 2 @ half)
        whole += (parts * np.abs(part)) @ parts.T  # |change| in the norm of S
    return bool(np.linalg.eigvalsh(whole)[-1] < 1 - 1e-9)


def all_pieces_regular(D: Array, b: Array, pairs: int, mu: Array) -> Claim:
    """[LR] proposition 9: [D b] on every piece has as many independent columns as rows."""
    zi = len(mu)
    patterns = 2**pairs * 4.0**zi
    if patterns > PIVOTS:
        return Claim.UNDECIDED
    worst = Claim.PROVED
    for word in np.ndindex(*([2] * pairs + [4] * zi)):
        rows, columns = _piece(D, word, pairs, mu)
        if not rows:
            continue
        matrix = np.column_stack([D[rows] @ columns, b[rows]])
        size = np.linalg.norm(matrix, axis=1)
        if (size <= ROUNDING).any():
            return Claim.REFUTED
        least = float(np.linalg.svd(matrix / size[:, None], compute_uv=False)[-1])
        if least <= ROUNDING:
            return Claim.REFUTED
        if least <= 1e3 * ROUNDING:
            worst = Claim.UNDECIDED
    return worst


def _piece(
    D: Array, word: tuple[int, ...], pairs: int, mu: Array
) -> tuple[list[int], Array]:
    """Rows whose y is zero on a piece, and x = columns w of what is free there.

    word: of pairs 1 for y = 0; of contacts at rest 0 free, 1 stick, 2 and 3 slip + and -.
    """
    rows, columns, zi = [], [], len(mu)
    eye = np.eye(len(D))
    for k, letter in enumerate(word):
        if letter == 0:
            continue
        tangential = k + zi
        rows.append(k)
        if k < pairs:
            columns.append(eye[k])
        elif letter == 1:
            rows.append(tangential)
            columns += [eye[k], eye[tangential]]
        else:
            sign = 1.0 if letter == 2 else -1.0
            columns.append(eye[k] + sign * mu[k - pairs] * eye[tangential])
    return rows, np.array(columns).T if columns else np.zeros((len(D), 0))
