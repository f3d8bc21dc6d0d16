"""The linear system of a large mesh by multigrid, in about the time of one solve with M.

In the one-sided basis every contact sits on a node of its own, whose columns of H are H_c, and
the statuses leave the directions V of the node free; forces that do no work on W^T are unknown
reactions (the table of `solvers.multigrid.nodes`).  The changes of a step are

    dv = v_0 + V z,    (W^T M V + L) z = W^T (F - M v_0 + H_T c_T),

v_0 being zero but at closed contacts, where H_c^T v_0 = -h.  The transposed system has the same
form with W and V exchanged, as L is symmetric:

    x = x_0 + W z,     (V^T M W + L) z = V^T (v~ + H u~ - M x_0),   H_c^T x_0 = -r~,

and forces H_c^T p = M x - v~ - H u~ at the nodes tell y: (r~ + H^T x)_T of what slides, -p
of what is held.  GMRES ends at a residual of TOLERANCE; its preconditioner is one cycle of
the coarse levels that contact multigrid makes at these statuses, and a smoother after it.
"""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...core.errors import SingularOperator
from ...linear.blocks import spatial
from ...problem.law.law import TRESCA
from ...problem.law.states import ContactStatus
from ...solvers.contract import Breakdown
from ...solvers.driven import driven_directions
from ...solvers.multigrid.levels import ContactLevels
from ...solvers.multigrid.nodes import CLOSED, ContactNodes
from ...solvers.multigrid.tangent import Tangent
from .linearised import Linearised
from .systems import SINGULAR, Adjoint, Change, GlobalSystem, System

Array = NDArray[np.float64]
TOLERANCE = 1e-9  # residual, relative to the load, at which an iteration ends
RESTART = 30  # vectors that GMRES keeps
MOST = 200  # cycles before it gives up
JACOBI = 0.7  # of block Jacobi at the contact nodes, which are neighbours


