"""A solved model as one VTK file: bodies, displacement, stress, and contact fields at nodes."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import meshio
import numpy as np
from numpy.typing import NDArray

from .solution import FrictionSolution

if TYPE_CHECKING:
    from .model import ContactFields, Model

Array = NDArray[np.float64]
CELL_TYPES = {
    "tri": "triangle", "quad": "quad", "tet": "tetra", "hex": "hexahedron", "wedge": "wedge",
    "pyramid": "pyramid",
}  # fmt: skip
OFF = -1  # CSTATUS of nodes that are no contact; the other contact fields are zero there


def write_model(
    model: Model, fields: ContactFields, solution: FrictionSolution, path: Path
) -> None:
    """Write all bodies with `displacement`, `von_mises` and the fields people know.

    COPEN gap, CPRESS pressure (positive in compression), CSHEAR and CSLIP lengths of the shear
    traction and of the slip, CSTATUS 0 open, 1 slip, 2 stick and -1 off the contact surface,
    CSLIDING 0 or 1, CFORCE force on the slave in global axes.
    """
    sizes = [len(body.mesh.points) for body in model.bodies]
    starts = np.concatenate([[0], np.cumsum(sizes)])
    cells, body_of_cell, stress = [], [], []
    for k, body in enumerate(model.bodies):
        stress.append(_von_mises(body, fields.displacement[k]))
        for block in body.mesh.cells:
            cells.append((CELL_TYPES[block.kind], block.nodes + starts[k]))
            body_of_cell.append(np.full(len(block.nodes), k))
    ends = np.cumsum([len(nodes) for _, nodes in cells])[:-1]
    meshio.Mesh(
        _spatial(np.concatenate([body.mesh.points for body in model.bodies])),
        cells,
        point_data={
            "displacement": _spatial(np.concatenate(fields.displacement)),
            **_contact_fields(fields, solution, starts),
        },
        cell_data={"von_mises": np.split(np.concatenate(stress), ends), "body": body_of_cell},
    ).write(path)


def _contact_fields(
    fields: ContactFields, solution: FrictionSolution, starts: NDArray[np.int64]
) -> dict[str, NDArray]:
    """Values per node of all bodies."""
    node = starts[fields.body] + fields.node
    values = {
        "COPEN": fields.gap,
        "CPRESS": fields.pressure,
        "CSHEAR": np.linalg.norm(fields.shear, axis=1),
        "CSLIP": np.linalg.norm(fields.slip, axis=1),
        "CSTATUS": solution.status.astype(np.int32),
        "CSLIDING": solution.sliding.astype(np.int32),
        "CFORCE": _spatial(fields.force),
    }
    out = {}
    for name, given in values.items():
        everywhere = np.zeros((starts[-1], *given.shape[1:]), dtype=given.dtype)
        if name == "CSTATUS":
            everywhere[:] = OFF
        everywhere[node] = given
        out[name] = everywhere
    return out


def _von_mises(body, displacement: Array) -> Array:
    """Von Mises stress at the centre of every cell, unit of stress."""
    from .fem import cell_stress, von_mises

    return von_mises(cell_stress(body.mesh, body.material, displacement))


def _spatial(vectors: Array) -> Array:
    """Rows of three components: VTK knows no plane."""
    out = np.zeros((len(vectors), 3))
    out[:, : vectors.shape[1]] = vectors
    return out
