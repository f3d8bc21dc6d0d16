"""Figures as files, drawn in memory."""

from __future__ import annotations

import os
from io import BytesIO
from pathlib import Path

from matplotlib.figure import Figure

from ...core.files import write_bytes


def picture(figure: Figure, suffix: str = ".png") -> bytes:
    """The bytes of a file that shows the figure; the suffix names its format."""
    drawn = BytesIO()
    figure.savefig(drawn, format=suffix.lower().removeprefix(".") or "png")
    return drawn.getvalue()


def spent_picture(figure: Figure) -> bytes:
    """The bytes of a PNG of a figure that is emptied then.

    Its artists hold each other: many figures would stay until the collector of garbage comes.
    """
    drawn = picture(figure)
    figure.clear()
    return drawn


def save_figure(figure: Figure, path: str | os.PathLike[str]) -> None:
    """Write a figure, complete or not at all; the suffix names the format."""
    write_bytes(path, picture(figure, Path(path).suffix))
