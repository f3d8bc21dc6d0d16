"""The sentences of the paper, the same from runs of ours and of Siconos, and whose fault."""

from __future__ import annotations

import json
import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from .methods import HYBRID, NEWTON, PRINTED, SWEEPING
from .race import PAPER, Cost, Runs, iterations, key
from .ratios import (
    cost_text,
    count,
    each_step,
    median_cost,
    number,
    profile_ratio,
    ratio,
    said,
    solved,
)

REFERENCE = json.loads((Path(__file__).parent / "reference.json").read_text())
HYBRID_SWEEPS = 100
NEAR = 0.5, 2.0  # ratios that count as close
AGREES, PAPERS, OURS = "agrees", "differs, by Siconos too", "differs, by us"


@dataclass(frozen=True)
class Claim:
    """A sentence of the paper, the same from some runs, and whether they agree."""

    text: str
    paper: str
    found: str
    agrees: bool
    reason: str = ""
    undecided: bool = False  # runs ended at the limit before they could tell


def claims(runs: Runs, cost: Cost = PAPER) -> list[Claim]:
    """The paper's claims about the wall, in its order."""
    found = [_close(runs, cost), _all_newton_ahead(runs, cost)]
    found.append(_factor(runs, HYBRID, 1e-3, cost))
    found += [_factor(runs, "NSN-AC", t, cost) for t in (1e-4, 1e-6)]
    return [*found, _natural_map_last(runs, cost), _hybrid(runs, cost), _upk(runs, cost)]


def _close(runs: Runs, cost: Cost) -> Claim:
    found = ratio(runs, "NSGS-AC", "NSN-AC", 1e-2, cost)
    return Claim(
        "at 1e-2 Newton and Gauss-Seidel are close", "about 1",
        f"NSGS-AC / NSN-AC {found}", NEAR[0] <= found.value <= NEAR[1], _why(runs, 1e-2),
    )  # fmt: skip


def _all_newton_ahead(runs: Runs, cost: Cost) -> Claim:
    costs = {name: median_cost(runs, name, 1e-3, cost) for name in (*NEWTON, *SWEEPING)}
    least = min(costs[name] for name in SWEEPING)
    return Claim(
        "at 1e-3 all Newton methods are ahead of Gauss-Seidel", "yes",
        "medians " + ", ".join(f"{n} {cost_text(t, cost)}" for n, t in costs.items()),
        all(costs[name] < least for name in NEWTON), _why(runs, 1e-3),
    )  # fmt: skip


def _factor(runs: Runs, newton: str, tolerance: float, cost: Cost) -> Claim:
    wanted = REFERENCE["newton_over_gauss_seidel"][key(tolerance)]
    found = ratio(runs, "NSGS-AC", newton, tolerance, cost)
    drawn = profile_ratio(runs, "NSGS-AC", newton, tolerance, 0.5, cost)
    read = "" if math.isnan(drawn) else f"; from the profiles at one half: {number(drawn)}"
    why = _why(runs, tolerance)
    early = found.at_least and found.value < wanted
    if early:
        why = f"a bound only, as NSGS-AC does not end within the limit; {why}"
    return Claim(
        f"at {said(tolerance)} {newton} is ahead of NSGS-AC", f"{wanted} times",
        f"{found} times{read}", found.value >= wanted, why, early,
    )  # fmt: skip


def _natural_map_last(runs: Runs, cost: Cost) -> Claim:
    costs = {name: median_cost(runs, name, 1e-6, cost) for name in NEWTON}
    steps = {n: float(np.median(iterations(runs, n, 1e-6, cost.criterion))) for n in NEWTON}
    return Claim(
        "NSN-NM is the slowest of the Newton methods", "yes",
        "medians to 1e-6 " + ", ".join(f"{n} {cost_text(t, cost)}" for n, t in costs.items()),
        max(costs, key=lambda name: costs[name]) == "NSN-NM",
        "median steps " + ", ".join(f"{n} {count(k)}" for n, k in steps.items()),
    )  # fmt: skip


def _hybrid(runs: Runs, cost: Cost) -> Claim:
    costs = {name: median_cost(runs, name, 1e-6, cost) for name in (*NEWTON, HYBRID)}
    counts = {name: solved(runs, name, 1e-6, cost) for name in PRINTED}
    robust = counts[HYBRID] == max(counts.values()) > 0
    steps = [np.array(iterations(runs, n, 1e-6, cost.criterion)) for n in (HYBRID, "NSN-AC")]
    both = np.isfinite(steps[0]) & np.isfinite(steps[1])
    saved = steps[1][both] - (steps[0][both] - HYBRID_SWEEPS)
    saving = f"{np.median(saved):+.0f}" if both.any() else "-"
    return Claim(
        "the hybrid is the best and the most robust", "yes",
        f"solved to 1e-6: {', '.join(f'{n} {c}' for n, c in counts.items())} of {len(runs)}; "
        + ", ".join(f"{n} {cost_text(t, cost)}" for n, t in costs.items()),
        robust and costs[HYBRID] <= min(costs.values()),
        f"{HYBRID_SWEEPS} sweeps save {saving} of the steps of NSN-AC from r = 0 (median)",
    )  # fmt: skip


