"""Displacements and contact fields at finite strains, in words of mechanics.

Frames, gaps and slips are those of the deformed state, and so are weights, the areas of now
that `contact.grown_areas` has for stresses of laws: pressure and shear are true stresses.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ...core.errors import InvalidInput, InvertedCells
from ...problem.solution import FrictionSolution
from .faced import Faced
from .fields import ContactFields, at_once, by_body, load_wrench
from .nodal_forces import nodal_forces
from .nonlinear_parts import nonlinear_parts
from .reactions import support_forces

if TYPE_CHECKING:
    from .model import Model

Array = NDArray[np.float64]


def recover_large(
    model: Model, surfaces: tuple[tuple[int, str], ...], solution: FrictionSolution
) -> ContactFields:
    """Fields of a solution at the model's load factor; surfaces: (body, slave) per pair."""
    linear, parts = model.discretisation, nonlinear_parts(model)
    whole = model.load_factor * linear.prescribed
    if solution.v is None or solution.v.shape != linear.free.shape:
        raise InvalidInput("solution: it belongs to another model, or holds no displacements")
    whole[linear.free] = solution.v
    r, u, moved = solution.r, solution.u, whole.reshape(parts.X.shape)
    sites = linear.sites
    meeting = parts.meet(moved)
    axes = meeting.frames
    own = np.einsum("pkc,pk->pc", axes, r)
    faced = Faced.of(meeting, sites.weights, own)
    force, traction = own * faced.passed[:, None], r / faced.areas[:, None]
    load = (model.load_factor * nodal_forces(model, model.loads)).at(moved)
    pushed = meeting.pushed(axes, r)
    try:
        held = support_forces(linear, parts.forces(moved) - load - pushed)
    except InvertedCells:  # of a state that has not converged: nobody knows its forces
        held = np.zeros_like(whole)
    displacement = by_body(model.bodies, linear, whole)
    return ContactFields(
        displacement=displacement, points=parts.points, frames=axes, weights=faced.areas,
        gap=u[:, 0], pressure=traction[:, 0], shear=traction[:, 1:], slip=u[:, 1:],
        force=force, resultant=force.sum(axis=0),
        body=sites.body, node=sites.node,
        facets=tuple((k, model.bodies[k].mesh.surface(name)) for k, name in surfaces),
        reaction=by_body(model.bodies, linear, held),
        load=load_wrench(model, displacement, load), status=solution.status,
        references=None, faced=faced, **at_once(solution),
    )  # fmt: skip
