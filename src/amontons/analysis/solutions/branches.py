"""What partly decided statuses leave of the equations of one load, in 2D and 3D.

A branch is a state of every contact (`statuses`): one status, or several that are not told
apart.  Variables of a contact are z = (r, u), u = W r + q, all scaled.  The statuses and their
cones in 2D:

    free   r = 0, u_N >= 0              slip +  u_N = 0, r_T =  mu r_N, r_N >= 0, u_T <= 0
    stick  u = 0, |r_T| <= mu r_N       slip -  u_N = 0, r_T = -mu r_N, r_N >= 0, u_T >= 0

In 3D slip has directions on an arc, and is not linear: SLIP stands for all of them.  A contact
without friction is free, or slips with u_T of any sign (in 2D listed as slip +).
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import linalg, sparse

from ..scaled import Scaled
from ..statuses import ANY, CLOSED, FREE, MINUS, PLUS, SLIP, STICK, States

Array = NDArray[np.float64]
Index = NDArray[np.int64]


def reactions(scaled: Scaled, branch: States) -> sparse.csr_array:
    """R (nc d, k): r = R y for all reactions of a branch."""
    nc, d = scaled.shape
    normal = np.flatnonzero(branch != FREE)
    states = branch[normal]
    signed = (states == PLUS) | (states == MINUS)
    single = signed | (scaled.mu[normal] == 0)
    first = np.concatenate([[0], np.cumsum(np.where(single, 1, d))])
    column = first[:-1]
    slope = np.where(states == MINUS, -1.0, 1.0) * scaled.mu[normal]
    rows, columns = [d * normal, d * normal[signed] + 1], [column, column[signed]]
    entries = [np.ones(len(normal)), slope[signed]]
    for j in range(1, d):
        rows.append(d * normal[~single] + j)
        columns.append(column[~single] + j)
        entries.append(np.ones(int((~single).sum())))
    return sparse.csr_array(
        (np.concatenate(entries), (np.concatenate(rows), np.concatenate(columns))),
        shape=(nc * d, int(first[-1])),
    )


def zero_velocities(scaled: Scaled, branch: States) -> NDArray[np.int64]:
    """Components of u that vanish in all of a branch."""
    d = scaled.shape[1]
    closed = np.flatnonzero((branch != FREE) & (branch != ANY))
    stick = np.flatnonzero(branch == STICK)
    along = [d * stick + j for j in range(1, d)]
    return np.sort(np.concatenate([d * closed, *along]))


def zeros(scaled: Scaled, branch: States, *, all_reactions: bool) -> tuple[Index, Index]:
    """(contacts, components of z) that vanish in all of a branch; r only where asked."""
    d = scaled.shape[1]
    u = zero_velocities(scaled, branch)
    contact, component = u // d, d + u % d
    if all_reactions:
        none = np.zeros(scaled.shape, dtype=bool)
        none[branch == FREE], none[scaled.mu == 0, 1:] = True, True
        more, own = np.nonzero(none)
        contact, component = np.concatenate([contact, more]), np.concatenate([component, own])
    return contact, component


def coordinates(scaled: Scaled, branch: States) -> list[tuple[int, ...]]:
    """The variables of every contact that are not zero and do not follow from others."""
    d = scaled.shape[1]
    r, u = tuple(range(d)), tuple(range(d, 2 * d))
    left = {FREE: u, STICK: r, PLUS: (0, *u[1:]), MINUS: (0, *u[1:]), ANY: r + u,
            CLOSED: r + u[1:], SLIP: r + u[1:]}  # fmt: skip
    smooth = left | {ANY: (0, *u), CLOSED: (0, *u[1:]), SLIP: (0, *u[1:])}
    return [
        (left if mu > 0 else smooth)[int(state)]
        for mu, state in zip(scaled.mu, branch, strict=True)
    ]


def energy_basis(scaled: Scaled, branch: States, apex: bool) -> Array:
    """Z (2 nc d, N): z = Z w for w with the zero velocities of a branch; apex: one row more.

    |w|^2 is the energy r W r, plus tau^2 where there is an apex, the last row of Z then.
    A semidefinite W gets a small part of |r|^2 more.
    """
    nc, d = scaled.shape
    R = reactions(scaled, branch)
    WR = scaled.W @ R.toarray() if R.shape[1] else np.zeros((len(scaled.W), 0))
    rows = zero_velocities(scaled, branch)
    motion = np.column_stack([WR, scaled.q.ravel()]) if apex else WR
    energy: Any = R.T @ ((WR + (R.T @ scaled.W).T) / 2)
    energy += 1e-13 * len(energy) * sparse.csr_array(R.T @ R).toarray()
    if apex:
        energy = linalg.block_diag(energy, 1.0)
    T = linalg.null_space(motion[rows]) if len(rows) else np.eye(motion.shape[1])
    T = T @ _inverse_root(T.T @ energy @ T)
    shape = (nc, d, T.shape[1])  # no columns where nothing can move
    r = np.asarray(R @ T[: R.shape[1]]).reshape(shape)
    u = (motion @ T).reshape(shape)
    Z = np.concatenate([r, u], axis=1).reshape(2 * nc * d, T.shape[1])
    return np.vstack([Z, T[-1:]]) if apex else Z


def _inverse_root(energy: Array) -> Array:
    """B with B^T energy B = I; where energy is not definite a multiple of |y|^2 is added."""
    n = len(energy)
    energy = (energy + energy.T) / 2
    size = float(np.trace(energy)) / max(n, 1)
    for part in (0.0, 1e-10, 1e-7, 1e-4, 1e-2, 1.0):
        try:
            L = np.linalg.cholesky(energy + part * size * np.eye(n))
        except np.linalg.LinAlgError:
            continue
        return linalg.solve_triangular(L, np.eye(n), lower=True, trans=1)
    return np.eye(n)
