"""Files of an evolution: where it stands, to go on from, and its discrete problems."""

from __future__ import annotations

import hashlib
import json
import os
import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeVar

import h5py
import numpy as np
from numpy.typing import NDArray

from ..core.arrays import real
from ..core.errors import FileFormatError, InvalidInput
from ..core.files import check_is_regular, make_folder
from ..core.hdf5 import check_contained
from ..mechanics.steps import State, TimeStep
from ..mechanics.steps.state import ARRAYS, MORE, RUBBED
from ..solvers import Iterate
from .fclib import DAMAGE, write_fclib, write_hdf5

GROUP = "amontons_state"
RUN = "amontons_run"  # beside the state, in the checkpoint of a run
Read = TypeVar("Read")


@dataclass(frozen=True, eq=False)
class Checkpoint:
    """All that a run needs to go on, in one file, so that its parts always belong together.

    case: what decides the numbers, JSON data by key; table (steps,): a structured array, one
    row for each step so far, with the field `index`; pictures: indices of the steps that have
    a VTK file; record: of the last of these steps, JSON data.  counts_slip: False for a file
    of an older version, whose state knows nothing of what has slid before it.
    """

    state: State
    case: dict[str, Any]
    table: NDArray[np.void]
    pictures: NDArray[np.int64]
    record: dict[str, Any] = field(default_factory=dict)
    counts_slip: bool = True


def save_state(path: str | os.PathLike[str], state: State) -> None:
    """Write a state; nothing on failure."""
    write_hdf5(path, lambda file: _put_state(file, state))


def load_state(path: str | os.PathLike[str]) -> State:
    """The state in a file of `save_state`, or in the checkpoint of a run.

    Raises FileFormatError naming file and dataset.
    """
    return _read(Path(path), _state)


def load_start(path: str | os.PathLike[str]) -> Iterate:
    """A start from a file: reactions r, and displacements or velocities v if there are any.

    An HDF5 file with the data sets r (nc, d) and maybe v (n,), such as our solution.h5, or the
    folder that holds it; or JSON, {"r": [[…], …], "v": […]}.  Raises FileFormatError naming
    the file for anything else, and for numbers that are not finite.
    """
    path = Path(path)
    if path.is_dir() and (path / "solution.h5").is_file():
        path = path / "solution.h5"
    if path.suffix.lower() != ".json":
        return _read(path, _start_in_hdf5, "a solution")
    check_is_regular(path)
    try:
        data = json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise FileFormatError(f"{path}: no such file") from None
    except (OSError, ValueError, RecursionError) as reason:
        raise FileFormatError(f"{path}: expected JSON, got: {reason}") from None
    return _start_of(path, data)


def _start_in_hdf5(path: Path, file: h5py.File) -> Iterate:
    nodes = ((name, file.get(name)) for name in ("r", "v"))
    found = {name: node[()] for name, node in nodes if isinstance(node, h5py.Dataset)}
    return _start_of(path, found)


def _start_of(path: Path, data: Any) -> Iterate:
    """The start in the data of a file."""
    if not isinstance(data, dict) or "r" not in data:
        words = "reactions r, a row per contact, and maybe v"
        if isinstance(data, dict) and "schema" in data:
            hint = "; solution.h5 of the same folder holds them" if "outcome" in data else ""
            hint = '; save one entry of "solutions"' if "solutions" in data else hint
            raise FileFormatError(
                f"{path}: expected {words}, got a record {data['schema']}{hint}"
            )
        raise FileFormatError(f"{path}: expected {words}, found no r")
    try:
        r, v = real("r", data["r"]), data.get("v")
        v = None if v is None else real("v", v)
    except InvalidInput as reason:
        raise FileFormatError(f"{path}: {reason}") from None
    for name, values, dimensions in (("r", r, 2), ("v", v, 1)):
        if values is None:
            continue
        if values.ndim != dimensions:
            words = "a row per contact" if name == "r" else "a list of numbers"
            raise FileFormatError(
                f"{path}: {name}: expected {words}, got shape {values.shape}"
            )
        if not np.isfinite(values).all():
            raise FileFormatError(f"{path}: {name}: holds a number that is not finite")
    return Iterate(r, v)


def save_checkpoint(path: str | os.PathLike[str], checkpoint: Checkpoint) -> None:
    """Write a checkpoint; nothing on failure."""
    case = json.dumps(checkpoint.case, sort_keys=True)

    def fill(file: h5py.File) -> None:
        _put_state(file, checkpoint.state)
        group = file.create_group(RUN)
        group["case"] = np.frombuffer(case.encode(), dtype=np.uint8)
        group["table"], group["pictures"] = checkpoint.table, checkpoint.pictures
        record = json.dumps(checkpoint.record)  # in its order, in which it is written again
        group["record"] = np.frombuffer(record.encode(), dtype=np.uint8)
        group["digest"] = np.frombuffer(_digest(checkpoint, case), dtype=np.uint8)

    write_hdf5(path, fill)


def load_checkpoint(path: str | os.PathLike[str]) -> Checkpoint:
    """The checkpoint in a file of `save_checkpoint`.

    Raises FileFormatError for a state alone, and for a file that has changed since.
    """
    return _read(Path(path), _checkpoint)


