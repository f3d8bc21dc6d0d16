"""What agrees with the paper, what differs by its fault, what by ours: counts, from data."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

AGREES, PAPER, OURS = "agrees", "the paper's fault", "ours"
COPIED = {"uzawa_lam_35": "uzawa_lam", "nitsche_35": "nitsche"}  # columns printed twice


def cell_verdict(
    name: str, ours: Mapping, printed: str | Mapping, column: int, same: bool, paper: Mapping
) -> str:
    """Whose fault a cell of a table is.

    The paper's where it names by displacements alone what its forces do not hold, and where it
    prints for mu = 3.5 the column of mu = 3 letter by letter.
    """
    if same:
        return AGREES
    if ours.get("unheld") and ours["unheld"] == printed:
        return PAPER
    if name in COPIED and _copied(name, column, paper):
        return PAPER
    return OURS


def _copied(name: str, column: int, paper: Mapping) -> bool:
    here, there = ([row[column] for row in paper[n]["cells"]] for n in (name, COPIED[name]))
    return here == there


def of_cells(record: Mapping, paper: Mapping, agrees: object) -> list[str]:
    """A verdict per cell of all tables that are stored."""
    found = []
    for name, table in paper.items():
        if "cells" not in table or name not in record:
            continue
        for mine, printed in zip(record[name], table["cells"], strict=True):
            for k, (a, b) in enumerate(zip(mine, printed, strict=True)):
                found.append(cell_verdict(name, a, b, k, agrees(a, b), paper))  # type: ignore[operator]
    return found


def of_counts(record: Mapping, paper: Mapping) -> list[str]:
    """A verdict per column of the random starts: shares of all kinds, to one start in ten."""
    found = []
    for name, table in paper.items():
        if "counts" not in table or name not in record:
            continue
        counts, draws = record[name]["counts"], record[name]["draws"]
        for k in range(min(len(table["values"]), len(next(iter(counts.values()))))):
            far = max(
                abs(counts[kind][k] / draws - table["counts"].get(kind, [0] * 99)[k] / 100)
                for kind in counts
            )
            found.append(AGREES if far <= 0.1 else OURS)
    return found


def of_thresholds(record: Mapping, printed: Mapping) -> list[str]:
    """A verdict per critical coefficient; the meshes above n_c = 1 are not in the paper."""
    found = []
    for k, n_c in enumerate(printed["n_c"]):
        one = record.get("mu_crit", {}).get(str(n_c))
        if one is None:
            continue
        steps = math.ceil(100 * one["mu_P"] - 1e-6) / 100
        pairs = ((steps, printed["mu_P"][k]), (round(one["mu_c"], 2), printed["mu_c"][k]))
        found += [AGREES if abs(a - b) < 1e-9 else PAPER for a, b in pairs]
    return found


def line(record: Mapping, paper: Mapping, agrees: object) -> list[str]:
    """The first lines of the page."""
    parts = {
        "cells": of_cells(record, paper, agrees),
        "columns of random starts": of_counts(record, paper),
        "critical coefficients": of_thresholds(record, paper["mu_crit"]),
    }  # fmt: skip
    every = [verdict for found in parts.values() for verdict in found]
    lines = [f"**{in_words(every)}**", ""]
    lines += [f"- {len(found)} {name}: {in_words(found)}" for name, found in parts.items()]
    return [*lines, ""]


def in_words(verdicts: Sequence[str]) -> str:
    """The counts."""
    agree, paper, ours = (verdicts.count(kind) for kind in (AGREES, PAPER, OURS))
    return f"agrees {agree} / differs by the paper's fault {paper} / differs by ours {ours}"
