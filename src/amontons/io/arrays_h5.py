"""The arrays of solution.h5, each with what it means and its unit."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from .fclib import put_arrays

if TYPE_CHECKING:
    from h5py import File

    from ..mechanics.model import ContactFields, Model
    from ..problem.solution import FrictionSolution

MEANING = {  # name: (unit, what it is)
    "r": ("force", "reactions in the local frames, (contacts, d)"),
    "u": ("length", "gaps and tangential displacements in the local frames, (contacts, d)"),
    "v": ("length", "unknowns: displacements of the free dofs, (n,)"),
    "status": ("1", "0 open, 1 slip, 2 stick, (contacts,)"),
    "sliding": ("1", "1 where the law lets a contact slide, (contacts,)"),
    "margin": ("force", "distance of every contact to its next status, (contacts,)"),
    "points": ("length", "where the contacts are, undeformed, (contacts, d)"),
    "frames": ("1", "local frames, rows n, t1, t2, (contacts, d, d)"),
    "weights": ("area", "area of every contact, current with kinematics finite, (contacts,)"),
    "pressure": ("stress", "normal traction, > 0 in compression, (contacts,)"),
    "shear": ("stress", "tangential traction on the slave in the local frame, (contacts, d-1)"),
    "force": ("force", "force on the slave, global axes, (contacts, d)"),
    "pair": ("1", "number of the contact pair, names in the attribute, (contacts,)"),
    "displacement": ("length", "displacement of the nodes of a body, (nodes, d)"),
    "reaction": ("force", "forces of supports at the nodes of a body, (nodes, d)"),
}
SPEED = {"u": "velocity", "v": "velocity"}  # or lengths: a discrete problem does not know
UNITS = "those of the input: nothing is converted; in 2D forces and areas are per thickness"


def notes_of(title: str, versions: dict[str, str]) -> dict[str, str]:
    """Attributes of a file: title, units, and the version that wrote it."""
    return {"title": title, "units": UNITS, "version": versions.get("amontons", "unknown")}


def put_all(
    file: File, found: FrictionSolution, model: Model | None, fields: ContactFields | None,
    notes: dict[str, str | float],
) -> None:  # fmt: skip
    """Add all arrays of a solution to a file, and attributes of the file."""
    arrays: dict[str, NDArray | None] = {
        "r": found.r, "u": found.u, "v": found.v, "status": found.status,
        "sliding": found.sliding.astype(np.int8), "margin": found.margin,
    }  # fmt: skip
    if model is not None and fields is not None:
        arrays |= {name: getattr(fields, name) for name in (
            "points", "frames", "weights", "pressure", "shear", "force")}  # fmt: skip
        sizes = [len(placed.rows.nodes) for placed in model.discretisation.placed]
        arrays["pair"] = np.repeat(np.arange(len(sizes)), sizes)
        for kind in ("displacement", "reaction"):
            for body, values in zip(model.bodies, getattr(fields, kind), strict=True):
                arrays[f"{kind}/{body.name}"] = values
    kept = {name: values for name, values in arrays.items() if values is not None}
    put_arrays(file, kept, notes)
    for name in kept:
        unit, meaning = MEANING[name.split("/")[0]]
        if model is None and name in SPEED:
            unit = f"{SPEED[name]} or {unit}"
        file[name].attrs.update({"unit": unit, "meaning": meaning})
    if model is not None and "pair" in kept:
        file["pair"].attrs["names"] = list(model.pair_names)
