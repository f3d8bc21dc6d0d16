"""`amontons uniqueness`: whether there is one solution, and from which friction on not."""

from __future__ import annotations

from collections.abc import Sequence

import click

from ...analysis.certificates.verdict import Verdict
from ...core.errors import InvalidInput
from ...io.certificates import check_certificate, write_certificate
from ...io.results import to_json, verdict_record
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
    if certificate is not None:
        problem = target if isinstance(target, FrictionProblem) else target.assemble()
        try:
            claim = write_certificate(problem, found, certificate)
        except InvalidInput as reason:  # the verdict stands
            click.echo(f"No certificate was written: {reason}", err=True)
            return UNSETTLED
        click.echo(f"{claim}: certificate in {certificate}; see amontons check",
                   err=json_copy == "-")  # fmt: skip
    if found.verdict is not Verdict.UNDECIDED:
        return 0
    return UNSETTLED if stop.received is None else stop.code


def check(path: str) -> int:
    """Check a certificate, show what it proves; the exit code."""
    click.echo(check_certificate(path))
    return 0
