"""The discrete problem of Nitsche's method: displacements only, the law inside the equation.

With S the rows of stresses and H those of displacements at q contact points, everything in
local frames, weights omega (areas), rho = omega kappa and reactions r in the unit of force,

    t = S^T v + s,   u = H^T v + w,   x = omega t - rho u,   r = P(x),
    F(v) = M v - f - H r - S (theta / kappa) (omega t - r) = 0.

P is Alart and Curnier's projection (`Law.augmented_reaction`).  In the letters of the design,
K v + A^T P(B v + c) = f with B = omega S^T - rho H^T, A^T = S theta / kappa - H and
K = M - S (theta omega / kappa) S^T.

r obeys its law exactly with the displacement u + (r - omega t) / rho; how far that is from u
is the error of the discretisation, not of the solver.  So the judge reads F alone, in the norm
dual to the energy, which no change of units alters:

    error = |F|_* / (|f|_* + |v_o|_M),   |F|_*^2 = F^T G^-1 F,   G = M.

For theta = 0, |F|_* is the energy norm of the distance from v to the displacement that the
reactions of v and the load produce.  kappa must not enter: a large one would hide reactions
that are wrong.  Where contact alone holds a body, G = M + H (omega c) H^T with the stiffness c
of the cells behind the surface.  v_o closes the overlap of a body placed in its obstacle.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ..core.arrays import expect_shape
from ..core.errors import SingularOperator
from ..linear import Direct, Factor, LinearSolver
from .friction import FrictionProblem
from .judge import measures as judge
from .judge.measures import Measure
from .law import Law
from .protocol import Form, Problem, Start, checked_motion
from .settling import Accepted, Motion

Array = NDArray[np.float64]
EPSILON = judge.EPSILON
NO_MULTIPLIERS = (
    "Nitsche's method has no contact multipliers, only displacements: solve takes it (auto or "
    'semismooth-newton); for anything else give the contacts method="nodal" or "mortar"'
)


@dataclass(frozen=True, eq=False)
class NitscheMatrices:
    """What load and friction do not change: M (n, n), H and S (n, q d), then (q,).

    held: supports leave no rigid motion, so that M can be inverted.
    """

    M: sparse.csc_array
    H: sparse.csc_array
    S: sparse.csc_array
    weights: Array
    kappa: Array
    theta: Array
    stiffness: Array
    held: bool

    @cached_property
    def rho(self) -> Array:
        """omega kappa, (q,), force per length."""
        return self.weights * self.kappa

    def _each(self, values: Array) -> sparse.dia_array:
        """Diagonal matrix of a value per contact."""
        d = self.H.shape[1] // len(self.weights)
        return sparse.diags_array(np.repeat(values, d))

    @cached_property
    def B(self) -> sparse.csr_array:
        """dx / dv, (q d, n)."""
        part = self._each(self.weights) @ self.S.T - self._each(self.rho) @ self.H.T
        return sparse.csr_array(part)

    @cached_property
    def minus_A(self) -> sparse.csr_array:
        """H - S theta / kappa, (n, q d): how reactions enter the equation."""
        if not self.theta.any():
            return sparse.csr_array(self.H)
        return sparse.csr_array(self.H - self.S @ self._each(self.theta / self.kappa))

    @cached_property
    def K(self) -> sparse.csc_array:
        """M - S (theta omega / kappa) S^T, (n, n)."""
        if not self.theta.any():
            return self.M
        weights = self._each(self.theta * self.weights / self.kappa)
        return sparse.csc_array(self.M - self.S @ weights @ self.S.T)

    @cached_property
    def G(self) -> Factor:
        """Factor of the matrix of the energy norm."""
        if self.held:
            return Direct().factor(self.M)
        return Direct().factor(sparse.csc_array(self.M + self.springs))

    @cached_property
    def bonded(self) -> Factor:
        """Factor of M + H rho H^T: all points bonded to the other side."""
        stiff = self.H @ self._each(self.rho) @ self.H.T
        return Direct().factor(sparse.csc_array(self.M + stiff))

    @cached_property
    def springs(self) -> sparse.csc_array:
        """H (omega c) H^T, (n, n): springs at all points, as stiff as the cells behind them."""
        return sparse.csc_array(self.H @ self._each(self.weights * self.stiffness) @ self.H.T)


@dataclass(frozen=True, eq=False)
class NitscheProblem(Problem):
    """Find v, (n,), with F(v) = 0.

    f (n,), force; at v = 0 w (q, d), local displacement with the gap, and t0 (q, d), traction;
    law of r in the unit of force.
    """

    matrices: NitscheMatrices
    f: Array
    w: Array
    t0: Array
    law: Law
    name: str = ""

    form = Form.NITSCHE
    measure = Measure.NITSCHE
    unfit = no_inertia = no_path = NO_MULTIPLIERS

    @property
    def contacts(self) -> int:
        """Number of contact points q."""
        return len(self.w)

    @property
    def dimension(self) -> int:
        """2 or 3."""
        return self.w.shape[1]

    @property
    def unknowns(self) -> int:
        """n."""
        return self.f.size

    @property
    def rho(self) -> Array:
        """omega kappa, (q,), force per length."""
        return self.matrices.rho

    def with_multipliers(self) -> FrictionProblem:
        """The same law at the same points with reactions as unknowns: an augmented Lagrangian.

        Its r (q, d) are tractions times sqrt(omega), its u displacements times sqrt(omega), so
        that one rho, stress per length, is the same at all points.  More points than the trace
        of v has freedom make W singular: for `Uzawa`, which never forms it.
        """
        m, d = self.matrices, self.dimension
        root = np.sqrt(m.weights)
        H = sparse.csc_array(m.H @ sparse.diags_array(np.repeat(root, d)))
        law = self.law.scaled(1 / root)  # a force becomes force / sqrt(omega), and root is > 0
        return FrictionProblem.from_global(
            m.M, H, self.f, root[:, None] * self.w, law, name=self.name
        )

    # ---------------------------------------------------------------- the equation
    def local_velocity(self, v: Array) -> Array:
        """u = H^T v + w, (q, d), length; u_N is the gap."""
        return (self.matrices.H.T @ v).reshape(self.w.shape) + self.w

    def traction(self, v: Array) -> Array:
        """t, (q, d): the stress of the slave on its surface, in the local frames."""
        return (self.matrices.S.T @ v).reshape(self.w.shape) + self.t0

    def augmented(self, v: Array) -> Array:
        """x = omega t - rho u, (q, d), force."""
        x0 = self.matrices.weights[:, None] * self.t0 - self.rho[:, None] * self.w
        return (self.matrices.B @ v).reshape(self.w.shape) + x0

    def reaction(self, v: Array) -> Array:
        """r = P(x), (q, d), force."""
        return self.law.augmented_reaction(self.augmented(v))

    def residual(self, v: Array) -> Array:
        """F(v), (n,), force."""
        return self.residual_of(self.reaction(v), v)

    def residual_of(self, r: Array, v: Array) -> Array:
        """The same with r (q, d) in the place of the reactions that v makes."""
        m = self.matrices
        out = m.M @ v - self.f - m.minus_A @ r.ravel()
        if m.theta.any():
            share = (m.theta * m.weights / m.kappa)[:, None] * self.traction(v)
            out -= m.S @ share.ravel()
        return out

    def tangent(self, v: Array) -> sparse.csc_array:
        """One element of the generalised Jacobian of F, (n, n); unsymmetric."""
        m, d = self.matrices, self.dimension
        blocks = self.law.augmented_reaction_jacobian(self.augmented(v))
        index = np.arange(self.contacts + 1)
        size = (self.contacts * d,) * 2
        D = sparse.bsr_array((blocks, index[:-1], index), shape=size)
        return sparse.csc_array(m.K - m.minus_A @ (sparse.csr_array(D) @ m.B))

    def lawful(self, u: Array, v: Array | None) -> Array:
        """The displacement u + (r - omega t) / rho, (q, d), with which r obeys its law."""
        assert v is not None
        return (self.reaction(v) - self.augmented(v)) / self.rho[:, None]

    # ---------------------------------------------------------------- judging
    def size(self, residual: Array) -> float:
        """|F|_*, square root of an energy."""
        return float(np.sqrt(max(residual @ self.matrices.G.solve(residual), 0.0)))

    @cached_property
    def scale(self) -> float:
        """Size of the load, |f|_* + |v_o|_M."""
        overlap = np.zeros_like(self.w)
        overlap[:, 0] = self.rho * np.maximum(-self.w[:, 0], 0.0)
        load = self.size(self.f)
        if not overlap.any():
            return load
        v = self.matrices.bonded.solve(self.matrices.H @ overlap.ravel())
        return load + float(np.sqrt(max(v @ (self.matrices.M @ v), 0.0)))

    @np.errstate(over="ignore", invalid="ignore")
    def error(self, r: Array | None, v: Array | None = None) -> float:
        """Unit-free residual of v, (n,), and of r, (q, d), where it is not that of v.

        Infinite without v.
        """
        if v is None or not np.isfinite(v).all():
            return np.inf
        expect_shape("v", np.shape(v), (self.unknowns,))
        own = self.reaction(v)
        size = self.size(self.residual_of(own, v))
        if r is not None and not np.array_equal(r, own):
            expect_shape("r", np.shape(r), own.shape)
            other = self.size(self.residual_of(r, v))
            size = max(size, other) if np.isfinite(other) else np.inf
        error = judge.ratio(size, self.scale)
        return error if np.isfinite(error) else np.inf

    def accepted(
        self, r: Array, v: Array | None, error: float, tolerance: float
    ) -> Accepted:
        """As it is: r obeys the law at every point, all error is in the balance."""
        return Accepted(r, v, error)

    def rounding(self, r: Array) -> float:
        """What rounding of huge reactions may hide in `error`."""
        m = self.matrices
        force = np.sqrt(((r**2).sum(axis=1) / (m.weights * m.stiffness)).sum())
        return judge.ratio(EPSILON * float(force), self.scale)

    # ---------------------------------------------------------------- starting
    @cached_property
    def guess(self) -> Array:
        """Where Newton starts, (n,): all points bonded to the other side by springs rho.

        From there it takes fewer steps than from rest, and a body that contact alone holds
        has a state at all.
        """
        m = self.matrices
        springs = (self.rho[:, None] * self.w).ravel()
        return m.bonded.solve(self.f - m.H @ springs)

    def start(self, given: Start | None = None) -> Motion:
        """(r, v) at the displacements that are given, or at the guess.

        The reactions of a start may be those of another method.
        """
        free = given is None or given.v is None
        v = self.guess if free else checked_motion(given.v, self.unknowns)
        return self.reaction(v), v

    def motion(self, r: Array, v: Array | None = None) -> Motion:
        """(u, v), at the guess without v: reactions alone tell no displacements here."""
        v = self.guess if v is None else v
        return self.local_velocity(v), v

    def newton_step(self, v: Array, linear: LinearSolver) -> Array:
        """-(dF/dv)^-1 F, (n,); -G^-1 F where that is singular: a loose body in the air."""
        try:
            return linear.factor(self.tangent(v)).solve(-self.residual(v))
        except SingularOperator:
            return self.matrices.G.solve(-self.residual(v))

