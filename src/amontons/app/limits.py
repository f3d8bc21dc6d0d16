"""Questions about limits of load and friction, of a model or a discrete problem."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from ..core.arrays import number
from ..core.clock import TimeLimit
from ..core.errors import InvalidInput, UnsupportedForm, shown
from ..problem.friction import FrictionProblem
from .api import checked

if TYPE_CHECKING:
    from ..analysis.limits.collapse import Collapse
    from ..analysis.limits.jamming import Jamming
    from ..mechanics.model import Model
    from ..mechanics.model.parts import Load

TOUCHING = 1e-9  # gap, relative to the size of a node's area, up to which a contact touches


def jamming_friction(
    problem: FrictionProblem | Model, *, time_limit: TimeLimit = None
) -> Jamming:
    """Bounds on the smallest friction at which a state can be locked in without load.

    Both are proved: below `lower` no reactions inside of the friction cones hold each other,
    at `upper` the `r` of the answer do.  Loads are not read; the friction given is the shape of
    that over the contacts.  Of a model the contacts that touch at first; of a discrete problem,
    whose M is a stiffness, all.  time_limit: seconds, by default 30, for the search over
    patterns of open contacts, without which lower is that of all contacts closed.  Raises
    UnsupportedLaw unless the law is Coulomb's.
    """
    from ..analysis.limits.jamming import jamming_friction as bounds

    given = checked(problem)
    if isinstance(given, FrictionProblem):
        return bounds(given, time_limit=time_limit)
    discrete, parts = _assembled(given, "jamming_friction"), given.discretisation
    size = parts.sites.weights ** (1 / max(given.dimension - 1, 1))
    return bounds(discrete, np.abs(parts.gap) <= TOUCHING * size, time_limit=time_limit)


def collapse_load(
    problem: FrictionProblem | Model, live: Sequence[Load] | ArrayLike, *, gap: float = 2e-3,
    time_limit: TimeLimit = None,
) -> Collapse:  # fmt: skip
    """Bounds on the factor of a live load at which blocks in frictional contact give way.

    Both are proved: nothing moves below `lower`, although slip is not normal to the friction
    cone, and there is no balance beyond `upper`.  The loads of the problem are dead.  live:
    loads of a model, such as [BodyForce((1, 0))], or f (n,) of a problem in global form.
    Deformations are left out: bodies move as wholes.  gap: relative distance of the bounds that
    is good enough; time_limit: seconds, by default 60.  Raises UnsupportedLaw unless the law is
    Coulomb's, InvalidInput for a model whose supports leave no body such a motion.
    """
    from ..analysis.limits.collapse import collapse_load as bounds

    given = checked(problem)
    if not 0 < number("gap", gap) < 1:
        raise InvalidInput(f"gap: expected a number between 0 and 1, got {gap!r}")
    if isinstance(given, FrictionProblem):
        return bounds(given, live, gap=gap, time_limit=time_limit)
    discrete, parts = _assembled(given, "collapse_load"), given.discretisation
    if not discrete.loose_modes.shape[1]:  # its M is a stiffness, no mass that resists all
        raise InvalidInput(
            "collapse_load: supports hold every body, so none can move as a whole under any "
            "load; expected blocks that contact holds"
        )
    from ..mechanics.model.parts import Load
    from ..mechanics.model.supports import external_load

    loads: Any = live
    if not isinstance(loads, list | tuple) or not all(isinstance(one, Load) for one in loads):
        raise InvalidInput(
            f"live: expected loads of the model, such as [BodyForce((1, 0))], got {shown(live)}"
        )
    force = external_load(given.bodies, loads, parts.beside, own=False)
    return bounds(discrete, parts.gathered(force), gap=gap, time_limit=time_limit)


def _assembled(model: Model, verb: str) -> FrictionProblem:
    if model.kind is not FrictionProblem:
        raise UnsupportedForm(
            f"{verb}: expected linear elastic or rigid bodies in contact of small kinematics, "
            "method 'nodal' or 'mortar'"
        )
    return model.assemble()
