"""Options of commands that write into a folder: where, and whether a report too."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import click


def results_folder(
    default: str, *, only_report: bool = False, asked: bool = False
) -> Callable[[Any], Any]:
    """The options -o and --report; only_report: nothing else is written into the folder.

    asked: nothing is written without one of them.
    """
    what = "report" if only_report else "results"

    def add(command: Any) -> Any:
        page = click.option(
            "--report", is_flag=True,
            help="Write report.html too: the result as a page that turns, without a network.",
        )  # fmt: skip
        none = "none, with --report " if asked else ""
        place = click.option(
            "-o", "--output", "folder", metavar="DIR",
            help=f"Folder for the {what}. [{none}{default}]",
        )  # fmt: skip
        return place(page(command))

    return add
