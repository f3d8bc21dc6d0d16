"""`amontons modes`: complex modes of small motions about a sliding state."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import click
import numpy as np

from ...core.errors import InvalidInput
from ...io.results import FIGURES, to_json, versions
from ..stability import modes
from .sources import open_source
from .terminal import check_writable, deliver_json

SCHEMA = "amontons/modes/1"
GROWS = 1  # exit code


def run(  # noqa: PLR0913
    source: str, overrides: Sequence[str], mu: float | None, count: int, near: float,
    velocity: str | None, flutter: bool, json_copy: str | None, picture: str | None,
) -> int:  # fmt: skip
    """Find modes, show; the exit code."""
    check_writable(json_copy, "--json")
    check_writable(picture, "--picture", FIGURES)
    opened = open_source(source, overrides)
    if not opened.has_model:
        raise InvalidInput(f"{source}: expected a model; an FCLib problem has no mass")
    target: Any = opened.target_with(mu)
    found = modes(target, count, near=near, velocity=_velocity(velocity))
    points = found.flutter() if flutter else None
    if json_copy != "-":
        click.echo(f"{opened.title}\n{found}")
        for point in points or ():
            click.echo(f"flutter from friction {point.mu:.7g} on, at {point.frequency:.7g}")
        for doubt in () if points is None else points.warnings:
            click.echo(str(doubt))
        if points is not None and np.isfinite(points.up_to):
            click.echo(f"flutter was looked for at frequencies up to {points.up_to:.4g}")
        if points == () and not points.warnings:
            click.echo("no flutter at any friction was found")
    if json_copy is not None:
        record = {"schema": SCHEMA, "title": opened.title, **found.record}
        record["flutter"] = None if points is None else [
            {"friction": p.mu, "frequency": p.frequency} for p in points
        ]  # fmt: skip
        up_to = np.inf if points is None else points.up_to
        record["flutter_looked_up_to"] = up_to if np.isfinite(up_to) else None
        record["warnings"] = [] if points is None else [w.record for w in points.warnings]
        deliver_json(to_json({**record, "versions": versions()}), json_copy)
    if picture is not None:
        found.plot(picture, title=opened.title)
    return 0 if found.stable else GROWS


def _velocity(text: str | None) -> tuple[float, ...] | None:
    if text is None:
        return None
    try:
        return tuple(float(word) for word in text.split(","))
    except ValueError:
        raise InvalidInput(
            f"--velocity {text}: expected numbers with commas between them, such as 1,0"
        ) from None
