"""`python -m reproduce.hueeber2008`: the command line; see `README.md` for what it found."""

from __future__ import annotations

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")

import json
from collections.abc import Callable, Iterator
from pathlib import Path

import click
import numpy as np

import amontons as am

from ..record import check_parts, heading, levels_of, regenerate
from . import bodies, cube, deformed, figures, sketches, tables, verdicts
from .runs import Run

HERE = Path(__file__).parent
CUBE = ("table4.1", "readings", "section3", "table4.2", "table4.3", "parameters", "figure4.3",
        "table5.1", "strategies", "newton")  # fmt: skip
PARTS = (*CUBE, "table6.1", "section6", "ring", "figure7.3")
FIGURES = (
    "4.1a", "4.1", "4.2", "4.3", "5.1a", "5.1b", "5.2", "5.3", "6.1a", "6.1", "6.2", "6.2b",
    "6.3-0.2", "6.3-0.4", "6.3-0.6", "6.4", "6.5", "6.6a", "6.6b", "6.6c", "7.1a", "7.1",
    "7.2a", "7.2b", "7.3",
)  # fmt: skip
REFERENCE = json.loads((HERE / "reference.json").read_text())
RESULTANTS = HERE.parents[1] / "tests/data/cube.json"


@click.command(context_settings={"help_option_names": ["-h", "--help"]})
@click.argument("parts", nargs=-1, metavar="[PART]...")
@click.option("--levels", default="0,1,2,3,4,5", show_default=True,
              help="Levels of refinement; figures are drawn on the finest.")  # fmt: skip
@click.option(
    "--results", type=click.Path(path_type=Path), help="For tables and figures. [results/]"
)
def main(parts: tuple[str, ...], levels: str, results: Path | None) -> None:
    """Active sets and multigrid for contact with friction, as in the paper of 2008.

    PART is one of table4.1, readings, section3, table4.2, table4.3, parameters, figure4.3,
    table5.1, strategies, newton (the cube), table6.1, section6 (the shell, up to level 3),
    figure7.3 (the same, levels 2 and 3), ring (ring and tool, coarse up to level 2); all of
    them by default.  Numbers of other parts, of figure7.3 also those of other levels, stay as
    they are stored.
    """
    check_parts(parts, PARTS)
    chosen = levels_of(levels, 0, 5)
    out = results or HERE / "results"
    chosen_parts = parts or PARTS
    click.echo(regenerate(out, chosen_parts, lambda p: (p, WORK[p](chosen, out)), page))


def page(record: dict) -> str:
    """All tables of what is stored, after a line of counts."""
    found = verdicts.verdicts(record, REFERENCE)
    title, *head = heading("hueeber2008", record)
    lines = [title, "", verdicts.counts_line(found), *head, *verdicts.summary(found)]
    for part, make in TABLES.items():
        if part in record and part in REFERENCE:
            lines += make(record[part], REFERENCE[part])
        elif part in record:
            lines += make(record[part])
        if part in record:
            lines += [*_beside(part, record), *note(part)]
    if "ring" in record:
        both = {"ring": record["ring"], **dict(sorted(record.get("figure7.3", {}).items()))}
        lines += [*tables.section7(both), *note("section7")]
    lines += [f"![Figure {name}](figure{name}.png)\n" for name in FIGURES]
    return "\n".join(lines)


def _beside(part: str, record: dict) -> list[str]:
    """What a table has below it from other parts."""
    if part == "table4.1" and "readings" in record:
        return tables.sentence41(record[part], record["readings"])
    if part == "table4.3" and "parameters" in record:
        return tables.parameters(record["parameters"])
    if part == "table5.1":
        known = json.loads(RESULTANTS.read_text()) if RESULTANTS.exists() else {}
        lines = [*note("norm"), *tables.resultants(record[part]["zero"], known)]
        if "newton" in record:
            lines += tables.newton(record["newton"], record[part]["zero"])
        return lines
    return []


