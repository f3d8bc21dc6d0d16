"""Ours beside the paper's: every table as Markdown, with the share of cells that agree."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

TITLES = {"uzawa": "Uzawa", "nitsche": "Nitsche", "alart_curnier": "Alart-Curnier",
          "primal_dual": "primal-dual"}  # fmt: skip
LEAST = 1e-6  # error below which rounding decides a rate
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
    mine = f"{ours['unheld']}, forces do not hold it" if ours.get("unheld") else ours["kind"]
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
        known = [*counts[kind], *["–"] * (len(printed) - len(counts[kind]))]
        pairs = [f"{a} ({b})" for a, b in zip(known, printed, strict=True)]
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


def enumeration(record: Mapping) -> list[str]:
    """Number of solutions over mu, section 5.1."""
    lines = ["## Number of solutions over μ = 0, 0.1, … 5 (section 5.1)", "",
             "Paper: 1 below μ = 3, 2 at 3, 3 above.", "",
             "| n_c | number of solutions | proved | slip solution at 3.5 |",
             "|---|---|---|---|"]  # fmt: skip
    for n_c, one in record.items():
        runs = [
            f"{count:g} for {first:g}" + (f" to {last:g}" if last > first else "")
            for first, last, count in one["runs"]
        ]
        proved = "all" if one["complete"] else "not all"
        words = " ".join(f"`{pattern}`" for pattern in one["slip at 3.5"])
        lines.append(f"| {n_c} | {', '.join(runs)} | {proved} | {words} |")
    return [*lines, ""]


def critical(record: Mapping, paper: Mapping) -> list[str]:
    """Critical coefficients, section 5.2."""
    lines = [
        "## mu_crit: critical coefficients, ours (paper)",
        "",
        "mu_P is printed there as the first failing multiple of 0.01.",
        "",
        "| n_c | mu_P | mu_c, full contact | proved for every load |",
        "|---|---|---|---|",
    ]
    for k, n_c in enumerate(paper["n_c"]):
        if str(n_c) in record:
            one = record[str(n_c)]
            lines.append(
                f"| {n_c} | {one['mu_P']:.4f} ({paper['mu_P'][k]:.2f}) | {one['mu_c']:.4f} "
                f"({paper['mu_c'][k]:.2f}) | {one['lower']:.4f} to {one['upper']:.4f} |"
            )
    return [*lines, ""]


def criteria(record: Mapping) -> list[str]:
    """Both criteria in 3D."""
    names = ("energy", "mu_P", "critical", "mu_c sharp", "mu_c", "mu_P given")
    lines = ["## criteria3d: the triangle extruded, critical coefficients in 3D", "",
             "Not in the paper. energy: the bound of `am.uniqueness` for every load in 3D; "
             "mu_P: friction discs and every choice of tangents; critical: from there on some "
             "load has several solutions; mu_c: c as printed; sharp: with the normal force "
             "alone; given: mu_P as printed, squares and the given tangents. The first three "
             "are safe, the others are not.", "",
             "| n_c | energy | mu_P | critical | mu_c, sharp | mu_c | mu_P, given tangents |",
             "|---|---|---|---|---|---|---|"]  # fmt: skip
    for n_c, one in record.items():
        cells = []
        for name in names:
            low, high = one[name] if name != "energy" else (one[name], one[name])
            same = high - low <= 1e-5 * high
            cells.append(f"{high:.4f}" if same else f"{low:.4f} to {high:.4f}")
        lines.append(f"| {n_c} | " + " | ".join(cells) + " |")
    return [*lines, ""]


def figure(record: Mapping) -> list[str]:
    """Figure 1 and the solutions that it shows."""
    lines = ["## Figure 1: n_c = 25, μ = 3.5", ""]
    for one in record["solutions"]:
        counts = ", ".join(f"{n} {word}" for word, n in one["counts"].items() if n)
        lines.append(f"- {counts}: energy {one['energy']:.4f}, error {one['error']:.0e}")
    proved = (
        "There is no other, with proof." if record["complete"] else "The list may lack some."
    )
    return [*lines, "", proved, "", "![Figure 1](figure1.png)", ""]


def refinement(record: Mapping) -> list[str]:
    """The slip solution over the mesh."""
    lines = ["## The slip solution over the mesh (structured, μ = 3.5)", "",
             "Energies; free has 0 and stick 4.1667 on every mesh.", "",
             "| n_c | pattern | energy |", "|---|---|---|"]  # fmt: skip
    for n_c, one in record.items():
        for pattern, energy in one["slip"]:
            lines.append(f"| {n_c} | `{pattern}` | {energy:.4f} |")
    return [*lines, ""]


def example(record: Mapping) -> list[str]:
    """c of section 5.2."""
    return ["## Section 5.2, one contact: c by its definition", "",
            "| | ours | paper |", "|---|---|---|",
            f"| without (F r)_N = 0 | {record['free']:.4f} | -0.4694 |",
            f"| with it | {record['held']:.4f} | 0.9103 |",
            f"| its friction | {record['mu']:.4f} | 2.2 |", "",
            "Without it the infimum is at tan θ = 3 / 6.6, where sin θ is 0.4138. Either is "
            "negative, which is what the paper concludes.", ""]  # fmt: skip


def kept(record: Sequence[Mapping]) -> list[str]:
    """Exact starts."""
    lines = ["## Exact r and v as a start: kept or not (n_c = 1)", "",
             "Three iterations of the algorithm from there, whatever a judge says. "
             "The paper: kept by all, but stick by Uzawa for large η only.", "",
             "| μ | algorithm | state | values | kept | left at |",
             "|---|---|---|---|---|---|"]  # fmt: skip
    for one in record:
        left = ", ".join(f"{value:g}" for value in one["left"])
        lines.append(f"| {one['mu']:g} | {TITLES[one['algorithm']]} | {one['state']} | "
                     f"{one['values']} | {one['values'] - len(one['left'])} | {left} |")
    return [*lines, ""]


def other(title: str, record: Mapping, paper: Mapping) -> list[str]:
    """Agreement of tables by another reading, beside that of the page."""
    lines = [f"## {title}", "", "| table | cells | agree | failed |", "|---|---|---|---|"]
    for name, rows in record.items():
        same, every = agreement(rows, paper[name])
        failed = sum(cell["kind"] == "fail" for row in rows for cell in row)
        lines.append(f"| {name} | {every} | {same} | {failed} |")
    return [*lines, ""]


def readings(record: Mapping, paper: Mapping) -> list[str]:
    """Nitsche's random starts by four readings, in one table: free/stick/slip/fail."""
    values = paper["nitsche_multidof"]["values"]
    lines = ["## Nitsche from random starts: what of u^0 is random, and how", "",
             "Of so many draws free / stick / slip / other / failed.", "",
             "| table: reading | draws | " + " | ".join(f"κ = {v:g}" for v in values) + " |",
             "|---" * (2 + len(values)) + "|"]  # fmt: skip
    for name, one in record.items():
        rows = zip(*(one["counts"][k] for k in ("free", "stick", "slip", "other", "fail")),
                   strict=True)  # fmt: skip
        cells = [" / ".join(map(str, row)) for row in rows]
        cells += ["–"] * (len(values) - len(cells))
        lines.append(f"| {name} | {one['draws']} | " + " | ".join(cells) + " |")
    return [*lines, ""]