def _upk(runs: Runs, cost: Cost) -> Claim:
    found, looser = (ratio(runs, *SWEEPING, t, cost) for t in (1e-6, 1e-4))
    sweeps = [np.array(iterations(runs, n, 1e-4, cost.criterion)) for n in SWEEPING]
    both = np.isfinite(sweeps[0]) & np.isfinite(sweeps[1])
    same = float(np.median(sweeps[1][both] / sweeps[0][both])) if both.any() else math.nan
    nobody = "" if found.problems else "none of them ends within the limit; "
    return Claim(
        "at 1e-6 NSGS-FP-VI-UPK is ahead of NSGS-AC", "yes",
        f"NSGS-AC / NSGS-FP-VI-UPK {found}; at 1e-4 {looser}", found.value > 1,
        f"{nobody}NSGS-FP-VI-UPK makes {number(same)} times the sweeps of NSGS-AC to 1e-4",
        not found.problems,
    )  # fmt: skip


def most_robust(runs: Runs, where: str, cost: Cost) -> Claim:
    """The claim about the hybrid on other problems than the paper's."""
    counts = {name: solved(runs, name, 1e-6, cost) for name in PRINTED}
    ends = Counter(entry["methods"][HYBRID]["outcome"] for entry in runs.values())
    failed = [f"{k} {end.replace('_', ' ')}" for end, k in ends.items() if end != "converged"]
    return Claim(
        f"the hybrid is the most robust, on {where}", "yes",
        f"solved to 1e-6: {', '.join(f'{n} {c}' for n, c in counts.items())} of {len(runs)}",
        counts[HYBRID] == max(counts.values()) > 0,
        "W of rigid bodies is singular and stops Newton, which does not go back to sweeps; the "
        f"hybrid ends by {', '.join(failed)}",
    )  # fmt: skip


def _why(runs: Runs, tolerance: float) -> str:
    """Counts and what one of each takes."""
    c = each_step(runs, tolerance)
    sweeps = "more sweeps than end" if math.isinf(c["sweeps"]) else f"{c['sweeps']:.0f} sweeps"
    parts = [f"median {sweeps}, {count(c['newton_steps'])} Newton steps"]
    for word, by in (("operations", "flops"), ("seconds", "seconds")):
        worth = c[f"newton_{word}"] / c[f"sweep_{word}"]
        if not math.isnan(worth):
            cost = Cost(by, "13")
            parts.append(
                f"a step {cost_text(c[f'newton_{word}'], cost)}, a sweep "
                f"{cost_text(c[f'sweep_{word}'], cost)} ({number(worth)} sweeps)"
            )
    return "; ".join(parts)


# ------------------------------------------------------------------------------- verdicts
def verdict(ours: Claim, theirs: Claim | None) -> str:
    """AGREES, PAPERS where Siconos differs as well on the same problems, else OURS.

    What was not run for long enough is ours, whatever Siconos says.
    """
    if ours.agrees:
        return AGREES
    differs = theirs is not None and not theirs.agrees and not theirs.undecided
    return PAPERS if differs and not ours.undecided else OURS


def opening(verdicts: Sequence[str], undecided: int = 0) -> str:
    """The first line of the page, in counts; undecided: those that our limit leaves open."""
    counts = Counter(verdicts)
    left = f" ({undecided} of them undecided within our limit)" if undecided else ""
    return (
        f"**Of the {len(verdicts)} claims: agrees {counts[AGREES]} / differs by the paper's "
        f"fault {counts[PAPERS]} / differs by ours {counts[OURS]}{left}.**"
    )


def table(
    ours: Sequence[Claim], seconds: Sequence[Claim | None], theirs: Sequence[Claim | None],
    their_seconds: Sequence[Claim | None],
) -> str:  # fmt: skip
    """Markdown: every claim by operations and by seconds, of ours and within Siconos."""
    rows = [
        "| the paper says | paper | ours, operations | ours, seconds | Siconos, operations | "
        "Siconos, seconds | |",
        "|---|---|---|---|---|---|---|",
    ]
    for claim, timed, other, last in zip(ours, seconds, theirs, their_seconds, strict=True):
        cells = [_cell(timed), _cell(other), _cell(last)]
        said_here = verdict(claim, other)
        why = f"{said_here}: {claim.reason}" if not claim.agrees else said_here
        if other is not None and not claim.agrees:
            why += f"; Siconos: {other.reason}"
        rows.append(f"| {claim.text} | {claim.paper} | {claim.found} | {' | '.join(cells)} | "
                    f"{why} |")  # fmt: skip
    return "\n".join(rows)


def _cell(claim: Claim | None) -> str:
    if claim is None:
        return "-"
    return f"{claim.found} ({'agrees' if claim.agrees else 'differs'})"
