"""Primal-dual accelerated gradients: projections and linear solves, no Newton matrix.

With the shift mu |u_T| of De Saxcé held fixed Coulomb's problem is convex.  A step of the
hybrid gradient method [CP] in r and one in v alternate with new shifts, [Rey] algorithm 2 [K]:

    s_i     = r_i^k - alpha_k (û_i^k + mu_i |u_T,i^k| n),       r_i^{k+1} = P_K(s_i)
    v^{k+1} = argmin_v  v M v / 2 - (f + H r^{k+1}) v + |v - v^k|_D^2 / (2 beta_k)
    theta_k = 1 / sqrt(1 + omega beta_k),   alpha_{k+1} = alpha_k / theta_k
    beta_{k+1} = theta_k beta_k,            û^{k+1} = u^{k+1} + theta_k (u^{k+1} - u^k)

where beta_0 = 1 / (alpha_0 gamma^2), gamma is the norm of H^T between the metrics of v and r,
and omega the convexity of M in the metric D of v:

    identity    D = 1, omega = lambda_min(M): as published, with a solve with 1 + beta_k M in
                each iteration; alpha_0 is in the units of r / u
    stiffness   D = M, omega = 1, alpha_0 relative to 1 / |W_ii|: independent of units, with
                v^{k+1} = (v^k + beta_k M^-1 (f + H r^{k+1})) / (1 + beta_k), a solve with one
                factor of M, or a product with W

As printed, [Rey] algorithm 2 has u in the place of û and r_c without beta_k: with those it does
not end at the printed solutions.

theta_k tends to 1, and the error falls like 1 / k^2.  A restart, alpha_0 and beta_0 again when
r moves against the gradient, (u + mu |u_T| n)(r^{k+1}) (r^{k+1} - r^k) > 0, makes it fall like
a geometric series ([OC] for gradient methods).  Under Tresca's law there is no shift and P is
the projection onto its cylinder.  Nothing ensures convergence for large mu.

[Rey] V. Rey, C. R. Mécanique (2026), section 3.4; [K] Y. Kanno, "Primal-dual algorithm for
quasi-static contact problem with Coulomb's friction" (2022); [CP] A. Chambolle, T. Pock, "An
introduction to continuous optimization for imaging", Acta Numerica 25 (2016); [OC]
B. O'Donoghue, E. Candès, "Adaptive restart for accelerated gradient schemes", Found. Comput.
Math. 15 (2015).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from enum import Enum
from functools import cached_property
from typing import ClassVar, Protocol

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse import linalg as sparse_linalg

from ..cones import Coulomb, Law, Tresca, with_de_saxce
from ..errors import SingularOperator, UnsupportedForm
from ..linear import Direct
from ..problem import Form, FrictionProblem
from .base import Iterate, Target, check_at_least, check_positive

Array = NDArray[np.float64]
SPECTRAL = 1500  # unknowns up to which the modes of M replace a factor in each iteration
DENSE = 200  # size up to which extreme eigenvalues come from all of them
NORM_ERROR = 1e-3  # of gamma^2 and omega from Lanczos' method
SAFETY = 1.01  # by which gamma^2 is increased, being found from below
EPSILON = np.finfo(float).eps


class Metric(Enum):
    """In which norm a step of v is short."""

    STIFFNESS = "stiffness"
    IDENTITY = "identity"


class Restart(Enum):
    """When alpha and beta return to their first values."""

    ADAPTIVE = "adaptive"
    NEVER = "never"


@dataclass(frozen=True, eq=False)
class GradientIterate(Iterate):
    """An iterate with |v - last v| in the metric of the method."""

    change: float = np.inf


@dataclass(frozen=True)
class AcceleratedGradient:
    """Primal-dual accelerated gradient method, [Rey] algorithm 2.

    The published method is metric=IDENTITY and restart=NEVER, which needs the global form.
    """

    form: ClassVar[Form] = Form.ANY
    alpha: float = 1.0  # first step of r: relative to 1 / |W_ii|, or with IDENTITY in r / u
    metric: Metric = Metric.STIFFNESS
    restart: Restart = Restart.ADAPTIVE  # IDENTITY: costs a solve with M in each iteration
    batch: int = 1  # iterations between two judgements

    def __post_init__(self) -> None:
        check_positive(alpha=self.alpha)
        check_at_least(1, batch=self.batch)

    def iterates(
        self, problem: FrictionProblem, start: Iterate, target: Target
    ) -> Iterator[Iterate]:
        """Iterates from r and v of `start`, for ever."""
        motion = self._motion(problem)
        law, restart = problem.law, self.restart is Restart.ADAPTIVE
        coefficient, tresca = law.coefficient, isinstance(law, Tresca)
        norm = self.alpha * motion.gamma_squared
        weight, first = self.alpha * motion.weight, 1 / norm if norm > 0 else 1.0
        r = np.where((weight > 0)[:, None], start.r, 0.0)  # who can not react keeps r = 0
        x = motion.start(r, start.v)
        u = ahead = motion.u(x)
        alpha, beta = weight, first
        while True:
            for _ in range(self.batch):
                r_last, x_last, u_last = r, x, u
                r = projected_step(r, alpha, ahead, u, coefficient, tresca)
                load = motion.load(r)
                x = motion.step(x, load, beta)
                u = motion.u(x)
                theta = 1 / math.sqrt(1 + motion.omega * beta)
                ahead, alpha, beta = u + theta * (u - u_last), alpha / theta, theta * beta
                if restart and _climbs(motion.response(load), law, r - r_last):
                    ahead, alpha, beta = u, weight, first
            change = motion.size(x - x_last)
            yield GradientIterate(r, motion.v(x), self.batch, change=change)

    def _motion(self, problem: FrictionProblem) -> Motion:
        if self.metric is Metric.STIFFNESS:
            return _Local(problem) if problem.form is Form.DELASSUS else _Stiffness(problem)
        if problem.form is Form.DELASSUS:
            raise UnsupportedForm(
                "metric=IDENTITY: measures v, which the local form does not have; "
                "use STIFFNESS or the global form"
            )
        return _Modes(problem) if problem.unknowns <= SPECTRAL else _Identity(problem)


@njit(cache=True, error_model="numpy")
def projected_step(r, alpha, ahead, u, coefficient, tresca):  # noqa: PLR0913
    """P(r - alpha (û + mu |u_T| n)) of r, ahead = û and u, all (nc, d); alpha (nc,)."""
    out = np.empty_like(r)
    nc, d = r.shape
    for i in range(nc):
        slip = pull = 0.0
        for k in range(1, d):
            slip += u[i, k] * u[i, k]
            out[i, k] = r[i, k] - alpha[i] * ahead[i, k]
            pull += out[i, k] * out[i, k]
        slip, pull, mu = math.sqrt(slip), math.sqrt(pull), coefficient[i]
        normal = r[i, 0] - alpha[i] * (ahead[i, 0] + (0.0 if tresca else mu * slip))
        scale = 1.0
        if tresca:
            normal = max(normal, 0.0)
            scale = mu / pull if pull > mu else 1.0
        elif mu * pull <= -normal:
            normal, scale = 0.0, 0.0
        elif pull > mu * normal:
            normal = (normal + mu * pull) / (1.0 + mu * mu)
            scale = mu * normal / pull
        out[i, 0] = normal
        for k in range(1, d):
            out[i, k] *= scale
    return out


def _climbs(u: Array, law: Law, dr: Array) -> bool:
    """Whether a step dr went against the gradient u + mu |u_T| n."""
    return np.vdot(with_de_saxce(u, law.mu) if isinstance(law, Coulomb) else u, dr) > 0


class Motion(Protocol):
    """How v follows r in one metric; x stands for v in the basis that makes steps cheap."""

    problem: FrictionProblem
    omega: float

    @property
    def weight(self) -> Array:
        """alpha of each contact relative to the option, (nc,)."""
        ...

    @property
    def gamma_squared(self) -> float:
        """Square of the norm of H^T between the metrics of v and of r weighted so."""
        ...

    def start(self, r: Array, v: Array | None) -> Array:
        """x of v, or in equilibrium with r where there is none."""
        ...

    def load(self, r: Array) -> Array:
        """f + H r in the form that `step` takes."""
        ...

    def step(self, x: Array, load: Array, beta: float) -> Array:
        """x^{k+1}."""
        ...

    def response(self, load: Array) -> Array:
        """u, (nc, d), in equilibrium with a load."""
        ...

    def u(self, x: Array) -> Array:
        """u of x, (nc, d)."""
        ...

    def v(self, x: Array) -> Array | None:
        """v of x, (n,); None in the Delassus form."""
        ...

    def size(self, x: Array) -> float:
        """Norm of a difference of two x in the metric."""
        ...


@dataclass(frozen=True, eq=False)
class _Local:
    """Metric M in the Delassus form: x is u, flat."""

    problem: FrictionProblem
    omega: float = 1.0

    @property
    def weight(self) -> Array:
        return self.problem.rho

    @cached_property
    def gamma_squared(self) -> float:
        d = self.problem.dimension
        root = np.repeat(np.sqrt(self.weight), d)
        return _largest(lambda y: root * self._compliance(root * y), root.size)

    def _compliance(self, r: Array) -> Array:
        assert self.problem.W is not None
        return self.problem.W @ r

    def start(self, r: Array, v: Array | None) -> Array:
        return self.load(r)

    def load(self, r: Array) -> Array:
        return self.problem.velocity(r)[0].ravel()

    def step(self, x: Array, load: Array, beta: float) -> Array:
        return (x + beta * load) / (1 + beta)

    def response(self, load: Array) -> Array:
        return self.u(load)

    def u(self, x: Array) -> Array:
        return x.reshape(self.problem.contacts, -1)

    def v(self, x: Array) -> Array | None:
        return None

    def size(self, x: Array) -> float:
        return float(np.linalg.norm(x))


class _Stiffness(_Local):
    """Metric M in the global form: x is v, and a load is M^-1 (f + H r)."""

    def _compliance(self, r: Array) -> Array:
        p = self.problem
        assert p.H is not None
        return p.H.T @ p.solve_M(p.H @ r)

    def start(self, r: Array, v: Array | None) -> Array:
        return self.load(r) if v is None else v

    def load(self, r: Array) -> Array:
        v = self.problem.velocity(r)[1]
        assert v is not None
        return v

    def u(self, x: Array) -> Array:
        return self.problem.local_velocity(x)

    def v(self, x: Array) -> Array | None:
        return x

    def size(self, x: Array) -> float:
        return float(np.sqrt(max(x @ (self.problem.M @ x), 0.0)))


@dataclass(frozen=True, eq=False)
class _Identity:
    """Metric 1: x is v, a factor of 1 + beta M in each step."""

    problem: FrictionProblem

    @cached_property
    def weight(self) -> Array:
        return np.where(self.problem.rho > 0, 1.0, 0.0)

    @cached_property
    def gamma_squared(self) -> float:
        H = self.problem.H
        assert H is not None
        return _largest(lambda r: H.T @ (H @ r), H.shape[1])

    @cached_property
    def omega(self) -> float:
        try:
            return 1 / _largest(self.problem.solve_M, self.problem.unknowns)
        except SingularOperator:
            return 0.0

    def start(self, r: Array, v: Array | None) -> Array:
        if v is not None:
            return v
        try:
            return self.problem.solve_M(self.load(r))
        except SingularOperator:
            return np.zeros(self.problem.unknowns)

    def load(self, r: Array) -> Array:
        assert self.problem.H is not None and self.problem.f is not None
        return self.problem.f + self.problem.H @ r.ravel()

    def step(self, x: Array, load: Array, beta: float) -> Array:
        matrix = beta * self.problem.M + sparse.eye_array(x.size, format="csc")
        return Direct().factor(sparse.csc_array(matrix)).solve(x + beta * load)

    def response(self, load: Array) -> Array:
        return self.u(self.problem.solve_M(load))

    def u(self, x: Array) -> Array:
        return self.problem.local_velocity(x)

    def v(self, x: Array) -> Array | None:
        return x

    def size(self, x: Array) -> float:
        return float(np.linalg.norm(x))


class _Modes(_Identity):
    """Metric 1 with the modes of M: x are their amplitudes, and a step is a product with H."""

    @cached_property
    def _modes(self) -> tuple[Array, Array]:
        M = self.problem.M
        assert M is not None
        return self.problem.kept("modes", lambda: np.linalg.eigh(M.toarray()))

    @cached_property
    def _directions(self) -> Array:
        """V^T H, (n, nc d)."""
        assert self.problem.H is not None
        return (self.problem.H.T @ self._modes[1]).T

    @cached_property
    def _steady(self) -> Array:
        """V^T f, (n,)."""
        return self._modes[1].T @ self.problem.f

    @cached_property
    def omega(self) -> float:
        values = self._modes[0]
        return max(values[0], 0.0) if values[0] > values.size * EPSILON * values[-1] else 0.0

    def start(self, r: Array, v: Array | None) -> Array:
        return self._modes[1].T @ super().start(r, v)

    def load(self, r: Array) -> Array:
        return self._steady + self._directions @ r.ravel()

    def step(self, x: Array, load: Array, beta: float) -> Array:
        return (x + beta * load) / (1 + beta * self._modes[0])

    def response(self, load: Array) -> Array:
        if self.omega == 0:
            raise SingularOperator("M: has no inverse, which restarts need; use Restart.NEVER")
        return self.u(load / self._modes[0])

    def u(self, x: Array) -> Array:
        assert self.problem.w is not None
        return (x @ self._directions).reshape(self.problem.w.shape) + self.problem.w

    def v(self, x: Array) -> Array | None:
        return self._modes[1] @ x


def _largest(product: Callable[[Array], Array], size: int) -> float:
    """Largest eigenvalue of a positive semidefinite operator, from above."""
    if size == 0:
        return 0.0
    if size <= DENSE:
        matrix = np.column_stack([product(row) for row in np.eye(size)])
        return float(np.linalg.norm(matrix, 2))
    operator = sparse_linalg.LinearOperator((size, size), matvec=product, dtype=float)
    start = np.random.default_rng(0).standard_normal(size)
    values = sparse_linalg.eigsh(
        operator, k=1, v0=start, tol=NORM_ERROR, return_eigenvectors=False
    )
    return SAFETY * float(values[0])
