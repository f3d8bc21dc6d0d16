"""Laws of contact of a deck: friction, pressure over overclosure, as numbers of a contact."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ...core.errors import InvalidInput
from ...problem.law import ExponentialOverclosure, OverclosureCurve
from .cards import Card, Row, number
from .materials import Interaction

TABLE = 60  # points of the law with a tension far away
SAME = 1e-9  # of numbers of a curve that are the same but for rounding


@dataclass(frozen=True)
class Options:
    """How a deck is read: cards that may be left out; hard: laws of overclosure too.

    small: strains, whatever NLGEOM says.  increments: of each step, in the place of what the
    deck says.
    """

    allow: tuple[str, ...] = ()
    hard: bool = False
    small: bool = False
    increments: int | None = None


def law_of(
    interaction: Interaction, *, options: Options, notes: list[str], nodal: bool = False
) -> dict[str, Any]:
    """Numbers of a contact; raises FileFormatError for a law of overclosure that is not read.

    nodal: LINEAR has a tension far away, which bends the line where contact begins.
    With the option `hard` all are hard and stick rigidly.
    """
    numbers: dict[str, Any] = {"mu": interaction.friction, "cap": interaction.limit}
    word, card = interaction.behaviour, interaction.behaviour_card or interaction.card
    if word not in LAWS:
        raise card.error(
            f"{word}: this law of pressure over overclosure is not read, expected one of "
            f"{', '.join(LAWS)}; --hard takes contact as hard and rigid"
        )
    if options.hard:
        if word != "HARD" or interaction.slope is not None:
            text = f"{card} (line {card.number}): contact is taken as hard and rigid, as asked"
            notes += [text] if text not in notes else []
        return numbers if word != "TIED" else {"tied": True}
    numbers |= LAWS[word](interaction, card, nodal)
    if interaction.slope is not None and (interaction.friction or word == "TIED"):
        numbers["stick_stiffness"] = interaction.slope
    if word == "TIED":
        numbers = {"tied": True} | {k: v for k, v in numbers.items() if k in BONDS}
    said = f"{card} (line {card.number}): {word}"
    if word != "HARD":
        said += f", {_told(numbers)}"
        notes += [said] if said not in notes else []
    return numbers


BONDS = ("stiffness", "stick_stiffness")


def _told(numbers: dict[str, Any]) -> str:
    """What of a law lets surfaces overlap or slip elastically, in words."""
    stiffness = numbers.get("stiffness")
    if stiffness is None:
        words = "rigid"
    elif isinstance(stiffness, float):
        words = f"{stiffness:g} of pressure over overclosure"
    else:
        words = "a curve of pressure over overclosure"
    slope = numbers.get("stick_stiffness")
    return words + ("" if slope is None else f", {slope:g} of shear over elastic slip")


def _values(interaction: Interaction, card: Card, least: int) -> tuple[list[float], Row]:
    """The numbers of the first line of a *SURFACE BEHAVIOR."""
    for row in interaction.values:
        if len(row.fields) < least:
            raise row.error(f"{card}: expected {least} numbers, got {len(row.fields)}")
        return [number(text, row, str(card)) for text in row.fields], row
    raise card.error(f"expected a line with {least} numbers, got none")


def _linear(interaction: Interaction, card: Card, nodal: bool) -> dict[str, Any]:
    """K, and for nodes the tension sigma that CalculiX has far away: a smooth corner.

    There p = K d (1/2 + atan(d / e) / pi) with e = pi sigma / K, of which p >= 0 is read.
    """
    values, _ = _values(interaction, card, 1)
    if not values[0] > 0:
        raise card.error("expected a stiffness > 0, pressure over overclosure")
    tension = values[1] if len(values) > 1 else 0.0
    if not nodal or not tension > 0:
        return {"stiffness": values[0]}
    return {"stiffness": bend(values[0], tension)}


def bend(stiffness: float, tension: float) -> OverclosureCurve:
    """The line of nodes with its smooth corner: stress / length, stress."""
    x = np.concatenate([[0.0], np.geomspace(1e-2, 1e4, TABLE)])
    width = np.pi * tension / stiffness
    pressure = np.pi * tension * x * (0.5 + np.arctan(x) / np.pi)
    return OverclosureCurve(pressure, width * x)


def bend_of(curve: OverclosureCurve) -> tuple[float, float] | None:
    """Stiffness and tension of a curve that `bend` has made, None of another one."""
    pressure, overclosure = np.asarray(curve.pressure), np.asarray(curve.overclosure)
    unit = bend(1.0, 1.0)
    if len(pressure) != len(np.asarray(unit.pressure)):
        return None
    tension = float(pressure[-1] / np.asarray(unit.pressure)[-1])
    stiffness = tension * float(np.asarray(unit.overclosure)[-1] / overclosure[-1])
    other = bend(stiffness, tension)
    same = np.allclose(pressure, other.pressure, rtol=SAME, atol=0.0) and np.allclose(
        overclosure, other.overclosure, rtol=SAME, atol=0.0
    )
    return (stiffness, tension) if same else None


def _exponential(interaction: Interaction, card: Card, nodal: bool) -> dict[str, Any]:
    """c0, p0 as CalculiX has them: a hundredth of p0 at the gap c0."""
    values, row = _values(interaction, card, 2)
    if not (values[0] > 0 and values[1] > 0):
        raise row.error(f"{card}: expected c0 > 0 and p0 > 0, got {values[:2]}")
    return {"stiffness": ExponentialOverclosure(values[1], values[0])}


def _tabular(interaction: Interaction, card: Card, nodal: bool) -> dict[str, Any]:
    """Lines of pressure, overclosure."""
    rows = []
    for row in interaction.values:
        if len(row.fields) != 2:
            raise row.error(f"{card}: expected pressure, overclosure, got {row.fields}")
        rows.append([number(text, row, str(card)) for text in row.fields])
    table = np.array(rows).reshape(-1, 2)
    try:
        return {"stiffness": OverclosureCurve(table[:, 0], table[:, 1])}
    except InvalidInput as reason:
        raise card.error(str(reason)) from None


def _tied(interaction: Interaction, card: Card, nodal: bool) -> dict[str, Any]:
    values, _ = _values(interaction, card, 1)
    if not values[0] > 0:
        raise card.error("expected a stiffness > 0, stress over the distance")
    return {"stiffness": values[0]}


LAWS = {"HARD": lambda *_: {}, "LINEAR": _linear, "EXPONENTIAL": _exponential,
        "TABULAR": _tabular, "TIED": _tied}  # fmt: skip
