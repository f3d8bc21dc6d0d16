"""A solved model as one VTK file: bodies, displacement, stress, and contact on both sides."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..linear.blocks import kernel_rows
from ..mechanics.elements import von_mises
from ..mechanics.elements.corotational import corotated_stress
from ..mechanics.elements.given import GivenMatrices
from ..mechanics.elements.nodal_stress import stress_of
from ..mechanics.elements.rigid import Rigid
from ..mechanics.elements.yielding import plastic_strain, relieved
from ..mechanics.meshes import Mesh
from ..mechanics.meshes.write import write_meshes
from ..mechanics.model.temperature import warming
from .contact_fields import contact_fields

if TYPE_CHECKING:
    from ..mechanics.model import Body, ContactFields, Model
    from ..mechanics.steps import TimeStep
    from ..problem.solution import FrictionSolution

Array = NDArray[np.float64]
ENTRIES = ((0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (0, 2))  # of a symmetric tensor, as in VTK


@dataclass(frozen=True, eq=False)
class ModelFields:
    """All that a file for viewers holds of a solved model.

    point, cell: values of nodes and cells of all bodies, one after another; whole: numbers of
    the whole, some of them names that stand for a number; stamp: "" of what has converged.
    """

    meshes: list[Mesh]
    point: dict[str, NDArray]
    cell: dict[str, NDArray]
    whole: dict[str, float]
    stamp: str


def write_model(
    model: Model, fields: ContactFields, solution: FrictionSolution | TimeStep, path: Path,
    title: str = "",
) -> None:  # fmt: skip
    """Write all bodies with the fields of `model_fields` as one VTU file."""
    found = model_fields(model, fields, solution, title)
    write_meshes(path, found.meshes, found.point, found.cell, found.whole, found.stamp)


def model_fields(
    model: Model, fields: ContactFields, solution: FrictionSolution | TimeStep, title: str = ""
) -> ModelFields:
    """The fields of a solution or of a step in time.

    At nodes displacement, reaction (force of supports), stress and von_mises (means of the
    cells around, by volume), and the fields of `contact_fields`.  In cells stress, von_mises at
    the centre, body (number of the connected part), region, CONVERGED.  Stresses have the six
    entries xx, yy, zz, xy, yz, xz; zero in rigid bodies and those with a given K.

    Of the whole: CONVERGED, 0 or 1, ERROR, TimeValue of a step, and what names say: `body 0:
    bracket`, `region 0: steel`, `title: …`, `version: …`.
    """
    from .results import versions

    starts = np.cumsum([0, *(len(body.mesh.points) for body in model.bodies)])
    stress = (
        (_six(centres), von_mises(centres), _six(nodes), von_mises(nodes))
        for centres, nodes in stresses(model, fields, getattr(solution, "time", None))
    )
    centres, at_centres, nodes, at_nodes = (_joined(each) for each in zip(*stress, strict=True))
    record = getattr(solution, "solution", solution).convergence  # of a step in time, too
    converged = int(not record.stamp)
    names, owner = _parts(model)
    regions, region = _regions(model)
    point = {
        "displacement": kernel_rows(_joined(fields.displacement)),
        "reaction": kernel_rows(_joined(fields.reaction)),
        "stress": nodes, "von_mises": at_nodes,
        **contact_fields(model, fields, solution.sliding, starts),
    }  # fmt: skip
    cell = {
        "stress": centres, "von_mises": at_centres, "body": owner,
        "region": region, "CONVERGED": np.full(len(owner), converged, dtype=np.int8),
    }  # fmt: skip
    if fields.plastic:
        cell["plastic_strain"] = np.concatenate([
            plastic_strain(body.mesh, body.material, fields.plastic[k])
            if k in fields.plastic else np.zeros(body.mesh.cell_count)
            for k, body in enumerate(model.bodies)
        ])  # fmt: skip
    whole: dict[str, Any] = {"CONVERGED": converged, "ERROR": float(record.error)}
    if hasattr(solution, "time"):
        whole["TimeValue"] = float(solution.time)  # as ParaView calls it
    whole |= {f"body {k}: {name}": k for k, name in enumerate(names)}
    whole |= {f"region {k}: {name}": k for k, name in enumerate(regions)}
    for body in model.bodies:
        if isinstance(body.material, GivenMatrices):
            whole[f"no stress, given K: {body.name}"] = 1
    if title or model.name:
        whole[f"title: {title or model.name}"] = 1
    whole[f"version: amontons {versions().get('amontons', '')}".rstrip()] = 1
    meshes = [body.mesh for body in model.bodies]
    return ModelFields(meshes, point, cell, whole, record.stamp)


def stresses(
    model: Model, fields: ContactFields, time: float | None
) -> Iterator[tuple[Array, Array]]:
    """Stress of cells and nodes of every body, one after another; time: of a step."""
    flown = fields.plastic or {}
    each = zip(model.bodies, fields.displacement, warming(model, time), strict=True)
    return (body_stress(*given, flown.get(k)) for k, given in enumerate(each))


def _joined(parts: Sequence[Array]) -> Array:
    """Rows of all parts; of one alone not a copy."""
    return parts[0] if len(parts) == 1 else np.concatenate(parts)


def body_stress(
    body: Body, moved: Array, warm: Array | None = None, flown: Array | None = None
) -> tuple[Array, Array]:
    """Stress of cells and nodes at displacements (nodes, d); 0 without a law.

    warm (nodes,): change of temperature; flown (h,): history of a body that yields.
    """
    if isinstance(body.material, Rigid | GivenMatrices):
        return np.zeros((body.mesh.cell_count, 3, 3)), np.zeros((len(moved), 3, 3))
    if body.corotational:
        return corotated_stress(body.mesh, body.material, moved)
    found = stress_of(body.mesh, body.material, moved, warm)
    return found if flown is None else relieved(body.mesh, body.material, found, flown)


def _six(stress: Array) -> Array:
    """The entries (k, 6) of symmetric tensors (k, 3, 3), in VTK's order."""
    return np.stack([stress[:, i, j] for i, j in ENTRIES], axis=1)


def _parts(model: Model) -> tuple[list[str], NDArray[np.int64]]:
    """Names of the connected parts of all bodies, and the part of every cell."""
    parts, d = model.discretisation.parts, model.dimension
    of = np.empty(model.beside.first // d, dtype=np.int64)
    for k, part in enumerate(parts):
        of[part.dofs[::d] // d] = k
    starts = model.discretisation.offsets // d
    owner = [
        of[start + block.nodes[:, 0]]
        for start, body in zip(starts, model.bodies, strict=False)
        for block in body.mesh.cells
    ]
    return [part.name for part in parts], np.concatenate(owner)


def _regions(model: Model) -> tuple[list[str], NDArray[np.int64]]:
    """Names of all regions, and the region of every cell."""
    names = list(dict.fromkeys(r for body in model.bodies for r in body.mesh.regions))
    of = [
        np.full(len(block.nodes), names.index(block.region))
        for body in model.bodies
        for block in body.mesh.cells
    ]
    return names, np.concatenate(of)
