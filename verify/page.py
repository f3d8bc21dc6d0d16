"""What a case looks like in the terminal, in `README.md` and as a figure."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from amontons.core.files import replacing

from .case import ROUNDING, Case, Outcome, Value

HEAD = """# Verification manual

Cases with a number that theory gives or somebody else has published. `python -m verify`
computes them again and exits with 1 if one fails, saying which and by how much;
`python -m verify hertz-2d` or `--only 'press-fit*'` takes some, `--fine` adds larger sizes,
`--list` names them. `--quick` takes the smallest size of each, for checks at every change: a
case that converges with order k is then allowed (largest / smallest size)^k of its tolerance.
`python -m verify --results verify` makes this page.

One rule for all tolerances. A case is *exact* where the discrete problem has the answer of
theory: every size is within 1e-6. Else it *converges*: the largest size is within 1 %, and its
error no larger than the largest of the coarser ones, or below what the expected number itself
is good for (terms that theory neglects). Press fits are within 0.5 %, the lap joint within
1e-5. The order is the slope of the error between the
smallest and the largest size, beside the one that theory expects; it does not decide.
A figure's dotted line has the expected slope.
"""


def _verdict(passed: bool) -> str:  # noqa: FBT001
    return "PASS" if passed else "FAIL"


def text_of(outcome: Outcome) -> str:
    """A few lines for a terminal."""
    case = outcome.case
    seconds = sum(outcome.seconds.values())
    lines = [f"{_verdict(outcome.passed)}  {case.name}: {case.title} ({seconds:.1f} CPU s)"]
    for value in outcome.last:
        order = outcome.order(value.name)
        lines.append(
            f"      {_verdict(outcome.passes(value))}  {value.name}: {value.computed:.6g}, "
            f"expected {value.expected:.6g}, error {value.error:.1e} of {outcome.tolerance:.0e}"
            + ("" if order is None else f", order {order:.2f} of {case.order}")
        )
        wrong = outcome.failure(value)
        if wrong is not None:
            lines.append(f"            {wrong}; expected from {case.source}")
    return "\n".join(lines)


def recorded(outcome: Outcome) -> dict[str, Any]:
    """The numbers of a case, for results.json."""
    return {
        "sizes": sorted(outcome.values), "passed": outcome.passed,
        "seconds": sum(outcome.seconds.values()),
        "values": [
            {"name": v.name, "computed": v.computed, "expected": v.expected, "error": v.error,
             "errors": outcome.errors(v.name), "order": outcome.order(v.name),
             "passed": outcome.passes(v)}
            for v in outcome.last
        ],
    }  # fmt: skip


def page(cases: Mapping[str, Case], record: Mapping[str, Any]) -> str:
    """The page of all cases that are stored."""
    kept = [case for name, case in cases.items() if name in record]
    passed = sum(record[case.name]["passed"] for case in kept)
    machine = "; ".join(f"{k} {v}" for k, v in record["machine"].items())
    lines = [HEAD, f"**{passed} of {len(kept)} cases pass.** {machine}.", "",
             "| case | value | computed | expected | error | tolerance | order (expected) | |",
             "|---|---|---|---|---|---|---|---|"]  # fmt: skip
    for case in kept:
        for value in record[case.name]["values"]:
            order = "exact"
            if case.order is not None:
                found = "-" if value["order"] is None else f"{value['order']:.2f}"
                order = f"{found} ({case.order:g})"
            lines.append(
                f"| [{case.name}](#{case.name}) | {value['name']} | {value['computed']:.6g} | "
                f"{value['expected']:.6g} | {value['error']:.1e} | {case.tolerance:.0e} | "
                f"{order} | {_verdict(value['passed'])} |"
            )
    for case in kept:
        lines += ["", *_section(case, record[case.name])]
    return "\n".join(lines) + "\n"


def _section(case: Case, found: Mapping[str, Any]) -> list[str]:
    sizes = ", ".join(map(str, found["sizes"]))
    text = f"**{case.title}.** {case.problem} {case.remarks}".strip()
    cost = f"{found['seconds']:.1f} CPU s for sizes {sizes}"
    lines = [f"## {case.name}", "", text, "", f"Expected: {case.source}.", "",
             f"`python -m verify {case.name}`; {cost}.", "",
             f"| size | {' | '.join(str(s) for s in found['sizes'])} |",
             "|---" * (len(found["sizes"]) + 1) + "|"]  # fmt: skip
    for value in found["values"]:
        errors = " | ".join(f"{error:.1e}" for error in value["errors"])
        lines.append(f"| {value['name']}: error | {errors} |")
    return [*lines, "", f"![Errors of {case.name}](results/{case.name}.png)"]


def figure(outcome: Outcome, path: Path) -> None:
    """Errors over sizes, with the expected slope."""
    from matplotlib.figure import Figure

    case, sizes = outcome.case, sorted(outcome.values)
    drawing = Figure(figsize=(5.5, 3.6), layout="constrained")
    axes = drawing.subplots()
    for value in outcome.last:
        axes.loglog(sizes, _shown(outcome, value), "o-", label=value.name)
    if case.order is not None:
        first = max(_shown(outcome, value)[0] for value in outcome.last)
        slope = [first * (size / sizes[0]) ** -case.order for size in sizes]
        axes.loglog(sizes, slope, ":", color="grey", label=f"order {case.order:g}")
    axes.axhline(case.tolerance, color="black", lw=0.8, label="tolerance")
    shown = [case.tolerance, *(e for value in outcome.last for e in _shown(outcome, value))]
    axes.set_ylim(10 ** np.floor(np.log10(min(shown)) - 0.05),
                  10 ** np.ceil(np.log10(max(shown)) + 0.05))  # fmt: skip
    axes.set(xlabel="size (1 / mesh width or step)", ylabel="relative error", title=case.title)
    axes.set_xticks(sizes, [str(s) for s in sizes])
    axes.minorticks_off()
    axes.legend(fontsize=8)
    with replacing(path) as new:
        drawing.savefig(new, format="png", dpi=100)


def _shown(outcome: Outcome, value: Value) -> list[float]:
    """Errors that a logarithmic axis can show."""
    return [max(error, ROUNDING * 1e-7) for error in outcome.errors(value.name)]
