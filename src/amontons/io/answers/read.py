"""An answer to audit from a file: `.frd`, `.dat`, VTU, a results folder or solution.h5."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ...analysis.audit import Answer, Turning
from ...core.errors import FileFormatError
from ..readers import Case
from . import dat, frd
from .matching import by_element, by_label, by_place, check_points, mean_of, shortened

if TYPE_CHECKING:
    from ...mechanics.model import Model
    from ..decks.about import About

Array = NDArray[np.float64]
KNOWN = (".frd", ".dat", ".vtu", ".h5", ".hdf5")
DOUBLE = 1e-15
EXPANDED = {"stress": 0.08, "axisymmetric": 0.005}  # of forces: bricks in place of plane cells


@dataclass(frozen=True, eq=False)
class Table:
    """Displacements (nodes, d) of all bodies one after another, at a time, None if untimed."""

    time: float | None
    values: Array


def read_answer(path: Path, case: Case, time: float | None = None) -> tuple[Model, Answer]:
    """The model at the time of an answer, and the answer: the last one, or that at `time`.

    Raises FileFormatError for what is no answer of this case: other nodes, another place, no
    displacements, numbers that are not finite.
    """
    folder = path / "solution.h5"
    if path.is_dir() and folder.is_file():
        path = folder
    if path.is_dir():
        raise FileFormatError(
            f"{path}: expected a folder with solution.h5 in it, as `amontons solve` writes; of "
            "a case in time name one of its files, such as step-00010.vtu"
        )
    suffix = path.suffix.lower()
    if suffix not in KNOWN:
        raise FileFormatError(
            f"{path}: expected results as {', '.join(KNOWN)} or a results folder, got "
            f"{suffix or 'no suffix'}"
        )
    if suffix in (".h5", ".hdf5"):
        from .own import read_own

        return _at_end(case), _named(read_own(path, case.model), case)
    digits = frd.DIGITS if suffix == ".frd" else None
    digits = dat.digits_of(path) if suffix == ".dat" else digits
    tables = _tables(path, suffix, case)
    at = _chosen(path, tables, time)
    table, before = tables[at], tables[at - 1] if at > 0 else None
    return _model_and_answer(case, table, before, digits, wanted=time)


def _at_end(case: Case) -> Model:
    """The model at the end of its loads."""
    return case.model if case.about is None else case.about.at(case.about.until)


def _named(answer: Answer, case: Case) -> Answer:
    names = None if case.about is None else case.about.labels.astype(str)
    return replace(answer, names=names)


def _model_and_answer(
    case: Case, table: Table, before: Table | None, digits: int | None, wanted: float | None
) -> tuple[Model, Answer]:  # fmt: skip
    about = case.about
    counts = [len(body.mesh.points) for body in case.model.bodies]
    answer = Answer(
        _split(table.values, counts),
        blur=_split(half_units(table.values, digits), counts),
        before=None if before is None else _split(before.values, counts),
    )
    if about is None or table.time is None:
        return _at_end(case), _named(answer, case)
    until = about.until
    reached = min(table.time, until)
    return about.at(reached), replace(
        answer, large=about.large, other=about.other, time=table.time,
        until=None if wanted is not None else until, names=about.labels.astype(str),
        one_way=about.one_way, tolerance=EXPANDED.get(about.plane, 0.0),
        turning=() if about.plane else tuple(Turning(*tie) for tie in about.turning),
    )  # fmt: skip


def half_units(values: Array, digits: int | None) -> Array:
    """Half a unit of the last digit that was printed, of each value."""
    if digits is None:
        return DOUBLE * np.abs(values)
    size = np.abs(values)
    power = np.floor(np.log10(np.where(size > 0, size, 1.0)))
    return np.where(size > 0, 0.5 * 10.0 ** (power - digits + 1), 0.0)


def _split(values: Array, counts: Sequence[int]) -> tuple[Array, ...]:
    return tuple(np.split(values, np.cumsum(counts)[:-1]))


def _chosen(path: Path, tables: Sequence[Table], time: float | None) -> int:
    """The last table, or that at a time."""
    if time is None:
        return len(tables) - 1
    times = [np.inf if t.time is None else abs(t.time - time) for t in tables]
    best = int(np.argmin(times))
    if not times[best] <= 1e-4 * max(abs(time), 1e-300):
        known = ", ".join(f"{t.time:g}" for t in tables if t.time is not None) or "none"
        raise FileFormatError(f"{path}: has nothing at time {time:g}; times: {known}")
    return best


def _tables(path: Path, suffix: str, case: Case) -> list[Table]:
    points = np.concatenate([body.mesh.points for body in case.model.bodies])
    about = case.about
    if suffix == ".vtu":
        return [_from_vtu(path, points)]
    labels = np.arange(1, len(points) + 1) if about is None else about.labels
    if suffix == ".dat":
        printed = dat.digits_of(path) == dat.DIGITS
        return [
            Table(block.time, _full(block.values[by_label(path, block.labels, labels)]
                  [:, : points.shape[1]], about, printed))
            for block in dat.read_dat(path)
        ]  # fmt: skip
    found = frd.read_frd(path, only="DISP")
    blocks = found.named("DISP")
    if about is not None and (about.plane or not about.are_unique):
        return _by_place(path, found, blocks, points, about)
    rows = by_label(path, found.labels, labels)
    check_points(path, found.points[rows], points, labels)
    strange = len(found.labels) - len(rows)
    more = np.setdiff1d(found.labels, labels) if strange else np.zeros(0)
    if len(more) > 0.5 * len(rows):
        raise FileFormatError(
            f"{path}: has {len(more)} nodes that the model lacks: it is the result of another "
            "one"
        )
    return [
        Table(block.time, block.values[by_label(path, block.labels, labels)]
              [:, : points.shape[1]])
        for block in blocks
    ]


def _by_place(
    path: Path, found: frd.Results, blocks: list[frd.Block], points: Array, about: About
) -> list[Table]:  # fmt: skip
    plane = about.plane
    if plane:
        pairs = by_element(path, found, points, about.cells, plane)
    else:
        pairs = by_place(path, found.points, points, plane)
    out = []
    single = np.bincount(pairs[0], minlength=len(points)) == 1
    printed = single & (found.program == frd.CALCULIX)
    for block in blocks:
        rows = by_label(path, block.labels, found.labels[pairs[1]])
        moved = mean_of((pairs[0], np.arange(len(rows))), found.points[pairs[1]],
                        block.values[rows], len(points), plane)  # fmt: skip
        out.append(Table(block.time, _full(moved, about, printed)))
    return out


def _full(moved: Array, about: About | None, printed: NDArray[np.bool_] | bool) -> Array:
    """Displacements (n, d) without what CalculiX takes from them where it printed means."""
    if about is None or about.plane != "axisymmetric":
        return moved
    factor = np.where(printed, shortened(about.cells, len(moved)), 1.0)
    return moved / np.column_stack([factor, np.ones(len(moved))])


def _from_vtu(path: Path, points: Array) -> Table:
    """The point field `displacement`, or one that is called so in other words."""
    from ...mechanics.meshes.read import mesh_of_meshio

    mesh: Any = mesh_of_meshio(path)
    names = {str(name).lower(): name for name in mesh.point_data}
    name = next((names[n] for n in ("displacement", "displacements", "disp", "u", "depl")
                 if n in names), None)  # fmt: skip
    if name is None:
        raise FileFormatError(
            f"{path}: expected a field 'displacement' at its nodes, got "
            f"{', '.join(map(str, mesh.point_data)) or 'none'}"
        )
    values = np.asarray(mesh.point_data[name], dtype=float)
    given = np.asarray(mesh.points, dtype=float)
    if len(given) == len(points) and np.allclose(given[:, : points.shape[1]], points):
        moved = values[:, : points.shape[1]]
    else:
        wide = np.zeros((len(given), 3))
        wide[:, : given.shape[1]] = given
        moved = mean_of(by_place(path, wide, points, ""), wide, values, len(points), "")
        moved = moved[:, : points.shape[1]]
    bad = np.flatnonzero(~np.isfinite(moved).all(axis=1))
    if bad.size:
        raise FileFormatError(f"{path}: the displacement of node {bad[0]} is not finite")
    return Table(None, moved)
