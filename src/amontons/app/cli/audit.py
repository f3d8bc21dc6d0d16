"""`amontons audit`: whether the results of another program, or ours, are true."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import click

from ...analysis.audit import Audit
from ...core.errors import AmontonsError
from ...io.results import to_json, versions
from ..api import solve_any_form
from ..audit import audit
from ..model_solution import ModelSolution
from .sources import check_is_plain, open_source
from .terminal import check_writable, deliver_json, report_folder, write_report

SCHEMA = "amontons/audit/1"
PICTURES = (".png", ".svg", ".pdf")
DOUBTED = 1  # exit code: wrong or undecided


def run(
    source: str, result: str, overrides: Sequence[str], time: float | None, law: str | None,
    json_copy: str | None, picture: str | None, **more: Any,
) -> int:  # fmt: skip
    """Audit, show; the exit code.  more: solve, report, folder, quiet."""
    check_writable(json_copy, "--json")
    check_writable(picture, "--picture", PICTURES)
    name = Path(result.rstrip("/")).stem
    folder = report_folder(more["report"], more["folder"], f"{name}-audit")
    found = _audit(source, result, overrides, time, law)
    if more["solve"]:
        found = replace(found, own=_own(found))
    text = to_json(record(found))
    if json_copy == "-":
        click.echo(text, nl=False)
    elif not more["quiet"]:
        click.echo(str(found))
        if found.own is not None:
            click.echo(beside(found))
    if json_copy not in (None, "-"):
        deliver_json(text, json_copy)
    if picture is not None:
        found.plot(picture)
    if folder is not None:
        from ...io.report.faces import page_of

        write_report(page_of(found), folder)
    return 0 if found.is_right else DOUBTED


def _audit(
    source: str, result: str, overrides: Sequence[str], time: float | None, law: str | None
) -> Audit:  # fmt: skip
    if source.startswith("example:"):
        opened = open_source(source, overrides)
        return audit(opened.model, result, time=time, law=law)
    check_is_plain(Path(source))
    return audit(source, result, time=time, law=law, overrides=overrides)


def _own(found: Audit) -> ModelSolution | None:
    """Our own solution of the same model with hard contact; None where there is none."""
    try:
        solution = solve_any_form(found.hard_model)
    except AmontonsError as reason:
        click.echo(f"--solve: {reason}", err=True)
        return None
    assert isinstance(solution, ModelSolution)
    if not solution.converged:
        sys.stdout.flush()
        click.echo(f"--solve: not converged: {solution.convergence.errors}", err=True)
    return solution


def beside(found: Audit) -> str:
    """Forces of every pair beside those of our own solution."""
    lines = ["  our own solution, contact hard and sticking rigid:"]
    for pair in found.pairs:
        own = found.own.pairs[pair.name].force
        size = float((own**2).sum()) ** 0.5
        off = float(((pair.force - own) ** 2).sum()) ** 0.5
        shown = ", ".join(f"{f:.6g}" for f in own)
        lines.append(f"  pair {pair.name}: force ({shown}), the answer is off by "
                     f"{off / size if size > 0 else 0.0:.2%}")  # fmt: skip
    return "\n".join(lines)


def record(found: Audit) -> dict[str, Any]:
    """What the JSON file holds."""
    own = None
    if found.own is not None:
        own = {"converged": bool(found.own.converged), "error": found.own.convergence.error,
               "pairs": [pair.record for pair in found.own.pairs.values()]}  # fmt: skip
    return {"schema": SCHEMA, **found.record, "solve": own, "versions": versions()}
