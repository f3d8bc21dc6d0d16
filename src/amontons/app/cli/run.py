"""`amontons run`: the steps of a case in time, written as they come, restartable."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING

import click

from ...core.clock import Deadline, now
from ...core.errors import FileFormatError, InvalidInput, NotConverged, NotWritten
from ...core.files import make_folder, remove_empty
from ...io.case import identity
from ...io.checkpoint import export_fclib, steps_of
from ...io.readers import Case
from ...mechanics.steps import Energies, QuasiStatic, TimeStep, at_rest, evolve
from ...mechanics.steps.stepping import at_end
from ...problem.solution import Outcome
from .doubts import Doubts
from .jumps import Jumps, check_rates
from .locking import locked
from .run_folder import BALANCE, PICTURES, WORKS, RunFolder, clear, continued, numbers_of
from .sources import open_source, with_flags
from .stopping import Stopping
from .terminal import REPORT, check_folder, say_growth, say_notes

if TYPE_CHECKING:
    from ...io.plots import Frame
    from ...io.report import Film


@dataclass(frozen=True)
class Wanted:
    """What is asked for beside the steps; time_limit in seconds, of all of them together."""

    time_limit: float | None = None
    every: int = 10
    pictures: bool = False
    quiet: bool = False
    report: bool = False
    restart: bool = False
    xdmf: bool = False
    export: str | None = None
    exported: list[range] | None = None  # the steps of export, None for all
    rates: bool = False


@dataclass
class _Run:
    """One call: the case, what was asked for, and the frames that are drawn at the end."""

    case: Case
    wanted: Wanted
    deadline: Deadline
    stop: Stopping
    frames: list[Frame] = field(default_factory=list)
    doubts: Doubts = field(default_factory=Doubts)
    jumps: Jumps | None = None  # where --rates asks for them
    film: Film | None = None  # of the report, where one is asked for
    failed: bool = False  # the step after the last one did not converge

    def unfinished(self, time: float) -> str:
        """What its pictures are stamped with where the last step at `time` is not the end."""
        assert self.case.evolution is not None
        if self.ended(time):
            return ""
        until = f"t = {time:.6g} of {self.case.evolution.until:g}"
        why = ", the next step did not converge" if self.failed else ""
        return f"NOT FINISHED ({until}{why})"

    def lines(self) -> list[str]:
        """What is said of all steps at the end."""
        return [*([] if self.jumps is None else self.jumps.lines()), *self.doubts.lines()]

    def ended(self, time: float) -> bool:
        """True for the time of the last step."""
        assert self.case.evolution is not None
        return at_end(time, self.case.evolution.until, self.case.evolution.method.step)


def run(
    case: str, overrides: Sequence[str], tolerance: float | None, time_limit: float | None,
    folder: str | None, export: str | None, every: int, pictures: bool, restart: bool,
    quiet: bool, export_steps: str | None = None, xdmf: bool = False, report: bool = False,
    rates: bool = False,
) -> int:  # fmt: skip
    """Read, step and write; returns the exit code."""
    if time_limit is not None and not time_limit > 0:
        raise InvalidInput(f"--time-limit: expected seconds > 0, got {time_limit}")
    chosen = _chosen(export, export_steps)
    wanted = Wanted(
        time_limit, every, pictures, quiet, report, restart, xdmf, export, chosen, rates
    )
    deadline = Deadline.after(time_limit)
    read = open_source(case, overrides)
    if read.evolution is None:
        raise FileFormatError(
            f"{case}: evolution: missing, expected a table with kind, step, until; one state "
            f"without time is found by: amontons solve {case}"
        )
    read = replace(read, settings=with_flags(read.settings, tolerance))
    return make_steps(read, folder, wanted, deadline)


def make_steps(read: Case, folder: str | None, wanted: Wanted, deadline: Deadline) -> int:
    """Make the steps of a case with an evolution, write as they come; the exit code."""
    place = check_folder(f"{read.name}-results" if folder is None else folder)
    export = wanted.export
    exported = None if export is None else check_folder(export, "--export-fclib")
    if wanted.rates:
        check_rates(read)
    with read.naming_keys():
        _ = read.in_time.discretisation, read.in_time.law
    if not wanted.quiet:
        say_notes(read.notes)
        say_growth(read)
    with Stopping() as stop, ExitStack() as stack:
        asked = _Run(read, wanted, deadline, stop)
        if wanted.report:
            from ...io.report import Film

            asked.film = Film(read.model)
        for each in {p.resolve(): p for p in (place, exported) if p is not None}.values():
            stack.callback(remove_empty, make_folder(each))
            stack.enter_context(locked(each))
            clear(each, read.name)
        try:
            with stop.breaking():
                results, steps = _prepared(asked, place)
        except KeyboardInterrupt:
            click.echo(f"{stop.word}.", err=True)
            return stop.code
        with _saying_what_is_safe(results), read.naming_keys():
            if exported is not None:
                steps = export_fclib(steps, exported, read.name, wanted.exported)
            return _follow(steps, results, asked)


def _chosen(export: str | None, steps: str | None) -> list[range] | None:
    """The steps of --export-steps, None for all."""
    if steps is None:
        return None
    if export is None:
        raise InvalidInput("--export-steps: needs --export-fclib DIR")
    try:
        return steps_of(steps)
    except InvalidInput as reason:
        raise InvalidInput(f"--export-steps: {reason.text}") from None


def _prepared(asked: _Run, place: Path) -> tuple[RunFolder, Iterator[TimeStep]]:
    """The folder of results and the steps, from the beginning or from the checkpoint."""
    read, wanted = asked.case, asked.wanted
    settings = read.settings
    assert read.evolution is not None
    case, numbers = identity(read), numbers_of(read.model)
    if wanted.restart:
        results, start, changed = continued(place, case, numbers, read.title, wanted.xdmf)
        for text in changed:
            click.echo(f"--restart: {text}, from step {start.index + 1} on", err=True)
    else:
        results = RunFolder(place, case, numbers, read.title, wanted.xdmf)
        start = at_rest(read.in_time)
    results.notes = read.notes
    steps = evolve(
        read.in_time, read.evolution.method, until=read.evolution.until, start=start,
        solver=settings.solver(), tolerance=settings.tolerance,
        contact_tolerance=settings.contact_tolerance, max_iterations=settings.max_iterations,
        time_limit=settings.time_limit,
        deadline=asked.deadline,
    )  # fmt: skip
    if not wanted.restart:
        results.save(start)
    asked.jumps = Jumps.after(start) if wanted.rates else None
    return results, steps


@contextmanager
def _saying_what_is_safe(results: RunFolder) -> Iterator[None]:
    try:
        yield
    except NotWritten as reason:
        raise NotWritten(
            f"{reason}; the state after step {results.saved} is safe, go on with --restart"
        ) from None


def _follow(steps: Iterator[TimeStep], results: RunFolder, asked: _Run) -> int:
    """Take the steps; the state is written whenever a picture is, and at the end."""
    last, code = None, 0
    try:
        while True:
            began = now()
            with asked.stop.breaking():
                step = next(steps, None)
            if step is None:
                break
            told = None
            if asked.jumps is not None:
                told = asked.jumps.note(step, quiet=asked.wanted.quiet)
            results.add(step, now() - began, told)
            last = step
            asked.doubts.note(step, quiet=asked.wanted.quiet)
            if asked.film is not None:
                asked.film.add(step)
            if step.state.index % asked.wanted.every == 0:
                _keep(step, results, asked)
            if not asked.wanted.quiet:
                _show(step, asked)
            if asked.stop.received is not None:  # where a library has swallowed it
                raise KeyboardInterrupt
            if asked.deadline.passed and not asked.ended(step.time):
                code = _stopped(asked, step.time)
                break
    except KeyboardInterrupt:
        click.echo(f"{asked.stop.word}; go on with --restart.", err=True)
        code = asked.stop.code
    except NotConverged as failure:
        code = _failed(failure, results, asked)
    except InvalidInput as reason:  # supports that push a node into what it meets
        if not isinstance(reason, NotWritten):
            _keep_last(last, results, asked)
        raise
    _keep_last(last, results, asked)
    if asked.frames:
        _draw(results, asked)
    if last is not None and asked.film is not None:
        _report(asked.film, results, asked)
    if not asked.wanted.quiet:
        _summary(results, asked)
        for line in asked.lines():
            click.echo(line)
    return code


def _failed(failure: NotConverged, results: RunFolder, asked: _Run) -> int:
    """Say why a step was not made; returns the exit code."""
    late = failure.solution.convergence.outcome is Outcome.TIME_LIMIT
    if late and asked.deadline.passed:
        time = results.rows[-1][1] if results.rows else 0.0
        return _stopped(asked, time)
    sys.stdout.flush()
    click.echo(f"Not converged: {failure}", err=True)
    asked.failed = True
    return 1


def _stopped(asked: _Run, time: float) -> int:
    """Say that the time of the run is over; returns the exit code."""
    assert asked.case.evolution is not None
    sys.stdout.flush()
    click.echo(
        f"Stopped by --time-limit {asked.wanted.time_limit:g} at t = {time:.6g} of "
        f"{asked.case.evolution.until:g}; go on with --restart.", err=True,
    )  # fmt: skip
    return 1


def _keep_last(last: TimeStep | None, results: RunFolder, asked: _Run) -> None:
    if last is not None and results.saved < last.state.index:
        _keep(last, results, asked)


def _keep(step: TimeStep, results: RunFolder, asked: _Run) -> None:
    """Write the picture of a step and its state."""
    results.draw(step)
    results.keep(step)
    if asked.wanted.pictures:
        from ...io.plots import Frame

        asked.frames.append(Frame.of(step))


def _draw(results: RunFolder, asked: _Run) -> None:
    """Pictures and film of the steps of this call, energies of all steps so far."""
    from ...io.plots import draw_film, energy_figure, save_figure

    table = results.table
    times = table["time"].tolist()
    note = asked.unfinished(times[-1])
    frames = [*asked.frames[:-1], replace(asked.frames[-1], stamp=note)]
    draw_film(asked.case.in_time, frames, results.folder / PICTURES)
    works = [Energies(*row) for row in table[list(WORKS)].tolist()]
    save_figure(energy_figure(times, works, note=note), results.folder / BALANCE)


def _report(film: Film, results: RunFolder, asked: _Run) -> None:
    """Write report.html: the states of this call, the table of all steps so far."""
    from ...io.report import run_page, save_page

    table, case = results.table, asked.case
    note = asked.unfinished(float(table["time"][-1]))
    told = (*asked.lines(), *case.notes)
    page = run_page(film, table, case.title, case.units, note, told)
    save_page(page, results.folder / REPORT)


def _show(step: TimeStep, asked: _Run) -> None:
    """A line per written step; on a terminal the steps between pass by on one line."""
    assert asked.case.evolution is not None
    told = step.state.index % asked.wanted.every == 0 or asked.ended(step.time)
    if told or (step.passage is not None and step.passage.jumped):
        click.echo(f"{'' if not sys.stdout.isatty() else chr(13)}{step}")
    elif sys.stdout.isatty():
        until = asked.case.evolution.until
        click.echo(f"\rt = {step.time:.6g} of {until:.6g} ", nl=False)


def _summary(results: RunFolder, asked: _Run) -> None:
    """Sums of all works, and where the results are."""
    assert asked.case.evolution is not None
    table = results.table
    if not len(table):
        return
    sums = results.works()
    rest = (
        f"missed by straight lines between the steps {sums['numerical']:.4g}"
        if isinstance(asked.case.evolution.method, QuasiStatic)
        else f"dissipated by damping {sums['damping']:.4g}, by the scheme "
        f"{sums['numerical']:.4g}"
    )
    click.echo(
        f"{len(table)} steps; work of loads {sums['loads']:.4g}, supports "
        f"{sums['supports']:.4g}, contact {sums['contact']:.4g}; {rest}; "
        f"gain {sums['gain']:.4g}, defect {sums['defect']:.1e}"
    )
    if not results.numbers:
        click.echo(
            f"{len(asked.case.model.contacts)} contact pairs are too many for columns of "
            "steps.csv; solution.json has those of the last step"
        )
    jumps = [f"{time:.6g}" for time in table["jump"] if time == time]
    if jumps:
        click.echo(f"jumps at t = {', '.join(jumps)}")
    click.echo(f"results in {results.folder}/")
