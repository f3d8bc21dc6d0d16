"""`amontons run`: the steps of a case in time, written as they come, restartable."""

from __future__ import annotations

import csv
import sys
from collections.abc import Iterator, Sequence
from dataclasses import fields as fields_of
from pathlib import Path
from typing import TYPE_CHECKING

import click

from .. import clock
from ..case import Case, read_case
from ..checkpoint import export_fclib, load_state, save_state
from ..errors import FileFormatError, NotConverged
from ..evolution import Energies, State, TimeStep, evolve
from ..files import make_folder, replacing
from ..solution import ContactStatus
from ..vtk import write_model
from .doubts import Doubts
from .group import INTERRUPTED
from .sources import case_file, naming_keys, with_flags
from .terminal import check_folder, say_growth

if TYPE_CHECKING:
    from ..plots import Frame

WORKS = tuple(field.name for field in fields_of(Energies))
COLUMNS = ("index", "time", "open", "slip", "stick", *WORKS, "defect", "iterations", "error",
           "seconds", "jump")  # fmt: skip


def run(
    case: str, overrides: Sequence[str], tolerance: float | None, folder: str | None,
    export: str | None, every: int, pictures: bool, restart: bool, quiet: bool,
) -> int:  # fmt: skip
    """Step and write; returns the exit code."""
    path = case_file(case)
    read = read_case(path, overrides)
    if read.evolution is None:
        raise FileFormatError(
            f"{case}: evolution: missing, expected a table with kind, step, until; one state "
            f"without time is found by: amontons solve {case}"
        )
    place = check_folder(f"{path.stem}-results" if folder is None else folder)
    exported = None if export is None else check_folder(export, "--export-fclib")
    with naming_keys(read.model, str(path)):
        _ = read.model.discretisation, read.model.law
    start = load_state(place / "state.h5") if restart else None
    if not quiet:
        say_growth(read)
    settings = with_flags(read.settings, None, tolerance)
    steps = evolve(
        read.model, read.evolution.method, until=read.evolution.until, start=start,
        solver=settings.solver(), tolerance=settings.tolerance,
    )  # fmt: skip
    steps = export_fclib(steps, exported, path.stem) if exported is not None else steps
    return _follow(steps, read, place, start, every, pictures=pictures, quiet=quiet)


def _follow(
    steps: Iterator[TimeStep], case: Case, folder: Path, start: State | None, every: int,
    *, pictures: bool, quiet: bool,
) -> int:  # fmt: skip
    """Take the steps; the state is written whenever a picture is, and at the end."""
    assert case.evolution is not None
    make_folder(folder)
    rows = _old_rows(folder / "steps.csv", start)
    written, frames = _old_pictures(folder, start), []
    last: TimeStep | None = None
    doubts = Doubts()
    try:
        began = clock.now()
        for step in steps:
            now = clock.now()
            rows.append(_row(step, now - began))
            began, last = now, step
            doubts.note(step, quiet=quiet)
            if step.state.index % every == 0:
                written.append(_write(step, folder))
                _save(step, rows, written, folder)
                frames += _frames(step) if pictures else []
            if not quiet:
                _show(step, case.evolution.until, every)
    except NotConverged as problem:
        sys.stdout.flush()
        click.echo(f"Not converged: {problem}", err=True)
        code = 1
    except KeyboardInterrupt:
        click.echo("Interrupted; go on with --restart.", err=True)
        code = INTERRUPTED
    else:
        code = 0
    if last is not None:
        if not written or written[-1][0] != last.time:
            written.append(_write(last, folder))
            frames += _frames(last) if pictures else []
        _save(last, rows, written, folder)
        if pictures:
            _draw(case, frames, rows, folder)
    if not quiet:
        _summary(rows, folder)
        for line in doubts.lines():
            click.echo(line)
    return code


def _frames(step: TimeStep) -> list[Frame]:
    """The frame of a step, in a list; matplotlib loads here."""
    from ..plots import Frame

    return [Frame.of(step)]


