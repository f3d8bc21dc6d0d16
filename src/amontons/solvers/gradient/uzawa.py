"""Augmented Lagrangian: Uzawa's update of the reactions, Newton's method for the motion inside.

For given multipliers lambda find v with (generalised Newton, [Rey] eq. (11))

    M v = H p + f,   p = P(lambda - rho u),   u = H^T v + w

where P is (x_N^+, projection of x_T onto the disk with the bound at x_N^+), then

    lambda <- p                                                        [Rey] algorithm 1

Contacts are thus springs of stiffness rho about lambda; each update removes most of what they
give way.  rho large: few updates, and each a harder problem for Newton's method.  So rho grows
after easy updates, and falls where Newton's method did not end; such an update is not made.
For Tresca's law this is the method of multipliers, which converges for every rho; with
Coulomb's the bound moves with p, and nothing ensures it for large mu.

The derivative of P at a kink is zero in x_N = 0 and the identity in x_T on the rim of the disk,
also when the disk is a point, as the conditions of [Rey] read.  A Newton step is

    global form     (M + H B H^T) dv = H p + f - M v,     B = rho P'(x): sparse, no reactions
    Delassus form   (1 + B W) dr = p - r

[Rey] V. Rey, C. R. Mécanique (2026), section 3.1, after J. Simo, T. Laursen, "An augmented
Lagrangian treatment of contact problems involving friction", Comput. Struct. 42 (1992).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from enum import Enum
from typing import ClassVar, Protocol

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ...core.clock import Deadline
from ...core.errors import InvalidInput, SingularOperator
from ...core.options import check_options
from ...linear import Direct, LinearSolver
from ...problem.friction import Form, FrictionProblem
from ...problem.law import Law
from ...problem.law.cones import project_disk, project_disk_jacobian
from ..augmentation import RhoStrategy, augmentation
from ..contract import Breakdown, Iterate, Target, check_at_least, check_positive
from ..newton.functions import columns
from ..newton.line_search import LineSearch, NonMonotone
from ..newton.semismooth import Condensed, State, block_diagonal

Array = NDArray[np.float64]
QUICK = 0.3  # share of the Newton steps allowed within which an update was easy
SOFTEST, STIFFEST = 1e-8, 1e4  # rho relative to the first
REDUCTION = 0.1  # of the residual of Newton's method, relative to the change of lambda


class InnerStart(Enum):
    """From which motion Newton's method starts after an update of lambda."""

    LAST = "last"
    FIRST = "first"


@dataclass(frozen=True)
class Uzawa:
    """Augmented Lagrangian with Uzawa's update, [Rey] algorithm 1; one iterate per update.

    growth: factor on rho after an update of few Newton steps, its inverse square after one that
    did not end.  With growth=1 rho is fixed and every update is made, as published.
    newton_tolerance: residual at which Newton's method ends, relative to the load; None: a
    tenth of the change of lambda.
    """

    form: ClassVar[Form] = Form.ANY
    rho: float = 1.0  # first stiffness of the springs, relative to what the strategy gives
    growth: float = 2.0
    rho_strategy: RhoStrategy = RhoStrategy.PER_CONTACT
    newton_tolerance: float | None = None
    newton_steps: int = 10  # at most, for one lambda
    inner_start: InnerStart = InnerStart.LAST
    line_search: LineSearch = field(default_factory=NonMonotone)
    linear: LinearSolver = field(default_factory=Direct)  # global form: M + H B H^T

    def __post_init__(self) -> None:
        check_options(self)
        check_positive(rho=self.rho)
        if not 1 <= self.growth < np.inf:
            raise InvalidInput(f"expected a number >= 1, got {self.growth}", ("growth",))
        if self.newton_tolerance is not None:
            check_positive(newton_tolerance=self.newton_tolerance)
        check_at_least(1, newton_steps=self.newton_steps)

    def iterates(
        self, problem: FrictionProblem, start: Iterate, target: Target
    ) -> Iterator[Iterate]:
        """One iterate per update from lambda = r and v of `start`, for ever."""
        local = problem.form is Form.DELASSUS
        system = _Local(problem) if local else _Motion(problem, self.linear)
        springs = _Springs.of(problem, self.rho, self.rho_strategy)
        multiplier = springs.admissible(start.r)
        first = state = system.state(multiplier, start.v)
        while True:
            if self.inner_start is InnerStart.FIRST:
                state = first
            try:
                found, p, count = self._motion(
                    system, springs, multiplier, state, target.deadline
                )
            except Breakdown:  # softer springs close and stick more contacts
                if self.growth == 1 or springs.softest:
                    raise
                springs = springs.scaled(self.growth**-2)
                continue
            yield Iterate(p, found.v, iterations=max(count, 1))
            if count < self.newton_steps or self.growth == 1:
                state, multiplier = found, p
            if count <= QUICK * self.newton_steps:
                springs = springs.scaled(self.growth)
            elif count == self.newton_steps:
                springs = springs.scaled(self.growth**-2)

    @np.errstate(over="ignore", invalid="ignore")  # steps without a line search may run away
    def _motion(
        self, system: System, springs: _Springs, multiplier: Array, state: State,
        deadline: Deadline,
    ) -> tuple[State, Array, int]:  # fmt: skip
        """The motion of a multiplier, its reactions p, and the Newton steps it took.

        Where time is up, what they have reached.
        """
        values: list[float] = []
        p, count = multiplier, 0
        for count in range(self.newton_steps + 1):
            p, B = springs.reaction(multiplier, state.u)
            values.append(system.residual(state, p))
            if not np.isfinite(values[-1]):
                raise Breakdown("Newton's iterates grow without bound")
            if self.newton_tolerance is None:
                goal = REDUCTION * system.size(p - multiplier)
            else:
                goal = self.newton_tolerance * system.load
            if values[-1] <= goal or count == self.newton_steps or deadline.passed:
                break
            step = system.step(state, p, B)

            def merit(t: float, state: State = state, step: State = step) -> float:
                moved = state.moved(t, step)
                return system.residual(moved, springs.reaction(multiplier, moved.u)[0])

            state = state.moved(self.line_search.length(merit, values), step)
        return state, p, count


