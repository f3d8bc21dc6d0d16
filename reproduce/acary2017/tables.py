"""What the runs say, as Markdown tables."""

from __future__ import annotations

from typing import Any

import numpy as np

from .methods import METHODS, NAMES
from .race import CLOCK, PAPER, TOLERANCES, Cost, Runs, iterations, key
from .ratios import cost_text, count, each_step, median_cost, number, ratio, said, solved

RIVALS = ("NSN-AC", "NSN-AC inexact", "Auto")  # of NSGS-AC
COMPARED = TOLERANCES[1:]
GRADES = 3  # groups of problems, from easy to hard ones


def methods_table(runs: Runs, cost: Cost = CLOCK) -> str:
    """Problems solved and median cost, by method and tolerance."""
    head = [f"to {said(t)}: solved, median" for t in TOLERANCES]
    rows = ["| method | " + " | ".join(head) + " | iterations to 1e-6 |"]
    rows.append("|---|" + "---|" * (len(head) + 1))
    for name in NAMES:
        if not any(name in entry["methods"] for entry in runs.values()):
            continue
        medians = [cost_text(median_cost(runs, name, t, cost), cost) for t in TOLERANCES]
        cells = [
            f"{solved(runs, name, t, cost)}, {middle}"
            for t, middle in zip(TOLERANCES, medians, strict=True)
        ]
        steps = count(float(np.median(iterations(runs, name, TOLERANCES[-1], cost.criterion))))
        rows.append(f"| {name} | " + " | ".join(cells) + f" | {steps.replace('∞', '-')} |")
    return "\n".join(rows)


def grades_table(runs: Runs, cost: Cost = CLOCK) -> str:
    """The ratio by difficulty, with what makes it."""
    rivals = [name for name in RIVALS if all(name in e["methods"] for e in runs.values())]
    at = ", ".join(said(t) for t in COMPARED)
    head = [f"NSGS-AC / {name} at {at}" for name in rivals]
    head += ["sweeps to 1e-4, 1e-6", "NSN-AC steps to 1e-4, 1e-6", "a sweep", "a step"]
    rows = ["| iterations of Newton | problems | " + " | ".join(head) + " |"]
    rows.append("|---|---|" + "---|" * len(head))
    for name, group in by_grade(runs).items():
        cells = [
            ", ".join(str(ratio(group, "NSGS-AC", rival, t, cost)) for t in COMPARED)
            for rival in rivals
        ]
        loose, tight = each_step(group, 1e-4), each_step(group, 1e-6)
        for what in ("sweeps", "newton_steps"):
            cells.append(f"{count(loose[what])}, {count(tight[what])}")
        cells += [cost_text(loose["sweep_seconds"]), cost_text(loose["newton_seconds"])]
        rows.append(f"| {name} | {len(group)} | {' | '.join(cells)} |")
    return "\n".join(rows)


def by_grade(runs: Runs) -> dict[str, Runs]:
    """The runs in groups of growing difficulty, by the iterations of Newton in their names."""
    order = sorted(runs, key=difficulty)
    groups: dict[str, Runs] = {}
    for part in np.array_split(np.array(order), min(GRADES, len(order))):
        low, high = difficulty(part[0]), difficulty(part[-1])
        name = f"{low}" if low == high else f"{low} to {high}"
        groups.setdefault(name, {}).update({str(stem): runs[str(stem)] for stem in part})
    return groups


def difficulty(stem: str) -> int:
    """The iterations of Newton in the name of a problem, 0 where it has none."""
    text = stem.rpartition("-")[2]
    return int(text) if text.isdigit() else 0


def variants_table(runs: Runs) -> str:
    """Solved, median iterations, operations and seconds, by method and tolerance."""
    rows = ["| method | " + " | ".join(
        f"to {said(t)}: solved, iterations, operations, time" for t in COMPARED) + " |",
        "|---|" + "---|" * len(COMPARED)]  # fmt: skip
    for name in NAMES:
        if not any(name in entry["methods"] for entry in runs.values()):
            continue
        cells = [
            f"{solved(runs, name, t)}, {count(float(np.median(iterations(runs, name, t))))}, "
            f"{cost_text(median_cost(runs, name, t, Cost('flops', 'judge')), PAPER)}, "
            f"{cost_text(median_cost(runs, name, t))}"
            for t in COMPARED
        ]
        rows.append(f"| {name} | {' | '.join(cells)} |")
    return "\n".join(rows)


def legend() -> str:
    """What the methods are."""
    return "\n".join(f"- {method.name}: {method.text}." for method in METHODS)


def record_of(runs: Runs) -> dict[str, Any]:
    """Ratios and what makes them, for the JSON."""
    return {
        "costs": {key(t): each_step(runs, t) for t in TOLERANCES},
        "ratios": {
            f"{cost.by}, {cost.criterion}": {
                key(t): vars(ratio(runs, "NSGS-AC", "NSN-AC", t, cost)) for t in TOLERANCES
            }
            for cost in (PAPER, CLOCK)
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
    low, middle, high = (number(float(np.quantile(factors, share))) for share in (0, 0.5, 1))
    return (
        f"The paper's error (13) of the solutions of NSN-AC is {low} to {high} times our "
        f"judge's, median {middle}: it adds "
        "newton seconds to metres per second, the judge scales each contact by its compliance."
    )
