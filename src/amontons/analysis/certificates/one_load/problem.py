"""One load of a 2D Coulomb problem, and what partly decided statuses leave of its equations.

Variables of a contact are z = (r_N, r_T, u_N, u_T), u = W r + q, all scaled by powers of two so
that |W_ii| and |q| are near 1: the scaled problem is the given one without rounding.
Statuses and their cones C_s:

    free   r = 0, u_N >= 0              slip +  u_N = 0, r_T =  mu r_N, r_N >= 0, u_T <= 0
    stick  u = 0, |r_T| <= mu r_N       slip -  u_N = 0, r_T = -mu r_N, r_N >= 0, u_T >= 0

A contact without friction is free, or slips with u_T of any sign (listed as slip +).

A branch is a state of every contact: one status, or several that are not told apart.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import linalg, sparse

from ....core.clock import NEVER, Deadline
from ....linear.dense import dense
from ....problem.friction import FrictionProblem
from ...multipliers.scales import contact_sizes, load_size, power_of_two

Array = NDArray[np.float64]
States = NDArray[np.int8]
FREE, STICK, PLUS, MINUS = range(4)  # statuses, also the order of columns below
UNDECIDED, CLOSED, SLIPPING = 4, 5, 6  # further states of a contact in a branch
LETTERS = "fs+-.cx"
ALLOWED = np.zeros((7, 4), dtype=bool)  # statuses of a state
ALLOWED[:4] = np.eye(4, dtype=bool)
ALLOWED[UNDECIDED], ALLOWED[CLOSED, STICK:], ALLOWED[SLIPPING, PLUS:] = True, True, True
COORDINATES = {  # variables of a contact that do not vanish, or follow, by its state
    FREE: (2, 3), STICK: (0, 1), PLUS: (0, 3), MINUS: (0, 3),
    UNDECIDED: (0, 1, 2, 3), CLOSED: (0, 1, 3), SLIPPING: (0, 1, 3),
}  # fmt: skip
WITHOUT_FRICTION = (0, 2, 3)  # of a contact that is not decided


@dataclass(frozen=True, eq=False)
class LoadProblem:
    """W (2 nc, 2 nc), q (2 nc,) and mu (nc,) in units that are powers of two."""

    problem: FrictionProblem
    W: Array
    q: Array
    mu: Array
    to_r: Array  # (2 nc,): reaction = to_r * scaled reaction
    to_u: Array
    reacts: NDArray[np.bool_]  # contacts with W_ii > 0

    @classmethod
    def of(cls, problem: FrictionProblem, deadline: Deadline = NEVER) -> LoadProblem:
        """The condensed problem, scaled."""
        local = problem.condensed(deadline)
        nc = local.contacts
        assert local.W is not None and local.q is not None
        W = dense(local.W, 6)
        size, reacts = contact_sizes(W, nc)
        root = np.repeat(power_of_two(np.sqrt(size)), 2)
        q = local.q.ravel() / root
        unit = power_of_two(np.array(load_size(q.reshape(nc, 2), local.mu, reacts) or 1.0))
        W = W / root / root[:, None]
        return cls(local, W, q / unit, local.mu, unit / root, unit * root, reacts)

    @property
    def contacts(self) -> int:
        """nc."""
        return len(self.mu)

    @property
    def root_branch(self) -> States:
        """Nothing decided but what can not be otherwise."""
        return np.where(self.reacts, UNDECIDED, FREE).astype(np.int8)

    def allowed(self, branch: States) -> NDArray[np.bool_]:
        """(nc, 4): statuses of every contact."""
        out = ALLOWED[branch].copy()
        smooth = self.mu == 0
        out[smooth, PLUS] |= out[smooth, STICK] | out[smooth, MINUS]
        out[smooth, STICK] = out[smooth, MINUS] = False
        return out

    def children(self, branch: States, contact: int) -> tuple[States, ...]:
        """The branches into which one contact divides a branch, none when it is decided."""
        parts = {UNDECIDED: (FREE, CLOSED), CLOSED: (STICK, SLIPPING), SLIPPING: (PLUS, MINUS)}
        if self.mu[contact] == 0:
            parts = {UNDECIDED: (FREE, PLUS)}
        out = []
        for state in parts.get(int(branch[contact]), ()):
            child = branch.copy()
            child[contact] = state
            out.append(child)
        return tuple(out)

    def coordinates(self, branch: States) -> list[tuple[int, ...]]:
        """The variables of every contact that are not zero and do not follow from others."""
        return [
            WITHOUT_FRICTION if mu == 0 and state == UNDECIDED else COORDINATES[int(state)]
            for mu, state in zip(self.mu, branch, strict=True)
        ]

    def reactions(self, branch: States) -> sparse.csr_array:
        """R (2 nc, k): r = R y for all reactions of a branch."""
        normal = np.flatnonzero(branch != FREE)
        states = branch[normal]
        single = (states == PLUS) | (states == MINUS) | (self.mu[normal] == 0)
        first = np.concatenate([[0], np.cumsum(np.where(single, 1, 2))])
        column = first[:-1]
        slope = np.where(states == MINUS, -1.0, 1.0) * self.mu[normal]
        rows = [2 * normal, 2 * normal[single] + 1, 2 * normal[~single] + 1]
        columns = [column, column[single], column[~single] + 1]
        entries = [np.ones(len(normal)), slope[single], np.ones(int((~single).sum()))]
        return sparse.csr_array(
            (np.concatenate(entries), (np.concatenate(rows), np.concatenate(columns))),
            shape=(2 * self.contacts, int(first[-1])),
        )

    def zero_velocities(self, branch: States) -> NDArray[np.int64]:
        """Components of u that vanish in all of a branch."""
        closed = np.flatnonzero((branch != FREE) & (branch != UNDECIDED))
        stick = np.flatnonzero(branch == STICK)
        return np.sort(np.concatenate([2 * closed, 2 * stick + 1]))


def word(branch: States) -> str:
    """A branch as text: f free, s stick, +, - slip, c closed, x slip, . anything."""
    return "".join(LETTERS[int(state)] for state in branch)


def energy_basis(local: LoadProblem, branch: States, apex: bool) -> tuple[Array, Array]:
    """(Z (4 nc, N), T (k, N)): z = Z w, y = T w for w with the zero velocities of a branch.

    |w|^2 is the energy r W r, plus tau^2 where there is an apex, the last row of Z and T then.
    A semidefinite W gets a small part of |r|^2 more.
    """
    R = local.reactions(branch)
    WR = local.W @ R.toarray() if R.shape[1] else np.zeros((len(local.W), 0))
    rows = local.zero_velocities(branch)
    motion = np.column_stack([WR, local.q]) if apex else WR
    energy = R.T @ ((WR + (R.T @ local.W).T) / 2)
    energy += 1e-13 * len(energy) * sparse.csr_array(R.T @ R).toarray()
    if apex:
        energy = linalg.block_diag(energy, 1.0)
    T = linalg.null_space(motion[rows]) if len(rows) else np.eye(motion.shape[1])
    T = T @ _inverse_root(T.T @ energy @ T)
    shape = (local.contacts, 2, T.shape[1])  # no columns where nothing can move
    r = np.asarray(R @ T[: R.shape[1]]).reshape(shape)
    u = (motion @ T).reshape(shape)
    Z = np.concatenate([r, u], axis=1).reshape(4 * local.contacts, T.shape[1])
    return (np.vstack([Z, T[-1:]]) if apex else Z), T


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
        return linalg.solve_triangular(L, np.eye(n), lower=True, trans="T")
    return np.eye(n)
