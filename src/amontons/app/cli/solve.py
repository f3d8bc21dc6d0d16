"""`amontons solve`: solve, judge, write, summarise."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

import click

from ...analysis.certificates.uniqueness import assess, quick_verdict
from ...analysis.certificates.verdict import Uniqueness
from ...analysis.quick import operations_of
from ...core.clock import TimeLimit
from ...core.errors import FileFormatError, UnsupportedForm
from ...core.files import put
from ...io import results as output
from ...io.readers import Case
from ...io.units import Units
from ...problem.friction import FrictionProblem
from ...problem.judge.measures import Criterion
from ...problem.solution import FrictionSolution, Outcome
from ...solvers.asked import Asked
from ..api import solve_as_asked
from ..model_solution import ModelSolution
from .group import INTERRUPTED
from .run import Wanted
from .solve_deck import solve_in_steps
from .sources import naming_culprits, open_source, start_from, with_flags
from .terminal import REPORT, check_folder, check_writable, say_notes, say_when

NOT_EXAMINED = "uniqueness: not examined, nothing is proved of this law"


def run(
    source: str, method: str | None, tolerance: float | None, overrides: Sequence[str],
    max_iterations: int | None, time_limit: float | None, folder: str | None,
    json_copy: str | None, quiet: bool, full_verdict: bool,
    contact_tolerance: float | None = None, patience: int = 500, criterion: str = "judge",
    start: str | None = None, fclib_error: bool = False, figures: str = "png",
    report: bool = False, frd: bool = False,
) -> int:  # fmt: skip
    """Solve and write; returns the exit code."""
    opened = open_source(source, overrides, method)
    settings = with_flags(
        opened.settings, tolerance, max_iterations, time_limit, contact_tolerance
    )
    silent = quiet or json_copy == "-"
    if opened.evolution is not None and opened.moving is None:
        if opened.about is None:
            raise FileFormatError(
                f"{source}: a case in time, whose state depends on the way; use: amontons run "
                f"{source}"
            )
        return solve_in_steps(
            replace(opened, settings=replace(settings, time_limit=opened.settings.time_limit)),
            folder, json_copy, Wanted(time_limit, quiet=silent, report=report),
            {"start": start, "uniqueness": full_verdict, "frd": frd,
             "fclib-error": fclib_error},
        )  # fmt: skip
    place = check_folder(f"{opened.name}-results" if folder is None else folder)
    check_writable(json_copy, "--json")
    begin = None if start is None else start_from(start, opened)
    with naming_culprits(opened, source, settings.method, start):
        asked = Asked(
            settings.tolerance, settings.contact_tolerance, settings.max_iterations,
            settings.time_limit, (lambda step, iterate: None) if silent else None,
            Criterion(criterion), patience or None, condense=True,
        )  # fmt: skip
        found = solve_as_asked(opened.target, asked, begin, settings.solver())
    left = None if settings.time_limit is None else asked.deadline
    result = replace(
        _output(opened, found, settings.method), fclib_error=fclib_error,
        figures="" if figures == "none" else figures,
        uniqueness=_verdict(found, full_verdict, left),
    )  # fmt: skip
    copy = None if json_copy in (None, "-") else Path(str(json_copy))
    more = {REPORT: partial(_page, units=opened.units)} if report else {}
    if frd and result.model is not None:
        labels = opened.about.labels if opened.about is not None else None
        more["solution.frd"] = partial(output.write_frd, labels=labels)
    output.save(result, place, copy, more)
    if json_copy == "-":
        click.echo(output.to_json(output.summary(result)), nl=False)
    elif not quiet:
        _report(result, full_verdict, place)
    return _finish(found)


def _page(result: output.Output, path: Path, units: Units) -> None:
    """Write report.html."""
    from ...io.report import page_of

    put(path, page_of(result, units=units).html.encode("utf-8"))


def _output(
    opened: Case, found: FrictionSolution | ModelSolution, method: str
) -> output.Output:
    if isinstance(found, ModelSolution):
        return replace(found.output, title=opened.title, method=method, notes=opened.notes)
    return output.Output(found, title=opened.title, method=method, warnings=found.warnings,
                         from_fclib=opened.path is not None, notes=opened.notes)  # fmt: skip


def _verdict(
    found: FrictionSolution | ModelSolution, full: bool, time_limit: TimeLimit
) -> Uniqueness | None:
    """The verdict, or its cheap part; None where the problem is too large for that.

    None also for large deformations: that of the tangent problem would say little; and for
    Nitsche's method, which has no reactions to speak of.
    """
    if isinstance(found, ModelSolution) and found.model.kind is not FrictionProblem:
        if full:
            raise UnsupportedForm(f"--uniqueness: {found.model.kind.unfit}")
        return None
    solution = found.solution if isinstance(found, ModelSolution) else found
    assert isinstance(solution.problem, FrictionProblem)
    if full:
        known = solution if solution.converged else None
        return assess(solution.problem, known, time_limit=time_limit)
    return quick_verdict(solution.problem, operations_of(solution.convergence), solution)


def _report(result: output.Output, full: bool, folder: Path) -> None:
    click.echo(output.describe(result))
    say_notes(result.notes)
    model = result.model
    if model is None or model.kind is FrictionProblem:
        verdict = result.uniqueness
        told = NOT_EXAMINED if verdict is None else verdict.in_full if full else verdict.brief
        click.echo(told)
    say_when(model)
    click.echo(f"results in {folder}/")


def _finish(found: FrictionSolution | ModelSolution) -> int:
    """Exit code; what went wrong, and what to do about it, goes to stderr."""
    record = found.convergence
    if record.outcome is Outcome.CONVERGED:
        return 0
    sys.stdout.flush()
    name = record.outcome.name.lower().replace("_", " ")
    detail = f" ({output.method_name(record.detail)})" if record.detail else ""
    click.echo(
        f"Not converged: {name}{detail}, {record.errors}. {record.advice}", err=True
    )
    return INTERRUPTED if record.by_user else 1
