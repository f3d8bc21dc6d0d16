"""How commands end: exit codes, and one clear message for a user's mistake."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from contextlib import suppress
from functools import cache
from typing import Any

import click

from ...core.errors import AmontonsError, TimeUp
from ...core.telling import telling
from ...core.words import nearest
from .streams import open_missing, printed

UNFINISHED, BAD_INPUT, INTERRUPTED = 1, 2, 130  # the last as shells tell of signals


def _use_threads(_context: click.Context, _option: click.Parameter, count: int | None) -> None:
    if count is not None:
        from ...core.threads import threads

        threads(count)


class Commands(click.Group):
    """A group whose commands return their exit code and may raise AmontonsError."""

    def add_command(self, cmd: click.Command, name: str | None = None) -> None:
        """Every command can be told how many threads it may use."""
        cmd.params.append(
            click.Option(
                ["--threads"], type=click.IntRange(1, 256), metavar="N", expose_value=False,
                callback=_use_threads, help="Threads for large problems; results do not depend "
                "on it. [AMONTONS_THREADS, OMP_NUM_THREADS, or the cores, 16 at most]",
            )  # fmt: skip
        )
        super().add_command(cmd, name)

    def main(self, args: Sequence[str] | None = None, *more: Any, **options: Any) -> Any:
        """Run and exit; that something could not be printed is said on stderr."""
        if not options.pop("standalone_mode", True):
            return super().main(args, *more, standalone_mode=False, **options)
        open_missing()
        try:
            code = super().main(args, *more, standalone_mode=False, **options)
        except click.ClickException as error:
            _say(error.show)
            code = error.exit_code
        except (click.Abort, KeyboardInterrupt):
            _say_line("Interrupted.")
            code = INTERRUPTED
        reason = printed()
        if reason is not None:
            _say_line(f"Error: standard output: can not be written: {reason}")
            code = BAD_INPUT
        sys.exit(code if isinstance(code, int) else 0)

    def resolve_command(self, ctx: click.Context, args: list[str]) -> Any:
        """The command of the first word; an unknown one is answered with the nearest."""
        if args and self.get_command(ctx, args[0]) is None and not args[0].startswith("-"):
            ctx.fail(f"No such command {args[0]!r}{nearest(args[0], self.list_commands(ctx))}")
        return super().resolve_command(ctx, args)

    def invoke(self, ctx: click.Context) -> Any:
        """Run a command; a user's mistake becomes one message and exit code 2."""
        try:
            with telling(_say_compiling):
                code = super().invoke(ctx)
        except TimeUp as error:
            _say_line(f"Not finished: {printable(str(error))}")
            ctx.exit(UNFINISHED)
        except AmontonsError as error:
            _say_line(f"Error: {printable(str(error))}")
            ctx.exit(BAD_INPUT)
        except MemoryError:
            _say_line("Error: not enough memory for this problem")
            ctx.exit(BAD_INPUT)
        except KeyboardInterrupt:
            _say_line("Interrupted.")
            ctx.exit(INTERRUPTED)
        ctx.exit(code if isinstance(code, int) else 0)


@cache
def _say_compiling() -> None:
    """Say once on a terminal what takes some seconds; in time reported it is apart anyway."""
    if not sys.stderr.isatty():
        return
    from ...core.compiled import why_compiling

    _say_line(f"compiling kernels once, some seconds ({why_compiling()})")


def _say_line(text: str) -> None:
    _say(lambda: click.echo(text, err=True))


def _say(show: Any) -> None:
    """Print on stderr, if anybody can read it."""
    with suppress(OSError):
        show()


def printable(text: str) -> str:
    """The text without what a terminal can not show, such as bytes that are not UTF-8."""
    return text.encode("utf-8", "backslashreplace").decode("utf-8")
