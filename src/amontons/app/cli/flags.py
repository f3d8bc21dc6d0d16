"""Options that several commands share."""

from __future__ import annotations

import json
from collections.abc import Callable
from functools import wraps
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
    """Of what has meshes: a picture of their surfaces."""
    picture = click.option("--picture", metavar="FILE",
                           help="Of a mesh, CAD file, case or deck: surfaces with numbers."
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


def rates(command: Command) -> Command:
    """Of steps in time: where a body can jump."""
    return click.option(
        "--rates", is_flag=True,
        help="Quasi-static: say of each step whether the body can jump in it, by the rates of "
        "contacts that slide or graze.",
    )(command)  # fmt: skip


def certificate(command: Command) -> Command:
    """Of what proves something: the proof as a file."""
    return click.option("--certificate", metavar="FILE",
                        help="What proves it, as an HDF5 file for amontons check."
                        )(command)  # fmt: skip


def of_decks(command: Command) -> Command:
    """Of what reads decks: what to leave out, and contact as hard as it can be.

    Stands next to the function: its settings join those of --set.
    """

    @wraps(command)
    def with_settings(
        *, allow: tuple[str, ...], hard: bool, overrides: tuple[str, ...], **options: Any
    ) -> Any:
        given = [f"deck.allow={json.dumps(allow)}"] if allow else []
        given += ["deck.hard=true"] if hard else []
        source = str(options.get("source", options.get("case")))
        if given and not source.lower().endswith((".inp", ".inp.gz")):
            flag = "--allow" if allow else "--hard"
            raise click.UsageError(f"{flag}: it is for decks (.inp), {source} is none")
        return command(overrides=(*overrides, *given), **options)

    allowed = click.option("--allow", multiple=True, metavar="KEYWORD",
                           help="Of a deck: go on without this keyword, at your risk, which "
                           "every result says; may be repeated.")  # fmt: skip
    rigid = click.option("--hard", is_flag=True,
                         help="Of a deck: hard contact and rigid sticking, whatever stiffness "
                         "it gives.")  # fmt: skip
    return allowed(rigid(with_settings))
