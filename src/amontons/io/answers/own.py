"""Our own answers: displacements and contact forces of a solution.h5."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ...analysis.audit import Answer
from ...core.errors import FileFormatError
from ...core.hdf5 import check_file

if TYPE_CHECKING:
    from ...mechanics.model import Model


def read_own(path: Path, model: Model) -> Answer:
    """Displacements of every body and r; raises FileFormatError for another model's."""
    import h5py

    try:
        check_file(path)
        with h5py.File(path, "r") as file:
            if "displacement" not in file:
                raise FileFormatError(
                    f"{path}: holds no displacements of bodies: a discrete problem, or no "
                    "results of a model"
                )
            group: Any = file["displacement"]
            moved = []
            for body in model.bodies:
                if body.name not in group:
                    raise FileFormatError(
                        f"{path}: has no displacements of body {body.name!r}, but of "
                        f"{', '.join(group)}: it is the result of another model"
                    )
                moved.append(np.asarray(group[body.name], dtype=float))
            given: Any = file["r"] if "r" in file else None
            r = None if given is None else np.asarray(given, dtype=float)
    except OSError as reason:
        raise FileFormatError(f"{path}: can not be read as HDF5: {reason}") from None
    for body, values in zip(model.bodies, moved, strict=True):
        if values.shape != body.mesh.points.shape:
            raise FileFormatError(
                f"{path}: body {body.name!r}: {values.shape[0]} nodes with displacements, the "
                f"model has {len(body.mesh.points)}: it is the result of another model"
            )
        if not np.isfinite(values).all():
            raise FileFormatError(f"{path}: body {body.name!r}: displacements are not finite")
    return Answer(tuple(moved), reactions=r)
