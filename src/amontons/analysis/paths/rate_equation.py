"""The abstract problem of [LR]: an evolution of one's own, and the path between two steps.

An evolution G(x, x') = F(t, x) is solved step by step, by the theta method or the midpoint
rule.  Between two steps lies the continuation problem (P) of [LR] section 2: at gamma = 0 the
last state solves it, and what solves it at gamma = 1 is a next state,

    G(theta x + (1 - theta) x_o, (x - x_k) / h + (1 - gamma) x'_k)
        = theta [gamma F(t_k+1, x) + (1 - gamma) F(t_k, x)]                                 (1)
        + (1 - theta) [gamma F(t_k, x_k) + (1 - gamma) F(t_k-1, x_k-1)],
    x_o = gamma x_k + (1 - gamma) x_k-1,   x'_k = (x_k - x_k-1) / (t_k - t_k-1),

theta = 1 being backward Euler, as in [LR].  The midpoint rule takes F at the state of G and at
the time in the middle of the step.  An evolution of second order is one of first order in x and
its velocity.

[LR] T. Ligurský, Y. Renard, CMAME 280 (2014), section 2 and remark 1.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...core.arrays import real
from ...core.errors import InvalidInput
from .checks import check_options, check_start, checked_limits
from .continuation import Continuation
from .following import Limits, follow_path
from .path import Branch, Matrix, is_number, name_of

Array = NDArray[np.float64]
NUDGE = 1e-6  # of differences in the place of derivatives, relative to one and x


@dataclass(frozen=True, eq=False)
class RateEquation:
    """G(x, x') = F(t, x), n equations for x (n,); [LR] eq. (1).

    G(x, rate) and F(t, x) return (n,).  G_slopes(x, rate): dG/dx and dG/drate, F_slope(t, x):
    dF/dx, (n, n) each, dense or sparse; where they are None, central differences, which blur
    kinks: give them where G or F has some.  G_piece(x, rate), F_piece(t, x): which selection
    function is active, as in `PathProblem`; None: there is one only.
    """

    G: Callable[[Array, Array], Array]
    F: Callable[[float, Array], Array]
    G_slopes: Callable[[Array, Array], tuple[Matrix, Matrix]] | None = None
    F_slope: Callable[[float, Array], Matrix] | None = None
    G_piece: Callable[[Array, Array], Hashable | NDArray[Any]] | None = None
    F_piece: Callable[[float, Array], Hashable | NDArray[Any]] | None = None

    def __post_init__(self) -> None:
        for name in ("G", "F", "G_slopes", "F_slope", "G_piece", "F_piece"):
            value = getattr(self, name)
            if not (callable(value) or (value is None and len(name) > 1)):
                raise InvalidInput(f"{name}: expected a function, got {value!r}")

    def slopes(self, x: Array, rate: Array) -> tuple[Matrix, Matrix]:
        """dG/dx and dG/drate."""
        if self.G_slopes is not None:
            return self.G_slopes(x, rate)
        return (_differences(lambda z: self.G(z, rate), x),
                _differences(lambda z: self.G(x, z), rate))  # fmt: skip

    def slope(self, t: float, x: Array) -> Matrix:
        """dF/dx."""
        if self.F_slope is not None:
            return self.F_slope(t, x)
        return _differences(lambda z: self.F(t, z), x)


@dataclass(frozen=True)
class ThetaMethod:
    """(1): theta = 1 is backward Euler, 1/2 the trapezoidal rule."""

    theta: float = 1.0

    def __post_init__(self) -> None:
        if not (is_number(self.theta) and 0 < self.theta <= 1):
            raise InvalidInput(f"theta: expected a number in (0, 1], got {self.theta!r}")


@dataclass(frozen=True)
class MidpointRule:
    """G and F at the mean of the states at the ends of a step, and the time in between."""

    theta: float = 0.5

    def __post_init__(self) -> None:
        if self.theta != 0.5:
            raise InvalidInput(f"theta: expected 0.5 for the midpoint rule, got {self.theta!r}")


@dataclass(frozen=True, eq=False)
class StepPath:
    """The PathProblem (1) in x (n,) and gamma between two steps of an evolution.

    states: x_k-1 and x_k, (n,) each, the last of which solves its step (between these two);
    times: t_k-1 < t_k < t_k+1.  weight: kappa of the weighted norm, by default 1 / n.
    """

    equation: RateEquation
    states: tuple[Array, Array]
    times: tuple[float, float, float]
    scheme: ThetaMethod | MidpointRule = ThetaMethod()
    weight: float | None = None

    def __post_init__(self) -> None:
        if not isinstance(self.equation, RateEquation):
            raise InvalidInput(f"equation: expected a RateEquation, got {self.equation!r}")
        if not isinstance(self.scheme, ThetaMethod | MidpointRule):
            raise InvalidInput(
                f"scheme: expected a ThetaMethod or the MidpointRule, got {self.scheme!r}"
            )
        self._check_times()
        if not isinstance(self.states, tuple | list) or len(self.states) != 2:
            raise InvalidInput("states: expected the last two, x_k-1 and x_k")
        states = tuple(np.atleast_1d(real("states", x)) for x in self.states)
        if states[0].shape != states[1].shape or states[0].ndim != 1:
            raise InvalidInput(
                "states: expected two vectors of the same length, got shapes "
                f"{states[0].shape} and {states[1].shape}"
            )
        object.__setattr__(self, "states", states)

    def _check_times(self) -> None:
        times = self.times
        known = isinstance(times, tuple | list) and len(times) == 3
        if not (known and all(map(is_number, times)) and times[0] < times[1] < times[2]):
            raise InvalidInput(f"times: expected t_k-1 < t_k < t_k+1, got {times!r}")

    @property
    def start(self) -> Array:
        """x_k, which solves (1) at gamma = `start_at`."""
        return self.states[1]

    @property
    def start_at(self) -> float:
        """Zero."""
        return 0.0

    def branch(
        self, *, back: float = 10.0, ahead: float = 1.0, options: Continuation | None = None,
        **limits: Any,
    ) -> Branch:  # fmt: skip
        """The curve through the last state; `at(1)` of it are all next states that it reaches.

        It is followed both ways, between gamma = -back and 1 + ahead: a path may pass gamma = 1
        more than once, and turns in between.  limits: max_points, time_limit, callback.
        """
        for name, value in (("back", back), ("ahead", ahead)):
            if not (is_number(value) and 0 <= value < np.inf):
                raise InvalidInput(f"{name}: expected a number >= 0, got {value!r}")
        check_options(options)
        bounds = Limits((-float(back), 1.0 + float(ahead)), **checked_limits(limits))
        check_start(self, self.start, 0.0)
        return follow_path(self, self.start, 0.0, bounds, options=options)

    def next(self, x: Array, t: float) -> StepPath:
        """The path of the step after this one, from a next state x (n,) to the time t."""
        return StepPath(self.equation, (self.start, np.asarray(x, dtype=float)),
                        (*self.times[1:], t), self.scheme, self.weight)  # fmt: skip

    # ---------------------------------------------------------------- PathProblem
    @property
    def name(self) -> str:
        """Of the parameter."""
        return "gamma"

    @property
    def smooth(self) -> bool:
        """True where neither G nor F names pieces."""
        return self.equation.G_piece is None and self.equation.F_piece is None

    @cached_property
    def _last_rate(self) -> Array:
        return (self.states[1] - self.states[0]) / (self.times[1] - self.times[0])

    def _point(self, x: Array, p: float) -> tuple[Array, Array]:
        """(state, rate), the arguments of G."""
        theta, (before, now) = self.scheme.theta, self.states
        old = p * now + (1 - p) * before
        rate = (x - now) / (self.times[2] - self.times[1]) + (1 - p) * self._last_rate
        return theta * x + (1 - theta) * old, rate

    def _places(self, x: Array, p: float) -> tuple[tuple[float, Array], tuple[float, Array]]:
        """(t, state) at which F depends on x: those of the next step and of the last one."""
        t0, t1, t2 = self.times
        if isinstance(self.scheme, ThetaMethod):
            return (t2, x), (t1, x)
        state, _ = self._point(x, p)
        return ((t1 + t2) / 2, state), ((t0 + t1) / 2, state)

    def residual(self, y: Array, p: float) -> Array:
        """Left side of (1) less its right side, (n,)."""
        F, theta = self.equation.F, self.scheme.theta
        new, last = (F(*place) for place in self._places(y, p))
        value = self.equation.G(*self._point(y, p))
        if isinstance(self.scheme, MidpointRule):
            return value - p * new - (1 - p) * last
        explicit = 0.0 if theta == 1 else p * self._known[1] + (1 - p) * self._known[0]
        return value - theta * (p * new + (1 - p) * last) - (1 - theta) * explicit

    @cached_property
    def _known(self) -> tuple[Array, Array]:
        """F at the last two states."""
        F = self.equation.F
        return F(self.times[0], self.states[0]), F(self.times[1], self.states[1])

    def jacobian(self, y: Array, p: float) -> tuple[Matrix, Array]:
        """Derivatives by y and p."""
        theta, (before, now) = self.scheme.theta, self.states
        by_state, by_rate = self.equation.slopes(*self._point(y, p))
        places = self._places(y, p)
        by_new, by_last = (self.equation.slope(*place) for place in places)
        new, last = (self.equation.F(*place) for place in places)
        right = p * by_new + (1 - p) * by_last
        J = theta * by_state + by_rate / (self.times[2] - self.times[1]) - theta * right
        moved = (1 - theta) * (now - before)
        Jp = by_state @ moved - by_rate @ self._last_rate
        if isinstance(self.scheme, MidpointRule):
            return J, Jp - (new - last) - right @ moved
        explicit = 0.0 if theta == 1 else self._known[1] - self._known[0]
        return J, Jp - theta * (new - last) - (1 - theta) * explicit

    def piece(self, y: Array, p: float) -> Hashable:
        """The names of the active pieces of G, and of F at both times."""
        e = self.equation
        names: list[Hashable] = []
        if e.G_piece is not None:
            names.append(name_of(e.G_piece(*self._point(y, p))))
        if e.F_piece is not None:
            names += [name_of(e.F_piece(*place)) for place in self._places(y, p)]
        return tuple(names) if names else "smooth"


def _differences(f: Callable[[Array], Array], x: Array) -> Array:
    """Central differences of f at x, (n, n)."""
    h = NUDGE * np.maximum(1.0, np.abs(x))
    columns = []
    for k in range(len(x)):
        step = np.zeros_like(x)
        step[k] = h[k]
        columns.append((np.asarray(f(x + step)) - np.asarray(f(x - step))) / (2 * h[k]))
    return np.column_stack(columns)
