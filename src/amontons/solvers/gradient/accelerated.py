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
from collections.abc import Iterator
from dataclasses import dataclass
from enum import Enum
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from ...core.compiled import njit
from ...core.options import check_options
from ...problem.friction import Form, FrictionProblem
from ...problem.law import Law
from ...problem.law.cones import with_de_saxce
from ...problem.law.law import BOUND, MU, TIED, given
from ..contract import Iterate, Target, check_at_least, check_positive
from .motion import in_identity, in_stiffness

Array = NDArray[np.float64]


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
        check_options(self)
        check_positive(alpha=self.alpha)
        check_at_least(1, batch=self.batch)

    def iterates(
        self, problem: FrictionProblem, start: Iterate, target: Target
    ) -> Iterator[Iterate]:
        """Iterates from r and v of `start`, for ever."""
        metric = in_stiffness if self.metric is Metric.STIFFNESS else in_identity
        motion = metric(problem)
        law, restart = problem.law, self.restart is Restart.ADAPTIVE
        norm = self.alpha * motion.gamma_squared
        weight, first = self.alpha * motion.weight, 1 / norm if norm > 0 else 1.0
        r = np.where((weight > 0)[:, None], start.r, 0.0)  # who can not react keeps r = 0
        x = x_last = motion.start(r, start.v)
        u = ahead = motion.u(x)
        alpha, beta = weight, first
        while True:
            for _ in range(self.batch):
                r_last, x_last, u_last = r, x, u
                r = projected_step(r, alpha, ahead, u, law.kind, law.parameters)
                load = motion.load(r)
                x = motion.step(x, load, beta)
                u = motion.u(x)
                theta = 1 / math.sqrt(1 + motion.omega * beta)
                ahead, alpha, beta = u + theta * (u - u_last), alpha / theta, theta * beta
                dr = r - r_last  # r at rest: short steps would keep v from following it
                if restart and (not dr.any() or _climbs(motion.response(load), law, r, dr)):
                    ahead, alpha, beta = u, weight, first
            change = motion.size(x - x_last)
            yield GradientIterate(r, motion.v(x), self.batch, change=change)


@njit(cache=True, error_model="numpy")
def projected_step(r, alpha, ahead, u, kind, parameters):  # noqa: PLR0913
    """P(r - alpha (û + mu |u_T| n)) of r, ahead = û and u, all (nc, d); alpha (nc,)."""
    out = np.empty_like(r)
    nc, d = r.shape
    for i in range(nc):
        slip = pull = 0.0
        for k in range(1, d):
            slip += u[i, k] * u[i, k]
            out[i, k] = r[i, k] - alpha[i] * ahead[i, k]
            pull += out[i, k] * out[i, k]
        fixed = given(kind[i], parameters[i], r[i, 0])
        mu = parameters[i, BOUND] if fixed else parameters[i, MU]
        slip, pull = math.sqrt(slip), math.sqrt(pull)
        normal = r[i, 0] - alpha[i] * (ahead[i, 0] + (0.0 if fixed else mu * slip))
        scale = 1.0
        if fixed:
            normal = normal if kind[i] == TIED else max(normal, 0.0)
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


def _climbs(u: Array, law: Law, r: Array, dr: Array) -> bool:
    """Whether a step dr went against the gradient u + mu |u_T| n at r."""
    mu = np.where(law.given(r), 0.0, law.parameters[:, MU])
    return bool(np.vdot(with_de_saxce(u, mu), dr) > 0)
