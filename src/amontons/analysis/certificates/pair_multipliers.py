"""Proofs by quadratic multipliers that no pattern of some contacts has a singular piece.

With z_p = (r_N, r_T, u_N, u_T) of a contact and symmetric W_c for pairs c of contacts, and for
single ones where that is enough, let

    z_c W_c z_c < 0  for all contacts of c in any of the states free, stick, slip+, slip-,
    M(S) = sum_c z_c W_c z_c > 0  for u = S r, r != 0.

Then no combination of states is singular.  All of them also have one orientation: let Q be the
form of the sum and Q_p its part on contact p.  With the other contacts in their states C, the
form of contact p that is left is K >= Q_p, negative on all states of p and, as M > 0, with no
more than two negative eigenvalues.  Where Q_p has two positive ones, so has all that is between
Q_p and K; then a K b is regular for two states a, b (a vector of b orthogonal to a would be
positive), and det(-a K b), the relative orientation of a and b, has the sign of det(-a Q_p b).
That is checked for stick against the other three.  As all contacts sticking or free has a
positive determinant, all determinants are positive.

[Boyd] S. Boyd et al., "Linear Matrix Inequalities in System and Control Theory" (1994), 2.6.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import linalg
from scipy.sparse.csgraph import minimum_spanning_tree

from ...core.clock import TimeLimit
from ..multipliers.lmi import (
    Family,
    LmiOutcome,
    Multipliers,
    Slacks,
    find_multipliers,
    restricted,
    slacks_are_positive,
)
from ..multipliers.rounding import EPSILON, is_positive_definite
from ..statuses import FREE, MINUS, PLUS, STICK

Array = NDArray[np.float64]
Pairs = NDArray[np.int64]
STATES = (FREE, PLUS, MINUS, STICK)  # in this order
HOPELESS = 3e-3  # eigenvalue of M below which the search ends, the mean of all being 1
ORIENTED = (1, -1, -1)  # sign of det(-stick Q b) for b = free, slip+, slip- in `state_planes`
FEW = 16  # contacts that are all paired
ACTIVE = 0.1  # undecided weight of contacts that are paired, of the largest one
MARGIN = 1e-9  # of signs of four-by-four matrices, relative: far above rounding


@dataclass(frozen=True, eq=False)
class PairMultipliers:
    """pairs (J, 2): places of contacts; W (J, 8, 8): of (z_p, z_q) of every pair.

    singles (K,), V (K, 4, 4): contacts with multipliers of their own.
    """

    pairs: Pairs
    W: Array
    singles: NDArray[np.int64]
    V: Array

    def form(self, contacts: int) -> tuple[Array, Array]:
        """(Q, bound of its rounding), (4 k, 4 k) each."""
        Q, size = np.zeros((2, 4 * contacts, 4 * contacts))
        for rows, own in ((pair_rows(self.pairs), self.W), (single_rows(self.singles), self.V)):
            for where, block in zip(rows, own, strict=True):
                Q[np.ix_(where, where)] += block
                size[np.ix_(where, where)] += np.abs(block)
        terms = np.bincount(self.pairs.ravel(), minlength=contacts).max(initial=0)
        return Q, 2 * EPSILON * (3 + int(terms)) * size


def state_planes(m: Array) -> Array:
    """Planes of z in the states free, slip+, slip-, stick of every contact, (k, 4, 4, 2)."""
    planes = np.zeros((len(m), len(STATES), 4, 2))
    planes[:, 0, 2, 0] = planes[:, 0, 3, 1] = 1.0
    planes[:, 1:3, 0, 0] = planes[:, 1:3, 3, 1] = 1.0
    planes[:, 1, 1, 0], planes[:, 2, 1, 0] = m, -m
    planes[:, 3, 0, 0] = planes[:, 3, 1, 1] = 1.0
    return planes


def pair_rows(pairs: Pairs) -> NDArray[np.int64]:
    """Rows (J, 8) of z of both contacts of a pair among those of all contacts."""
    return (4 * pairs[:, :, None] + np.arange(4)).reshape(-1, 8)


def single_rows(singles: NDArray[np.int64]) -> NDArray[np.int64]:
    """Rows (K, 4) of z of single contacts."""
    return 4 * singles[:, None] + np.arange(4)


def strongest_pairs(S: Array) -> Pairs:
    """Pairs that connect all contacts by the strongest couplings: a tree, (k - 1, 2)."""
    k = len(S) // 2
    size = np.sqrt((S.reshape(k, 2, k, 2) ** 2).sum(axis=(1, 3)))
    size = np.maximum(size, size.T)
    np.fill_diagonal(size, 0)
    least = size.max(initial=0) * 1e-12 + np.finfo(float).tiny
    tree = minimum_spanning_tree(1 / np.maximum(size, least) * (1 - np.eye(k))).tocoo()
    return np.sort(np.stack([tree.row, tree.col], axis=1).astype(np.int64), axis=1)


def pair_family(pairs: Pairs, m: Array) -> Family:
    """The matrix inequalities -W_c > 0 on all pairs of states; m (k,) friction."""
    planes = state_planes(m)
    owner = np.arange(len(pairs))
    slacks = []
    for a in range(len(STATES)):
        for b in range(len(STATES)):
            G = np.zeros((len(pairs), 8, 4))
            G[:, :4, :2], G[:, 4:, 2:] = planes[pairs[:, 0], a], planes[pairs[:, 1], b]
            slacks.append(Slacks(owner, restricted(G)))
    return Family(pair_rows(pairs), tuple(slacks), np.zeros(0))


def single_family(singles: NDArray[np.int64], m: Array) -> Family:
    """The matrix inequalities -W_p > 0 on all states of single contacts."""
    planes = state_planes(m)
    owner = np.arange(len(singles))
    slacks = tuple(Slacks(owner, restricted(planes[singles, a])) for a in range(len(STATES)))
    return Family(single_rows(singles), slacks, np.zeros(0))


def find_pair_multipliers(
    S: Array, rounding: Array, m: Array, *, time_limit: TimeLimit,
    undecided: Array | None = None,
) -> tuple[PairMultipliers | None, Array]:  # fmt: skip
    """(proved multipliers or None, weight (k, 4) of every state where there are none).

    S, rounding (2 k, 2 k): u = (S + d) r with any |d| <= rounding.  The weights belong to the
    dual moments: how much of every state a contact would need for a singular piece.
    undecided (k,): what of them is known; many contacts are paired only where it is large.
    """
    k = len(m)
    pairs = _chosen_pairs(S, undecided)
    singles = np.setdiff1d(np.arange(k), pairs)
    families = [pair_family(pairs, m)] if len(pairs) else []
    families += [single_family(singles, m)] if len(singles) else []
    T = _coordinates(S)

    def multipliers(W: tuple[Array, ...]) -> PairMultipliers:
        V = W[-1] if len(singles) else np.zeros((0, 4, 4))
        return PairMultipliers(pairs, W[0] if len(pairs) else np.zeros((0, 8, 8)), singles, V)

    def accept(W: tuple[Array, ...], extras: tuple[Array, ...]) -> bool:
        found = multipliers(W)
        return (
            proves(found, S, rounding, T)
            and is_oriented(found, m)
            and slacks_are_positive(families, W, extras)
        )

    answer = find_multipliers(_stacked(T, S @ T), families, accept=accept,
                              time_limit=time_limit, smallest=HOPELESS)  # fmt: skip
    if answer.outcome is LmiOutcome.FOUND:
        return multipliers(answer.W), np.zeros((k, len(STATES)))
    return None, _weights(answer, pairs, singles, k)


def _chosen_pairs(S: Array, undecided: Array | None) -> Pairs:
    """All strongest pairs of few contacts, of many those with an undecided contact."""
    pairs = strongest_pairs(S)
    if len(S) // 2 <= FEW:
        return pairs
    if undecided is None:
        return pairs[:0]
    return pairs[undecided[pairs].max(axis=1) > ACTIVE * undecided.max()]


def proves(
    multipliers: PairMultipliers, S: Array, rounding: Array, T: Array | None = None
) -> bool:
    """True only when M(S + d) is positive definite for all |d| <= rounding."""
    k = len(S) // 2
    Q, spread = multipliers.form(k)
    T = _coordinates(S) if T is None else T
    z = _stacked(np.eye(2 * k), S)
    size, off = _stacked(np.eye(2 * k), np.abs(S)), _stacked(np.zeros((2 * k, 2 * k)), rounding)
    M = z.T @ Q @ z
    most = np.abs(Q) + spread
    error = (8 * k + 20) * EPSILON * (size.T @ most @ size) + size.T @ spread @ size
    error += off.T @ most @ size + (off.T @ most @ size).T + off.T @ most @ off
    turned = T.T @ M @ T
    error = np.abs(T).T @ (error + (4 * k + 20) * EPSILON * np.abs(M)) @ np.abs(T)
    return is_positive_definite((turned + turned.T) / 2, error * (1 + 1e-9))


def is_oriented(multipliers: PairMultipliers, m: Array) -> bool:
    """True when Q_p has two positive eigenvalues and the expected orientations, for all p."""
    k = len(m)
    own = np.arange(k)
    Q, spread = (A.reshape(k, 4, k, 4)[own, :, own] for A in multipliers.form(k))
    size = np.linalg.norm(Q, axis=(1, 2))
    if not (np.linalg.norm(spread, axis=(1, 2)) < MARGIN / 100 * size).all():
        return False
    if not (np.linalg.eigvalsh(Q)[:, 2] > MARGIN * size).all():
        return False
    planes = state_planes(m)
    stick = np.swapaxes(planes[:, 3], 1, 2)
    for b, sign in enumerate(ORIENTED):
        det = np.linalg.det(-stick @ Q @ planes[:, b])
        if not (sign * det > MARGIN * size**2 * (1 + m)).all():
            return False
    return True


def _coordinates(S: Array) -> Array:
    """T with T^T S T near the identity: r = T y."""
    symmetric = (S + S.T) / 2
    values, vectors = linalg.eigh(symmetric)
    floor = 1e-3 * np.abs(values).max(initial=0)  # friction can take definiteness away
    return vectors / np.sqrt(np.maximum(np.abs(values), floor))


def _stacked(r: Array, u: Array) -> Array:
    """Rows r_N, r_T, u_N, u_T of every contact."""
    k = len(u) // 2
    z = np.empty((k, 4, r.shape[1]))
    z[:, :2], z[:, 2:] = r.reshape(k, 2, -1), u.reshape(k, 2, -1)
    return z.reshape(4 * k, -1)


def _weights(
    answer: Multipliers, pairs: Pairs, singles: NDArray[np.int64], contacts: int
) -> Array:
    """Traces of the dual moments by contact and state, (k, 4)."""
    weights = np.zeros((contacts, len(STATES)))
    moments = list(answer.moments[1:])
    if not moments:  # no time for a single step
        return weights
    if len(pairs):
        for a in range(len(STATES)):
            for b in range(len(STATES)):
                diagonal = np.diagonal(moments.pop(0), axis1=1, axis2=2)
                np.add.at(weights[:, a], pairs[:, 0], diagonal[:, :2].sum(axis=1))
                np.add.at(weights[:, b], pairs[:, 1], diagonal[:, 2:].sum(axis=1))
        weights /= np.maximum(np.bincount(pairs.ravel(), minlength=contacts), 1)[:, None]
    for a, X in enumerate(moments):
        weights[singles, a] = np.trace(X, axis1=1, axis2=2)
    return weights
