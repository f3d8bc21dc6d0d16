"""How commands end: exit codes, and one clear message for a user's mistake."""

from __future__ import annotations

from typing import Any

import click

from ..errors import AmontonsError, TimeUp

UNFINISHED, BAD_INPUT, INTERRUPTED = 1, 2, 130


class Commands(click.Group):
    """A group whose commands return their exit code and may raise AmontonsError."""

    def invoke(self, ctx: click.Context) -> Any:
        """Run a command; a user's mistake becomes one message and exit code 2."""
        try:
            code = super().invoke(ctx)
        except TimeUp as error:
            click.echo(f"Not finished: {error}", err=True)
            ctx.exit(UNFINISHED)
        except AmontonsError as error:
            click.echo(f"Error: {printable(str(error))}", err=True)
            ctx.exit(BAD_INPUT)
        except MemoryError:
            click.echo("Error: not enough memory for this problem", err=True)
            ctx.exit(BAD_INPUT)
        except KeyboardInterrupt:
            click.echo("Interrupted.", err=True)
            ctx.exit(INTERRUPTED)
        ctx.exit(code if isinstance(code, int) else 0)


def printable(text: str) -> str:
    """The text without what a terminal can not show, such as bytes that are not UTF-8."""
    return text.encode("utf-8", "backslashreplace").decode("utf-8")
