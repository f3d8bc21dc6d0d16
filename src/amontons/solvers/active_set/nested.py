"""The problem on the next coarser level, and its solution as a start: full multigrid."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ...linear.levels import fine_unknown
from ...problem.friction import FrictionProblem
from ...problem.law import Law
from ...problem.law.law import BOUND
from ...problem.one_sided import HELD, OneSided, one_sided
from ..contract import Iterate

Array = NDArray[np.float64]
Index = NDArray[np.int64]
WHOLE = 1e-9  # how far weights of interpolation may be from 1 in sum
NO_COARSER = (
    "nested needs a coarser level with contacts on it: meshes with levels, such as refined() "
    "makes them, and a slave node of its own for every contact; use nested = False"
)


@dataclass(frozen=True, eq=False)
class Coarser:
    """A coarse problem and the way back.

    P (n, coarse n); weights (nc, coarse nc): the same between slave nodes; basis: of the fine
    problem; contacts: fine numbers of the coarse ones; area (nc,): that of the contacts up to a
    factor, from the stiffness of their nodes.
    """

    problem: FrictionProblem
    fine: FrictionProblem
    P: sparse.csr_array
    weights: sparse.csr_array
    basis: OneSided
    contacts: Index
    area: Array

    def start(self, found: Iterate) -> Iterate:
        """A coarse iterate on the fine level: v interpolated, r as forces per area.

        At the contacts u_N is interpolated, gaps included, and so is the vector u_T: what is
        closed stays closed although finer facets have other gaps and normals.
        """
        assert found.v is not None
        force = np.einsum("kij,ki->kj", self.basis.frames[self.contacts], found.r)
        traction = force / (self.weights.T @ self.area)[:, None]
        spread = self.area[:, None] * (self.weights @ traction)
        r = np.einsum("kij,kj->ki", self.basis.inverse, spread)
        guess = self.fine.guess
        if guess is None:
            v = self.P @ found.v
        else:
            v = guess + self.P @ (found.v - guess[fine_unknown(self.P)])
        return Iterate(r, self._with_contacts(v, self.problem.local_velocity(found.v)))

    def _with_contacts(self, v: Array, u: Array) -> Array:
        """v (n,) with slave nodes moved so that the contacts have the coarse u, (coarse nc, d).

        Those between nodes without a contact keep what they have.
        """
        axes, dofs = self.basis.axes, self.basis.dofs
        slip = self.weights @ np.einsum("kij,ki->kj", axes[self.contacts][:, 1:], u[:, 1:])
        wanted = np.einsum("kij,kj->ki", axes, slip)
        wanted[:, 0] = self.weights @ u[:, 0]
        change = wanted - self.fine.local_velocity(v)
        moved = np.einsum("kij,ki->kj", self.basis.inverse, change)
        whole = np.abs(self.weights.sum(axis=1) - 1) < WHOLE
        used = (dofs != HELD) & whole[:, None]
        out = v.copy()
        out[dofs[used]] += moved[used]
        return out


def coarser(fine: FrictionProblem) -> Coarser | None:
    """The problem that a coarser mesh would give; None without one.

    Stiffness and load are Galerkin products for v = P v_coarse + e, contacts those fine ones
    whose slave node is a coarse one, with their gaps and frames: between two bodies they see
    there the coarse values of the other side.  Tresca's bounds are summed with the weights of
    interpolation.  e, zero at coarse nodes, is what the guess has beside its interpolation:
    prescribed values belong to v - e on coarse cells, not to the fine ones next to the support.
    """
    basis = one_sided(fine)
    if basis is None or not fine.levels:
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
    d = fine.dimension
    modes = fine.near_nullspace
    assert fine.w is not None and fine.M is not None and fine.f is not None
    assert fine.H is not None
    slots = (d * contacts[:, None] + np.arange(d)).ravel()
    H = sparse.csc_array(sparse.csc_array(fine.H)[:, slots])
    rest, w = fine.f, fine.w[contacts]
    if fine.guess is not None:
        e = fine.guess - P @ fine.guess[own]
        rest, w = fine.f - fine.M @ e, w + (H.T @ e).reshape(-1, d)
    problem = replace(
        FrictionProblem.from_global(
            P.T @ fine.M @ P, P.T @ H, P.T @ rest, w, _law(fine.law, contacts, weights),
            near_nullspace=None if modes is None else modes[own], levels=fine.levels[1:],
            structure=fine.structure and fine.structure.at(contacts, own),
        ),
        guess=None if fine.guess is None else fine.guess[own],
    )  # fmt: skip
    if one_sided(problem) is None:  # slaves that are masters too on the coarse level
        return None
    used = basis.dofs != HELD
    area = np.where(used, fine.M.diagonal()[basis.dofs], 0.0).sum(axis=1)
    return Coarser(problem, fine, P, weights, basis, contacts, area)


def _law(law: Law, contacts: Index, weights: sparse.csr_array) -> Law:
    bounds = law.parameters[:, BOUND]
    return law.at(contacts).with_bounds(weights.T @ np.where(np.isfinite(bounds), bounds, 0.0))
