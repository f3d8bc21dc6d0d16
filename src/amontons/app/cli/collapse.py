"""`amontons collapse`: bounds on the live load at which blocks give way."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import click

from ...core.errors import InvalidInput
from ...io.results import to_json, versions
from ..limits import collapse_load
from .sources import open_source
from .terminal import check_writable, deliver_json

if TYPE_CHECKING:
    from ...mechanics.model.parts import Load

SCHEMA = "amontons/collapse/1"
WIDE = 1  # exit code


def run(
    source: str, live: Sequence[str], traction: Sequence[str], overrides: Sequence[str],
    gap: float, time_limit: float | None, json_copy: str | None,
) -> int:  # fmt: skip
    """Find the bounds, show; the exit code."""
    check_writable(json_copy, "--json")
    if not 0 < gap < 1:
        raise InvalidInput(f"--gap: expected a number between 0 and 1, got {gap}")
    if time_limit is not None and not time_limit > 0:
        raise InvalidInput(f"--time-limit: expected seconds > 0, got {time_limit}")
    if not live and not traction:
        raise InvalidInput("expected a live load, --live 1,0 or --traction SURFACE=1,0")
    opened = open_source(source, overrides)
    if not opened.has_model:
        raise InvalidInput(f"{source}: expected a model; an FCLib problem has no bodies")
    loads = _loads(live, traction, opened.model.dimension)
    found = collapse_load(opened.model, loads, gap=gap, time_limit=time_limit)
    if json_copy != "-":
        click.echo(f"{opened.title}\n{found}")
    if json_copy is not None:
        record = {"schema": SCHEMA, "title": opened.title, **found.record}
        deliver_json(to_json({**record, "versions": versions()}), json_copy)
    return 0 if found.balanced and found.width <= gap * (1 + 1e-9) else WIDE


def _loads(live: Sequence[str], traction: Sequence[str], dimension: int) -> list[Load]:
    """Body forces and tractions of the flags."""
    from ...mechanics.model import BodyForce, Traction

    loads: list[Load] = []
    for text in live:
        region, _, words = text.rpartition("=")
        loads.append(BodyForce(_vector("--live", text, words, dimension), region or None))
    for text in traction:
        surface, _, words = text.rpartition("=")
        if not surface:
            raise InvalidInput(f"--traction {text}: expected SURFACE=X,Y")
        loads.append(Traction(surface, _vector("--traction", text, words, dimension)))
    return loads


def _vector(flag: str, text: str, words: str, dimension: int) -> tuple[float, ...]:
    try:
        found = tuple(float(word) for word in words.split(","))
    except ValueError:
        found = ()
    if len(found) != dimension:
        such = ",".join(["1", "0", "0"][:dimension])
        raise InvalidInput(
            f"{flag} {text}: expected {dimension} numbers with commas between, such as {such}"
        )
    return found
