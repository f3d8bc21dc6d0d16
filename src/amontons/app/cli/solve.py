"""`amontons solve`: solve, judge, write, summarise."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import click

from ...analysis.certificates.uniqueness import Uniqueness, assess, quick_verdict
from ...core.clock import Deadline, TimeLimit, compiling, now
from ...core.errors import FileFormatError, InvalidInput, SingularOperator, UnsupportedForm
from ...io import results as output
from ...io.case import in_words
from ...io.checkpoint import load_start
from ...problem.friction import Form
from ...problem.judge.measures import Criterion
from ...problem.nitsche import NO_MULTIPLIERS
from ...problem.solution import FrictionSolution, Outcome
from ...solvers import Iterate
from ...solvers.first_iterate import first_iterate
from .. import api
from ..model_solution import ModelSolution
from .group import INTERRUPTED
from .sources import Source, open_source, with_flags
from .terminal import check_folder, check_writable, say_when
from .uniqueness import brief, describe, record


def run(
    source: str, method: str | None, tolerance: float | None, overrides: Sequence[str],
    max_iterations: int | None, time_limit: float | None, folder: str | None,
    json_copy: str | None, quiet: bool, full_verdict: bool,
    contact_tolerance: float | None = None, patience: int = 500, criterion: str = "judge",
    start: str | None = None,
) -> int:  # fmt: skip
    """Solve and write; returns the exit code."""
    opened = open_source(source, overrides, method)
    if opened.in_time:
        raise FileFormatError(
            f"{source}: a case in time, it has [evolution]; use: amontons run {source}"
        )
    settings = with_flags(
        opened.settings, tolerance, max_iterations, time_limit, contact_tolerance
    )
    place = check_folder(f"{opened.name}-results" if folder is None else folder)
    check_writable(json_copy, "--json")
    began, compiled = now(), compiling()
    deadline = Deadline.after(settings.time_limit)
    begin = _start(start, opened.solvable())
    assembled = now() - began if opened.model is not None else 0.0
    compiled = compiling() - compiled
    silent = quiet or json_copy == "-"
    try:
        found = api.solve_any_form(
            opened.target, settings.solver(), tolerance=settings.tolerance,
            contact_tolerance=settings.contact_tolerance,
            max_iterations=settings.max_iterations, time_limit=deadline,
            patience=patience or None, criterion=Criterion(criterion),
            callback=(lambda step, iterate: None) if silent else None, start=begin,
        )  # fmt: skip
    except (UnsupportedForm, SingularOperator, InvalidInput) as reason:
        text = f"{source}: --method {settings.method}: {in_words(str(reason))}"
        raise type(reason)(text) from reason
    result = _output(opened, found, settings.method, assembled, compiled)
    left = None if settings.time_limit is None else deadline
    verdict = _verdict(found, full_verdict, left)
    if verdict is not None:
        result = replace(result, uniqueness=record(verdict))
    copy = None if json_copy in (None, "-") else Path(str(json_copy))
    output.save(result, place, copy)
    if json_copy == "-":
        click.echo(output.to_json(output.summary(result)), nl=False)
    elif not quiet:
        _report(result, verdict, full_verdict, place)
    return _finish(found)


def _start(file: str | None, problem: Any) -> Iterate | None:
    """The start in the file of --start, fit for the problem."""
    if file is None:
        return None
    try:
        found = load_start(file)
        if problem.form is Form.NITSCHE and found.v is None:
            raise InvalidInput("no v, and the method starts from displacements")
        return first_iterate(problem, found)
    except (FileFormatError, InvalidInput) as reason:
        text = str(reason).removeprefix(f"{file}: ")
        raise type(reason)(f"--start {file}: {text}") from None


def _output(
    source: Source, found: FrictionSolution | ModelSolution, method: str, assembled: float,
    compiled: float,
) -> output.Output:
    if isinstance(found, ModelSolution):
        return replace(
            found.output, title=source.title, method=method, assemble_seconds=assembled,
            assemble_compiling=compiled,
        )  # fmt: skip
    return output.Output(found, title=source.title, method=method,
                         from_fclib=source.from_fclib, warnings=found.warnings)  # fmt: skip


def _verdict(
    found: FrictionSolution | ModelSolution, full: bool, time_limit: TimeLimit
) -> Uniqueness | None:
    """The verdict, or its cheap part; None where the problem is too large for that.

    None also for large deformations: that of the tangent problem would say little; and for
    Nitsche's method, which has no reactions to speak of.
    """
    if isinstance(found, ModelSolution) and found.model.contacts[0].nitsche is not None:
        if full:
            raise UnsupportedForm(f"--uniqueness: {NO_MULTIPLIERS}")
        return None
    if isinstance(found, ModelSolution) and found.model.is_large:
        if full:
            raise UnsupportedForm("--uniqueness: there is no verdict on large deformations")
        return None
    solution = found.solution if isinstance(found, ModelSolution) else found
    if full:
        known = solution if solution.converged else None
        return assess(solution.problem, known, time_limit=time_limit)
    return quick_verdict(solution.problem)


def _report(
    result: output.Output, verdict: Uniqueness | None, full: bool, folder: Path
) -> None:
    click.echo(in_words(output.describe(result)))
    model = result.model
    if model is None or not (model.is_large or model.contacts[0].nitsche is not None):
        click.echo(describe(verdict) if full and verdict is not None else brief(verdict))
    say_when(model)
    click.echo(f"results in {folder}/")


def _finish(found: FrictionSolution | ModelSolution) -> int:
    """Exit code; what went wrong, and what to do about it, goes to stderr."""
    record = found.convergence
    if record.outcome is Outcome.CONVERGED:
        return 0
    sys.stdout.flush()
    name = record.outcome.name.lower().replace("_", " ")
    detail = f" ({in_words(record.detail)})" if record.detail else ""
    click.echo(
        f"Not converged: {name}{detail}, {record.errors}. {record.advice}", err=True
    )
    return INTERRUPTED if record.by_user else 1
