"""Smoothing Newton on the second-order cone: each iteration factorises W plus 3x3 blocks.

With x = (mu r_N, r_T) and y = (u_N / mu + |u_T|, u_T), Coulomb's law is: x and y in the
Lorentz cone, x . y = 0.  The projection in x - P(x - rho y) = 0 is smoothed spectrally,

    P_eps(z): phi(l) = (l + sqrt(l^2 + 4 eps^2)) / 2 on both eigenvalues l = z_0 ± |z_T|,

|u_T| becomes sqrt(|u_T|^2 + sigma^2) - sigma, and eps_i = sigma rho_i, sigma a velocity.
With G = dy/du and S = dx/dr the Newton equation, multiplied by (rho P' G)^-1, is

    [ W + (1/rho) G^-1 (P'^-1 - I) S ] dr = - (1/rho) G^-1 P'^-1 F,

and the eigenvalues of P'^-1 - I are known without cancellation: with s = sqrt(l^2 + 4 eps^2),
a = s + l and b = s - l (the smaller one as 4 eps^2 / the larger), they are b/a for both l and
(b_1 + b_2) / (a_1 + a_2) for the third.  sigma shrinks as the equations are met.

A proximal term alpha_i (r_i - center_i) added to u makes singular problems regular:
`ProximalPoint` uses it.  Contacts with mu = 0 are smoothed in their normal alone.

[CT] X. Chen, P. Tseng, "Non-interior continuation methods for solving semidefinite
complementarity problems", Math. Program. 95 (2003); [FLT] M. Fukushima, Z.-Q. Luo, P. Tseng,
"Smoothing functions for second-order-cone complementarity problems", SIAM J. Optim. 12 (2002).
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from ...core.clock import NEVER, Deadline
from ...core.compiled import njit
from ...core.copies import copy_rows_inplace
from ...core.errors import InvalidInput, UnsupportedLaw
from ...core.options import check_options
from ...linear.blocks import spatial
from ...problem.friction import Form, FrictionProblem
from ...problem.judge.measures import PENETRATION, contact_residual, natural_error
from ...problem.law import Coulomb
from ...problem.law.law import MU
from ..contract import Breakdown, Iterate, Target, check_at_least, check_positive
from ..sweeps.kernels import sweep_data, sweep_inplace
from .block_lu import Symbolic, factorise_inplace, solve_inplace
from .faces import FaceMatrix

Array = NDArray[np.float64]
PINNED = 1e16  # relative stiffness that keeps r_T = 0 where mu = 0
IDLE = 1e100  # stiffness of a contact that can not react: its cube is a number
PRODUCT_SECONDS = 1e-8  # of a product of 3x3 blocks in a factor, on a slow core
SMALLEST = 1e-18  # smoothing relative to |q|, far below rounding; smaller ones become denormal


@njit(cache=True, error_model="numpy")
def _split(l, eps):
    """s + l and s - l with s = sqrt(l^2 + 4 eps^2), the smaller one without cancellation."""
    s = math.sqrt(l * l + 4.0 * eps * eps)
    if l > 0.0:
        a = s + l
        return a, 4.0 * eps * eps / a
    b = s - l
    return 4.0 * eps * eps / b, b


@njit(cache=True, error_model="numpy")
def _smoothed(r, u, mu, rho, sigma, i):
    """F_sigma of contact i (three scalars, unit of r), and what its derivative needs."""
    eps = sigma * rho
    if mu == 0.0:
        a, b = _split(r[i, 0] - rho * u[i, 0], eps)
        return r[i, 0] - 0.5 * a, 0.0, 0.0, a, b, 1.0, 0.0, 1.0, 0.0
    root = math.sqrt(u[i, 1] ** 2 + u[i, 2] ** 2 + sigma * sigma)
    x0 = mu * r[i, 0]
    z0 = x0 - rho * (u[i, 0] / mu + root - sigma)
    z1 = r[i, 1] - rho * u[i, 1]
    z2 = r[i, 2] - rho * u[i, 2]
    t = math.sqrt(z1 * z1 + z2 * z2)
    c, s = (z1 / t, z2 / t) if t > 0.0 else (1.0, 0.0)
    a1, b1 = _split(z0 + t, eps)
    a2, b2 = _split(z0 - t, eps)
    radial = 0.25 * (a1 - a2)
    f0 = x0 - 0.25 * (a1 + a2)
    return f0, r[i, 1] - radial * c, r[i, 2] - radial * s, a1, b1, a2, b2, c, s


@njit(cache=True, error_model="numpy")
def _merit(r, u, mu, rho, sigma):
    """|F_sigma / rho| over all contacts, unit of u."""
    total = 0.0
    for i in range(len(mu)):
        if rho[i] > 0.0:
            f = _smoothed(r, u, mu[i], rho[i], sigma, i)
            total += (f[0] ** 2 + f[1] ** 2 + f[2] ** 2) / rho[i] ** 2
    return math.sqrt(total)


@njit(cache=True, error_model="numpy")
def _assemble(r, u, mu, rho, sigma, shift, prox, extra, rhs):  # noqa: PLR0913
    """Block diagonal and right-hand side of the Newton equation."""
    for i in range(len(mu)):
        d = extra[i]
        d[:, :] = 0.0
        if rho[i] <= 0.0:  # W_ii = 0: this contact can not react
            d[0, 0] = d[1, 1] = d[2, 2] = IDLE
            rhs[i, :] = 0.0
            continue
        f0, f1, f2, a1, b1, a2, b2, c, s = _smoothed(r, u, mu[i], rho[i], sigma, i)
        if mu[i] == 0.0:
            k = b1 / a1
            d[0, 0] = k / rho[i]
            d[1, 1] = d[2, 2] = PINNED / rho[i]
            rhs[i, 0] = -(1.0 + k) * f0 / rho[i]
            rhs[i, 1] = rhs[i, 2] = 0.0
        else:
            k1, k2, k3 = b1 / a1, b2 / a2, (b1 + b2) / (a1 + a2)
            mean, half = 0.5 * (k1 + k2), 0.5 * (k1 - k2)
            # K = P'^-1 - I in the basis (n, t1, t2)
            k00, k01, k02 = mean, half * c, half * s
            k11 = mean * c * c + k3 * s * s
            k12 = (mean - k3) * c * s
            k22 = mean * s * s + k3 * c * c
            root = math.sqrt(u[i, 1] ** 2 + u[i, 2] ** 2 + sigma * sigma)
            e1, e2 = u[i, 1] / root, u[i, 2] / root
            g0 = f0 + k00 * f0 + k01 * f1 + k02 * f2
            g1 = f1 + k01 * f0 + k11 * f1 + k12 * f2
            g2 = f2 + k02 * f0 + k12 * f1 + k22 * f2
            m, w = mu[i], 1.0 / rho[i]
            rhs[i, 0] = -w * m * (g0 - e1 * g1 - e2 * g2)
            rhs[i, 1] = -w * g1
            rhs[i, 2] = -w * g2
            d[0, 0] = w * m * m * (k00 - e1 * k01 - e2 * k02)
            d[0, 1] = w * m * (k01 - e1 * k11 - e2 * k12)
            d[0, 2] = w * m * (k02 - e1 * k12 - e2 * k22)
            d[1, 0], d[1, 1], d[1, 2] = w * m * k01, w * k11, w * k12
            d[2, 0], d[2, 1], d[2, 2] = w * m * k02, w * k12, w * k22
        add = shift / rho[i] + prox[i]
        d[0, 0] += add
        d[1, 1] += add
        d[2, 2] += add


@njit(cache=True, error_model="numpy")
def _product(indptr, indices, data, prox, x, out):
    """out = (W + diag(prox)) x."""
    for i in range(len(prox)):
        u0, u1, u2 = prox[i] * x[i, 0], prox[i] * x[i, 1], prox[i] * x[i, 2]
        for k in range(indptr[i], indptr[i + 1]):
            j = indices[k]
            b = data[k]
            x0, x1, x2 = x[j, 0], x[j, 1], x[j, 2]
            u0 += b[0, 0] * x0 + b[0, 1] * x1 + b[0, 2] * x2
            u1 += b[1, 0] * x0 + b[1, 1] * x1 + b[1, 2] * x2
            u2 += b[2, 0] * x0 + b[2, 1] * x1 + b[2, 2] * x2
        out[i, 0], out[i, 1], out[i, 2] = u0, u1, u2


@njit(cache=True, error_model="numpy")
def _law_error(r, u, kind, parameters, rho):
    """|(r - P(r - rho û)) / rho|, the judge's formula with u given."""
    total = 0.0
    for i in range(len(kind)):
        if rho[i] > 0.0:
            e0, e1, e2 = contact_residual(
                r[i, 0], r[i, 1], r[i, 2], u[i, 0], u[i, 1], u[i, 2], rho[i], kind[i],
                parameters[i],
            )  # fmt: skip
            total += max(e0 * e0 + e1 * e1 + e2 * e2, (PENETRATION * min(u[i, 0], 0.0)) ** 2)
    return math.sqrt(total)


