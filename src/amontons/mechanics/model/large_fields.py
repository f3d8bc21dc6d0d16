"""Displacements and contact fields at finite strains, in words of mechanics.

Frames, gaps and slips are those of the deformed state.  pressure and shear are forces per area
of the reference configuration (first Piola-Kirchhoff), which weights are too.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ...core.errors import InvalidInput
from ...problem.solution import FrictionSolution
from ..contact import frames
from .fields import ContactFields
from .nonlinear_parts import nonlinear_parts

if TYPE_CHECKING:
    from .model import Model

Array = NDArray[np.float64]


def recover_large(
    model: Model, surfaces: tuple[tuple[int, str], ...], solution: FrictionSolution
) -> ContactFields:
    """Fields of a solution at the model's load factor; surfaces: (body, slave) per pair."""
    linear = model.discretisation
    whole = model.load_factor * linear.prescribed
    if solution.v is None or solution.v.shape != linear.free.shape:
        raise InvalidInput("solution: it belongs to another model, or holds no displacements")
    whole[linear.free] = solution.v
    return large_fields(model, surfaces, whole, solution.r, solution.u)


def large_fields(
    model: Model, surfaces: tuple[tuple[int, str], ...], displacement: Array, r: Array, u: Array
) -> ContactFields:
    """Fields of displacements (dofs,); r and u = [gap, slip] (nc, d) in the frames there."""
    parts = nonlinear_parts(model)
    rows = [placed.rows for placed in model.discretisation.placed]
    axes = frames(parts.meet(displacement.reshape(parts.X.shape)).normals)
    weights = np.concatenate([row.weights for row in rows])
    force = np.einsum("pkc,pk->pc", axes, r)
    traction = r / weights[:, None]
    bodies = np.split(displacement.reshape(parts.X.shape), parts.ends)
    return ContactFields(
        displacement=tuple(bodies), points=parts.points, frames=axes, weights=weights,
        gap=u[:, 0], pressure=traction[:, 0], shear=traction[:, 1:], slip=u[:, 1:],
        force=force, resultant=force.sum(axis=0),
        body=np.concatenate([np.full(len(p.rows.nodes), p.body)
                             for p in model.discretisation.placed]),
        node=np.concatenate([row.nodes for row in rows]),
        facets=tuple((k, model.bodies[k].mesh.surface(name)) for k, name in surfaces),
    )  # fmt: skip