def meshes(record: Mapping, values: Sequence[float]) -> list[str]:
    """Where primal-dual switches from free to stick, over the mesh."""
    heads = " | ".join(f"α = {v:g}" for v in values)
    lines = ["## Primal-dual at μ = 3.5 over the mesh: free ends", "",
             f"| n_c | unknowns | λ_min | draws | {heads} |",
             "|---" * (4 + len(values)) + "|"]  # fmt: skip
    for n_c, one in record.items():
        free = [*map(str, one["free"]), *["–"] * (len(values) - len(one["free"]))]
        row = [n_c, str(one["unknowns"]), f"{one['lambda_min']:.2e}", str(one["draws"]), *free]
        lines.append("| " + " | ".join(row) + " |")
    return [*lines, ""]


def rate(record: Mapping, paper: Mapping) -> list[str]:
    """How Nitsche's slip solution tends to that of the nodal contact as kappa grows."""
    known = [(value, row[-1]["error"]) for value, row in
             zip(paper["values"], record, strict=True)
             if row[-1]["kind"] == "slip" and row[-1]["error"] > LEAST]  # fmt: skip
    lines = ["## Nitsche's energetic error over κ (last column of nitsche_35)", "",
             "| κ | squared energy norm | rate in κ |", "|---|---|---|"]  # fmt: skip
    for k, (kappa, error) in enumerate(known):
        slope = ""
        if k:
            before, worse = known[k - 1]
            slope = f"{2 * math.log(error / worse) / math.log(kappa / before):.2f}"
        lines.append(f"| {kappa:g} | {error**2:.1e} | {slope} |")
    return [*lines, ""]