@njit(cache=True, error_model="numpy")
def newton_inplace(  # noqa: PLR0913
    indptr, indices, data, q, kind, parameters, rho, order, upper_start, upper, lower_start,
    lower,
    prox, center, x, r, sigma, shift, tracking, shrink, goal, steps, patience,
):  # fmt: skip
    """At most `steps` Newton steps on x; r ends as the best iterate by the law's own residual.

    goal: residual, unit of u, at which to stop; patience: steps without halving it;
    prox (nc,), center (nc, 3): proximal term.
    Returns (steps done, best residual, sigma); a negative count says that a factor broke down.
    """
    mu = parameters[:, MU].copy()
    nc = len(mu)
    extra = np.empty((nc, 3, 3))
    U, L = np.empty((len(upper), 3, 3)), np.empty((len(upper), 3, 3))
    inverse, work = np.empty((nc, 3, 3)), np.zeros((nc, 3, 3))
    rhs, dr, du = np.empty((nc, 3)), np.empty((nc, 3)), np.empty((nc, 3))
    u, trial, trial_u = np.empty((nc, 3)), np.empty((nc, 3)), np.empty((nc, 3))
    copy_rows_inplace(x, r)
    _product(indptr, indices, data, prox, x, u)
    for i in range(nc):
        for a in range(3):
            u[i, a] += q[i, a] - prox[i] * center[i, a]
    best = _law_error(x, u, kind, parameters, rho)
    count = last_gain = 0
    milestone = best
    root = math.sqrt(nc)
    size = 0.0
    for i in range(nc):
        size += q[i, 0] ** 2 + q[i, 1] ** 2 + q[i, 2] ** 2
    floor = max(1e-3 * goal, SMALLEST * math.sqrt(size)) / root
    value = _merit(x, u, mu, rho, sigma)
    recent = np.full(4, value)
    while count < steps and best > goal and count - last_gain <= patience:
        count += 1
        _assemble(x, u, mu, rho, sigma, shift, prox, extra, rhs)
        if not factorise_inplace(
            indptr, indices, data, extra, order, upper_start, upper, lower_start, lower,
            U, L, inverse, work,
        ):  # fmt: skip
            return -count, best, sigma
        solve_inplace(order, upper_start, upper, lower_start, lower, U, L, inverse, rhs, dr)
        _product(indptr, indices, data, prox, dr, du)
        ceiling = recent.max()
        step = 1.0
        for _ in range(12):
            for i in range(nc):
                for a in range(3):
                    trial[i, a] = x[i, a] + step * dr[i, a]
                    trial_u[i, a] = u[i, a] + step * du[i, a]
            value = _merit(trial, trial_u, mu, rho, sigma)
            if value <= (1.0 - 1e-4 * step) * ceiling:
                break
            step *= 0.5
        if not math.isfinite(value):
            return -count, best, sigma
        copy_rows_inplace(trial, x)
        copy_rows_inplace(trial_u, u)
        residual = _law_error(x, u, kind, parameters, rho)
        if residual < best:
            best = residual
            copy_rows_inplace(x, r)
        if best <= 0.5 * milestone:
            milestone, last_gain = best, count
        recent[count % 4] = value
        if value <= tracking * sigma * root:
            sigma = max(shrink * sigma, floor)
            recent[:] = _merit(x, u, mu, rho, sigma)
        elif step < 0.01:
            sigma *= 2.0
            recent[:] = _merit(x, u, mu, rho, sigma)
    return count, best, sigma


