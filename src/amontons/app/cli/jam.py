"""`amontons jam`: the smallest friction that locks a state in without load."""

from __future__ import annotations

from collections.abc import Sequence

import click

from ...core.errors import InvalidInput
from ...io.results import to_json, versions
from ..limits import jamming_friction
from .sources import open_source
from .terminal import check_writable, deliver_json

SCHEMA = "amontons/jam/1"
UNSETTLED = 1  # exit code


def run(
    source: str, overrides: Sequence[str], time_limit: float | None, json_copy: str | None
) -> int:
    """Find the bounds, show; the exit code."""
    check_writable(json_copy, "--json")
    if time_limit is not None and not time_limit > 0:
        raise InvalidInput(f"--time-limit: expected seconds > 0, got {time_limit}")
    opened = open_source(source, overrides)
    found = jamming_friction(opened.target_with(None), time_limit=time_limit)
    if json_copy != "-":
        click.echo(f"{opened.title}\n{found}")
    if json_copy is not None:
        record = {"schema": SCHEMA, "title": opened.title, **found.record}
        deliver_json(to_json({**record, "versions": versions()}), json_copy)
    return 0 if found.every else UNSETTLED
