"""Primal-dual active sets: a semismooth Newton method with linear conditions per contact.

Every step decides by (r, u) which contacts are closed and which slide, replaces the law by
linear conditions there (`conditions`) and solves one linear problem: exactly, or by some
multigrid cycles, which is the inexact strategy [HSW].  The bound of Coulomb friction lags
behind (Algorithm 2) or is part of the Newton step (section 7).

[HSW] S. Hüeber, G. Stadler, B. Wohlmuth, "A primal-dual active set algorithm for
three-dimensional contact problems with Coulomb friction", SIAM J. Sci. Comput. 30 (2008).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from enum import Enum
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from ...core.errors import InvalidInput, SingularOperator
from ...core.options import check_options
from ...linear import Direct, LinearSolver
from ...problem.friction import Form, FrictionProblem
from ...problem.law import Law
from ...problem.law.law import TRESCA
from ...problem.one_sided import one_sided
from ...problem.status import ActiveSets
from ..augmentation import own_blocks
from ..contract import Breakdown, Iterate, Target, check_at_least, check_positive
from ..driven import driven_directions, sliding_rho
from .conditions import (
    Conditions,
    FrictionFunction,
    Modification,
    Settings,
    conditions,
    newton_conditions,
)
from .multigrid import MultigridCycle
from .nested import NO_COARSER, coarser
from .systems import EXACT, Cycles, Saddle, State, System

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
TINY = float(np.finfo(float).tiny)
NESTED = 1e-8  # relative change at which a coarse solution is good enough as a start
MOST_NESTED = 100  # steps on a coarse level after which its last state has to do


class FrictionBound(Enum):
    """How the bound mu r_N of Coulomb friction follows the pressure."""

    FIXED_POINT = "fixed-point"  # [HSW] Algorithm 2: it lags behind
    NEWTON = "newton"  # [HSW] section 7: it is linearised with the rest


class ChangeNorm(Enum):
    """Which displacements the change from step to step is measured on; [HSW] do not say."""

    CONTACT = "contact"  # those of the contacts, between two bodies the relative ones
    ALL = "all"  # all unknowns, between two bodies of the basis in which cycles work


@dataclass(frozen=True, eq=False)
class ActiveSetIterate(Iterate):
    """An iterate with the active sets of its step, (nc,), and |u - last u| / |u|.

    normal: in contact; tangential: may slide (open contacts of Coulomb friction included).
    change refers to u when the friction bound was last updated, and to the norm that the solver
    was told.  alpha, beta: see `Conditions`.
    """

    normal: Mask = field(default_factory=lambda: np.zeros(0, dtype=bool))
    tangential: Mask = field(default_factory=lambda: np.zeros(0, dtype=bool))
    change: float = np.inf
    alpha: Array = field(default_factory=lambda: np.zeros(0))
    beta: Array = field(default_factory=lambda: np.zeros(0))


@dataclass(frozen=True)
class ActiveSet:
    """Primal-dual active set method (PDAS), exact or inexact, for all laws of friction.

    With Tresca's law at some contacts and another at others the bound is updated in every step.

    c_normal, c_tangential: parameters of the complementarity functions (3.1) and (4.1), unit of
    r / u; None takes the stiffness of each contact alone (diagonal of M in the local basis).
    multigrid: cycles for the linear problems instead of the direct solver; with `cycles` of
    them in a step (m of the paper), or as many as an exact solution needs (None).  They need
    contacts that look like contacts with an obstacle, see `one_sided`, and the fixed point.
    bound_steps: steps between updates of the friction bound (k_f), None: until nothing changes.
    change: [HSW]'s stopping rule (epsilon_u): the steps go on until |u^k - u^kc| / |u^k| is
    below it and the bound was updated after the first steps (k > k_f), and end there, whatever
    the error is; u^kc is that of the last bound.  None: the judge alone decides.
    modification: of the Robin conditions of sliding contacts, with the function PRODUCT.
    nested: start from the solution on the next coarser level, if no start is given.

    Iterates are `ActiveSetIterate`.
    """

    form: ClassVar[Form] = Form.GLOBAL
    bound: FrictionBound = FrictionBound.NEWTON
    modification: Modification = Modification.FIRST
    function: FrictionFunction = FrictionFunction.PRODUCT
    c_normal: float | None = None
    c_tangential: float | None = None
    bound_steps: int | None = 1
    multigrid: MultigridCycle | None = None
    cycles: int | None = None
    nested: bool = False
    change: float | None = None
    change_norm: ChangeNorm = ChangeNorm.CONTACT
    linear: LinearSolver = field(default_factory=Direct)

    def __post_init__(self) -> None:
        check_options(self)
        for name in ("c_normal", "c_tangential", "change"):
            if getattr(self, name) is not None:
                check_positive(**{name: getattr(self, name)})
        for name in ("bound_steps", "cycles"):
            if getattr(self, name) is not None:
                check_at_least(1, **{name: getattr(self, name)})
        if self.multigrid is None and self.cycles is not None:
            raise InvalidInput("expected None without multigrid, which makes them", ("cycles",))
        if self.multigrid is not None and self.bound is FrictionBound.NEWTON:
            raise InvalidInput(
                "expected fixed-point with multigrid, whose coarse levels do not know "
                "how the bound of the Newton method couples the normal with the tangents",
                ("bound",),
            )

    def iterates(
        self, problem: FrictionProblem, start: Iterate, target: Target
    ) -> Iterator[Iterate]:
        """Steps from `start`; raises Breakdown when a linear problem has no solution."""
        sets, kept = _known_sets(start)
        if self.nested and not start.r.any() and start.v is None:
            start = self._nested_start(problem, target)
        system = self._system(problem)
        state = system.state(start)
        bound = _Bound(self, problem, state)
        settings = self._settings(problem)
        driven = np.any(driven_directions(problem), axis=1)
        first, change = not start.r.any(), np.inf
        while self.change is None or not (bound.compares and change < self.change):
            g = bound.update(state)
            now = _sliding(settings, driven, problem.law, state, g)
            try:
                given = self._conditions(problem, state, g, first, now)
                new = system.step(given, state)
            except SingularOperator as reason:
                if not first:
                    raise Breakdown(f"the linear problem of a step: {reason}") from reason
                given = _bonded(problem)
                new = system.step(given, state)
            if not np.isfinite(new.r).all():
                raise Breakdown("a step is not finite")
            change = bound.change(new)
            last, sets = sets, np.concatenate([given.normal, given.tangential])
            kept = kept + 1 if last is not None and np.array_equal(last, sets) else 0
            yield ActiveSetIterate(
                new.r, system.displacement(new), linear_iterations=new.linear_iterations,
                normal=given.normal, tangential=given.tangential, change=change,
                alpha=given.alpha, beta=given.beta, ends=self._ends(bound, change),
                sets=ActiveSets.of(given.normal, given.tangential, kept, change),
            )  # fmt: skip
            state, first = new, False

    def _ends(self, bound: _Bound, change: float) -> str | None:
        """Why the steps end here by [HSW]'s rule, "" while they do not, None without it."""
        if self.change is None:
            return None
        if not (bound.compares and change < self.change):
            return ""
        return f"the change of u, {change:.1e}, is below {self.change:.0e}"

    def _nested_start(self, problem: FrictionProblem, target: Target) -> Iterate:
        """The solutions from the coarsest level up; raises Breakdown where there is none."""
        levels = []
        below = coarser(problem)
        while below is not None:
            levels.append(below)
            below = coarser(below.problem)
        if not levels:
            raise Breakdown(NO_COARSER)
        plain = replace(self, nested=False)
        start = Iterate(np.zeros((levels[-1].problem.contacts, problem.dimension)))
        for level in reversed(levels):
            for k, found in enumerate(plain.iterates(level.problem, start, target)):
                start = found
                if found.change <= NESTED or k == MOST_NESTED or target.deadline.passed:
                    break
            start = level.start(start)
        return start

    def _conditions(
        self, problem: FrictionProblem, state: State, g: Array, first: bool, settings: Settings
    ) -> Conditions:
        follows = self.bound is FrictionBound.NEWTON and not (problem.law.kind == TRESCA).any()
        if follows and not first:
            return newton_conditions(state.r, state.u, problem.law, settings)
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
        return Settings(
            given[0], given[1], self.modification, self.function, problem.law.tied
        )

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


