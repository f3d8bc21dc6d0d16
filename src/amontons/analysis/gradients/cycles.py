"""The linear system of a large mesh by multigrid, in about the time of one solve with M.

In the one-sided basis every contact sits on a node of its own, whose columns of H are H_c, and
the statuses leave the directions V of the node free; forces that do no work on W^T are unknown
reactions (the table of `solvers.multigrid.nodes`).  The changes of a step are

    dv = v_0 + V z,    (W^T M V + L) z = W^T (F - M v_0 + H_T c_T),

v_0 being zero but at closed contacts, where H_c^T v_0 = -h.  The transposed system has the same
form with W and V exchanged, as L is symmetric:

    x = x_0 + W z,     (V^T M W + L) z = V^T (v~ + H u~ - M x_0),   H_c^T x_0 = -r~,

and forces H_c^T p = M x - v~ - H u~ at the nodes tell y: (r~ + H^T x)_T of what slides, -p
of what is held.  The iteration ends at a residual of TOLERANCE, told by the product M x that p
needs as well; its preconditioner is one cycle of the coarse levels that contact multigrid makes
at these statuses, and a smoother after it.

Only friction spoils the symmetry of the systems, so residuals are made small along directions
whose products are orthogonal to the last two alone, Orthomin(2) of [V]: on the cube of
`benchmarks/cube.py` that takes no cycle more than GMRES, which keeps them all.  Where the
residual falls slowly GMRES goes on.

[V] P. K. W. Vinsome, "Orthomin, an iterative method for solving sparse sets of simultaneous
linear equations", Society of Petroleum Engineers, paper 5729 (1976).
"""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...core.errors import SingularOperator
from ...linear.blocks import spatial
from ...linear.vectors import add_two, advance, norm, two_dots
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
ROUNDED = 1e-6  # the most at which it may end where rounding stops it
LAST = 2  # directions to which Orthomin makes the next one orthogonal
SLOW, EARLY = 0.7, 6  # mean fall a cycle above which, after so many, GMRES takes over
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
        x, product = self._solved(force, start, transposed=False)
        r = np.einsum("cia,ca->ci", self.back, product[node] - f[node])
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
        x, product = self._solved(f, self._held(spatial(r)), transposed=True)
        p = np.einsum("cia,ca->ci", self.back, product[node] - f[node])[:, :d]
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
    def _solved(self, force: Array, start: Array, *, transposed: bool) -> tuple[Array, Array]:
        """x = start + V z, or W z, of the module's equation for z, and M x."""
        trial = self.W if transposed else self.V
        if transposed not in self.cycles:
            test = self.V if transposed else self.W
            self.cycles[transposed] = _Cycle(self.levels, self.contacts, trial, test, self.L)
        x, product, count = _iterated(self.cycles[transposed], force, start)
        self.iterations += count
        return x, product


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
        own = np.linalg.inv(contacts.inverse)
        block = np.einsum("cab,cad,cde->cbe", test, own, trial) + L
        self.inverse = np.linalg.pinv(block, rcond=1e-12)
        self.work = np.zeros((self.finest.A.nodes, 3))
        self.nothing = np.zeros_like(self.work)

    def residual(self, force: Array, product: Array, own: Array) -> Array:
        """W^T (force - M x) - L own at the contact nodes, force - M x elsewhere; product: M x.

        own (nc, 3): z of the contact nodes.
        """
        out = force - product
        out[self.node] = np.einsum("cab,ca->cb", self.test, out[self.node])
        out[self.node] -= np.einsum("cab,cb->ca", self.L, own)
        return out

    def times(self, x: Array, out: Array) -> None:
        """out = A x, x free in the directions of the trial space alone, and given back."""
        own = x[self.node].copy()
        x[self.node] = np.einsum("cab,cb->ca", self.trial, own)
        self.finest.A.times(x, out)
        x[self.node] = own
        out[self.node] = np.einsum("cab,ca->cb", self.test, out[self.node]) + np.einsum(
            "cab,cb->ca", self.L, own
        )

    def apply(self, b: Array, z: Array) -> None:
        """z: what a cycle makes of zero for A x = b: coarse levels first, then a smoother."""
        P, levels = self.finest.P, self.tangent.hierarchy
        if P is None:
            z[:] = self.tangent.solve(b)
            return
        z[:] = 0.0
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

    def _relax(self, b: Array, z: Array) -> None:
        """A step of block Jacobi at the contact nodes."""
        node, own = self.node, z[self.node].copy()
        z[node] = np.einsum("cab,cb->ca", self.trial, own)
        self.contacts.own_residual(self.nothing, z, self.work)  # - M z
        rest = b[node] + np.einsum("cab,ca->cb", self.test, self.work[node])
        rest -= np.einsum("cab,cb->ca", self.L, own)
        z[node] = own + JACOBI * np.einsum("cab,cb->ca", self.inverse, rest)


