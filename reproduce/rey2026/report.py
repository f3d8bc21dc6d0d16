"""Ours beside the paper's: every table as Markdown, with the share of cells that agree."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

TITLES = {"uzawa": "Uzawa", "nitsche": "Nitsche", "alart_curnier": "Alart-Curnier",
          "primal_dual": "primal-dual"}  # fmt: skip
WITHIN = 0.1  # relative difference up to which a printed error counts as ours


def agrees(ours: Mapping, paper: str | Mapping) -> bool:
    """Whether a cell is the printed one: the same kind, and the error where one is given."""
    if isinstance(paper, str):
        return ours["kind"] == paper
    printed = paper["slip_error"]  # the square of the energy norm
    near = abs(ours["error"] ** 2 - printed) <= WITHIN * printed
    return ours["kind"] == "slip" and near


def agreement(ours: Sequence[Sequence[Mapping]], paper: Mapping) -> tuple[int, int]:
    """Cells that agree, and all cells."""
    same = [agrees(a, b) for one, two in zip(ours, paper["cells"], strict=True)
            for a, b in zip(one, two, strict=True)]  # fmt: skip
    return sum(same), len(same)


def map_table(name: str, ours: Sequence[Sequence[Mapping]], paper: Mapping) -> list[str]:
    """A table of cells; where they differ, ours and the paper's in brackets."""
    same, every = agreement(ours, paper)
    symbol = {"u": "u^0", "lambda": "λ^0", "r": "r^0"}[paper["start"]]
    title = f"{TITLES[paper['algorithm']]}, μ = {paper['mu']:g}, over {paper['parameter']}"
    lines = [f"## {name}: {title} and {symbol}", "", f"{same} of {every} cells agree.", "",
             "| | " + " | ".join(paper["heads"]) + " |",
             "|---" * (1 + len(paper["heads"])) + "|"]  # fmt: skip
    for value, one, two in zip(paper["values"], ours, paper["cells"], strict=True):
        lines.append(f"| {value:g} | " + " | ".join(map(_cell, one, two)) + " |")
    return [*lines, ""]


def _cell(ours: Mapping, paper: str | Mapping) -> str:
    printed = paper if isinstance(paper, str) else f"slip {paper['slip_error']:.1e}"
    mine = ours["kind"]
    if mine == "slip" and ours["error"] ** 2 > 1e-12:
        mine = f"slip {ours['error'] ** 2:.1e}"
    return mine if agrees(ours, paper) else f"**{mine}** ({printed})"


def count_table(name: str, ours: Mapping, paper: Mapping) -> list[str]:
    """How many of the random starts led to what, ours and the paper's in brackets."""
    counts, draws = ours["counts"], ours["draws"]
    kinds = [kind for kind in counts if any(counts[kind]) or kind in paper["counts"]]
    title = f"{TITLES[paper['algorithm']]}, μ = {paper['mu']:g}"
    values = " | ".join(f"{value:g}" for value in paper["values"])
    lines = [f"## {name}: {title}, {draws} random starts (paper {paper['draws']})", "",
             f"| {paper['parameter']} | {values} |",
             "|---" * (1 + len(paper["values"])) + "|"]  # fmt: skip
    for kind in kinds:
        printed = paper["counts"].get(kind, [0] * len(paper["values"]))
        pairs = [f"{a} ({b})" for a, b in zip(counts[kind], printed, strict=True)]
        lines.append(f"| {kind} | " + " | ".join(pairs) + " |")
    return [*lines, ""]


def summary(record: Mapping, paper: Mapping) -> list[str]:
    """Cells that agree in every table of cells, and in all."""
    lines = ["## Agreement", "", "| table | cells | agree |", "|---|---|---|"]
    total = [0, 0]
    for name, table in paper.items():
        if "cells" not in table or name not in record:
            continue
        same, every = agreement(record[name], table)
        total = [total[0] + same, total[1] + every]
        lines.append(f"| {name} | {every} | {same} |")
    return [*lines, f"| all | {total[1]} | {total[0]} |", ""]
