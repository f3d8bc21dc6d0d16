"""`amontons enumerate`: all solutions of a problem, and whether there can be others."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import click
import numpy as np
from numpy.typing import NDArray

from ...analysis.solutions.enumerate import Solutions
from ...core.files import made, write_bytes
from ...core.words import shortened
from ...io.numbers import solutions_csv
from ...io.readers import Case
from ...io.results import FIGURES, to_json, versions
from ...problem.friction import FrictionProblem
from ...solvers import Iterate
from ...solvers.driver import drive
from ..questions import all_solutions
from .sources import open_source
from .stopping import ending_early
from .terminal import (
    check_folder,
    check_writable,
    deliver_json,
    say_when,
    show_table,
    write_report,
)
from .uniqueness import deliver_certificate

Array = NDArray[np.float64]
SCHEMA = "amontons/enumerate/1"
TABLE = "solutions.csv"
INCOMPLETE = 1  # exit code


def run(
    source: str, overrides: Sequence[str], mu: float | None, time_limit: float | None,
    json_copy: str | None, picture: str | None, report: bool = False,
    folder: str | None = None, certificate: str | None = None,
) -> int:  # fmt: skip
    """Search, show; the exit code."""
    check_writable(json_copy, "--json")
    check_writable(certificate, "--certificate")
    check_writable(picture, "--picture", FIGURES)
    opened = open_source(source, overrides)
    place = None
    if report or folder is not None:
        place = check_folder(f"{opened.name}-results" if folder is None else folder)
    problem = opened.discrete_with(mu)
    with ending_early() as stop:
        found = all_solutions(opened.target_with(mu), time_limit=time_limit,
                              keep_proof=certificate is not None)  # fmt: skip
    if json_copy != "-":
        _show(opened.title, found)
        say_when(opened.target)
    if json_copy is not None:
        deliver_json(to_json(record(found)), json_copy)
    if picture is not None:
        named = [
            f"{k}: orientation {s.orientation:+d}" for k, s in enumerate(found.solutions, 1)
        ]
        draw(opened, problem, [s.r for s in found.solutions], named, picture)
    if place is not None:
        _write(found, opened, problem, mu, place, report=report)
    written = certificate is None or deliver_certificate(
        problem, found, certificate, json_copy == "-"
    )
    if written and found.complete:
        return 0
    return INCOMPLETE if stop.received is None else stop.code


def _write(
    found: Solutions, opened: Case, problem: FrictionProblem, mu: float | None, place: Path, *,
    report: bool,
) -> None:  # fmt: skip
    """The folder: solutions.csv, and the page where that is asked for."""
    model: Any = opened.target_with(mu) if opened.has_model else None
    with made(place):
        write_bytes(place / TABLE, solutions_csv(found.solutions, problem.dimension, model))
        if report:
            from ...io.report import solutions_page

            page = solutions_page(found, opened.title, opened.units, problem, model)
            write_report(page, place)


def record(found: Solutions) -> dict[str, Any]:
    """What the JSON file holds."""
    solutions = [
        {"pattern": s.pattern, "touching": list(s.touching), "r": s.r.tolist(),
         "u": s.u.tolist(), "error": s.error, "orientation": s.orientation, "energy": s.energy,
         "freedom": s.freedom, "sole": s.sole, "at_least": s.at_least,
         "distance": s.distance}
        for s in found.solutions
    ]  # fmt: skip
    return {"schema": SCHEMA, "complete": found.complete, "reason": found.reason,
            "resolution": found.resolution, "examined": found.examined,
            "seconds": found.seconds, "solutions": solutions,
            "versions": versions()}  # fmt: skip


def draw(
    opened: Case, problem: FrictionProblem, reactions: Sequence[Array], names: Sequence[str],
    picture: str,
) -> None:  # fmt: skip
    """Solutions of a problem, given by their reactions, side by side."""
    from ...io.plots import save_figure, solutions_figure

    solutions = [drive(problem, start=Iterate(np.array(r))) for r in reactions]
    figure = solutions_figure(solutions, names, title=opened.title,
                              model=opened.model if opened.has_model else None)  # fmt: skip
    save_figure(figure, picture)


def _show(title: str, found: Solutions) -> None:
    rows = []
    for s in found.solutions:
        counts = [
            str(sum(s.pattern.count(letter) for letter in part)) for part in ("f", "s", "+-l")
        ]
        kind = "isolated" if s.freedom == 0 else f"a set of dimension {s.freedom}"
        rows.append(
            [
                shortened(s.pattern),
                *counts,
                f"{s.orientation:+d}",
                f"{s.energy:.5g}",
                f"{s.error:.1e}",
                kind,
            ]
        )
    show_table(
        title,
        ["pattern", "open", "stick", "slip", "orientation", "energy", "error", ""],
        rows,
    )
    count = f"{len(found)} solution" + ("s" if len(found) != 1 else "")
    sure = "there is no other" if found.complete else "there may be others"
    click.echo(f"{count}; {sure}: {found.reason}{found.resolved} "
               f"({found.examined} partial patterns, {found.seconds:.3g} s)")  # fmt: skip