def _put_state(file: h5py.File, state: State) -> None:
    group = file.create_group(GROUP)
    group["index"], group["time"] = state.index, state.time
    for name in (*ARRAYS, *RUBBED):
        group[name] = getattr(state, name)
    for name in MORE:
        if getattr(state, name).size:
            group[name] = getattr(state, name)


def _read(
    path: Path, reader: Callable[[Path, h5py.File], Read], what: str = "a saved state"
) -> Read:
    """What a reader finds in a file; any damage becomes a FileFormatError."""
    check_is_regular(path)
    if not path.is_file():
        raise FileFormatError(f"{path}: no such file")
    try:
        with h5py.File(path, "r") as file:
            check_contained(path, file)
            return reader(path, file)
    except FileFormatError:
        raise
    except InvalidInput as reason:
        raise FileFormatError(f"{path}: {reason}") from reason
    except DAMAGE as reason:
        raise FileFormatError(
            f"{path}: expected {what} (HDF5), got: {str(reason).splitlines()[0]}"
        ) from reason


def _state(path: Path, file: h5py.File) -> State:
    if GROUP not in file:
        raise FileFormatError(f"{path}: /{GROUP}: missing group")
    group: Any = file[GROUP]
    more = RUBBED | dict.fromkeys(MORE, 1)
    known = ARRAYS | {name: k for name, k in more.items() if name in group}
    values = {name: np.asarray(group[name][()], dtype=float) for name in known}
    for name, dimensions in known.items():
        if values[name].ndim != dimensions:
            raise FileFormatError(
                f"{path}: /{GROUP}/{name}: expected {dimensions} dimensions, "
                f"got shape {values[name].shape}"
            )
    return State(int(group["index"][()]), float(group["time"][()]), **values)


def _checkpoint(path: Path, file: h5py.File) -> Checkpoint:
    state = _state(path, file)
    if RUN not in file:
        raise FileFormatError(
            f"{path}: /{RUN}: missing group: this is a state alone, without the table and the "
            "case of its run; evolve(..., start=load_state(...)) goes on from it"
        )
    group: Any = file[RUN]
    case = group["case"][()].tobytes().decode()
    inner: Any = file[GROUP]
    record = group["record"][()].tobytes().decode() if "record" in group else "{}"
    found = Checkpoint(state, json.loads(case), group["table"][()], group["pictures"][()],
                       json.loads(record), all(name in inner for name in RUBBED))  # fmt: skip
    if group["digest"][()].tobytes() != _digest(found, case):
        raise FileFormatError(f"{path}: has changed since it was written: the digest differs")
    return found


def _digest(checkpoint: Checkpoint, case: str) -> bytes:
    """A hash of all that a checkpoint holds."""
    state = checkpoint.state
    names = (*ARRAYS, *RUBBED) if checkpoint.counts_slip else tuple(ARRAYS)
    parts = [np.array([state.index]), np.array([state.time]),
             *(getattr(state, name) for name in names),
             *(more for name in MORE if (more := getattr(state, name)).size),
             checkpoint.table, checkpoint.pictures]  # fmt: skip
    whole = hashlib.sha256(case.encode())
    if checkpoint.counts_slip:  # older versions have no record either
        whole.update(json.dumps(checkpoint.record, sort_keys=True).encode())
    for part in parts:
        whole.update(f"{part.dtype.descr} {part.shape}".encode())
        whole.update(np.ascontiguousarray(part).tobytes())
    return whole.digest()


def export_fclib(
    steps: Iterator[TimeStep], folder: str | os.PathLike[str], name: str = "step",
    chosen: Sequence[range] | None = None,
) -> Iterator[TimeStep]:  # fmt: skip
    """The same steps, the problem of each written to FOLDER/NAME-00001.hdf5 and so on.

    chosen: the steps, counted from 1, that are written; all without.  The reactions of the step
    go along as the file's solution.  A step without contacts has no problem and no file.
    """
    folder = Path(folder)
    make_folder(folder)
    for step in steps:
        wanted = chosen is None or any(step.state.index in part for part in chosen)
        if wanted and step.problem.contacts:
            problem: Any = step.problem  # another form is refused
            write_fclib(
                problem, folder / f"{name}-{step.state.index:05d}.hdf5",
                solution=step.solution, title=f"{step.problem.name or name}, t = {step.time:g}",
            )  # fmt: skip
        yield step


def steps_of(text: str) -> list[range]:
    """The steps of "1-40,50-500:10,777": single ones, from-to, from-to:every; from 1 on.

    >>> [list(part) for part in steps_of("1-3,10-30:10,77")]
    [[1, 2, 3], [10, 20, 30], [77]]
    """
    found = []
    for word in text.split(","):
        match = re.fullmatch(r"\s*(\d{1,9})(?:-(\d{1,9})(?::(\d{1,9}))?)?\s*", word)
        first, last, every = (int(n or 0) for n in match.groups()) if match else (0, 0, 0)
        last, every = last or first, every or (1 if match and match[3] is None else 0)
        if not 1 <= first <= last or every < 1:
            raise InvalidInput(
                f"expected 7, 1-40 or 50-500:10, with commas between them, got {word!r}",
                ("steps",),
            )
        found.append(range(first, last + 1, every))
    return found