@dataclass(frozen=True)
class SmoothingNewton:
    """Smoothing Newton on the Delassus form, for Coulomb friction."""

    form: ClassVar[Form] = Form.DELASSUS
    needs_cone: ClassVar[bool] = True
    sigma: float = 0.1  # first smoothing velocity, relative to |q| / sqrt(nc)
    shift: float = 1e-8  # added to the Newton matrix, relative to |W_ii|: W is often singular
    tracking: float = 0.3  # sigma shrinks when |F_sigma / rho| <= tracking sigma sqrt(nc)
    shrink: float = 0.3  # factor on sigma then
    batch: int = 1  # Newton steps between two judgements

    def __post_init__(self) -> None:
        check_options(self)
        check_positive(sigma=self.sigma, shift=self.shift, tracking=self.tracking)
        if not 0 < self.shrink < 1:
            raise InvalidInput(f"expected between 0 and 1, got {self.shrink}", ("shrink",))
        check_at_least(1, batch=self.batch)

    def iterates(
        self, problem: FrictionProblem, start: Iterate, target: Target
    ) -> Iterator[Iterate]:
        """Newton steps from `start`, until a factorisation breaks down."""
        work = Workspace.of(problem)
        x = spatial(start.r)
        sigma = self.sigma * problem.q_norm / math.sqrt(max(problem.contacts, 1))
        while True:
            count, _, sigma, _ = work.newton(x, sigma, self, goal=0.0, steps=self.batch)
            if count < 0:
                raise Breakdown("the Newton matrix is singular")
            yield Iterate(x[:, : problem.dimension].copy(), iterations=count)


