"""`amontons basins`: which solution each method finds, from many starts."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from typing import Any

import click

from ...analysis.basins.methods import BasinMethod, Maker, fields_of
from ...analysis.basins.study import Basins
from ...core.errors import InvalidInput
from ...core.words import shortened
from ...io.case import make_solver, method_class
from ...io.case.overrides import split_override
from ...io.results import FIGURES, to_json, versions
from .. import questions
from .contestants import Contestant, contestants
from .group import INTERRUPTED, UNFINISHED
from .sources import open_source
from .terminal import check_writable, deliver_json, say_when, show_table

NITSCHE = "nitsche"


def run(  # noqa: PLR0913
    source: str, overrides: Sequence[str], mu: float | None, methods: Sequence[str],
    parameters: Sequence[str], starts: str | None, draws: int, seed: int, tolerance: float,
    within: float, max_iterations: int | None, run_limit: float | None,
    time_limit: float | None, json_copy: str | None, picture: str | None, quiet: bool,
) -> int:  # fmt: skip
    """Run all, show, write; the exit code."""
    check_writable(json_copy, "--json")
    check_writable(picture, "--picture", FIGURES)
    opened = open_source(source, overrides)
    named, grid = _methods(methods), _grid(parameters)
    found = questions.basins(
        opened.target_with(mu), named, grid, _starts(starts), draws=draws, seed=seed,
        tolerance=tolerance, within=within, max_iterations=max_iterations,
        run_limit=run_limit, time_limit=time_limit,
        callback=None if quiet or json_copy == "-" else _progress,
    )  # fmt: skip
    _progress_ends()
    if json_copy != "-" and not quiet:
        _show(opened.title, found)
        say_when(opened.target)
    if json_copy is not None:
        deliver_json(to_json(record(found, opened.title)), json_copy)
    if picture is not None:
        from ...io.plots import basins_figure, save_figure

        save_figure(basins_figure(found, title=opened.title), picture)
    if found.finished:
        return 0
    return INTERRUPTED if "user" in found.ended else UNFINISHED


def record(found: Basins, title: str) -> dict[str, Any]:
    """What the JSON file holds."""
    return {**found.record(), "title": title, "versions": versions()}


def _methods(texts: Sequence[str]) -> dict[str, Any]:
    """The methods by name; words of options become values of their fields."""
    words = [word for text in texts for word in text.split(",")]
    solvers = ",".join(word for word in words if word.strip() != NITSCHE)
    found: dict[str, Any] = {}
    if solvers.strip(" ,") or not words:
        found = {each.name: _maker(each) for each in contestants([solvers])}
    if len(solvers.split(",")) < len(words) or not found:
        found[NITSCHE] = NITSCHE
    return found


def _maker(each: Contestant) -> Maker:
    """How the variants of a method are made of texts."""

    def make(values: dict[str, Any]) -> BasinMethod:
        solver = make_solver(each.method, {**each.options, **values})
        return BasinMethod(solver, each.name, values)

    return Maker(fields_of(method_class(each.method)), make)


def _grid(texts: Sequence[str]) -> dict[str, list[Any]]:
    """Values by field, of texts [METHOD.]FIELD=A,B,… as they are typed."""
    grid: dict[str, list[Any]] = {}
    for text in texts:
        key, sign, values = text.partition("=")
        words = [word.strip() for word in values.split(",") if word.strip()]
        if not sign or not key.strip() or not words:
            raise InvalidInput(
                f"--parameter {text}: expected FIELD=A,B,… or METHOD.FIELD=A,B,…, such as "
                "uzawa.rho=1,10,100"
            )
        if key.strip() in grid:
            raise InvalidInput(f"--parameter {text}: {key.strip()} stands there twice")
        grid[key.strip()] = [split_override(f"value={word}")[1] for word in words]
    return grid


def _starts(text: str | None) -> list[str] | None:
    """The kinds of --starts."""
    if text is None:
        return None
    words = [word.strip() for word in text.split(",") if word.strip()]
    if not words:
        raise InvalidInput(f"--starts: expected kinds with commas between them, got {text!r}")
    return words


def _progress(done: int, every: int) -> None:
    """How far it is, on one line that is overwritten; nothing where nobody looks."""
    if sys.stderr.isatty():
        click.echo(f"\r\x1b[Krun {done} of {every}", err=True, nl=False)


def _progress_ends() -> None:
    if sys.stderr.isatty():
        click.echo("\r\x1b[K", err=True, nl=False)


def _show(title: str, found: Basins) -> None:
    """The solutions, and a row per method and kind of start."""
    rows = [[s.name, shortened(s.pattern), f"{s.error:.1e}", s.source] for s in found.solutions]
    show_table(title, ["solution", "pattern", "error", ""], rows, numbers="left")
    proof = "there is no other" if found.complete else "there may be others"
    click.echo(f"{len(found.solutions)} known; {proof}: {found.reason}")
    kinds = list(dict.fromkeys(start.kind for start in found.starts))
    lines = []
    for k, method in enumerate(found.methods):
        for kind in kinds:
            counts = found.count(k, kind)
            lines.append([method.label, kind, *[str(n) if n else "·" for n in counts.values()]])
    show_table("What the runs found", ["method", "start", *found.names], lines)
    click.echo(f"{len(found.runs)} runs in {found.seconds:.3g} s, errors up to "
               f"{found.tolerance:g}")  # fmt: skip
    if found.missing:
        click.echo(f"{found.missing} runs are missing: {found.ended}")
