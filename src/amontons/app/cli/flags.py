"""Options that several commands share."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import click

Command = Callable[..., Any]
FORMATS = ("png", "svg", "pdf", "none")


def figures(command: Command) -> Command:
    """Of commands that draw by themselves: in which format, or not at all."""
    none = click.option("--no-figures", "figures", flag_value="none", help="Draw nothing.")
    chosen = click.option("--figures", type=click.Choice(FORMATS), default="png",
                          show_default=True, help="Format of the figures.")  # fmt: skip
    return chosen(none(command))


def frd(command: Command) -> Command:
    """Of a solve: results for the viewers of CalculiX too."""
    text = "Write solution.frd too, for cgx and PrePoMax."
    return click.option("--frd", is_flag=True, help=text)(command)


def axes(command: Command) -> Command:
    """Of commands that draw branches: what over what, and in which format."""
    known = '"r_N 3", "sum r_T", "force x", "displacement y SURFACE", norm, arclength'
    up = click.option("--y", metavar="NAME",
                      help=f"What the figure shows: {known}. [sum r_N]")  # fmt: skip
    across = click.option("--x", metavar="NAME", help="Over what. [the parameter]")
    return across(up(figures(command)))


def surfaces(command: Command) -> Command:
    """Of what describes meshes: a picture of their surfaces."""
    picture = click.option("--picture", metavar="FILE",
                           help="Of a mesh or CAD file: its surfaces with numbers on them."
                           )  # fmt: skip
    size = click.option("--size", type=float, metavar="X",
                        help="Of a CAD file: size of cells. [a 15th of its length]"
                        )  # fmt: skip
    apart = click.option("--no-glue", is_flag=True,
                         help="Of a CAD file: each solid by itself, as with glue = false."
                         )  # fmt: skip
    return picture(size(apart(command)))


def fclib_error(command: Command) -> Command:
    """The published error where it costs something."""
    return click.option(
        "--fclib-error", is_flag=True,
        help="Put the published FCLib error into solution.json also where it takes a "
        "factorisation; it is for comparison only.",
    )(command)  # fmt: skip
