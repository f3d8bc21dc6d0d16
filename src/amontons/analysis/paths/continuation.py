"""Continuation of the solution curves of piecewise smooth problems, step by step.

Algorithm 1 of [LR]: predictor along the tangent, inexact Moore-Penrose corrector, step control.
What happens at a kink depends on what the problem tells: where it names the pieces around a
point (`residual_of`, `jacobian_of`, `margins`, `pieces`; see `path`), the walk goes by pieces,
else by the simple tangent switch (`walk_by_pieces`, `walk_by_switch`; `walk` for the rest).

[LR] T. Ligurský, Y. Renard, CMAME 280 (2014), section 2.2.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from ...core.errors import InvalidInput
from ...core.options import check_options
from .corrector import Curve, Tolerances
from .first_order import first_order
from .path import Event, PathProblem, Point
from .probes import by_probes
from .tangents import FirstOrder, Tangent
from .walk_by_pieces import WalkByPieces
from .walk_by_switch import WalkBySwitch

Array = NDArray[np.float64]
WITHIN, ACROSS = 0.999, 0.99999  # cosines inside of a piece, and where kinks may come
PIECES = ("residual_of", "jacobian_of", "margins", "pieces")


class Switch(Enum):
    """How a kink is passed."""

    FIRST_ORDER = "first-order"
    TANGENT = "tangent"


@dataclass(frozen=True)
class Continuation:
    """The options of algorithms 1 and 2, with the names of [LR] in brackets; lengths weighted.

    step: first, and after a kink that was passed by the tangent switch.  A problem's |H| and
    unknowns should have size one: the tolerances are absolute.
    """

    step: float = 5e-4  # [h]
    min_step: float = 5e-7  # [h_min]
    max_step: float = 0.1  # [h_max]
    grow: float = 1.3  # [h_inc]
    shrink: float = 0.5  # [h_dec]
    residual: float = 5e-12  # [epsilon]
    change: float = 5e-12  # [epsilon']
    min_cosine: float | None = None  # [c_min] between neighbouring tangents; see `cosine`
    corrections: int = 5  # [j_max]
    quick: int = 4  # [j_thr] corrections below which the step grows
    border: float = 1e-9  # margin of a piece that counts as zero
    ahead: float | None = None  # [h_1] of the tangent switch; None: a hundredth of min_step
    aside: float | None = None  # [h_2] of the tangent switch, the first; None: min_step
    switch: Switch | None = None  # None: by the first-order system where the problem allows it

    def __post_init__(self) -> None:
        check_options(self)
        self._check_ranges()

    def _check_ranges(self) -> None:
        steps = (0 < self.min_step <= self.step <= self.max_step) and np.isfinite(self.max_step)
        checks = {
            "step": (steps, "0 < min_step <= step <= max_step"),
            "grow": (self.grow > 1, "a number > 1"),
            "shrink": (0 < self.shrink < 1, "a number between 0 and 1"),
            "residual": (self.residual > 0, "a number > 0"),
            "change": (self.change > 0, "a number > 0"),
            "min_cosine": (self.min_cosine is None or self.min_cosine < 1, "a number < 1"),
            "corrections": (self.corrections >= 1, "at least 1"),
            "quick": (self.quick >= 0, "at least 0"),
            "border": (self.border > 0, "a number > 0"),
            "ahead": (self.ahead is None or 0 < self.ahead < np.inf, "a number > 0"),
            "aside": (self.aside is None or 0 < self.aside < np.inf, "a number > 0"),
        }
        for name, (holds, wanted) in checks.items():
            if not holds:
                raise InvalidInput(f"expected {wanted}, got {getattr(self, name)}", (name,))

    @property
    def tolerances(self) -> Tolerances:
        """Those of the corrector."""
        return Tolerances(self.residual, self.change, self.corrections)

    @property
    def ahead_of_kink(self) -> float:
        """h_1: [LR] has 1.5 min_step, but does not locate kinks."""
        return self.min_step / 100 if self.ahead is None else self.ahead

    @property
    def aside_of_kink(self) -> float:
        """h_2, the first that is tried."""
        return self.min_step if self.aside is None else self.aside

    def cosine(self, problem: PathProblem) -> float:
        """The smallest cosine between neighbouring tangents: 0.999, or 0.99999 as in [LR].

        The latter where a jump of the tangent is all that tells of a kink.
        """
        if self.min_cosine is not None:
            return self.min_cosine
        smooth = getattr(problem, "smooth", False)
        return WITHIN if smooth or self.knows_pieces(problem) else ACROSS

    def start(self, problem: PathProblem, y: Array, p: float) -> FirstOrder:
        """All one-sided tangents at a solution, by probes where the problem tells no pieces.

        Raises SingularOperator where there is no unique one on any piece.
        """
        if self.knows_pieces(problem):
            found = first_order(problem, y, p, tolerance=self.border)
            if found.tangents:
                return found
        return by_probes(Curve(problem, len(y)), y, p, self)

    def walk(
        self, problem: PathProblem, y: Array, p: float, tangent: Tangent,
        interval: tuple[float, float], *, step: float | None = None,
    ) -> Iterator[tuple[Point, Event | None]]:  # fmt: skip
        """From a solution along a tangent: points, and events with the points they are at.

        Ends with an event END.  To go on later, start from the last point: its state,
        parameter, tangent and step.
        """
        low, high = interval
        if not low <= p <= high:
            raise InvalidInput(f"start: expected a parameter in {low:g} … {high:g}, got {p:g}")
        kind = WalkByPieces if self.knows_pieces(problem) else WalkBySwitch
        walk = kind(self, problem, y, p, tangent, interval, step or self.step)
        yield walk.here(), None
        while walk.stop is None:
            yield from walk.advance()

    def knows_pieces(self, problem: PathProblem) -> bool:
        """True where kinks are passed by the first-order system."""
        known = all(hasattr(problem, name) for name in PIECES)
        if self.switch is Switch.FIRST_ORDER and not known:
            raise InvalidInput(f"switch: the problem has not all of {', '.join(PIECES)}")
        return known and self.switch is not Switch.TANGENT


def resumed(point: Point) -> Tangent:
    """The tangent with which `walk` goes on from a point."""
    return Tangent(point.direction, point.rate, point.piece)
