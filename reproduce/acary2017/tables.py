"""What the runs say: ratios, performance profiles, the paper's claims beside ours."""

from __future__ import annotations

import json
import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from amontons.analysis import performance_profile

from .methods import HYBRID, METHODS, NAMES, NEWTON, PRINTED
from .race import TOLERANCES, Runs, iterations, key, limits, seconds

REFERENCE = json.loads((Path(__file__).parent / "reference.json").read_text())
PROFILED = TOLERANCES[1:]
HYBRID_SWEEPS = 100
RIVALS = ("NSN-AC", "NSN-AC inexact", "Auto")  # of NSGS-AC
SWEEP_BLOCK, SWEEP_CONTACT = 18.0, 500.0  # operations of a sweep per 3x3 block and contact


@dataclass(frozen=True)
class Ratio:
    """Median over the problems of time(slow) / time(fast).

    Where only one of them met the tolerance the other counts with the time limit: a bound.
    at_least, at_most: the median is such a bound.  problems: those that at least one met.
    """

    value: float
    at_least: bool
    at_most: bool
    problems: int

    def __str__(self) -> str:
        if not self.problems:
            return "-"
        sign = "≥ " if self.at_least else "≤ " if self.at_most else ""
        return f"{sign}{_number(self.value)}"


def ratio(runs: Runs, slow: str, fast: str, tolerance: float, limit: float) -> Ratio:
    """See `Ratio`."""
    found = []
    allowed = limits(runs, (slow, fast), limit)
    for (a, b), (most_a, most_b) in zip(
        seconds(runs, (slow, fast), tolerance), allowed, strict=True
    ):
        if math.isfinite(a) or math.isfinite(b):
            bound = (not math.isfinite(a)) - (not math.isfinite(b))
            found.append((min(a, most_a) / min(b, most_b), bound))
    if not found:
        return Ratio(math.nan, False, False, 0)
    found.sort()
    middle = [found[(len(found) - 1) // 2], found[len(found) // 2]]
    value = math.sqrt(middle[0][0] * middle[1][0])
    bounds = [bound for _, bound in middle]
    return Ratio(value, max(bounds) > 0, min(bounds) < 0, len(found))


def profile_ratio(runs: Runs, slow: str, fast: str, tolerance: float, share: float) -> float:
    """Horizontal distance of two profiles at a share of the problems, as the paper reads it.

    Infinite where the slow method does not reach the share, NaN where neither does.
    """
    tau, rho = performance_profile(seconds(runs, PRINTED, tolerance))
    reached = []
    for name in (slow, fast):
        curve = rho[PRINTED.index(name)]
        reached.append(tau[np.argmax(curve >= share)] if curve[-1] >= share else math.inf)
    return math.nan if math.isinf(reached[1]) else float(reached[0] / reached[1])


def solved(runs: Runs, name: str, tolerance: float) -> int:
    """Problems on which a method met a tolerance."""
    return sum(math.isfinite(row[0]) for row in seconds(runs, (name,), tolerance))


def median_time(runs: Runs, name: str, tolerance: float) -> float:
    """Median time, unsolved problems counting as infinite."""
    return float(np.median(seconds(runs, (name,), tolerance)))


# ------------------------------------------------------------------------------- claims
@dataclass(frozen=True)
class Claim:
    """A sentence of the paper, the same from our runs, and whether they agree."""

    text: str
    paper: str
    ours: str
    agrees: bool
    reason: str = ""


def claims(runs: Runs, limit: float) -> list[Claim]:
    """The paper's claims about the wall, in its order."""
    found = [_close(runs, limit), _all_newton_faster(runs)]
    found.append(_factor(runs, HYBRID, 1e-3, limit))
    found += [_factor(runs, "NSN-AC", t, limit) for t in (1e-4, 1e-6)]
    return [*found, _natural_map_slowest(runs), _hybrid(runs), _upk(runs, limit)]


def _close(runs: Runs, limit: float) -> Claim:
    found = ratio(runs, "NSGS-AC", "NSN-AC", 1e-2, limit)
    return Claim(
        "at 1e-2 Newton and Gauss-Seidel are close", "about 1",
        f"NSGS-AC / NSN-AC {found}", 0.5 <= found.value <= 2,
        "" if 0.5 <= found.value <= 2 else _costs_text(runs, 1e-2),
    )  # fmt: skip


def _all_newton_faster(runs: Runs) -> Claim:
    times = {name: median_time(runs, name, 1e-3) for name in (*NEWTON, "NSGS-AC")}
    agrees = all(times[name] < times["NSGS-AC"] for name in NEWTON)
    return Claim(
        "at 1e-3 all Newton methods are faster than Gauss-Seidel", "yes",
        "median times " + ", ".join(f"{n} {_time(t)}" for n, t in times.items()), agrees,
        "" if agrees else _costs_text(runs, 1e-3),
    )  # fmt: skip


def _factor(runs: Runs, newton: str, tolerance: float, limit: float) -> Claim:
    wanted = REFERENCE["newton_over_gauss_seidel"][key(tolerance)]
    found = ratio(runs, "NSGS-AC", newton, tolerance, limit)
    drawn = profile_ratio(runs, "NSGS-AC", newton, tolerance, 0.5)
    agrees = found.value >= wanted
    read = "" if math.isnan(drawn) else f"; from the profiles at one half: {_number(drawn)}"
    ours = ratio(runs, "NSGS-AC", "NSN-AC inexact", tolerance, limit)
    if newton == "NSN-AC" and all("NSN-AC inexact" in e["methods"] for e in runs.values()):
        read += f"; our NSN-AC inexact {ours} times"
    return Claim(
        f"at {said(tolerance)} {newton} is ahead of NSGS-AC", f"{wanted} times",
        f"{found} times{read}", agrees,
        "" if agrees else "; ".join(
            (_costs_text(runs, tolerance), _grades(runs, newton, tolerance, limit))
        ),
    )  # fmt: skip


def _grades(runs: Runs, newton: str, tolerance: float, limit: float) -> str:
    """The ratio for each time step, which decides how many sweeps there are."""
    found = [f"{step} {ratio(group, 'NSGS-AC', newton, tolerance, limit)}"
             for step, group in by_step(runs).items()]  # fmt: skip
    return "by time step " + ", ".join(found)


def _natural_map_slowest(runs: Runs) -> Claim:
    times = {name: median_time(runs, name, 1e-6) for name in NEWTON}
    steps = {name: float(np.median(iterations(runs, name, 1e-6))) for name in NEWTON}
    return Claim(
        "NSN-NM is the slowest of the Newton methods", "yes",
        "median to 1e-6: " + ", ".join(f"{n} {_time(t)}" for n, t in times.items()),
        max(times, key=lambda name: times[name]) == "NSN-NM",
        "the same cost of a step, and median steps "
        + ", ".join(f"{n} {_count(k)}" for n, k in steps.items()),
    )  # fmt: skip


def most_robust(runs: Runs, where: str) -> Claim:
    """The claim about the hybrid on other problems than the paper's."""
    counts = {name: solved(runs, name, 1e-6) for name in PRINTED}
    ends = Counter(entry["methods"][HYBRID]["outcome"] for entry in runs.values())
    failed = [f"{k} {end.replace('_', ' ')}" for end, k in ends.items() if end != "converged"]
    return Claim(
        f"the hybrid is the most robust, on {where}", "yes",
        f"solved to 1e-6: {', '.join(f'{n} {c}' for n, c in counts.items())} of {len(runs)}",
        counts[HYBRID] == max(counts.values()),
        "W of rigid bodies is singular and stops Newton, which does not go back to sweeps; the "
        f"hybrid ends by {', '.join(failed)}",
    )  # fmt: skip


def _hybrid(runs: Runs) -> Claim:
    times = {name: median_time(runs, name, 1e-6) for name in (*NEWTON, HYBRID)}
    counts = {name: solved(runs, name, 1e-6) for name in PRINTED}
    agrees = counts[HYBRID] == max(counts.values())
    steps = [np.array(iterations(runs, name, 1e-6)) for name in (HYBRID, "NSN-AC")]
    both = np.isfinite(steps[0]) & np.isfinite(steps[1])
    more = (
        float(np.median(steps[0][both] - HYBRID_SWEEPS - steps[1][both])) if both.any() else 0
    )
    return Claim(
        "the hybrid is the best and the most robust", "yes",
        f"solved to 1e-6: {', '.join(f'{n} {c}' for n, c in counts.items())} of {len(runs)}; "
        f"median time {_time(times[HYBRID])} against {_time(times['NSN-AC'])} of NSN-AC",
        agrees and times[HYBRID] <= min(times.values()),
        ("as robust as any, but not the quickest: " if agrees else "")
        + f"after {HYBRID_SWEEPS} sweeps Newton makes {more:+.0f} steps beside those from "
        "r = 0 (median of the difference)",
    )  # fmt: skip


def _upk(runs: Runs, limit: float) -> Claim:
    found = ratio(runs, "NSGS-AC", "NSGS-FP-VI-UPK", 1e-6, limit)
    sweeps = [np.array(iterations(runs, name, 1e-4)) for name in ("NSGS-AC", "NSGS-FP-VI-UPK")]
    both = np.isfinite(sweeps[0]) & np.isfinite(sweeps[1])
    same = float(np.median(sweeps[1][both] / sweeps[0][both])) if both.any() else math.nan
    return Claim(
        "at 1e-6 NSGS-FP-VI-UPK is faster than NSGS-AC", "yes",
        f"NSGS-AC / NSGS-FP-VI-UPK {found}", found.value > 1,
        f"both make the same sweeps (median ratio {_number(same)}): each contact is solved "
        "exactly either way, ours by a few Newton steps and by up to 100 projections",
    )  # fmt: skip


# -------------------------------------------------------------------------------- costs
def costs(runs: Runs, tolerance: float) -> dict[str, float]:
    """Medians that explain a ratio: counts, seconds each, operations each."""
    names = ("NSGS-AC", "NSN-AC")
    times = np.array(seconds(runs, names, tolerance))
    counts = np.array([iterations(runs, name, tolerance) for name in names]).T
    with np.errstate(invalid="ignore", divide="ignore"):
        each = np.where(np.isfinite(times), times / counts, np.nan)
    m = np.array([3.0 * entry["contacts"] for entry in runs.values()])
    density = np.array([entry["density"] for entry in runs.values()])
    sweep = SWEEP_BLOCK * density * (m / 3) ** 2 + SWEEP_CONTACT * m / 3
    return {
        "sweeps": float(np.median(counts[:, 0])),
        "newton_steps": float(np.median(counts[:, 1])),
        "sweep_seconds": _median(each[:, 0]),
        "newton_seconds": _median(each[:, 1]),
        "sweep_operations": float(np.median(sweep)),
        "dense_lu_operations": float(np.median(2 / 3 * m**3)),
    }


def _median(values: np.ndarray) -> float:
    known = values[np.isfinite(values)]
    return float(np.median(known)) if known.size else math.nan


def _costs_text(runs: Runs, tolerance: float) -> str:
    c = costs(runs, tolerance)
    worth = c["newton_seconds"] / c["sweep_seconds"]
    sweeps = "more than the limit allows" if math.isinf(c["sweeps"]) else f"{c['sweeps']:.0f}"
    return (
        f"median {sweeps} sweeps of {_time(c['sweep_seconds'])} against "
        f"{c['newton_steps']:.0f} Newton step(s) of {_time(c['newton_seconds'])}: a step costs "
        f"as much as {worth:.0f} sweeps"
    )


# ------------------------------------------------------------------------------ Markdown
def claims_table(found: Sequence[Claim]) -> str:
    """The claims as Markdown."""
    rows = ["| the paper says | paper | ours | |", "|---|---|---|---|"]
    for claim in found:
        verdict = "agrees" if claim.agrees else f"differs: {claim.reason}".rstrip(": ")
        rows.append(f"| {claim.text} | {claim.paper} | {claim.ours} | {verdict} |")
    return "\n".join(rows)


def methods_table(runs: Runs) -> str:
    """Problems solved and median time, by method and tolerance."""
    head = [f"to {said(t)}: solved, median" for t in TOLERANCES]
    rows = ["| method | " + " | ".join(head) + " | iterations to 1e-6 |"]
    rows.append("|---|" + "---|" * (len(head) + 1))
    for name in NAMES:
        count = sum(name in entry["methods"] for entry in runs.values())
        if not count:
            continue
        cells = [f"{solved(runs, name, t)}, {_time(median_time(runs, name, t))}"
                 for t in TOLERANCES]  # fmt: skip
        last = float(np.median(iterations(runs, name, TOLERANCES[-1])))
        steps = "-" if math.isinf(last) else f"{last:.0f}"
        rows.append(f"| {name} | " + " | ".join(cells) + f" | {steps} |")
    return "\n".join(rows)


def steps_table(runs: Runs, limit: float) -> str:
    """The ratio by step size, with what makes it."""
    groups = by_step(runs)
    rivals = [name for name in RIVALS if all(name in e["methods"] for e in runs.values())]
    at = ", ".join(said(t) for t in PROFILED)
    head = [f"NSGS-AC / {name} at {at}" for name in rivals]
    head += ["sweeps to 1e-4, 1e-6", "NSN-AC steps to 1e-4, 1e-6", "a sweep", "a step"]
    rows = [f"| time step | problems | {' | '.join(head)} |", "|---|---|" + "---|" * len(head)]
    for step, group in groups.items():
        cells = [
            ", ".join(str(ratio(group, "NSGS-AC", name, t, limit)) for t in PROFILED)
            for name in rivals
        ]
        loose, tight = costs(group, 1e-4), costs(group, 1e-6)
        for count in ("sweeps", "newton_steps"):
            cells.append(f"{_count(loose[count])}, {_count(tight[count])}")
        cells += [_time(costs(group, 1e-3)["sweep_seconds"]), _time(tight["newton_seconds"])]
        rows.append(f"| {step} | {len(group)} | {' | '.join(cells)} |")
    return "\n".join(rows)


def by_step(runs: Runs) -> dict[str, Runs]:
    """The runs by the time step that is in the names of the problems, such as "5 ms"."""
    groups: dict[str, Runs] = {}
    for name, entry in runs.items():
        groups.setdefault(name.split("-")[1].replace("ms", " ms"), {})[name] = entry
    return groups


def legend() -> str:
    """What the methods are."""
    return "\n".join(f"- {method.name}: {method.text}." for method in METHODS)


def record_of(runs: Runs, limit: float) -> dict[str, Any]:
    """Ratios and what makes them, for the JSON."""
    return {
        "costs": {key(t): costs(runs, t) for t in TOLERANCES},
        "ratios": {
            key(t): vars(ratio(runs, "NSGS-AC", "NSN-AC", t, limit)) for t in TOLERANCES
        },
    }


def measures_text(runs: Runs) -> str:
    """How the published error (13) relates to the judge where NSN-AC solved a problem."""
    pairs = [(run["error_13"], run["error"]) for entry in runs.values()
             if (run := entry["methods"].get("NSN-AC")) and run["outcome"] == "converged"
             and run["error"] and run["error_13"]]  # fmt: skip
    if not pairs:
        return ""
    factors = np.array([a / b for a, b in pairs])
    low, middle, high = (_number(np.quantile(factors, share)) for share in (0, 0.5, 1))
    return (
        f"The paper's error (13) of the solutions of NSN-AC is {low} to {high} times our "
        f"judge's, median {middle}: it adds "
        "newton seconds to metres per second, the judge scales each contact by its compliance."
    )


def middle(values: Sequence[float]) -> float:
    """The median."""
    return float(np.median(values))


def said(tolerance: float) -> str:
    """1e-3 for 0.001."""
    return f"1e{round(math.log10(tolerance))}"


def _number(value: float) -> str:
    if math.isinf(value):
        return "∞"
    return f"{value:.0f}" if value >= 10 else f"{value:.2g}"


def _count(value: float) -> str:
    return "∞" if math.isinf(value) else f"{value:.0f}"


def _time(value: float) -> str:
    if not math.isfinite(value):
        return "-"
    if value >= 0.9995:
        return f"{value:.3g} s"
    return f"{1e3 * value:.0f} ms" if value >= 0.0095 else f"{1e3 * value:.2g} ms"