class _Bound:
    """The friction bound g and the state it was taken from."""

    def __init__(self, solver: ActiveSet, problem: FrictionProblem, state: State) -> None:
        self.law, self.period, self.gap = problem.law, solver.bound_steps, problem.w
        is_given = (self.law.kind == TRESCA).all()
        self.lags = not is_given and solver.bound is FrictionBound.FIXED_POINT
        self.norm = solver.change_norm
        self.g, self.state, self.last = problem.law.bound(state.r), state, state
        self.step, self.updates, self.settled = 0, 0, False

    def update(self, state: State) -> Array:
        """The bound of the next step."""
        due = self.settled if self.period is None else self.step % self.period == 0
        if due or not self.lags or not self.updates:
            self.g, self.state = self.law.bound(state.r), state
            self.updates += 1
        self.step += 1
        return self.g

    @property
    def compares(self) -> bool:
        """k > k_f: the bound has followed the pressure, so that a change of u tells something.

        Where it is given, [HSW] Algorithm 1, or part of the step, it always does.
        """
        return self.updates > 1 or not self.lags

    def change(self, new: State) -> float:
        """|u - u of the bound| / |u|, in the norm of the option."""
        size = max(float(np.linalg.norm(new.v)), TINY)
        self.settled = bool(np.linalg.norm(new.v - self.last.v) <= EXACT * size)
        self.last = new
        if self.norm is ChangeNorm.ALL:
            return float(np.linalg.norm(new.v - self.state.v)) / size
        assert self.gap is not None
        size = max(float(np.linalg.norm(new.u - self.gap)), TINY)
        return float(np.linalg.norm(new.u - self.state.u)) / size


def _known_sets(start: Iterate) -> tuple[Mask | None, int]:
    """Sets of a start that an active set method has made, and for how many steps they hold."""
    if isinstance(start, ActiveSetIterate) and start.sets is not None:
        return np.concatenate([start.normal, start.tangential]), start.sets.kept
    return None, 0


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
