"""What plastic flow changes in the fields of a model: forces of supports, stresses."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from ...problem.solution import FrictionSolution
from .fields import ContactFields, by_body
from .reactions import support_forces
from .supports import external_load
from .yielding import yielding_step

if TYPE_CHECKING:
    from .model import Model


def with_flow(
    model: Model, fields: ContactFields, solution: FrictionSolution
) -> ContactFields:
    """The fields of a static solution of bodies that had not flown before."""
    parts, factor = model.discretisation, model.load_factor
    assert solution.v is not None
    load = factor * external_load(model.bodies, model.loads, parts.beside)
    problem = yielding_step(model, load, factor * parts.prescribed)
    q = problem.displacement(solution.v)
    found = problem.yielding.respond(q, problem.history, tangent=False)
    held = support_forces(parts, parts.missing(q, load + found.forces, solution.r))
    return replace(
        fields, reaction=by_body(model.bodies, parts, np.asarray(held)),
        plastic=problem.yielding.histories(found.history),
    )  # fmt: skip
