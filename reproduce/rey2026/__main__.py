"""`python -m reproduce.rey2026`: the command line; see `README.md` for what it found."""

from __future__ import annotations

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")

import json
from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path
from types import ModuleType

import click

from ..record import check_parts, heading, regenerate
from . import (
    alart_curnier,
    extra,
    extruded,
    nitsche,
    primal_dual,
    report,
    solutions,
    uzawa,
    verdict,
)

HERE = Path(__file__).parent
PAPER: dict[str, dict] = json.loads((HERE / "paper.json").read_text())
# Each has cells(table): a row of Cell per entry of table["values"], in it one per entry of
# table["columns"]; and counts(table, draws, seed): {kind: [a number per entry of "values"]}.
ALGORITHMS: dict[str, ModuleType] = {
    "alart_curnier": alart_curnier,
    "nitsche": nitsche,
    "primal_dual": primal_dual,
    "uzawa": uzawa,
}
TABLES = [name for name, table in PAPER.items() if table.get("algorithm") in ALGORITHMS]
EXTRA = ("example", "kept", "symmetric", "integral", "strict", "readings", "meshes",
         "criteria3d")  # fmt: skip
PARTS = (*TABLES, "enumeration", "figure1", "refinement", "mu_crit", *EXTRA)
SEED = 2026


@click.command(context_settings={"help_option_names": ["-h", "--help"]})
@click.argument("parts", nargs=-1, metavar="[PART]...")
@click.option("--draws", default=100, show_default=True, help="Random starts, as in the paper.")
@click.option("--contacts", type=click.Choice(["50", "100"]), default="50", show_default=True,
              help="Contact nodes of random starts; 100 is not in the paper.")  # fmt: skip
@click.option(
    "--results", type=click.Path(path_type=Path), help="For tables and figures. [results/]"
)
def main(
    parts: tuple[str, ...], draws: int, contacts: str, results: Path | None
) -> None:  # fmt: skip
    """Which solution four algorithms find, as in the paper of 2026.

    PART is the name of a table or figure in `paper.json`; all of them by default.  Numbers of
    other parts stay as they are stored.
    """
    check_parts(parts, PARTS)
    out = results or HERE / "results"

    def named(part: str) -> tuple[str, list | dict | Iterator[dict]]:
        other = "counts" in PAPER.get(part, {}) and int(contacts) != PAPER[part]["n_c"]
        return f"{part}@{contacts}" if other else part, work(part, draws, int(contacts), out)

    regenerate(out, parts or PARTS, named, page)


def work(part: str, draws: int, contacts: int, out: Path) -> list | dict | Iterator[dict]:
    """The numbers of a part."""
    if part == "enumeration":
        return solutions.enumeration()
    if part == "figure1":
        return solutions.slip_figure(out / "figure1.png")
    if part == "refinement":
        return solutions.refinement()
    if part == "mu_crit":
        return solutions.critical()
    if part in EXTRA:
        return beside(part, draws)
    table = PAPER[part]
    module = ALGORITHMS[table["algorithm"]]
    if "cells" in table:
        return [[asdict(cell) for cell in row] for row in module.cells(table)]
    return one_by_one(module, {**table, "n_c": contacts}, draws)


def beside(part: str, draws: int) -> list | dict | Iterator[dict]:
    """The numbers of a part that is no table of the paper."""
    if part == "example":
        return extra.example()
    if part == "kept":
        return extra.kept()
    if part == "symmetric":
        return extra.symmetric(PAPER)
    if part == "integral":
        return extra.integral(PAPER)
    if part == "strict":
        return extra.strict(PAPER)
    if part == "readings":
        return extra.readings(PAPER, draws, SEED)
    if part == "criteria3d":
        return extruded.criteria()
    return extra.meshes(draws, SEED)


def one_by_one(module: ModuleType, table: dict, draws: int) -> Iterator[dict]:
    """The counts of a table, given away again after each value of its parameter."""
    counts: dict[str, list[int]] = {}
    for value in table["values"]:
        found = module.counts({**table, "values": [value]}, draws, SEED)
        counts = {kind: counts.get(kind, []) + found[kind] for kind in found}
        yield {"draws": draws, "counts": counts}


def page(record: dict) -> str:
    """All tables of what is stored."""
    title, *rest = heading("rey2026", record)
    lines = [title, "", *verdict.line(record, PAPER, report.agrees), *rest[1:]]
    lines += report.summary(record, PAPER)
    for name, table in PAPER.items():
        if name in record and "algorithm" in table:
            make = report.map_table if "cells" in table else report.count_table
            lines += make(name, record[name], table)
        if f"{name}@100" in record:
            lines += report.count_table(f"{name}, n_c = 100", record[f"{name}@100"], table)
    if "nitsche_35" in record:
        lines += report.rate(record["nitsche_35"], PAPER["nitsche_35"])
    for part, make in (("enumeration", report.enumeration), ("figure1", report.figure),
                       ("refinement", report.refinement)):  # fmt: skip
        if part in record:
            lines += make(record[part])
    if "mu_crit" in record:
        lines += report.critical(record["mu_crit"], PAPER["mu_crit"])
    return "\n".join([*lines, *_beside(record)])


def _beside(record: dict) -> list[str]:
    """What is no table of the paper."""
    titles = {"integral": "Uzawa with integral contact terms",
              "symmetric": "Nitsche's symmetric variant (θ = 1)",
              "strict": "One element with 1e-10 for the judge and for naming"}  # fmt: skip
    lines: list[str] = []
    if "criteria3d" in record:
        lines += report.criteria(record["criteria3d"])
    if "example" in record:
        lines += report.example(record["example"])
    if "kept" in record:
        lines += report.kept(record["kept"])
    for part, title in titles.items():
        if part in record:
            lines += report.other(title, record[part], PAPER)
    if "readings" in record:
        lines += report.readings(record["readings"], PAPER)
    if "meshes" in record:
        lines += report.meshes(record["meshes"], extra.ALPHAS)
    return lines


if __name__ == "__main__":
    main()
