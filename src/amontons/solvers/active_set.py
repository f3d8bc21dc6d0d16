"""Primal-dual active sets: a semismooth Newton method with linear conditions per contact.

Every step decides by (r, u) which contacts are closed and which slide, replaces the law by
linear conditions there (`active_conditions`) and solves one linear problem: exactly, or by some
multigrid cycles, which is the inexact strategy [HSW].  The bound of Coulomb friction lags
behind (Algorithm 2) or is part of the Newton step (section 7).

[HSW] S. Hüeber, G. Stadler, B. Wohlmuth, "A primal-dual active set algorithm for
three-dimensional contact problems with Coulomb friction", SIAM J. Sci. Comput. 30 (2008).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from enum import Enum
from typing import ClassVar, Protocol

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ..cones import Coulomb, Law
from ..errors import InvalidInput, SingularOperator
from ..linear import Direct, LinearSolver
from ..one_sided import HELD, OneSided, one_sided
from ..options import check_options
from ..problem import Form, FrictionProblem
from .active_conditions import (
    Conditions,
    Modification,
    Settings,
    conditions,
    newton_conditions,
)
from .active_multigrid import ContactCycles, MultigridCycle
from .active_nested import coarser
from .augmentation import own_blocks
from .base import Breakdown, Iterate, Target, check_at_least, check_positive
from .driven import able_directions, driven_directions, sliding_rho

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
EXACT = 1e-12  # relative residual at which cycles count as an exact solution
NESTED = 1e-8  # relative change at which a coarse solution is good enough as a start
MOST_NESTED = 100  # steps on a coarse level after which its last state has to do
MOST_CYCLES = 200  # per step; a hierarchy that needs more does not converge


class FrictionBound(Enum):
    """How the bound mu r_N of Coulomb friction follows the pressure."""

    FIXED_POINT = "fixed-point"  # [HSW] Algorithm 2: it lags behind
    NEWTON = "newton"  # [HSW] section 7: it is linearised with the rest


@dataclass(frozen=True, eq=False)
class ActiveSetIterate(Iterate):
    """An iterate with the active sets of its step, (nc,), and |v - last v| / |v|.

    normal: in contact; tangential: may slide (open contacts of Coulomb friction included).
    change refers to v when the friction bound was last updated.  alpha, beta: see `Conditions`.
    """

    normal: Mask = field(default_factory=lambda: np.zeros(0, dtype=bool))
    tangential: Mask = field(default_factory=lambda: np.zeros(0, dtype=bool))
    change: float = np.inf
    alpha: Array = field(default_factory=lambda: np.zeros(0))
    beta: Array = field(default_factory=lambda: np.zeros(0))


@dataclass(frozen=True)
class ActiveSet:
    """Primal-dual active set method (PDAS), exact or inexact, for Tresca and Coulomb friction.

    c_normal, c_tangential: parameters of the complementarity functions (3.1) and (4.1), unit of
    r / u; None takes the stiffness of each contact alone (diagonal of M in the local basis).
    multigrid: cycles for the linear problems instead of the direct solver; with `cycles` of
    them in a step (m of the paper), or as many as an exact solution needs (None).  They need
    contacts that look like contacts with an obstacle, see `one_sided`, and the fixed point.
    bound_steps: steps between updates of the friction bound (k_f), None: until nothing changes.
    nested: start from the solution on the next coarser level (contact with obstacles only).

    Iterates are `ActiveSetIterate`.
    """

    form: ClassVar[Form] = Form.GLOBAL
    bound: FrictionBound = FrictionBound.NEWTON
    modification: Modification = Modification.FIRST
    c_normal: float | None = None
    c_tangential: float | None = None
    bound_steps: int | None = 1
    multigrid: MultigridCycle | None = None
    cycles: int | None = None
    nested: bool = False
    linear: LinearSolver = field(default_factory=Direct)

    def __post_init__(self) -> None:
        check_options(self)
        for name in ("c_normal", "c_tangential"):
            if getattr(self, name) is not None:
                check_positive(**{name: getattr(self, name)})
        for name in ("bound_steps", "cycles"):
            if getattr(self, name) is not None:
                check_at_least(1, **{name: getattr(self, name)})
        if self.multigrid is None and self.cycles is not None:
            raise InvalidInput("cycles: expected None without multigrid, which makes them")
        if self.multigrid is not None and self.bound is FrictionBound.NEWTON:
            raise InvalidInput(
                "bound: expected fixed-point with multigrid, whose coarse levels do not know "
                "how the bound of the Newton method couples the normal with the tangents"
            )

    def iterates(
        self, problem: FrictionProblem, start: Iterate, target: Target
    ) -> Iterator[Iterate]:
        """Steps from `start`; raises Breakdown when a linear problem has no solution."""
        start = self._nested_start(problem, start, target)
        system = self._system(problem)
        state = system.state(start)
        bound = _Bound(self, problem, state)
        settings = self._settings(problem)
        driven = driven_directions(problem).any(axis=1)
        first = not start.r.any()
        while True:
            g = bound.update(state)
            now = _sliding(settings, driven, problem.law, state, g)
            given = self._conditions(problem, state, g, first, now)
            try:
                new = system.step(given, state)
            except SingularOperator as reason:
                if not first:
                    raise Breakdown(f"the linear problem of a step: {reason}") from reason
                given = _bonded(problem)
                new = system.step(given, state)
            if not np.isfinite(new.r).all():
                raise Breakdown("a step is not finite")
            change = bound.change(new)
            yield ActiveSetIterate(
                new.r, system.displacement(new), linear_iterations=new.linear_iterations,
                normal=given.normal, tangential=given.tangential, change=change,
                alpha=given.alpha, beta=given.beta,
            )  # fmt: skip
            state, first = new, False

    def _nested_start(
        self, problem: FrictionProblem, start: Iterate, target: Target
    ) -> Iterate:
        """The solution on the next coarser level where it can be had, else the given start."""
        if not self.nested or start.r.any() or start.v is not None:
            return start
        coarse = coarser(problem)
        if coarse is None:
            return start
        zero = Iterate(np.zeros((coarse.problem.contacts, problem.dimension)))
        for k, found in enumerate(self.iterates(coarse.problem, zero, target)):
            if found.change <= NESTED or k == MOST_NESTED or target.deadline.passed:
                break
        return coarse.start(found)

    def _conditions(
        self, problem: FrictionProblem, state: State, g: Array, first: bool, settings: Settings
    ) -> Conditions:
        if isinstance(problem.law, Coulomb) and self.bound is FrictionBound.NEWTON:
            if not first:
                return newton_conditions(state.r, state.u, problem.law.mu, settings)
        return conditions(state.r, state.u, g, first, settings)

    def _settings(self, problem: FrictionProblem) -> Settings:
        """c_n and c_tau: as given, or the diagonal of M in the local basis."""
        stiffness = np.diagonal(
            np.linalg.pinv(own_blocks(problem), hermitian=True), axis1=1, axis2=2
        )
        normal, tangential = stiffness[:, 0], stiffness[:, 1:].mean(axis=1)
        given = []
        for option, own in ((self.c_normal, normal), (self.c_tangential, tangential)):
            usual = own[own > 0].mean() if (own > 0).any() else 1.0
            given.append(
                np.where(own > 0, own, usual) if option is None else np.full(len(own), option)
            )
        return Settings(given[0], given[1], self.modification)

    def _system(self, problem: FrictionProblem) -> System:
        if self.multigrid is None:
            return Saddle(problem, self.linear)
        basis = one_sided(problem)
        if basis is None:
            raise Breakdown(
                "multigrid needs a slave node of its own for every contact; use the direct "
                "solver (multigrid = None)"
            )
        if driven_directions(problem).any():
            raise Breakdown(
                "multigrid needs contact nodes that supports do not move along the surface; "
                "use the direct solver (multigrid = None)"
            )
        return Cycles(problem, basis, self.multigrid, self.cycles)


@dataclass(frozen=True, eq=False)
class State:
    """r and u (nc, d) with v (n,), which may be in the one-sided basis."""

    r: Array
    u: Array
    v: Array
    linear_iterations: int = 0


class System(Protocol):
    """One step: the linear problem with given conditions."""

    def state(self, start: Iterate) -> State:
        """The first state; zero where the start says nothing."""
        ...

    def step(self, given: Conditions, state: State) -> State:
        """The next state."""
        ...

    def displacement(self, state: State) -> Array:
        """v of a state, (n,)."""
        ...


class _Bound:
    """The friction bound g and the state it was taken from."""

    def __init__(self, solver: ActiveSet, problem: FrictionProblem, state: State) -> None:
        self.law, self.period = problem.law, solver.bound_steps
        self.g, self.v = problem.law.bound(state.r), state.v
        self.step, self.settled, self.last = 0, False, state.v

    def update(self, state: State) -> Array:
        """The bound of the next step."""
        due = self.settled if self.period is None else self.step % self.period == 0
        if due or not isinstance(self.law, Coulomb):
            self.g, self.v = self.law.bound(state.r), state.v
        self.step += 1
        return self.g

    def change(self, new: State) -> float:
        """|v - v of the bound| / |v|."""
        size = max(float(np.linalg.norm(new.v)), np.finfo(float).tiny)
        self.settled = np.linalg.norm(new.v - self.last) <= EXACT * size
        self.last = new.v
        return float(np.linalg.norm(new.v - self.v)) / size


def _sliding(
    settings: Settings, driven: Mask, law: Law, state: State, g: Array
) -> Settings:
    """The settings with which driven contacts are seen to slide."""
    if not driven.any():
        return settings
    pressed = state.r.copy()
    pressed[:, 0] -= np.minimum(settings.c_normal * state.u[:, 0], 0.0)
    reached = np.maximum(g, law.bound(pressed))
    c = sliding_rho(settings.c_tangential, driven, reached, state.u)
    return replace(settings, c_tangential=c)


def _bonded(problem: FrictionProblem) -> Conditions:
    """All contacts closed and sticking: M alone may be singular in the first step."""
    nc, d = problem.contacts, problem.dimension
    zero, one = np.zeros((nc, d, d)), np.tile(np.eye(d), (nc, 1, 1))
    yes, nan = np.ones(nc, dtype=bool), np.full(nc, np.nan)
    return Conditions(zero, one, np.zeros((nc, d)), yes, ~yes, nan, nan)


class Saddle:
    """[M, -H; G_u H^T, G_r] with any H, factorised in every step."""

    def __init__(self, problem: FrictionProblem, linear: LinearSolver) -> None:
        self.problem, self.linear = problem, linear
        self.able, self.driven = able_directions(problem), driven_directions(problem)
        own = np.diagonal(own_blocks(problem), axis1=1, axis2=2)
        largest = own.max(axis=1, initial=0.0)
        self.rho = 1 / np.where(largest > 0, largest, 1.0)

    def state(self, start: Iterate) -> State:
        """v of the start; of its reactions, if there are any and M has an inverse; else 0."""
        return first_state(self.problem, start)

    def step(self, given: Conditions, state: State) -> State:
        """A sparse factorisation; rows of displacements are scaled to the unit of r."""
        p, able = self.problem, self._able(given)[:, :, None]
        assert p.M is not None and p.H is not None and p.f is not None and p.w is not None
        nc, d = p.contacts, p.dimension
        scale = np.where(np.einsum("kii->ki", given.G_r) == 0, self.rho[:, None], 1.0)
        rows_u = given.G_u * scale[:, :, None] * able
        rows_r = given.G_r * scale[:, :, None] * able + (~able) * np.eye(d)
        b = (given.b * scale - np.einsum("kij,kj->ki", rows_u, p.w)) * able[:, :, 0]
        G_u, G_r = _block_diagonal(rows_u), _block_diagonal(rows_r)
        matrix = sparse.block_array([[p.M, -p.H], [G_u @ p.H.T, G_r]], format="csc")
        x = self.linear.factor(matrix).solve(np.concatenate([p.f, b.ravel()]))
        v, r = x[: p.unknowns], x[p.unknowns :].reshape(nc, d)
        return State(r, p.local_velocity(v), v, 1)

    def _able(self, given: Conditions) -> Mask:
        """Directions with a condition on r: driven ones while it is not that they stick."""
        return self.able | (self.driven & given.G_r.any(axis=2))

    def displacement(self, state: State) -> Array:
        """v as it is."""
        return state.v


class Cycles:
    """Multigrid cycles in the one-sided basis."""

    def __init__(
        self,
        problem: FrictionProblem,
        basis: OneSided,
        option: MultigridCycle,
        cycles: int | None,
    ) -> None:
        self.problem, self.basis, self.cycles = problem, basis, cycles

        def make() -> ContactCycles:
            return ContactCycles(basis, problem.dimension, problem.near_nullspace)

        self.tool = problem.kept("active set cycles", make)
        self.tool.option = option
        used = basis.dofs != HELD
        self.slots = np.where(used, basis.dofs, 0)
        self.frames = basis.frames * used[:, None, :]
        self.rows = sparse.csr_array(basis.M)[self.slots.ravel()]

    def state(self, start: Iterate) -> State:
        """As for the direct solver, in the one-sided basis."""
        given = first_state(self.problem, start)
        return State(given.r, given.u, self.basis.from_displacement(given.v))

    def step(self, given: Conditions, state: State) -> State:
        """m cycles, or as many as an exact solution needs."""
        tool, w = self.tool, self.problem.w
        assert w is not None
        tool.set(given, self.basis.f, w)
        x = tool.nodes.spread(state.v)
        size, count = tool.residual(x), 0
        while count < (self.cycles or MOST_CYCLES):
            size = tool.cycle(x)
            count += 1
            if not np.isfinite(size):
                raise Breakdown("the multigrid cycles diverge")
            if self.cycles is None and size <= EXACT:
                break
        v = tool.nodes.gather(x)
        force = (self.rows @ v).reshape(self.slots.shape) - self.basis.f[self.slots]
        r = np.einsum("kij,kj->ki", self.frames, force)
        u = np.einsum("kij,kj->ki", self.frames, v[self.slots]) + w
        return State(r, u, v, count)

    def displacement(self, state: State) -> Array:
        """v from the one-sided basis."""
        return self.basis.to_displacement(state.v)


def first_state(problem: FrictionProblem, start: Iterate) -> State:
    """v of the start; of its reactions, if there are any and M has an inverse; else 0."""
    v = start.v
    if v is None and start.r.any():
        try:
            v = problem.velocity(start.r)[1]
        except SingularOperator:
            v = None
    if v is None:
        v = np.zeros(problem.unknowns)
    return State(start.r, problem.local_velocity(v), v)


def _block_diagonal(blocks: Array) -> sparse.csr_array:
    nc, d, _ = blocks.shape
    index = np.arange(nc + 1)
    tiles = sparse.bsr_array((blocks, index[:-1], index), shape=(nc * d, nc * d))
    return sparse.csr_array(tiles)
