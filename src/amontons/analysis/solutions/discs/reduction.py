"""Multipliers of one load for many contacts: few different ones, on a growing subspace.

Contacts with cones of the same kinds that move each other most are put together, and share one
multiplier; slacks are those of every contact.  M = sum_p Z_p^T W_p Z_p is asked to be positive
on a subspace of reactions only: at first constant and alternating ones of each set, then also
those, by Lanczos' method, on which the multipliers found so far fail.  In the end M as a
whole is proved positive definite as always (`proof`), so nothing is lost but chances.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy import linalg, sparse
from scipy.sparse.linalg import ArpackNoConvergence, LinearOperator, eigsh

from ....core.clock import Deadline
from ...multipliers.lmi import Accept, LmiOutcome, find_multipliers
from ...multipliers.program import Family
from ...scaled import Scaled
from ...statuses import States
from ..branch_proof import diagonal_parts
from ..branches import reactions
from ..groups import Group, whole

Array = NDArray[np.float64]
Index = NDArray[np.int64]
SETS = 30  # of contacts with a multiplier of their own
ROUNDS = 12  # of new directions
DIRECTIONS = 24  # that one round adds at most
ROUND_WORK = 2000.0  # operations of a round per square of the reactions
MARGIN = 0.2  # part of the largest possible eigenvalue of M that multipliers must reach


def shared_multipliers(
    local: Scaled, branch: States, groups: list[Group], accept: Accept, *,
    deadline: Deadline,
) -> bool:  # fmt: skip
    """True when multipliers of a branch without vanishing velocities were accepted."""
    n = 2.0 * local.contacts
    if not deadline.affords(4 * n**3):
        return False
    deadline.spend(4 * n**3)
    signs, families = _shared(local, groups)
    R = reactions(local, branch)
    WR = np.asarray((R.T @ local.W.T).T)
    energy = R.T @ WR
    try:
        L = np.linalg.cholesky((energy + energy.T) / 2)
    except np.linalg.LinAlgError:
        return False
    V = _first_directions(R, families, signs)
    for _ in range(ROUNDS):
        if not deadline.affords(ROUND_WORK * n**2):
            return False
        deadline.spend(ROUND_WORK * n**2)
        basis = linalg.solve_triangular(L, linalg.qr(L.T @ V, mode="economic")[0],
                                        lower=True, trans=1)  # fmt: skip
        Z = _rows(R, WR, basis)
        last: list[tuple[tuple[Array, ...], tuple[Array, ...]]] = []

        def keep(W: tuple[Array, ...], extras: tuple[Array, ...], kept: list = last) -> bool:
            kept.append((W, extras))
            return True

        answer = find_multipliers(Z, families, accept=keep, time_limit=deadline, margin=MARGIN)
        if answer.outcome is not LmiOutcome.FOUND:
            return False
        if accept(*last[-1]):
            return True
        more = _failing(R, WR, L, groups, last[-1][0])
        if not more.shape[1]:
            return False
        V = np.hstack([basis, more])
    return False


def _shared(local: Scaled, groups: list[Group]) -> tuple[Array, list[Family]]:
    """(sign of every contact in alternating reactions, families that share multipliers)."""
    nc = local.contacts
    blocks = local.W.reshape(nc, 2, nc, 2)
    coupling = np.sqrt(np.einsum("iajb,iajb->ij", blocks, blocks))
    signs, families = np.ones(nc), []
    for group in groups:
        own = group.contacts
        target = max(1, round(SETS * len(own) / nc))
        label, sign = _clusters(coupling[np.ix_(own, own)], target)
        signs[own] = sign
        entries = (np.ones(len(own)), (np.arange(len(own)), label))
        share = sparse.csr_array(entries, shape=(len(own), int(label.max()) + 1))
        families.append(replace(group.turned, share=share))
    return signs, families


def _clusters(coupling: Array, target: int) -> tuple[Index, Array]:
    """(set of every contact, sign within its first pair), by pairs of the most coupled."""
    n = len(coupling)
    label, sign = np.arange(n), np.ones(n)
    first = True
    while label.max() + 1 > target:
        count = int(label.max()) + 1
        sums = sparse.csr_array((np.ones(n), (np.arange(n), label)), shape=(n, count))
        size = np.asarray(sums.sum(axis=0)).ravel()
        mean = sums.T @ coupling @ sums / size[:, None] / size
        low, high = np.triu_indices(count, 1)
        partner = np.full(count, -1)
        order = np.argsort(-(mean + mean.T)[low, high], kind="stable")
        for i, j in zip(low[order], high[order], strict=True):
            if partner[i] < 0 and partner[j] < 0:
                partner[i], partner[j] = j, i
        merged = np.minimum(np.arange(count), np.where(partner < 0, np.arange(count), partner))
        if first:
            sign = np.where(merged[label] == label, 1.0, -1.0)
            first = False
        _, renamed = np.unique(merged, return_inverse=True)
        label = np.ravel(renamed)[label]
    return label, sign


def _first_directions(R: sparse.csr_array, families: list[Family], signs: Array) -> Array:
    """Constant and alternating reactions of every set, as coordinates y (r = R y)."""
    columns = sparse.csc_array(R)
    row = columns.indices[columns.indptr[:-1]]  # the first of each column
    contact, component = row // 2, row % 2
    number, count = np.full(len(signs), -1), 0
    for family in families:
        label = family.share.indices
        number[family.rows[:, 0] // 4] = count + label
        count += family.share.shape[1]
    out = np.zeros((R.shape[1], 2, count, 2))
    each = np.arange(R.shape[1])
    out[each, component, number[contact], 0] = 1.0
    out[each, component, number[contact], 1] = signs[contact]
    out = out.reshape(R.shape[1], -1)
    kept = np.linalg.qr(out[:, out.any(axis=0)])
    return kept[0][:, np.abs(np.diag(kept[1])) > 1e-8]


def _rows(R: sparse.csr_array, WR: Array, basis: Array) -> Array:
    """z of all contacts, 4 rows each."""
    r, u = R @ basis, WR @ basis
    n = basis.shape[1]
    return np.concatenate([r.reshape(-1, 2, n), u.reshape(-1, 2, n)], axis=1).reshape(-1, n)


def _failing(
    R: sparse.csr_array, WR: Array, L: Array, groups: list[Group], W: tuple[Array, ...]
) -> Array:
    """Directions y in which y M y is negative, most relative to the energy."""
    rr, ru, uu = diagonal_parts(whole(groups, W, R.shape[0] // 2, 4))

    def product(x: Array) -> Array:
        y = linalg.solve_triangular(L, x, lower=True, trans=1, check_finite=False)
        r, u = R @ y, WR @ y
        out = R.T @ (rr @ r + ru @ u) + WR.T @ (ru.T @ r + uu @ u)
        return linalg.solve_triangular(L, out, lower=True, check_finite=False)

    n = len(L)
    operator = LinearOperator((n, n), matvec=product, dtype=float)
    start = np.cos(np.arange(n) + 0.5)
    count = min(DIRECTIONS, n - 2)
    try:
        values, vectors = eigsh(operator, count, which="SA", v0=start, maxiter=20,
                                tol=1e-2)  # type: ignore[arg-type]  # fmt: skip
    except ArpackNoConvergence as partial:
        values, vectors = partial.eigenvalues, partial.eigenvectors
    keep = values < 0.1 * max(abs(values).max(initial=0.0), 1e-300)
    return linalg.solve_triangular(L, vectors[:, keep], lower=True, trans=1)
