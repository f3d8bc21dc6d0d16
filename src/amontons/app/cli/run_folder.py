"""The results folder of a run: its checkpoint, and what follows from it.

state.h5 holds all that a run needs to go on, its table and its list of pictures too, and is
replaced in one moment.  steps.csv and steps.pvd are written out of it, after it, and again when
a run goes on: wherever a process is killed, all that `--restart` reads belongs to one step.
"""

from __future__ import annotations

import csv
import re
from dataclasses import dataclass, field
from dataclasses import fields as fields_of
from io import StringIO
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...core.errors import FileFormatError
from ...core.files import KEPT, remove_parts, replacing, write_bytes
from ...io.case import SOLVER, differences
from ...io.checkpoint import Checkpoint, load_checkpoint, save_checkpoint
from ...io.vtk import write_model
from ...mechanics.steps import Energies, State, TimeStep
from ...problem.solution import ContactStatus
from .terminal import REPORT

WORKS = tuple(field.name for field in fields_of(Energies))
WHOLE = ("index", "open", "slip", "stick", "iterations")
COLUMNS = ("index", "time", "open", "slip", "stick", *WORKS, "defect", "iterations", "error",
           "seconds", "jump")  # fmt: skip
ROW = np.dtype([(name, np.int64 if name in WHOLE else np.float64) for name in COLUMNS])
STATE, TABLE, FILM, BALANCE = "state.h5", "steps.csv", "steps.pvd", "energy.png"
PICTURE = re.compile(r"step-\d{5,}\.(vtu|png)|film\.gif")
FILES = (STATE, TABLE, FILM, BALANCE, REPORT)
OURS = (PICTURE, *(re.compile(re.escape(name)) for name in FILES))
PICTURES = "pictures"  # folder of those drawn here


@dataclass
class RunFolder:
    """A folder and what is in it: rows of the steps so far, indices of those with a VTK file.

    case: what decides the numbers; saved: index of the last state that is safe, -1 for none.
    """

    folder: Path
    case: dict[str, Any]
    rows: list[tuple] = field(default_factory=list)
    pictures: list[int] = field(default_factory=list)
    saved: int = -1

    def add(self, step: TimeStep, seconds: float) -> None:
        """Take a step into the table."""
        e, record = step.energies, step.solution.convergence
        counts = [int((step.status == status).sum()) for status in ContactStatus]
        jumped = step.passage is not None and step.passage.jumped
        jump = step.passage.folds[0] if jumped else np.nan
        self.rows.append((
            step.state.index, step.time, *counts, *(getattr(e, name) for name in WORKS),
            e.defect, record.iterations, record.error, seconds, jump,
        ))  # fmt: skip

    def draw(self, step: TimeStep) -> None:
        """Write the VTK file of a step, once."""
        if step.state.index not in self.pictures[-1:]:
            with replacing(self.folder / picture_name(step.state.index)) as path:
                write_model(step.model, step.fields, step, path)  # type: ignore[arg-type]
            self.pictures.append(step.state.index)

    def save(self, state: State) -> None:
        """Write the checkpoint of a state, then the files that follow from it."""
        pictures = np.array(self.pictures, dtype=np.int64)
        checkpoint = Checkpoint(state, self.case, self.table, pictures)
        save_checkpoint(self.folder / STATE, checkpoint)
        self.saved = state.index
        self.follow()

    def follow(self) -> None:
        """Write the table, and the list of pictures that ParaView opens."""
        write_bytes(self.folder / TABLE, _csv(self.table))
        write_bytes(self.folder / FILM, _pvd(self.table, self.pictures))

    @property
    def table(self) -> NDArray[np.void]:
        """All rows, (steps,), fields COLUMNS; `jump` is NaN where there was none."""
        return np.array(self.rows, dtype=ROW)


def picture_name(index: int) -> str:
    """The name of the VTK file of a step."""
    return f"step-{index:05d}.vtu"


def clear(folder: Path, name: str) -> None:
    """Remove what runs of a case of that name that were killed left half written."""
    exported = re.compile(rf"{re.escape(name[:KEPT])}.*\.hdf5")
    for place in (folder, folder / PICTURES):
        if place.is_dir():
            remove_parts(place, (*OURS, exported))


def continued(folder: Path, case: dict[str, Any]) -> tuple[RunFolder, State, list[str]]:
    """The folder of a run that goes on, its state, and how its solver differs, in words.

    Raises FileFormatError where the checkpoint belongs to another case.
    """
    path = folder / STATE
    found = load_checkpoint(path)
    indices = np.arange(1, found.state.index + 1)
    if found.table.dtype != ROW or not np.array_equal(found.table["index"], indices):
        raise FileFormatError(
            f"{path}: /amontons_run/table: expected {found.state.index} rows with "
            f"{', '.join(COLUMNS)}"
        )
    others = differences(_without_solver(found.case), _without_solver(case))
    if others:
        raise FileFormatError(
            f"{path}: is of another case: {'; '.join(others)}; begin again without --restart, "
            "or write elsewhere with -o"
        )
    rows = [tuple(row) for row in found.table.tolist()]
    run = RunFolder(folder, case, rows, found.pictures.tolist(), found.state.index)
    run.follow()
    return run, found.state, differences(found.case, case)


def _without_solver(case: dict[str, Any]) -> dict[str, Any]:
    return {key: value for key, value in case.items() if not key.startswith(SOLVER)}


def _csv(table: NDArray[np.void]) -> bytes:
    text = StringIO(newline="")
    rows = [["" if value != value else value for value in row] for row in table.tolist()]
    csv.writer(text).writerows([COLUMNS, *rows])
    return text.getvalue().encode("utf-8")


def _pvd(table: NDArray[np.void], pictures: list[int]) -> bytes:
    entries = "".join(
        f'    <DataSet timestep="{table["time"][k - 1]:.12g}" file="{picture_name(k)}"/>\n'
        for k in pictures
    )
    return (
        '<?xml version="1.0"?>\n<VTKFile type="Collection" version="0.1">\n  <Collection>\n'
        f"{entries}  </Collection>\n</VTKFile>\n"
    ).encode()
