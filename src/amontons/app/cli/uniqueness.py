"""`amontons uniqueness`: whether there is one solution, and from which friction on not."""

from __future__ import annotations

from collections.abc import Sequence

import click

from ...analysis.certificates.verdict import Uniqueness, Verdict
from ...analysis.paths.diagram import Diagram
from ...analysis.solutions.enumerate import Solutions
from ...core.errors import InvalidInput
from ...io.certificates import check_certificate, write_certificate
from ...io.results import to_json, verdict_record
from ...mechanics.model import Model
from ...problem.friction import FrictionProblem
from ..questions import uniqueness
from .sources import open_source
from .stopping import ending_early
from .terminal import check_writable, deliver_json, say_when

UNSETTLED = 1  # exit code


def run(
    source: str, overrides: Sequence[str], mu: float | None, time_limit: float | None,
    json_copy: str | None, certificate: str | None = None,
) -> int:  # fmt: skip
    """Assess, show; the exit code."""
    check_writable(json_copy, "--json")
    check_writable(certificate, "--certificate")
    if time_limit is not None and not time_limit > 0:
        raise InvalidInput(f"--time-limit: expected seconds > 0, got {time_limit}")
    opened = open_source(source, overrides)
    target = opened.target_with(mu)
    with ending_early() as stop:
        found = uniqueness(target, time_limit=time_limit)
    if json_copy != "-":
        click.echo(f"{opened.title}\n{found.in_full}")
        say_when(opened.target)
    if json_copy is not None:
        deliver_json(to_json(verdict_record(found)), json_copy)
    written = certificate is None or deliver_certificate(
        target, found, certificate, json_copy == "-"
    )
    if written and found.verdict is not Verdict.UNDECIDED:
        return 0
    return UNSETTLED if stop.received is None else stop.code


def deliver_certificate(
    target: Model | FrictionProblem, found: Uniqueness | Solutions | Diagram, path: str,
    err: bool, *, end: FrictionProblem | None = None,
) -> bool:  # fmt: skip
    """Write what proves an answer and say so, err: on stderr; False where nothing does.

    end: the problem at the other end of a diagram.
    """
    problem = target if isinstance(target, FrictionProblem) else target.assemble()
    try:
        claim = write_certificate(problem, found, path, end=end)
    except InvalidInput as reason:  # the answer stands
        click.echo(f"No certificate was written: {reason}", err=True)
        return False
    click.echo(f"{claim}: certificate in {path}; see amontons check", err=err)
    return True


def check(path: str) -> int:
    """Check a certificate, show what it proves; the exit code."""
    click.echo(check_certificate(path))
    return 0
