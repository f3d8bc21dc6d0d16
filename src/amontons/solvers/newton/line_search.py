"""Step lengths for Newton's method on F(x) = 0, with the merit m(t) = |F(x + t d) / rho|.

    full step        t = 1, [ABD] eq. (11) as printed (the methods NSN-…-NLS of its table 1)
    Armijo           first t = 1, 1/2, … with m(t) <= (1 - s t) m(0)
    non-monotone     the same against the largest of the last values, [GLL]: the default
    Goldstein-Price  t with  -2 m_2 t <= theta(t) / theta(0) - 1 <= -2 m_1 t,  theta = m^2 / 2,
                     by bisection, [GP]: the line search of Siconos' Newton solvers

-2 theta(0) is the derivative of theta along an exact Newton step.  A generalised Jacobian gives
no descent direction for sure, so each search ends after some trials: the first two keep the
shortest step then, Goldstein and Price's takes the full one, as Siconos does.

[ABD] V. Acary, M. Brémond, F. Dubois, CSMA 2017 (see `gauss_seidel`);
[GLL] L. Grippo, F. Lampariello, S. Lucidi, "A nonmonotone line search technique for Newton's
method", SIAM J. Numer. Anal. 23 (1986);
[GP] A. Goldstein, J. Price, "An effective algorithm for minimization", Numer. Math. 10 (1967).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol

from ...core.errors import InvalidInput
from ...core.options import check_options
from ..contract import check_at_least

Merit = Callable[[float], float]


class LineSearch(Protocol):
    """How long a Newton step becomes."""

    def length(self, merit: Merit, values: Sequence[float]) -> float:
        """Step t > 0; values are those of the merit at all iterates, the current one last."""
        ...


def _check_share(**fields: float) -> None:
    """Raise InvalidInput for the first option that is not between 0 and 1."""
    for name, value in fields.items():
        if not 0 < value < 1:
            raise InvalidInput(f"expected a number between 0 and 1, got {value}", (name,))


def _halved(merit: Merit, ceiling: float, halvings: int, decrease: float) -> float:
    """First t = 1, 1/2, … with merit(t) <= (1 - decrease t) ceiling, else the shortest."""
    t = 1.0
    for _ in range(halvings):
        if merit(t) <= (1 - decrease * t) * ceiling:
            return t
        t /= 2
    return t


@dataclass(frozen=True)
class FullStep:
    """No line search: quadratic near a solution, may cycle far from one."""

    def length(self, merit: Merit, values: Sequence[float]) -> float:
        """1."""
        return 1.0


@dataclass(frozen=True)
class Armijo:
    """Monotone: each iterate must have a smaller merit than the one before."""

    halvings: int = 12  # of the step before it is taken as it is
    decrease: float = 1e-4  # share of the decrease that Newton's model promises

    def __post_init__(self) -> None:
        check_options(self)
        check_at_least(1, halvings=self.halvings)
        _check_share(decrease=self.decrease)

    def length(self, merit: Merit, values: Sequence[float]) -> float:
        """Step length from the last value."""
        return _halved(merit, values[-1], self.halvings, self.decrease)


@dataclass(frozen=True)
class NonMonotone:
    """Some growth is allowed: passes the ridges between the pieces of the law."""

    memory: int = 5  # merit values that the search may look back on; 1: monotone
    halvings: int = 12  # of the step before it is taken as it is
    decrease: float = 1e-4  # share of the decrease that Newton's model promises

    def __post_init__(self) -> None:
        check_options(self)
        check_at_least(1, memory=self.memory)
        check_at_least(1, halvings=self.halvings)
        _check_share(decrease=self.decrease)

    def length(self, merit: Merit, values: Sequence[float]) -> float:
        """[GLL] step length from the largest of the last values."""
        return _halved(merit, max(values[-self.memory :]), self.halvings, self.decrease)


@dataclass(frozen=True)
class GoldsteinPrice:
    """Monotone, and refuses steps that are too short as well."""

    trials: int = 100  # lengths tried before the full step is taken
    least: float = 0.01  # m_1: smallest share of the decrease along the tangent
    most: float = 0.99  # m_2: largest share, above which a step is too short

    def __post_init__(self) -> None:
        check_options(self)
        check_at_least(1, trials=self.trials)
        _check_share(least=self.least, most=self.most)
        if not self.least < self.most:
            text = f"expected below most = {self.most}, got {self.least}"
            raise InvalidInput(text, ("least",))

    def length(self, merit: Merit, values: Sequence[float]) -> float:
        """[GP] step length, found by bisection from 1."""
        start = values[-1] ** 2
        low, high, t = 0.0, math.inf, 1.0
        for _ in range(self.trials):
            fall = merit(t) ** 2 - start
            if fall > -2 * self.least * t * start:
                high = t
            elif fall < -2 * self.most * t * start:
                low = t
            else:
                return t
            t = 0.5 * (low + high) if math.isfinite(high) else 2 * t
        return 1.0
