"""The problems of the wall: steps of one run of its compression and shear, as FCLib files.

As in the paper: one series of time steps, from which problems of graded difficulty for the
non-smooth Newton method are chosen.  Difficulty is the number of iterations of NSN-AC with full
steps from r = 0, counted on some steps of the run; it stands in the name of a file behind step
and contacts, as in the collection LowWall_FEM.  What the paper leaves open is in `README.md`.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

import amontons as am
from amontons.core.files import replacing
from amontons.io.case import read_case

CASE = Path(__file__).resolve().parents[2] / "examples" / "wall" / "wall.toml"
COUNTED_TO = 1e-6  # error at which the iterations of Newton are counted
MOST = 100  # iterations after which a step counts as too hard for it
NEWTON = am.SemismoothNewton(am.AlartCurnier(), line_search=am.FullStep())
STATUSES = ("open", "slip", "stick")


@dataclass(frozen=True)
class Series:
    """Steps of one run: cells of a block, steps to count iterations on, how many to choose."""

    name: str
    cells: tuple[int, int, int]
    counted: tuple[int, ...]
    chosen: int

    @property
    def steps(self) -> int:
        """Steps of the run."""
        return self.counted[-1]


# the wall cracks within the first steps of shear, later ones differ less
PAPER = Series("wall", (8, 4, 4), (*range(1, 41), *range(50, 501, 10)), 50)
FINE = Series("fine", (16, 6, 6), (10, 12), 2)  # 2037 contacts
QUICK = Series("quick", (2, 1, 1), (2, 4, 6, 9, 11, 12, 14), 3)


def write_problems(
    series: Series, folder: Path, report: Callable[[str], None] = print
) -> list[Path]:
    """The chosen problems of a series, in the order of their steps; kept if they are there.

    Beside each file lies its warm start, FILE.npz: impulses r (nc, 3) of the step before at the
    contacts of this one.  `series_file` holds what was counted.
    """
    folder.mkdir(parents=True, exist_ok=True)
    known = series_file(series, folder)
    if known.is_file():
        paths = [folder / name for name in json.loads(known.read_text())["chosen"]]
        if all(path.is_file() and path.with_suffix(".npz").is_file() for path in paths):
            return paths
    rows = _follow(series, folder, report)
    newton = [math.nan if row["newton"] is None else row["newton"] for row in rows]
    indices = am.graded(newton, series.chosen)
    names = [rows[k]["file"] for k in indices]
    for row in rows:
        if row["file"] not in names:
            for suffix in (".hdf5", ".npz"):
                (folder / row["file"]).with_suffix(suffix).unlink(missing_ok=True)
    record = {"series": series.name, "cells": series.cells, "steps": series.steps,
              "tolerance": COUNTED_TO, "counted": rows, "chosen": names}  # fmt: skip
    with replacing(known) as temporary:
        temporary.write_text(json.dumps(record, indent=1) + "\n")
    return [folder / name for name in names]


def series_file(series: Series, folder: Path) -> Path:
    """The record of a series: steps with their statuses and iterations, names of the chosen."""
    return folder / f"{series.name}-series.json"


def newton_iterations(path: Path) -> int:
    """The iterations of Newton in the name of a problem."""
    return int(path.stem.rpartition("-")[2])


def _follow(
    series: Series, folder: Path, report: Callable[[str], None]
) -> list[dict[str, Any]]:  # fmt: skip
    """Make the run; a row and a file for each counted step."""
    case = read_case(CASE, [f"wall.cells={list(series.cells)}"])
    assert case.evolution is not None
    method = case.evolution.method
    rows, before = [], None
    for done in am.evolve(case.model, method, until=series.steps * method.step,
                          tolerance=case.settings.tolerance):  # fmt: skip
        if done.state.index in series.counted:
            rows.append(row := _row(series, done))
            path = folder / row["file"]
            title = f"wall, step {done.state.index}, t = {done.time:g} s"
            am.write_fclib(done.problem, path, title=title)
            force = np.zeros_like(done.state.force) if before is None else before
            with replacing(path.with_suffix(".npz")) as temporary:
                with temporary.open("wb") as file:
                    np.savez(file, r=method.step * force[done.active])
            report(f"{path.name}: " + ", ".join(f"{row[name]} {name}" for name in STATUSES))
        before = done.state.force
    return rows


def _row(series: Series, done: am.TimeStep) -> dict[str, Any]:
    """A step in numbers; newton: None where full steps do not converge."""
    found = am.drive(done.problem.condensed(), NEWTON, tolerance=COUNTED_TO,
                     max_iterations=MOST)  # fmt: skip
    newton = found.convergence.iterations if found.converged else None
    contacts = done.problem.contacts
    name = f"{series.name}-{done.state.index:04d}-{contacts}-{newton or 0:02d}.hdf5"
    status = np.bincount(done.solution.status, minlength=3)
    counts = {name: int(status[k]) for k, name in enumerate(STATUSES)}
    return {"step": done.state.index, "time": done.time, "contacts": contacts, **counts,
            "newton": newton, "unknowns": done.problem.unknowns, "file": name}  # fmt: skip


def section(record: dict[str, Any]) -> str:
    """Markdown: what was counted on a series, and what was chosen of it beside the paper."""
    rows = [row for row in record["counted"] if row["file"] in record["chosen"]]
    newton = sorted(row["newton"] for row in rows)
    contacts = [row["contacts"] for row in rows]
    hard = sum(row["newton"] is None for row in record["counted"])
    return "\n".join([
        "| | LowWall_FEM | here |",
        "|---|---|---|",
        f"| unknowns | 7212 | {rows[0]['unknowns']} |",
        f"| problems | 50 of steps 1 to 498 | {len(rows)} of steps {rows[0]['step']} to "
        f"{rows[-1]['step']} |",
        f"| contacts in a problem | 624 to 688 | {min(contacts)} to {max(contacts)} |",
        f"| iterations of Newton | 14 to 56, median 31 | {newton[0]} to {newton[-1]}, median "
        f"{np.median(newton):g} |",
        f"| hardest over easiest | 4 | {newton[-1] / newton[0]:.3g} |",
        "",
        f"Counted on {len(record['counted'])} of {record['steps']} steps, to an error of "
        f"{record['tolerance']:g} from r = 0; on {hard} of them full steps did not converge "
        f"within {MOST} iterations. " + _spread(rows),
    ])  # fmt: skip


def _spread(rows: Sequence[dict[str, Any]]) -> str:
    """A sentence about the statuses of the chosen problems."""
    ranges = ", ".join(
        f"{min(row[name] for row in rows)} to {max(row[name] for row in rows)} {name}"
        for name in STATUSES
    )
    return f"In the chosen problems {ranges}."
