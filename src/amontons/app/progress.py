"""A line that tells how far a solve is, on a terminal or in a notebook."""

from __future__ import annotations

import html
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from ..problem.solution import Step
from ..solvers.asked import Callback
from ..solvers.contract import Iterate

PAUSE = 0.1  # seconds: drawing takes longer than a small solve


@contextmanager
def progress(callback: Callback | None, tolerance: float) -> Iterator[Callback | None]:
    """The callback of the user, or one that shows each iterate where somebody may look."""
    if callback is not None:
        yield callback
    elif in_notebook():
        with _notebook() as draw:
            yield _telling(lambda stage, text: draw(f"{stage} {text}".strip()), tolerance)
    elif sys.stderr.isatty():
        from rich.console import Console

        with Console(stderr=True).status("solving …", refresh_per_second=8) as line:
            yield _telling(
                lambda stage, text: line.update(
                    (f"[dim]{stage}[/dim]  " if stage else "") + text
                ),
                tolerance,
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


def _telling(draw: Callable[[str, str], None], tolerance: float) -> Callback:
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
