"""A solved model as one VTK file: bodies, displacement, stress, and contact fields at nodes."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..linear.blocks import spatial
from ..mechanics.elements import cell_stress, von_mises
from ..mechanics.elements.hyperelasticity import cauchy_stress, is_hyperelastic
from ..mechanics.elements.rigid import Rigid
from ..mechanics.meshes.write import write_meshes
from ..problem.solution import FrictionSolution

if TYPE_CHECKING:
    from ..mechanics.model import Body, ContactFields, Model

Array = NDArray[np.float64]
OFF = -1  # CSTATUS of nodes that are no contact; the other contact fields are zero there


def write_model(
    model: Model, fields: ContactFields, solution: FrictionSolution, path: Path
) -> None:
    """Write all bodies with `displacement`, `von_mises` and the fields people know.

    COPEN gap, CPRESS pressure (positive in compression), CSHEAR and CSLIP lengths of the shear
    traction and of the slip, CSTATUS 0 open, 1 slip, 2 stick and -1 off the contact surface,
    CSLIDING 0 or 1, CFORCE force on the slave in global axes.  Corners of triangles of second
    order are no contacts: the first four get the mean of the contacts around.  By Nitsche's
    method a node takes the Gauss points next to it: means of CPRESS and CSHEAR by area.

    Field data CONVERGED, 0 or 1, and ERROR; a cell field CONVERGED as well, to be seen at once.

    Where several pairs meet at a node, CFORCE, CPRESS and CSHEAR are those of the sum of their
    forces, pressures and shear vectors; COPEN is the least, CSLIP, CSTATUS, CSLIDING the most.
    """
    pairs = list(zip(model.bodies, fields.displacement, strict=True))
    starts = np.cumsum([0, *(len(body.mesh.points) for body, _ in pairs)])
    stress = [_stress(body, moved) for body, moved in pairs]
    owner = [np.full(body.mesh.cell_count, k) for k, (body, _) in enumerate(pairs)]
    displacement = spatial(np.concatenate(fields.displacement))
    record = getattr(solution, "solution", solution).convergence  # of a step in time, too
    converged = int(not record.stamp)
    cells = len(np.concatenate(owner))
    write_meshes(
        path,
        [body.mesh for body, _ in pairs],
        {"displacement": displacement, **_contact_fields(model, fields, solution, starts)},
        {"von_mises": von_mises(np.concatenate(stress)), "body": np.concatenate(owner),
         "CONVERGED": np.full(cells, converged, dtype=np.int8)},
        {"CONVERGED": converged, "ERROR": float(record.error)},
        record.stamp,
    )  # fmt: skip


def _stress(body: Body, moved: Array) -> Array:
    """Stress (cells, 3, 3) at displacements (nodes, d); 0 in a rigid body, nobody knows it."""
    if isinstance(body.material, Rigid):
        return np.zeros((body.mesh.cell_count, 3, 3))
    stress: Any = cauchy_stress if is_hyperelastic(body.material) else cell_stress
    return stress(body.mesh, body.material, moved)


def _contact_fields(
    model: Model, fields: ContactFields, solution: FrictionSolution, starts: NDArray[np.int64]
) -> dict[str, NDArray]:
    """Values per node of all bodies."""
    at = starts[fields.body] + fields.node
    nodes, index = np.unique(at, return_inverse=True)
    share = _shares(model, fields, at)
    shear = np.einsum("ik,ikc->ic", fields.shear, fields.frames[:, 1:])  # global axes: they add
    slip = np.linalg.norm(fields.slip, axis=1)
    found = {
        "COPEN": _gathered(np.minimum, fields.gap, index),
        "CPRESS": _gathered(np.add, share * fields.pressure, index),
        "CSHEAR": np.linalg.norm(_gathered(np.add, share[:, None] * shear, index), axis=1),
        "CSLIP": _gathered(np.maximum, slip, index),
        "CSTATUS": _gathered(np.maximum, solution.status.astype(np.int32), index),
        "CSLIDING": _gathered(np.maximum, solution.sliding.astype(np.int32), index),
        "CFORCE": spatial(_gathered(np.add, fields.force, index)),
    }
    out = {}
    for name, values in found.items():
        everywhere = np.zeros((starts[-1], *values.shape[1:]), dtype=values.dtype)
        if name == "CSTATUS":
            everywhere[:] = OFF
        everywhere[nodes] = values
        out[name] = everywhere
    for name in ("COPEN", "CPRESS", "CSHEAR", "CSLIP"):
        out[name] = _with_corners(out[name], fields, starts)
    return out


def _shares(model: Model, fields: ContactFields, at: NDArray[np.int64]) -> Array:
    """Part of each contact in its pair's area at the node, (nc,): 1 but for Gauss points."""
    sizes = [len(placed.rows.nodes) for placed in model.discretisation.placed]
    pair = np.repeat(np.arange(len(sizes)), sizes)
    _, label = np.unique(np.stack([pair, at]), axis=1, return_inverse=True)
    total = np.bincount(label.ravel(), fields.weights)
    whole = total[label.ravel()]
    return np.divide(fields.weights, whole, out=np.ones(len(at)), where=whole > 0)


def _gathered(combine: np.ufunc, values: NDArray, index: NDArray[np.int64]) -> NDArray:
    """Values of the contacts at each node, combined; index (nc,): their place in the result."""
    out = np.zeros((index.max(initial=-1) + 1, *values.shape[1:]), dtype=values.dtype)
    out[index] = values  # one of them, to begin with
    if combine is np.add:
        out[:] = 0
    combine.at(out, index, values)
    return out


def _with_corners(values: Array, fields: ContactFields, starts: NDArray[np.int64]) -> Array:
    """Values (n,) with means at corners of triangles of second order: no contacts there."""
    total, count = np.zeros_like(values), np.zeros_like(values)
    for body, blocks in fields.facets:
        for facets in blocks:
            if facets.kind == "tri6":
                nodes = facets.nodes + starts[body]
                for k in range(3):
                    sides = nodes[:, [3 + k, 3 + (k - 1) % 3]]
                    np.add.at(total, nodes[:, k], values[sides].mean(axis=1))
                    np.add.at(count, nodes[:, k], 1)
    return np.where(count > 0, total / np.maximum(count, 1), values)