def _draw(case: Case, frames: list[Frame], rows: list[list], folder: Path) -> None:
    """Pictures and film of the steps of this call, energies of all steps so far."""
    from ..plots import draw_film, energy_figure

    draw_film(case.model, frames, folder / "pictures")
    works = [Energies(*map(float, row[5 : 5 + len(WORKS)])) for row in rows]
    with replacing(folder / "energy.png") as temporary:
        energy_figure([float(row[1]) for row in rows], works).savefig(temporary, format="png")


def _row(step: TimeStep, seconds: float) -> list:
    e, record = step.energies, step.solution.convergence
    counts = [int((step.status == status).sum()) for status in ContactStatus]
    return [step.state.index, step.time, *counts, *(getattr(e, name) for name in WORKS),
            e.defect, record.iterations, record.error, seconds, _jump(step)]  # fmt: skip


def _jump(step: TimeStep) -> float | str:
    """The time at which the body jumped, empty where it did not or no path was followed."""
    return step.passage.folds[0] if step.passage is not None and step.passage.jumped else ""


def _old_rows(path: Path, start: State | None) -> list[list]:
    """Rows of the evolution that is continued, up to its state."""
    if start is None or not path.is_file():
        return []
    with path.open(newline="", encoding="utf-8") as file:
        rows = list(csv.reader(file))[1:]
    return [row for row in rows if row and int(row[0]) <= start.index]


def _old_pictures(folder: Path, start: State | None) -> list[tuple[float, str]]:
    rows = _old_rows(folder / "steps.csv", start)
    named = ((float(row[1]), f"step-{int(row[0]):05d}.vtu") for row in rows)
    return [(when, name) for when, name in named if (folder / name).is_file()]


def _write(step: TimeStep, folder: Path) -> tuple[float, str]:
    """One VTK file of a step: its time and name."""
    name = f"step-{step.state.index:05d}.vtu"
    with replacing(folder / name) as temporary:
        write_model(step.model, step.fields, step, temporary)  # type: ignore[arg-type]
    return step.time, name


def _save(
    step: TimeStep, rows: list[list], pictures: list[tuple[float, str]], folder: Path
) -> None:
    """State, table of energies, and the list of pictures that ParaView opens."""
    save_state(folder / "state.h5", step.state)
    with replacing(folder / "steps.csv") as temporary:
        with temporary.open("w", newline="", encoding="utf-8") as file:
            csv.writer(file).writerows([COLUMNS, *rows])
    entries = "\n".join(
        f'    <DataSet timestep="{when:.12g}" file="{name}"/>' for when, name in pictures
    )
    text = (
        '<?xml version="1.0"?>\n<VTKFile type="Collection" version="0.1">\n  <Collection>\n'
        f"{entries}\n  </Collection>\n</VTKFile>\n"
    )
    with replacing(folder / "steps.pvd") as temporary:
        temporary.write_text(text, encoding="utf-8")


def _show(step: TimeStep, until: float, every: int) -> None:
    """A line per written step; on a terminal the steps between pass by on one line."""
    told = step.state.index % every == 0 or step.time >= until * (1 - 1e-9)
    if told or (step.passage is not None and step.passage.jumped):
        click.echo(f"{'' if not sys.stdout.isatty() else chr(13)}{step}")
    elif sys.stdout.isatty():
        click.echo(f"\rt = {step.time:.6g} of {until:.6g} ", nl=False)


def _summary(rows: list[list], folder: Path) -> None:
    """Sums of all works, and where the results are."""
    if not rows:
        return
    sums = {name: sum(float(r[5 + k]) for r in rows) for k, name in enumerate(WORKS)}
    click.echo(
        f"{len(rows)} steps; work of loads {sums['loads']:.4g}, supports "
        f"{sums['supports']:.4g}, contact {sums['contact']:.4g}; dissipated by damping "
        f"{sums['damping']:.4g}, by the scheme {sums['numerical']:.4g}; "
        f"gain {sums['gain']:.4g}, "
        f"defect {sum(float(r[COLUMNS.index('defect')]) for r in rows):.1e}"
    )
    jumps = [f"{float(row[-1]):.6g}" for row in rows if row[-1] != ""]
    if jumps:
        click.echo(f"jumps at t = {', '.join(jumps)}")
    click.echo(f"results in {folder}/")
