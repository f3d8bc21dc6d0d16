"""What people read on a terminal."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import click

from ...core.errors import InvalidInput
from ...core.files import made, write_bytes
from ...problem.friction import FrictionProblem

if TYPE_CHECKING:
    from ...io.readers import Case
    from ...io.report import Page
    from ...mechanics.model import Model


REPORT = "report.html"


def show_table(
    title: str,
    columns: list[str],
    rows: list[list[str]],
    numbers: Literal["left", "right"] = "right",
) -> None:
    """Print a table on stdout; `numbers` is how all columns but the first are aligned."""
    from rich.console import Console
    from rich.table import Table

    table = Table(
        title=title, title_justify="left", title_style="bold", box=None, pad_edge=False
    )
    for k, column in enumerate(columns):
        table.add_column(column, justify="left" if k == 0 else numbers, overflow="fold")
    for row in rows:
        table.add_row(*row)
    wide = None if sys.stdout.isatty() else 200  # a file or a pipe needs no wrapping
    console = Console(width=wide, highlight=False)
    with console.capture() as printed:
        console.print(table)
    click.echo("\n".join(line.rstrip() for line in printed.get().splitlines()))


def say_when(model: Model | FrictionProblem | None) -> None:
    """Print at which time values of a model were taken that depend on it."""
    if model is None or isinstance(model, FrictionProblem):
        return
    from ...mechanics.steps.timed import depends_on_time

    if depends_on_time(model):
        click.echo("supports or loads depend on the time t: this is t = 0; `amontons follow` "
                   "traces solutions over t, `amontons run` takes steps in time")  # fmt: skip


def say_growth(case: Case) -> None:
    """Print how the loads of quasi-static steps come to act, where that may surprise."""
    from ...mechanics.steps import QuasiStatic
    from ...mechanics.steps.timed import growth_in_words

    assert case.evolution is not None
    words = growth_in_words(case.in_time)
    if words and isinstance(case.evolution.method, QuasiStatic):
        click.echo(words)


def say_notes(notes: Sequence[str]) -> None:
    """Print what a case leaves out of its file, or has found, a line for each."""
    for note in notes:
        click.echo(f"note: {note}")


def deliver_json(text: str, target: str | None) -> None:
    """Print JSON for "-", write it for a file name, nothing for None."""
    if target == "-":
        click.echo(text, nl=False)
    elif target is not None:
        write_bytes(target, text.encode("utf-8"))


def check_writable(
    target: Path | str | None, what: str = "file", suffixes: Sequence[str] = ()
) -> None:
    """Raise InvalidInput before the work, not after it, when a file can not be written."""
    if str(target) == "-" and sys.__stdout__ is None:
        raise InvalidInput(f"{what}: standard output is closed, expected the name of a file")
    if target is None or str(target) == "-":
        return
    if not str(target):
        raise InvalidInput(f"{what}: expected the name of a file, got an empty text")
    path = Path(target)
    if suffixes and path.suffix.lower() not in suffixes:
        raise InvalidInput(
            f"{path}: expected a name that ends in {' or '.join(suffixes)}, got {path.suffix!r}"
        )
    if os.path.isdir(path):
        raise InvalidInput(f"{path}: expected the name of a file, this is a folder")
    if not os.path.isdir(path.parent):
        raise InvalidInput(f"{path}: the folder {path.parent} does not exist")
    _check_name(path)


def _check_name(path: Path) -> None:
    """Raise InvalidInput for a name that the file system can not hold."""
    try:
        path.stat()
    except (FileNotFoundError, NotADirectoryError):
        return
    except (OSError, ValueError) as reason:
        shown = f"{str(path)[:60]}…" if len(str(path)) > 80 else str(path)
        raise InvalidInput(
            f"{shown}: can not be written: {getattr(reason, 'strerror', None) or reason}"
        ) from None


def report_folder(asked: bool, folder: str | None, default: str) -> Path | None:
    """Where --report writes, None where it is not asked for; -o needs it."""
    if asked:
        return check_folder(default if folder is None else folder)
    if folder is not None:
        raise InvalidInput("--output: this command writes into a folder with --report only")
    return None


def write_report(page: Page, folder: Path) -> None:
    """Write report.html into a folder, made if need be."""
    with made(folder):
        write_bytes(folder / REPORT, page.html.encode("utf-8"))


def check_folder(folder: str, what: str = "--output") -> Path:
    """The results folder; raises InvalidInput when it can not be made."""
    if not folder:
        raise InvalidInput(f"{what}: expected the name of a folder, got an empty text")
    path = Path(folder)
    _check_name(path)
    for part in (path, *path.parents):
        if part.exists():
            if not part.is_dir():
                raise InvalidInput(f"{path}: expected a folder, {part} is a file")
            return path
    return path