def _iterated(cycle: _Cycle, force: Array, start: Array) -> tuple[Array, Array, int]:
    """(x, M x, cycles) of x = start + trial z: Orthomin, and GMRES where that is slow.

    Both are preconditioned from the right.  The residual is that of M x as it is, at most
    TOLERANCE of the larger of |force| and the first residual; where rounding of M x keeps it
    above that, at most ROUNDED.  Raises SingularOperator where it does not come to that.
    """
    node, x, product = cycle.node, start.copy(), np.zeros_like(force)
    own, count = np.zeros((len(node), 3)), 0
    if start.any():
        cycle.finest.A.times(start, product)
    r = cycle.residual(force, product, own)
    beta = norm(r)
    size, before, rest = max(norm(force), beta), np.inf, np.inf
    goal, method = TOLERANCE * size, _orthomin
    while not beta <= goal:  # nor where it is not a number
        if rest <= goal and 0.5 * before < beta <= ROUNDED * size:  # no method sees more of it
            break
        if count >= MOST or not np.isfinite(beta):
            raise SingularOperator(
                f"{SINGULAR}; {count} multigrid cycles left a residual of "
                f"{beta / size:.1e}"
            )
        z, more, rest = method(cycle, r, beta, goal)
        count, method = count + more, method if rest <= goal else _arnoldi
        own += z[node]
        z[node] = np.einsum("cab,cb->ca", cycle.trial, z[node])
        x += z
        cycle.finest.A.times(x, product)
        r = cycle.residual(force, product, own)
        before, beta = beta, norm(r)
    return x, product, count


def _orthomin(
    cycle: _Cycle, r: Array, beta: float, goal: float
) -> tuple[Array, int, float]:
    """(change of z, cycles, residual by the recurrence) of [V]; r becomes that residual.

    It ends where the residual falls slowly, too.
    """
    z, rest, count = np.zeros_like(r), beta, 0
    ways = [np.zeros_like(r) for _ in range(LAST + 1)]
    products = [np.zeros_like(r) for _ in ways]
    sizes = [0.0 for _ in ways]
    while rest > goal and count < MOST:
        now = count % len(ways)
        way, product = ways[now], products[now]
        cycle.apply(r, way)
        cycle.times(way, product)
        one, two = others = [k for k in range(len(ways)) if k != now]
        dots = two_dots(products[one], products[two], product)
        shares = tuple(-a / sizes[k] if sizes[k] > 0 else 0.0
                       for a, k in zip(dots, others, strict=True))  # fmt: skip
        last = [products[one], products[two]], [ways[one], ways[two]]
        sizes[now], along = add_two(product, way, (shares[0], shares[1]), *last, r)
        count += 1
        if not 0 < sizes[now] < np.inf:
            break
        rest = advance(z, r, along / sizes[now], way, product)
        if count >= EARLY and not rest <= SLOW**count * beta:
            break
    return z, count, rest


def _arnoldi(
    cycle: _Cycle, r: Array, beta: float, goal: float
) -> tuple[Array, int, float]:
    """(change of z, cycles, residual by the recurrence) of one restart of GMRES.

    Gram-Schmidt is the classical one, two products with the whole basis: what it loses of
    orthogonality, the next residual tells.
    """
    shape, n = r.shape, r.size
    basis, made = np.empty((RESTART + 1, n)), np.empty((RESTART, n))
    basis[0] = r.ravel() / beta
    H, e = np.zeros((RESTART + 1, RESTART)), np.zeros(RESTART + 1)
    e[0], k, y, rest = beta, 0, np.zeros(0), beta
    for k in range(RESTART):
        w = basis[k + 1]
        cycle.apply(basis[k].reshape(shape), made[k].reshape(shape))
        cycle.times(made[k].reshape(shape), w.reshape(shape))
        H[: k + 1, k] = basis[: k + 1] @ w
        w -= H[: k + 1, k] @ basis[: k + 1]
        H[k + 1, k] = norm(w)
        part = H[: k + 2, : k + 1]
        y = np.linalg.lstsq(part, e[: k + 2], rcond=None)[0]
        rest = float(np.linalg.norm(part @ y - e[: k + 2]))
        if rest <= goal or not H[k + 1, k] > 0 or not np.isfinite(rest):
            break
        w /= H[k + 1, k]
    return (y @ made[: k + 1]).reshape(shape), k + 1, rest
