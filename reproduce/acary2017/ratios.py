"""Ratios of two methods over many problems, and what makes them."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from amontons.analysis import performance_profile

from .methods import PRINTED
from .race import CLOCK, Cost, Runs, costs_spent, costs_to, iterations


@dataclass(frozen=True)
class Ratio:
    """Median over the problems of cost(slow) / cost(fast).

    Where only one of them met the tolerance the other counts with what its run really took: a
    bound.  at_least, at_most: the median is such a bound.  problems: those that at least one
    met.
    """

    value: float
    at_least: bool
    at_most: bool
    problems: int

    def __str__(self) -> str:
        if not self.problems:
            return "-"
        sign = "≥ " if self.at_least else "≤ " if self.at_most else ""
        return f"{sign}{number(self.value)}"


def ratio(runs: Runs, slow: str, fast: str, tolerance: float, cost: Cost = CLOCK) -> Ratio:
    """See `Ratio`."""
    found = []
    spent = costs_spent(runs, (slow, fast), cost)
    for (a, b), (most_a, most_b) in zip(
        costs_to(runs, (slow, fast), tolerance, cost), spent, strict=True
    ):
        if math.isfinite(a) or math.isfinite(b):
            bound = (not math.isfinite(a)) - (not math.isfinite(b))
            value = (a if math.isfinite(a) else most_a) / (b if math.isfinite(b) else most_b)
            if not math.isnan(value):
                found.append((value, bound))
    if not found:
        return Ratio(math.nan, False, False, 0)
    found.sort()
    middle = [found[(len(found) - 1) // 2], found[len(found) // 2]]
    value = math.sqrt(middle[0][0] * middle[1][0])
    bounds = [bound for _, bound in middle]
    return Ratio(value, max(bounds) > 0, min(bounds) < 0, len(found))


def profile_ratio(
    runs: Runs, slow: str, fast: str, tolerance: float, share: float, cost: Cost = CLOCK
) -> float:
    """Horizontal distance of two profiles at a share of the problems, as the paper reads it.

    Infinite where the slow method does not reach the share, NaN where neither does.
    """
    names = [n for n in PRINTED if all(n in entry["methods"] for entry in runs.values())]
    tau, rho = performance_profile(costs_to(runs, names, tolerance, cost))
    reached = []
    for name in (slow, fast):
        curve = rho[names.index(name)]
        reached.append(tau[np.argmax(curve >= share)] if curve[-1] >= share else math.inf)
    return math.nan if math.isinf(reached[1]) else float(reached[0] / reached[1])


def solved(runs: Runs, name: str, tolerance: float, cost: Cost = CLOCK) -> int:
    """Problems on which a method met a tolerance."""
    return sum(not math.isinf(row[0]) for row in costs_to(runs, (name,), tolerance, cost))


def median_cost(runs: Runs, name: str, tolerance: float, cost: Cost = CLOCK) -> float:
    """Median cost, unsolved problems counting as infinite; NaN where it is not counted."""
    return float(np.median(costs_to(runs, (name,), tolerance, cost)))


def each_step(runs: Runs, tolerance: float) -> dict[str, float]:
    """Medians of NSGS-AC and NSN-AC that explain a ratio.

    Counts of sweeps and Newton steps; seconds and operations of one of each.
    """
    names, out = ("NSGS-AC", "NSN-AC"), {}
    counts = np.array([iterations(runs, name, tolerance, "13") for name in names]).T
    for by, word in (("seconds", "seconds"), ("flops", "operations")):
        costs = np.array(costs_to(runs, names, tolerance, Cost(by, "13")))
        with np.errstate(invalid="ignore", divide="ignore"):
            each = np.where(np.isfinite(costs), costs / counts, np.nan)
        out[f"sweep_{word}"], out[f"newton_{word}"] = (_median(each[:, k]) for k in (0, 1))
    out["sweeps"], out["newton_steps"] = (float(np.median(counts[:, k])) for k in (0, 1))
    return out


def _median(values: np.ndarray) -> float:
    known = values[np.isfinite(values)]
    return float(np.median(known)) if known.size else math.nan


# --------------------------------------------------------------------------------- words
def said(tolerance: float) -> str:
    """1e-3 for 0.001."""
    return f"1e{round(math.log10(tolerance))}"


def number(value: float) -> str:
    """Two digits."""
    if math.isnan(value):
        return "-"
    if math.isinf(value):
        return "∞"
    return f"{value:.0f}" if value >= 10 else f"{value:.2g}"


def count(value: float) -> str:
    """A whole number."""
    return "∞" if math.isinf(value) else f"{value:.0f}"


def cost_text(value: float, cost: Cost = CLOCK) -> str:
    """Seconds or operations with their unit."""
    if not math.isfinite(value):
        return "-"
    if cost.by == "flops":
        return f"{value / 1e9:.3g} G" if value >= 1e9 else f"{value / 1e6:.3g} M"
    return f"{value:.3g} s" if value >= 1 else f"{1e3 * value:.3g} ms"
