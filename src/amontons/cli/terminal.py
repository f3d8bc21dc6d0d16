"""What people read on a terminal."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Literal

import click
from rich.console import Console
from rich.table import Table

from ..errors import InvalidInput
from ..files import replacing


def show_table(
    title: str,
    columns: list[str],
    rows: list[list[str]],
    numbers: Literal["left", "right"] = "right",
) -> None:
    """Print a table on stdout; `numbers` is how all columns but the first are aligned."""
    table = Table(
        title=title, title_justify="left", title_style="bold", box=None, pad_edge=False
    )
    for k, column in enumerate(columns):
        table.add_column(column, justify="left" if k == 0 else numbers, overflow="fold")
    for row in rows:
        table.add_row(*row)
    wide = None if sys.stdout.isatty() else 200  # a file or a pipe needs no wrapping
    Console(width=wide, highlight=False).print(table)


def deliver_json(text: str, target: str | None) -> None:
    """Print JSON for "-", write it for a file name, nothing for None."""
    if target == "-":
        click.echo(text, nl=False)
    elif target is not None:
        with replacing(target) as temporary:
            temporary.write_text(text, encoding="utf-8")


def check_writable(target: Path | str | None) -> None:
    """Raise InvalidInput before the work, not after it, when a file can not be written."""
    if target is None or str(target) == "-":
        return
    path = Path(target)
    if path.is_dir():
        raise InvalidInput(f"{path}: expected the name of a file, this is a folder")
    if not path.parent.is_dir():
        raise InvalidInput(f"{path}: the folder {path.parent} does not exist")


def check_folder(path: Path) -> None:
    """Raise InvalidInput when a results folder can not be made."""
    for part in (path, *path.parents):
        if part.exists():
            if not part.is_dir():
                raise InvalidInput(f"{path}: expected a folder, {part} is a file")
            return
