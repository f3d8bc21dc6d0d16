"""What the figures share: colours and marks of the statuses, units on axes, round numbers.

Colours are those of Okabe and Ito, which colour-blind readers can tell apart.  Figures are made
without pyplot: no global state, no display needed.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from matplotlib.lines import Line2D

from ..solution import ContactStatus

COLOURS = {
    ContactStatus.OPEN: "#C9D1D9",
    ContactStatus.SLIP: "#E69F00",
    ContactStatus.STICK: "#0072B2",
}
MARKERS = {ContactStatus.OPEN: "o", ContactStatus.SLIP: "^", ContactStatus.STICK: "s"}
INK = "#333333"


@dataclass(frozen=True)
class Units:
    """What the axes say; empty where only the reader knows."""

    length: str = ""
    time: str = ""
    energy: str = ""


UNKNOWN, SI = Units(), Units("m", "s", "J")


def with_unit(name: str, unit: str) -> str:
    """The label of an axis."""
    return f"{name} in {unit}" if unit else name


def status_marks(labels: Mapping[ContactStatus, str]) -> list[Line2D]:
    """The marks of the statuses, for a legend."""
    return [
        Line2D([], [], linestyle="", marker=MARKERS[status], label=label,
               color=COLOURS[status], markeredgecolor=INK)
        for status, label in labels.items()
    ]  # fmt: skip


def marker_size(count: int) -> float:
    """The area of one of so many marks, in square points."""
    return float(np.clip(4000 / max(count, 1), 8, 60))


def round_below(value: float) -> float:
    """The largest of 1, 2, 5 times a power of ten that is not above a value > 0."""
    power = 10.0 ** math.floor(math.log10(value))
    return float(max(k for k in (1, 2, 5) if k * power <= value * (1 + 1e-12))) * power