@dataclass(frozen=True, eq=False)
class _Springs:
    """P(lambda - rho u) and its derivative; contacts that can not react have rho = 0."""

    law: Law
    rho: Array  # (nc, 1) or (nc, d)
    able: NDArray[np.bool_]  # (nc, 1)
    first: Array

    @classmethod
    def of(cls, problem: FrictionProblem, factor: float, strategy: RhoStrategy) -> _Springs:
        rho = columns(augmentation(problem, strategy, factor), problem.dimension)
        return cls(problem.law, rho, problem.rho[:, None] > 0, rho)

    @property
    def softest(self) -> bool:
        """Whether they are at their lower bound."""
        return bool((self.rho <= SOFTEST * self.first).all())

    def scaled(self, factor: float) -> _Springs:
        """Stiffer or softer ones, between the bounds."""
        bounds = SOFTEST * self.first, STIFFEST * self.first
        return replace(self, rho=np.clip(factor * self.rho, *bounds))

    def admissible(self, r: Array) -> Array:
        """r with zero at contacts that can not react."""
        return np.where(self.able, r, 0.0)

    def reaction(self, multiplier: Array, u: Array) -> tuple[Array, Array]:
        """p, (nc, d), and B = -dp/du, (nc, d, d)."""
        x = multiplier - self.rho * u
        closed = (x[:, 0] > 0) | self.law.tied
        normal = np.where(closed, x[:, 0], 0.0)
        radius = self.law.bound(x)
        p = np.column_stack([normal, project_disk(x[:, 1:], radius)])
        in_t, in_radius = project_disk_jacobian(x[:, 1:], radius)
        slope = np.zeros((*x.shape, x.shape[1]))
        slope[:, 0, 0], slope[:, 1:, 1:] = closed, in_t
        slope[:, 1:, 0] = in_radius * self.law.bound_slope(x)[:, None]
        return self.admissible(p), slope * np.where(self.able, self.rho, 0.0)[:, None, :]


class System(Protocol):
    """The equation of motion in one form, residuals in the unit of its forces."""

    load: float  # what residuals compare with

    def state(self, r: Array, v: Array | None) -> State:
        """The first state, of v where it is given."""
        ...

    def residual(self, state: State, p: Array) -> float:
        """Size of M v - H p - f, or of r - p."""
        ...

    def size(self, dp: Array) -> float:
        """Size of a change of reactions, unit of `residual`."""
        ...

    def step(self, state: State, p: Array, B: Array) -> State:
        """The Newton step."""
        ...


class _Local:
    """r = p(W r + q)."""

    def __init__(self, problem: FrictionProblem) -> None:
        self.problem, self.condensed = problem, Condensed(problem)
        assert problem.q is not None
        self.load = float(np.linalg.norm(problem.rho[:, None] * problem.q))

    def state(self, r: Array, v: Array | None) -> State:
        return State(r, self.problem.velocity(r)[0])

    def residual(self, state: State, p: Array) -> float:
        return self.size(state.r - p)

    def size(self, dp: Array) -> float:
        return float(np.linalg.norm(dp))

    def step(self, state: State, p: Array, B: Array) -> State:
        identity = np.broadcast_to(np.eye(p.shape[1]), B.shape)
        return self.condensed.step(state, (state.r - p, identity, B), 0.0)[0]


class _Motion:
    """M v = H p(H^T v + w) + f; the r of a state is not used."""

    def __init__(self, problem: FrictionProblem, linear: LinearSolver) -> None:
        self.problem, self.linear = problem, linear
        self.load = problem.scales[0]

    def state(self, r: Array, v: Array | None) -> State:
        if v is None:
            try:
                v = self.problem.velocity(r)[1]
            except SingularOperator:  # a body that contacts alone hold
                v = np.zeros(self.problem.unknowns)
        assert v is not None
        return State(r, self.problem.local_velocity(v), v)

    def balance(self, state: State, p: Array) -> Array:
        """H p + f - M v, (n,)."""
        problem = self.problem
        return problem.H @ p.ravel() + problem.f - problem.M @ state.v  # type: ignore[operator]

    def residual(self, state: State, p: Array) -> float:
        return float(np.linalg.norm(self.balance(state, p)))

    def size(self, dp: Array) -> float:
        assert self.problem.H is not None
        return float(np.linalg.norm(self.problem.H @ dp.ravel()))

    def step(self, state: State, p: Array, B: Array) -> State:
        problem = self.problem
        H = problem.H
        assert H is not None
        matrix = sparse.csc_array(problem.M + H @ block_diagonal(B) @ H.T)
        try:
            dv = self.linear.factor(matrix).solve(self.balance(state, p))
        except SingularOperator as reason:
            raise Breakdown(f"M with the springs of closed contacts: {reason}") from reason
        return State(np.zeros_like(p), (H.T @ dv).reshape(p.shape), dv)