class CycleSystem(System):
    """(1) and (2) of `systems` without a factor; falls back to one where nodes do not fit."""

    def __init__(self, at: Linearised) -> None:
        self.at, self.iterations = at, 0
        self.fallback: System | None = None
        try:
            self.levels = ContactLevels.of(at.problem)
        except Breakdown:
            self.fallback = GlobalSystem(at)
            return
        if driven_directions(at.problem).any():
            self.fallback = GlobalSystem(at)
            return
        self.contacts = self.levels.finest(at.problem)[0]
        self._set_states(self.contacts)
        self.V, self.W, self.L = self._tangent()
        self.back = self.contacts.to_reaction  # H_c^-1
        self.cycles: dict[bool, _Cycle] = {}

    @cached_property
    def distance(self) -> float | None:
        """None: nothing is factorised; cycles that do not converge say that it is small."""
        return None if self.fallback is None else self.fallback.distance

    def _set_states(self, contacts: ContactNodes) -> None:
        solution, law = self.at.solution, self.at.problem.law
        contacts.r[:], contacts.u[:] = spatial(solution.r), spatial(solution.u)
        closed = (solution.status != ContactStatus.OPEN) | law.tied
        slides = solution.sliding & ~law.tied
        motion = np.where(slides, int(ContactStatus.SLIP), int(ContactStatus.STICK))
        apart = np.where(law.kind == TRESCA, motion, int(ContactStatus.OPEN))
        contacts.state[:] = np.where(closed, CLOSED + motion, apart)

    def _tangent(self) -> tuple[Array, Array, Array]:
        """V, W and L of the pieces, without the bounds that a solver puts on L."""
        at, c = self.at, self.contacts
        V, W, _ = c.tangent()
        d = at.problem.dimension
        S = np.zeros((len(V), 3, 3))
        slides = at.slope.any(axis=1)
        S[slides, :d, :d] = at.B[slides]
        S[:, 0, :] = S[:, :, 0] = 0.0
        return V, W, np.einsum("cai,cij,cbj->cab", c.H, S, c.H)

    # ---------------------------------------------------------------- the two systems
    def change(self, F: Array | None, c: Array, h: Array) -> Change:
        """See `systems.System`."""
        if self.fallback is not None:
            return self.fallback.change(F, c, h)
        assert F is not None
        levels, nodes, node = self.levels, self.levels.nodes, self.contacts.node
        f = nodes.spread(levels.basis.to_load(F))
        start = self._held(spatial(h))
        force = f.copy()
        force[node] += np.einsum("cai,ci->ca", self.contacts.H[:, :, 1:], spatial(c)[:, 1:])
        x = self._solved(force, start, transposed=False)
        rest = self._product(x) - f
        r = np.einsum("cia,ca->ci", self.back, rest[node])
        u = np.einsum("cai,ca->ci", self.contacts.H, x[node])
        d = self.at.problem.dimension
        return Change(r[:, :d] * self._reacts, u[:, :d] + h, levels.displacement(x))

    def adjoint(self, v: Array | None, r: Array, u: Array) -> Adjoint:
        """See `systems.System`."""
        if self.fallback is not None:
            return self.fallback.adjoint(v, r, u)
        levels, nodes, node = self.levels, self.levels.nodes, self.contacts.node
        at, d = self.at, self.at.problem.dimension
        load = np.zeros(at.problem.unknowns) if v is None else v
        f = nodes.spread(levels.basis.to_load(load))
        f[node] += np.einsum("cai,ci->ca", self.contacts.H, spatial(u))
        x = self._solved(f, self._held(spatial(r)), transposed=True)
        p = np.einsum("cia,ca->ci", self.back, (self._product(x) - f)[node])[:, :d]
        s = np.einsum("cai,ca->ci", self.contacts.H, x[node])[:, :d] + r
        by_r = np.einsum("kii->ki", at.A) != 0  # A^T y = s where these rows are alone
        y = np.where(by_r, s, -p)
        z = u - np.einsum("kji,kj->ki", at.B, y)
        return Adjoint(y, z, levels.displacement(x))

    @property
    def _reacts(self) -> Array:
        """0 where a reaction does not change, else 1, (nc, d)."""
        held = self.at.B.any(axis=2)
        still = (np.einsum("kii->ki", self.at.A) != 0) & ~held
        slides: Any = self.at.slope.any(axis=1)
        still &= ~slides[:, None]
        return np.where(still, 0.0, 1.0)

    def _held(self, given: Array) -> Array:
        """Values at the nodes (nodes, 3) with H_c^T x = -given where the contacts do not open.

        given (nc, 3), read in the directions that the statuses hold or bend.
        """
        out = np.zeros((self.levels.nodes.count, 3))
        d = self.at.problem.dimension
        moved = given.copy()
        slides: Any = self.at.slope.any(axis=1)
        moved[:, :d] *= self.at.B.any(axis=2) | slides[:, None]
        out[self.contacts.node] = -np.einsum("cia,ci->ca", self.back, moved)
        return out

    # ---------------------------------------------------------------- linear algebra
    def _product(self, x: Array) -> Array:
        out = np.empty_like(x)
        self.levels.hierarchy.levels[0].A.times(x, out)
        return out

    def _solved(self, force: Array, start: Array, *, transposed: bool) -> Array:
        trial = self.W if transposed else self.V
        if transposed not in self.cycles:
            test = self.V if transposed else self.W
            self.cycles[transposed] = _Cycle(self.levels, self.contacts, trial, test, self.L)
        cycle, node = self.cycles[transposed], self.contacts.node
        b = force - self._product(start) if start.any() else force.copy()
        b[node] = np.einsum("cab,ca->cb", cycle.test, b[node])
        z, count = _gmres(cycle, b, float(np.linalg.norm(force)))
        self.iterations += count
        z[node] = np.einsum("cab,cb->ca", trial, z[node])
        return start + z