@dataclass(frozen=True, eq=False)
class Workspace:
    """A Coulomb problem in Delassus form and the symbolic factor its Newton steps share."""

    problem: FrictionProblem
    symbolic: Symbolic

    @classmethod
    def of(cls, problem: FrictionProblem) -> Workspace:
        """Order and analyse W once; raises UnsupportedLaw unless the law is Coulomb's."""
        if not isinstance(problem.law, Coulomb):
            raise UnsupportedLaw(
                "smoothing Newton and interior point need Coulomb's cone, not "
                f"{problem.law.name}; use SemismoothNewton or GaussSeidel"
            )
        return cls(problem, Symbolic.of(problem))

    @cached_property
    def sharing(self) -> FaceMatrix:
        """Faces that contacts share, for steps of interior points."""
        return FaceMatrix.of(self.problem)

    def affordable(self, steps: int, deadline: Deadline, products: int | None = None) -> int:
        """Steps of one compiled call that still fit before a deadline, one at least.

        products: of blocks in a step, by default in one with the whole factor.
        """
        left, whole = deadline.left, self.symbolic.products
        each = PRODUCT_SECONDS * (1 + (whole if products is None else products))
        return steps if math.isinf(left) else max(1, min(steps, int(left / each)))

    def newton(  # noqa: PLR0913
        self, x: Array, sigma: float, options: SmoothingNewton, *, goal: float, steps: int,
        alpha: float = 0.0, center: Array | None = None, patience: int = 10**9,
    ) -> tuple[int, float, float, Array]:  # fmt: skip
        """Newton steps on x in place: (steps, best residual, sigma, best r).

        alpha, relative to |W_ii|, is the weight of the proximal term about `center`.
        """
        indptr, indices, data, q, kind, parameters, rho = self.problem.kernel_data
        prox = np.where(rho > 0, alpha / np.where(rho > 0, rho, 1.0), 0.0)
        best = np.empty_like(x)
        count, residual, sigma = newton_inplace(
            indptr, indices, data, q, kind, parameters, rho, *self.symbolic.arrays,
            prox, x.copy() if center is None else center, x, best, sigma,
            options.shift, options.tracking, options.shrink, goal, steps, patience,
        )  # fmt: skip
        return count, residual, sigma, best

    def error(self, r: Array) -> float:
        """The judge's residual before division by |q|, unit of u."""
        return natural_error(*self.problem.product_data, r)

    def sweeps(self, r: Array, count: int) -> None:
        """Gauss-Seidel sweeps on r in place, alternating direction."""
        data = sweep_data(self.problem)
        for k in range(count):
            sweep_inplace(data, k % 2 == 1, r)


@dataclass(frozen=True)
class ProximalPoint:
    """Proximal point on r for singular, hyperstatic problems; inner solver smoothing Newton.

    Outer step: r solves the problem with u + alpha_i (r_i - center_i) in place of u, center the
    last r.  alpha is halved after a step that lowered the error and grows fourfold after one
    that did not; a few Gauss-Seidel sweeps of alternating direction come in between.
    """

    form: ClassVar[Form] = Form.DELASSUS
    needs_cone: ClassVar[bool] = True
    inner: SmoothingNewton = field(default_factory=SmoothingNewton)
    alpha: float = 1e-2  # first proximal weight, relative to |W_ii|
    alpha_min: float = 1e-5
    inner_steps: int = 12
    inner_reduction: float = 0.3  # the inner residual aims at this part of the current error
    sweeps: int = 10

    def __post_init__(self) -> None:
        check_options(self)
        check_positive(alpha=self.alpha, alpha_min=self.alpha_min)
        check_at_least(1, inner_steps=self.inner_steps)
        check_at_least(0, sweeps=self.sweeps)

    def iterates(
        self, problem: FrictionProblem, start: Iterate, target: Target
    ) -> Iterator[Iterate]:
        """Outer steps from `start`, for ever."""
        work = Workspace.of(problem)
        yield from self.steps(work, spatial(start.r), target.deadline)

    def steps(
        self, work: Workspace, r: Array, deadline: Deadline = NEVER
    ) -> Iterator[Iterate]:
        """Outer steps from r, (nc, 3)."""
        d = work.problem.dimension
        root = math.sqrt(max(work.problem.contacts, 1))
        alpha, best, error = self.alpha, r, work.error(r)
        while True:
            sigma = max(error, 1e-16 * work.problem.q_norm) / root
            x = best.copy()
            count, _, _, found = work.newton(
                x, sigma, self.inner, goal=self.inner_reduction * error,
                steps=work.affordable(self.inner_steps, deadline), alpha=alpha,
                center=best.copy(),
            )  # fmt: skip
            work.sweeps(found, self.sweeps)
            new = work.error(found)
            if new < error:
                best, error = found, new
                alpha = max(0.5 * alpha, self.alpha_min)
            else:
                alpha = min(4.0 * alpha, 1e4)
            yield Iterate(best[:, :d].copy(), iterations=abs(count), stage="proximal point")
