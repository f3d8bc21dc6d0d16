"""A line that tells how far a solve or a search is, on a terminal or in a notebook."""

from __future__ import annotations

import html
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from typing import Any

from ..core.onlookers import Onlooker, anybody_looks, present
from ..problem.solution import Step
from ..solvers.asked import Callback
from ..solvers.contract import Iterate

Draw = Callable[[str, str], None]
PAUSE = 0.1  # seconds: drawing takes longer than a small solve


@contextmanager
def progress(callback: Callback | None, tolerance: float) -> Iterator[Callback | None]:
    """The callback of the user, or one that shows each iterate where somebody may look."""
    if callback is not None:
        yield callback
        return
    with _line("solving …") as draw:
        yield None if draw is None else _telling(draw, tolerance)


@contextmanager
def searching(verb: str) -> Iterator[None]:
    """Shows in which stage a search is, where somebody may look."""
    with ExitStack() as stack:
        draw = None if anybody_looks() else stack.enter_context(_line(f"{verb} …"))
        if draw is not None:
            stack.enter_context(present(Onlooker(_staging(draw, verb))))
        yield


@contextmanager
def _line(first: str) -> Iterator[Draw | None]:
    """What draws (stage, text) in a notebook or on a terminal; None where nobody looks."""
    if in_notebook():
        with _notebook() as draw:
            yield lambda stage, text: draw(f"{stage} {text}".strip())
    elif sys.stderr.isatty():
        from rich.console import Console

        with Console(stderr=True).status(first, refresh_per_second=8) as line:
            yield lambda stage, text: line.update(
                (f"[dim]{stage}[/dim]  " if stage else "") + text
            )
    else:
        yield None


def in_notebook() -> bool:
    """True in a kernel of Jupyter; IPython is not imported to find out."""
    module: Any = sys.modules.get("IPython")
    shell = None if module is None else module.get_ipython()
    return shell is not None and hasattr(shell, "kernel")


@contextmanager
def _notebook() -> Iterator[Callable[[str], None]]:
    """A line below the cell, which is gone when the solve has ended."""
    from IPython.display import HTML, display  # type: ignore[import-not-found]

    line = display(HTML(""), display_id=True)
    try:
        yield lambda text: line.update(HTML(f"<code>{html.escape(text)}</code>"))
    finally:
        line.update(HTML(""))


def _telling(draw: Draw, tolerance: float) -> Callback:
    shown = 0.0

    def show(step: Step, iterate: Iterate) -> None:
        nonlocal shown
        if step.seconds < shown + PAUSE:
            return
        shown = step.seconds
        draw(
            iterate.stage or "",
            f"iteration {step.iteration}  error {step.error:.1e} (goal {tolerance:.0e})  "
            f"{step.seconds:.1f} s",
        )

    return show


def _staging(draw: Draw, verb: str) -> Callable[[str], None]:
    began = shown = time.perf_counter()

    def show(stage: str) -> None:
        nonlocal shown
        moment = time.perf_counter()
        if moment >= shown + PAUSE:
            shown = moment
            draw(verb, f"{stage}  {moment - began:.1f} s".strip())

    return show