class _Cycle:
    """A = W^T M V + L at the contact nodes, M elsewhere, and one cycle for it."""

    def __init__(
        self, levels: ContactLevels, contacts: ContactNodes, trial: Array, test: Array, L: Array
    ) -> None:
        self.trial, self.test, self.L = trial, test, L
        self.levels, self.contacts, self.node = levels, contacts, contacts.node
        self.finest = levels.hierarchy.levels[0]
        self.held = np.zeros(self.finest.A.nodes, dtype=bool)
        self.held[self.node] = True
        self.tangent = Tangent(levels.truncation)
        self.tangent.begin(0, contacts)
        self.tangent.renew(trial, test, L, turned=0.0)
        rows = self.finest.A.rows(self.node)
        own = np.linalg.inv(rows.inverse)
        block = np.einsum("cab,cad,cde->cbe", test, own, trial) + L
        self.inverse = np.linalg.pinv(block, rcond=1e-12)
        self.work = np.zeros((self.finest.A.nodes, 3))

    def times(self, x: Array, out: Array) -> None:
        """out = A x, x free in the directions of the trial space alone, and given back."""
        own = x[self.node].copy()
        x[self.node] = np.einsum("cab,cb->ca", self.trial, own)
        self.finest.A.times(x, out)
        x[self.node] = own
        out[self.node] = np.einsum("cab,ca->cb", self.test, out[self.node]) + np.einsum(
            "cab,cb->ca", self.L, own
        )

    def apply(self, b: Array) -> Array:
        """What one cycle makes of zero for A x = b: coarse levels first, then a smoother."""
        P = self.finest.P
        if P is None:
            return self.tangent.solve(b)
        z, levels = np.zeros_like(b), self.tangent.hierarchy
        coarse = levels.levels[1].work
        self.work[:] = b
        P.restrict(self.work, coarse.b)
        levels.cycle(1, coarse.b, coarse.x)
        P.add(coarse.x, z)
        self._relax(b, z)
        own = z[self.node].copy()
        z[self.node] = np.einsum("cab,cb->ca", self.trial, own)
        self.finest.A.smooth(b, z, self.held, False)
        if self.finest.A.is_stored:  # sweeps of Gauss-Seidel, in both orders
            self.finest.A.smooth(b, z, self.held, True)
        z[self.node] = own
        self._relax(b, z)
        return z

    def _relax(self, b: Array, z: Array) -> None:
        """A step of block Jacobi at the contact nodes."""
        node, own = self.node, z[self.node].copy()
        z[node] = np.einsum("cab,cb->ca", self.trial, own)
        indptr, indices, data = self.contacts.rows
        product = np.einsum("eab,eb->ea", data, z[indices])
        force = np.add.reduceat(product, indptr[:-1], axis=0)
        rest = b[node] - np.einsum("cab,ca->cb", self.test, force)
        rest -= np.einsum("cab,cb->ca", self.L, own)
        z[node] = own + JACOBI * np.einsum("cab,cb->ca", self.inverse, rest)


def _gmres(cycle: _Cycle, b: Array, size: float) -> tuple[Array, int]:
    """(x, cycles) with |b - A x| <= TOLERANCE size, right preconditioned.

    Raises SingularOperator where it does not come to that.
    """
    x, r, count = np.zeros_like(b), b.copy(), 0
    size = max(size, float(np.linalg.norm(b)))
    product = np.empty_like(b)
    while True:
        beta = float(np.linalg.norm(r))
        if beta <= TOLERANCE * size:
            return x, count
        if count >= MOST or not np.isfinite(beta):
            raise SingularOperator(
                f"{SINGULAR}; {count} multigrid cycles left a residual of {beta / size:.1e}"
            )
        step, more, rest = _arnoldi(cycle, r, beta, TOLERANCE * size)
        x += step
        count += more
        if rest <= TOLERANCE * size:
            return x, count
        cycle.times(x, product)
        np.subtract(b, product, out=r)


def _arnoldi(
    cycle: _Cycle, r: Array, beta: float, goal: float
) -> tuple[Array, int, float]:
    """(change of x, cycles, residual) of one restart of GMRES."""
    shape, basis, made = r.shape, [r.ravel() / beta], []
    H = np.zeros((RESTART + 1, RESTART))
    k, rest, y = 0, beta, np.zeros(0)
    w = np.empty(shape)
    for k in range(RESTART):
        made.append(cycle.apply(basis[k].reshape(shape)))
        cycle.times(made[k], w)
        flat = w.ravel()
        for j, q in enumerate(basis):  # modified Gram-Schmidt
            H[j, k] = q @ flat
            flat -= H[j, k] * q
        H[k + 1, k] = np.linalg.norm(flat)
        e = np.zeros(k + 2)
        e[0] = beta
        y = np.linalg.lstsq(H[: k + 2, : k + 1], e, rcond=None)[0]
        rest = float(np.linalg.norm(H[: k + 2, : k + 1] @ y - e))
        if rest <= goal or not H[k + 1, k] > 0 or not np.isfinite(rest):
            break
        basis.append(flat / H[k + 1, k])
    step = np.zeros(shape)
    for value, z in zip(y, made, strict=False):
        step += value * z
    return step, k + 1, rest
