"""Files of an evolution: its state, to go on from, and its discrete problems as FCLib files."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

import h5py
import numpy as np

from .errors import FileFormatError, InvalidInput
from .evolution import State, TimeStep
from .fclib import DAMAGE, write_fclib
from .files import check_is_regular, make_folder, replacing
from .hdf5 import check_contained

GROUP = "amontons_state"
ARRAYS = {"displacement": 1, "velocity": 1, "force": 2, "slip": 2}  # name: dimensions


def save_state(path: str | os.PathLike[str], state: State) -> None:
    """Write a state; nothing on failure."""
    with replacing(path) as temporary, h5py.File(temporary, "w") as file:
        group = file.create_group(GROUP)
        group["index"], group["time"] = state.index, state.time
        for name in ARRAYS:
            group[name] = getattr(state, name)


def load_state(path: str | os.PathLike[str]) -> State:
    """The state in a file of `save_state`; raises FileFormatError naming file and dataset."""
    path = Path(path)
    check_is_regular(path)
    if not path.is_file():
        raise FileFormatError(f"{path}: no such file")
    try:
        with h5py.File(path, "r") as file:
            check_contained(path, file)
            if GROUP not in file:
                raise FileFormatError(f"{path}: /{GROUP}: missing group")
            group = file[GROUP]
            values = {name: np.asarray(group[name][()], dtype=float) for name in ARRAYS}
            for name, dimensions in ARRAYS.items():
                if values[name].ndim != dimensions:
                    raise FileFormatError(
                        f"{path}: /{GROUP}/{name}: expected {dimensions} dimensions, "
                        f"got shape {values[name].shape}"
                    )
            return State(int(group["index"][()]), float(group["time"][()]), **values)
    except FileFormatError:
        raise
    except InvalidInput as reason:
        raise FileFormatError(f"{path}: {reason}") from reason
    except DAMAGE as reason:
        raise FileFormatError(
            f"{path}: expected a saved state (HDF5), got: {str(reason).splitlines()[0]}"
        ) from reason


def export_fclib(
    steps: Iterator[TimeStep], folder: str | os.PathLike[str], name: str = "step"
) -> Iterator[TimeStep]:
    """The same steps, the problem of each written to FOLDER/NAME-00001.hdf5 and so on.

    The reactions of the step go along as the file's solution.  A step without contacts has no
    problem and no file.
    """
    folder = Path(folder)
    make_folder(folder)
    for step in steps:
        if step.problem.contacts:
            write_fclib(
                step.problem, folder / f"{name}-{step.state.index:05d}.hdf5",
                solution=step.solution, title=f"{step.problem.name or name}, t = {step.time:g}",
            )  # fmt: skip
        yield step
