"""The results folder of a run: its checkpoint, and what follows from it.

state.h5 holds all that a run needs to go on, its table and its list of pictures too, and is
replaced in one moment.  steps.csv, steps.pvd and solution.json are written out of it, after it,
and again when a run goes on: wherever a process is killed, all that `--restart` reads belongs
to one step.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from dataclasses import fields as fields_of
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...core.errors import FileFormatError
from ...core.files import KEPT, remove_parts, replacing, write_bytes
from ...io.case import SOLVER, differences
from ...io.checkpoint import Checkpoint, load_checkpoint, save_checkpoint
from ...io.numbers import csv_of, flat_columns, flat_values
from ...io.results import step_record, to_json
from ...io.series import LIST, MESH, step_name, write_list, write_step
from ...io.vtk import write_model
from ...mechanics.model import Model
from ...mechanics.model.names import support_names
from ...mechanics.steps import Energies, State, TimeStep
from ...problem.solution import ContactStatus
from .terminal import REPORT

WORKS = tuple(field.name for field in fields_of(Energies))
WHOLE = ("index", "open", "slip", "stick", "iterations")
SUMMED = tuple(name for name in WORKS if name not in ("kinetic", "elastic"))  # of a step each
COLUMNS = ("index", "time", "open", "slip", "stick", *WORKS, "defect", "iterations", "error",
           "seconds", "jump", "jump_possible")  # fmt: skip
LATER = ("jump_possible",)  # columns that a checkpoint of an older version lacks
MOST_NUMBERS = 400  # columns of pairs and supports: HDF5 keeps a row's names in 64 kB
STATE, TABLE, FILM, BALANCE = "state.h5", "steps.csv", "steps.pvd", "energy.png"
RECORD = "solution.json"
PICTURE = re.compile(r"step-\d{5,}\.(vtu|h5|png)|film\.gif")
FILES = (STATE, TABLE, FILM, BALANCE, RECORD, LIST, MESH, REPORT)
OURS = (PICTURE, *(re.compile(re.escape(name)) for name in FILES))
PICTURES = "pictures"  # folder of those drawn here


@dataclass
class RunFolder:
    """A folder and what is in it: rows of the steps so far, indices of those with a VTK file.

    case: what decides the numbers; numbers: columns of pairs and supports; title: for files;
    xdmf: write that too; saved: index of the last state that is safe, -1 for none; record: what
    solution.json holds; notes: what the file of the case says and the model leaves out.
    """

    folder: Path
    case: dict[str, Any]
    numbers: tuple[str, ...] = ()
    title: str = ""
    xdmf: bool = False
    rows: list[tuple] = field(default_factory=list)
    pictures: list[int] = field(default_factory=list)
    saved: int = -1
    record: dict[str, Any] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    rates: dict[str, Any] | None = None  # of the last step, where they were asked for

    def add(
        self, step: TimeStep, seconds: float, rates: dict[str, Any] | None = None
    ) -> None:
        """Take a step into the table; rates: the record of what was asked of them."""
        e, record = step.energies, step.solution.convergence
        counts = [int((step.status == status).sum()) for status in ContactStatus]
        jumped = step.passage is not None and step.passage.jumped
        jump = step.passage.folds[0] if jumped else np.nan
        numbers = _in_columns(step, self.numbers)
        self.rows.append((
            step.state.index, step.time, *counts, *(getattr(e, name) for name in WORKS),
            e.defect, record.iterations, record.error, seconds, jump, _number(rates), *numbers,
        ))  # fmt: skip
        self.rates = rates

    def draw(self, step: TimeStep) -> None:
        """Write the VTK file of a step, once."""
        if step.state.index not in self.pictures[-1:]:
            with replacing(self.folder / picture_name(step.state.index)) as path:
                write_model(step.model, step.fields, step, path, self.title)
            if self.xdmf:
                write_step(self.folder, step, self.title, with_mesh=not self._in_series())
            self.pictures.append(step.state.index)

    def keep(self, step: TimeStep) -> None:
        """Write the checkpoint of a step, then the files that follow from it."""
        self.record = step_record(step, self.title, self.works()) | {"notes": [*self.notes]}
        if self.rates is not None:
            self.record["rates"] = self.rates
        self.save(step.state)

    def save(self, state: State) -> None:
        """Write the checkpoint of a state, then the files that follow from it."""
        pictures = np.array(self.pictures, dtype=np.int64)
        checkpoint = Checkpoint(state, self.case, self.table, pictures, self.record)
        save_checkpoint(self.folder / STATE, checkpoint)
        self.saved = state.index
        self.follow()

    def follow(self) -> None:
        """Write the table, the numbers at the end, and the list that ParaView opens."""
        write_bytes(self.folder / TABLE, csv_of((*COLUMNS, *self.numbers), self.table))
        write_bytes(self.folder / FILM, _pvd(self.table, self.pictures))
        if self.xdmf and self._in_series():
            write_list(self.folder, [(self.table["time"][k - 1], k) for k in self._in_series()])
        if self.record:
            write_bytes(self.folder / RECORD, to_json(self.record).encode("utf-8"))

    def _in_series(self) -> list[int]:
        """The steps with an HDF5 file: a call before may have written VTK files alone."""
        return [k for k in self.pictures if (self.folder / step_name(k)).exists()]

    def works(self) -> dict[str, float]:
        """Sums of the works of all steps so far, and of what the balance misses."""
        table = self.table
        return {name: float(table[name].sum()) for name in (*SUMMED, "defect")}

    @property
    def table(self) -> NDArray[np.void]:
        """All rows, (steps,), fields COLUMNS and numbers; NaN: no jump, or not known."""
        return np.array(self.rows, dtype=row_of(self.numbers))


def _number(rates: dict[str, Any] | None) -> float:
    """1 where a jump is possible, 0 where not, NaN where that is not known."""
    known = None if rates is None else rates["jump_possible"]
    return np.nan if known is None else float(known)


def row_of(numbers: tuple[str, ...]) -> np.dtype:
    """The type of a row, with the columns of pairs and supports."""
    kinds = [(name, np.int64 if name in WHOLE else np.float64) for name in COLUMNS]
    return np.dtype([*kinds, *((name, np.float64) for name in numbers)])


def numbers_of(model: Model) -> tuple[str, ...]:
    """The columns of all pairs and supports; none where they are more than MOST_NUMBERS."""
    names = flat_columns(model.dimension, model.pair_names, support_names(model.supports))
    return names if len(names) <= MOST_NUMBERS else ()


def _in_columns(step: TimeStep, columns: tuple[str, ...]) -> list[float]:
    """The numbers of a step; NaN for supports that its stage does not have."""
    if not columns:
        return []
    own = numbers_of(step.model)
    values = flat_values(step.pairs, step.supports)
    if own == columns:
        return values
    known = dict(zip(own, values, strict=False))
    return [known.get(name, np.nan) for name in columns]


def picture_name(index: int) -> str:
    """The name of the VTK file of a step."""
    return f"step-{index:05d}.vtu"


def clear(folder: Path, name: str) -> None:
    """Remove what runs of a case of that name that were killed left half written."""
    exported = re.compile(rf"{re.escape(name[:KEPT])}.*\.hdf5")
    for place in (folder, folder / PICTURES):
        if place.is_dir():
            remove_parts(place, (*OURS, exported))


def continued(
    folder: Path, case: dict[str, Any], numbers: tuple[str, ...] = (), title: str = "",
    xdmf: bool = False,
) -> tuple[RunFolder, State, list[str]]:  # fmt: skip
    """The folder of a run that goes on, its state, and how this call differs, in words.

    Raises FileFormatError where the checkpoint belongs to another case.
    """
    path = folder / STATE
    found = load_checkpoint(path)
    indices = np.arange(1, found.state.index + 1)
    names = found.table.dtype.names or ()
    lacking = set(COLUMNS) - set(LATER) - set(names)
    if lacking or not np.array_equal(found.table["index"], indices):
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
    table = np.zeros(len(found.table), dtype=row_of(numbers))
    for name in (*COLUMNS, *numbers):  # a checkpoint of an older version knows no pairs
        table[name] = found.table[name] if name in names else np.nan
    rows = [tuple(row) for row in table.tolist()]
    run = RunFolder(folder, case, numbers, title, xdmf, rows, found.pictures.tolist(),
                    found.state.index, found.record)  # fmt: skip
    run.follow()
    told = differences(found.case, case)
    if not found.counts_slip:
        told.append("it is of an older version, slip and friction work are counted anew")
    return run, found.state, told


def _without_solver(case: dict[str, Any]) -> dict[str, Any]:
    return {key: value for key, value in case.items() if not key.startswith(SOLVER)}


def _pvd(table: NDArray[np.void], pictures: list[int]) -> bytes:
    entries = "".join(
        f'    <DataSet timestep="{table["time"][k - 1]:.12g}" file="{picture_name(k)}"/>\n'
        for k in pictures
    )
    return (
        '<?xml version="1.0"?>\n<VTKFile type="Collection" version="0.1">\n  <Collection>\n'
        f"{entries}  </Collection>\n</VTKFile>\n"
    ).encode()