TABLES: dict[str, Callable] = {
    "table4.1": tables.table41, "section3": tables.section3, "table4.2": tables.table42,
    "table4.3": tables.table43, "figure4.3": tables.figure43, "table5.1": tables.table51,
    "strategies": tables.strategies, "table6.1": tables.table61,
}  # fmt: skip


def note(part: str) -> list[str]:
    """What `notes.md` says about the differences of a part."""
    for section in (HERE / "notes.md").read_text().split("\n# ")[1:]:
        title, text = section.split("\n", 1)
        if title == part:
            return [text.strip(), ""]
    return []


def _records(runs: dict[str, Run]) -> dict:
    return {level: run.record() for level, run in runs.items()}


def _table41(levels: list[int], out: Path) -> dict:
    runs = cube.table41(levels)
    last = levels[-1]
    _cube_figures(runs[str(last)].solution, last, out / "figure4.2.png", out / "figure4.1.png")
    sketches.cube(out / "figure4.1a.png")
    return _records(runs)


def _readings(levels: list[int], out: Path) -> dict:
    return {name: _records(runs) for name, runs in cube.readings(levels).items()}


def _parameters(levels: list[int], out: Path) -> dict:
    level = min(3, levels[-1])
    return {"level": level} | _records(cube.parameters(level))


def _strategies(levels: list[int], out: Path) -> dict:
    return {name: _records(runs) for name, runs in cube.strategies(levels).items()}


def _cube_figures(
    solution: am.FrictionSolution, level: int, contact: Path, picture: Path
) -> None:
    """Status of the nodes and the deformed cube, both on the face z = 0."""
    points = cube.contact_points(level)[:, :2]
    figures.status(
        cube.model(level), solution, points, np.eye(3)[:2], 1.5 * 2.0**-level, contact,
        ((0.55, 1.02), (0.55, 1.02)),
    )  # fmt: skip
    deformed.deformed(cube.model(level), solution, picture)


def _table42(levels: list[int], out: Path) -> dict:
    return {name: _records(runs) for name, runs in cube.table42(levels).items()}


def _table43(levels: list[int], out: Path) -> dict:
    return {name: _records(runs) for name, runs in cube.table43(levels).items()}


def _figure43(levels: list[int], out: Path) -> dict:
    runs = cube.figure43(levels[-1])
    figures.modifications(runs, levels[-1], out / "figure4.3.png")
    node = cube.node(levels[-1])
    return {
        name: run.record() | {
            "alpha": [float(it.alpha[node]) for it in run.iterates],
            "beta": [float(it.beta[node]) for it in run.iterates],
        }
        for name, run in runs.items()
    }  # fmt: skip


def _table51(levels: list[int], out: Path) -> dict:
    runs = cube.table51(levels)
    record = {name: _records(found) for name, found in runs.items()}
    for level, run in runs["zero"].items():
        fields = cube.model(int(level)).recover(run.solution)
        record["zero"][level] |= {
            "counts": run.solution.counts, "resultant": [float(x) for x in fields.resultant],
            "corner": cube.corner_traction(int(level), run.solution),
        }  # fmt: skip
    last = levels[-1]
    solution, points = runs["zero"][str(last)].solution, cube.contact_points(last)
    _cube_figures(solution, last, out / "figure5.2.png", out / "figure5.1a.png")
    figures.bound(solution, points, out / "figure5.1b.png")
    figures.sets(runs["zero"], out / "figure5.3.png")
    return record


def _newton(levels: list[int], out: Path) -> dict:
    return _records(cube.newton([k for k in levels if k < 5]))


WORK: dict[str, Callable[[list[int], Path], dict | Iterator[dict]]] = {
    "table4.1": _table41, "readings": _readings, "table4.2": _table42, "table4.3": _table43,
    "section3": lambda levels, out: cube.robust(levels), "parameters": _parameters,
    "figure4.3": _figure43, "table5.1": _table51, "strategies": _strategies, "newton": _newton,
    "table6.1": bodies.table61, "section6": bodies.section6, "ring": bodies.ring_and_tool,
    "figure7.3": bodies.figure73,
}  # fmt: skip

if __name__ == "__main__":
    main()
