"""The problem on the next coarser level, and its solution as a start: full multigrid."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ..cones import Law, Tresca
from ..linear.levels import fine_unknown
from ..one_sided import HELD, one_sided
from ..problem import FrictionProblem
from .base import Iterate

Array = NDArray[np.float64]
Index = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Coarser:
    """A coarse problem and the way back.

    P (n, coarse n); weights (nc, coarse nc): the same between contact nodes; frames (nc, d, d)
    and those of the coarse contacts, whose fine numbers are in `contacts`; area (nc,): that of
    the contacts up to a factor, from the stiffness of their nodes.
    """

    problem: FrictionProblem
    fine: FrictionProblem
    P: sparse.csr_array
    weights: sparse.csr_array
    frames: Array
    contacts: Index
    area: Array

    def start(self, found: Iterate) -> Iterate:
        """A coarse iterate on the fine level: v interpolated, r as forces per area."""
        assert found.v is not None
        force = np.einsum("kij,ki->kj", self.frames[self.contacts], found.r)
        traction = force / (self.weights.T @ self.area)[:, None]
        spread = self.area[:, None] * (self.weights @ traction)
        r = np.einsum("kij,kj->ki", self.frames, spread)
        guess = self.fine.guess
        if guess is None:
            return Iterate(r, self.P @ found.v)
        own = fine_unknown(self.P)
        return Iterate(r, guess + self.P @ (found.v - guess[own]))


def coarser(fine: FrictionProblem) -> Coarser | None:
    """The problem that a coarser mesh would give; None without one, or between two bodies.

    Stiffness and load are Galerkin products for v = P v_coarse + e, contacts those fine ones at
    coarse nodes with their gaps and frames; Tresca's bounds are summed with the weights of
    interpolation.  e, zero at coarse nodes, is what the guess has beside its interpolation:
    prescribed values belong to v - e on coarse cells, not to the fine ones next to the support.
    """
    basis = one_sided(fine)
    if basis is None or basis.coupling is not None or not fine.levels:
        return None
    P = fine.levels[0]
    own = fine_unknown(P)
    column = np.full(P.shape[0] + 1, HELD)
    column[own] = np.arange(len(own))
    dofs = column[basis.dofs]  # the last entry stands for HELD
    contacts = np.flatnonzero(
        ((dofs != HELD) == (basis.dofs != HELD)).all(axis=1) & (dofs[:, 0] != HELD)
    )
    if not contacts.size:
        return None
    dofs = dofs[contacts]
    weights = sparse.csr_array(P[basis.dofs[:, 0]][:, dofs[:, 0]])
    nc, d = dofs.shape
    contact, slot = np.nonzero(dofs != HELD)
    rows = np.repeat(dofs[contact, slot], d)
    columns = (d * contact[:, None] + np.arange(d)).ravel()
    values = basis.frames[contacts][contact, :, slot].ravel()
    shape = (P.shape[1], nc * d)
    modes = fine.near_nullspace
    assert fine.w is not None and fine.M is not None and fine.f is not None
    rest = fine.f
    if fine.guess is not None:
        rest = fine.f - fine.M @ (fine.guess - P @ fine.guess[own])
    problem = replace(
        FrictionProblem.from_global(
            P.T @ fine.M @ P, sparse.coo_array((values, (rows, columns)), shape=shape),
            P.T @ rest, fine.w[contacts], _law(fine.law, contacts, weights),
            near_nullspace=None if modes is None else modes[own], levels=fine.levels[1:],
        ),
        guess=None if fine.guess is None else fine.guess[own],
    )  # fmt: skip
    used = basis.dofs != HELD
    area = np.where(used, fine.M.diagonal()[basis.dofs], 0.0).sum(axis=1)
    return Coarser(problem, fine, P, weights, basis.frames, contacts, area)


def _law(law: Law, contacts: Index, weights: sparse.csr_array) -> Law:
    return Tresca(weights.T @ law.limit) if isinstance(law, Tresca) else law.at(contacts)
