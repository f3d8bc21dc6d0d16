"""`amontons follow`: solution curves over the load or the friction, with folds and events."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import click

from ...analysis.paths.diagram import Diagram
from ...analysis.paths.path import Branch, Event, EventKind, Stop
from ...analysis.paths.quantities import csv_of
from ...core.errors import InvalidInput
from ...core.files import made, write_bytes
from ...core.words import shortened
from ...io.results import to_json, versions
from .. import questions
from .sources import open_source
from .terminal import (
    check_folder,
    check_writable,
    deliver_json,
    show_table,
    write_report,
)
from .uniqueness import deliver_certificate

SCHEMA = "amontons/follow/1"
UNFINISHED = 1  # exit code
FINISHED = (Stop.INTERVAL, Stop.CLOSED, Stop.JOINED, Stop.NOT_STARTED)
ALIASES = {"t": "load"}  # the time of loads that depend on it
ROWS = 30  # events that the table shows
SHOWN = 40  # letters of a pattern


def run(
    source: str, overrides: Sequence[str], parameter: str, low: float, high: float,
    mu: float | None, every: bool, max_points: int, time_limit: float | None,
    folder: str | None, json_copy: str | None, quiet: bool, figures: str = "png",
    x: str | None = None, y: str | None = None, report: bool = False,
    certificate: str | None = None,
) -> int:  # fmt: skip
    """Follow, write, show; the exit code."""
    check_writable(json_copy, "--json")
    check_writable(certificate, "--certificate")
    if certificate is not None and not every:
        raise InvalidInput("--certificate: expected --all with it, which is what is proved")
    opened = open_source(source, overrides)
    if not low < high:
        raise InvalidInput(f"--from, --to: expected a smaller and a larger number, got {low:g} "
                           f"and {high:g}")  # fmt: skip
    place = check_folder(f"{opened.name}-results" if folder is None else folder)
    target = opened.target if mu is None else opened.target.with_mu(mu)
    name = ALIASES.get(parameter, parameter)
    at: Sequence[float] = ()
    whole: tuple[float, float] | None = None
    undecided: Sequence[tuple[float, float]] = ()
    limits: dict[str, Any] = {"max_points": max_points, "time_limit": time_limit,
                              "options": opened.settings.continuation()}  # fmt: skip
    found: Diagram | None = None
    if every:
        found = questions.diagram(target, name, (low, high), **limits)
        branches, complete, reason = list(found), found.complete, found.reason
        at, whole, undecided = found.at, found.whole, found.undecided
    else:
        branches = [questions.follow(target, name, (low, high), **limits)]
        complete, reason = None, ""
    text = to_json(
        record(branches, parameter, (low, high), complete, reason, at, whole, undecided)
    )
    model: Any = opened.model if opened.has_model else None
    table = csv_of(branches, [name for name in (x, y) if name is not None], model)
    figure = None
    if branches and figures != "none":
        from ...io.plots import branch_figure

        figure = branch_figure(branches, x=x, y=y, model=model, title=opened.title)
    _write(place, text, table, figure, figures)
    if report:
        from ...io.report import curves_page

        shown: Any = target if opened.has_model else None
        write_report(curves_page(branches, opened.title, opened.units, shown, reason), place)
    if json_copy is not None:
        deliver_json(text, json_copy)
    if json_copy != "-" and not quiet:
        _show(opened.title, parameter, branches, reason, place)
    if certificate is not None and not _proved(found, low, high, certificate, json_copy == "-"):
        return UNFINISHED
    ended = all(stop in FINISHED for branch in branches for stop in branch.stops)
    return 0 if ended and complete is not False else UNFINISHED


def _proved(found: Diagram | None, low: float, high: float, path: str, err: bool) -> bool:
    """Write what proves a diagram and say so, err: on stderr; False where nothing does."""
    if found is None or not len(found):
        click.echo("No certificate was written: no solution was found", err=True)
        return False
    of: Any = found.branches[0].problem
    return deliver_certificate(of.at(low), found, path, err, end=of.at(high))


def record(
    branches: Sequence[Branch], parameter: str, interval: tuple[float, float],
    complete: bool | None, reason: str, at: Sequence[float] = (),
    whole: tuple[float, float] | None = None, undecided: Sequence[tuple[float, float]] = (),
) -> dict[str, Any]:  # fmt: skip
    """What follow.json holds; points and events name their branch.

    complete: all solutions at the values `at` are on these branches, which says nothing of the
    values between them; whole: the interval on which the same is proved of all values;
    undecided: parts of it, in 3D, for which it is not, where it is of the rest.
    """
    parts = [branch.record() for branch in branches]

    def rows(key: str) -> list[dict[str, Any]]:
        return [{"branch": k, **row} for k, part in enumerate(parts) for row in part[key]]

    return {
        "schema": SCHEMA, "parameter": parameter, "interval": list(interval),
        "points": rows("points"), "events": rows("events"),
        "branches": [
            {key: part[key] for key in ("stops", "closed", "warnings")} for part in parts
        ],
        "complete": complete, "at": list(at), "whole": None if whole is None else list(whole),
        "undecided": [list(span) for span in undecided], "reason": reason,
        "versions": versions(),
    }  # fmt: skip


def _write(place: Path, text: str, table: str, figure: Any, suffix: str) -> None:
    """All files, none before all of them are made."""
    with made(place):
        write_bytes(place / "follow.json", text.encode("utf-8"))
        write_bytes(place / "follow.csv", table.encode("utf-8"))
        if figure is not None:
            from ...io.plots import save_figure

            save_figure(figure, place / f"follow.{suffix}")


def _show(title: str, parameter: str, branches: list[Branch], reason: str, place: Path) -> None:
    events = [(k, e) for k, branch in enumerate(branches) for e in branch.events]
    shown = [item for item in events if item[1].kind is not EventKind.STATUS]
    rest = ROWS - len(shown)
    if len(events) - len(shown) <= rest:
        shown = events
    rows = [[str(k), e.kind.name.lower(), f"{e.parameter:.10g}", _way(e)] for k, e in shown]
    show_table(title, ["branch", "event", parameter, ""], rows, numbers="left")
    if len(shown) < len(events):
        click.echo(f"{len(events) - len(shown)} changes of status are in follow.json")
    for branch in branches:
        click.echo(str(branch))
    if reason:
        click.echo(reason)
    click.echo(f"results in {place}/")


def _way(event: Event) -> str:
    if event.stop is not None:
        return f"{event.stop.advice} {event.detail}".strip()
    words = [str(word) for word in (event.before, event.after) if word is not None]
    return " -> ".join(shortened(word, SHOWN) for word in words)
