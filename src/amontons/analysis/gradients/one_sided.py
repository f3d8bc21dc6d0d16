"""All one-sided derivatives of a solution with contacts on the border of their statuses.

The solutions over a parameter p that carries the data along the asked direction leave along
the tangents of `paths.first_order`; those with p' > 0 are the derivatives for a small step that
way, one each.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...core.errors import AmontonsError
from ...problem.law import Coulomb, Tresca
from ...problem.solution import FrictionSolution
from ..paths.first_order import first_order
from ..paths.friction_path import FrictionPath
from .gradient import OneSided
from .linearised import Linearised

Array = NDArray[np.float64]
FORWARD = 1e-9  # rate of the parameter, of a tangent of length 1, that leads on


def sides_of(
    at: Linearised, F: Array | None, h: Array, mu: Array, bound: Array
) -> tuple[tuple[OneSided, ...], bool, str]:
    """(one-sided derivatives, whether these are all, what is to be said) along a direction.

    F (n,) or None, h (nc, d): changes of f and of w or q; mu, bound (nc,).
    """
    problem, solution = at.problem, at.solution
    law = problem.law
    if not isinstance(law, Coulomb | Tresca):
        return (), False, (
            "one-sided derivatives are found for Coulomb's and Tresca's law, not for "
            f"{law.name}"
        )
    rate = mu if isinstance(law, Coulomb) else bound
    falls = rate < 0
    if (falls & (law.coefficient == 0)).any():
        return (), False, "friction falls below zero along this direction"
    most = float((law.coefficient[falls] / -rate[falls]).min(initial=np.inf)) / 2
    try:
        part = min(most, _part(solution, F, h, rate))
    except AmontonsError as reason:
        return (), False, f"one-sided derivatives were not found: {reason}"
    changes: dict = {"law": type(law)(law.coefficient + part * rate)}
    if F is not None:
        changes |= {"f": problem.f + part * F, "w": problem.w + part * h}
    else:
        changes |= {"q": problem.q + part * h}
    try:
        path = FrictionPath(problem, replace(problem, **changes, guess=None))
        found = first_order(path, path.state(solution.r), 0.0, tolerance=_reach(path, at))
    except AmontonsError as reason:
        return (), False, f"one-sided derivatives were not found: {reason}"
    sides = tuple(
        _side(solution, path.reaction_rates(t.direction / (part * t.rate)), F, h, str(t.piece))
        for t in found.tangents if t.rate > FORWARD
    )  # fmt: skip
    reason = found.reason if not found.complete else ""
    if found.complete and not sides:
        reason = "no solution leaves that way: it ends here, at a fold or by a jump"
    return sides, found.complete, reason


def _part(solution: FrictionSolution, F: Array | None, h: Array, rate: Array) -> float:
    """How far along the direction data change by as much as carries the state.

    The list is that of a cone: it must not depend on how long the direction is given.
    """
    problem: Any = solution.problem
    root = np.sqrt(np.where(problem.rho > 0, problem.rho, 0.0))[:, None]
    change = h if F is None else h + (problem.H.T @ problem.solve_M(F)).reshape(h.shape)
    carried = float(np.linalg.norm(solution.r / np.where(root > 0, root, 1.0)))
    if carried == 0.0:
        carried = float(np.linalg.norm(root * solution.u)) or 1.0
    usual = float(problem.law.coefficient.max(initial=0.0))
    if usual == 0.0:  # Coulomb's is a number, a bound a force
        bounded = isinstance(problem.law, Tresca)
        usual = (float(np.abs(solution.r).max(initial=0.0)) if bounded else 0.0) or 1.0
    grows = max(float(np.linalg.norm(root * change)) / carried, np.abs(rate).max() / usual)
    return 1.0 / grows if grows > 0 else 1.0


def _reach(path: FrictionPath, at: Linearised) -> float:
    """Distance to a border, in unknowns of the path, within which a contact is weak."""
    worst = 1e-9
    d = at.problem.dimension
    scaled = at.solution.margin / path.to_r[::d]
    for i in at.weak:
        worst = max(worst, 2.0 * float(scaled[i]))
    return min(worst, 1e-6)


def _side(
    solution: FrictionSolution, r: Array, F: Array | None, h: Array, piece: str
) -> OneSided:
    """The change of u and v with that of r."""
    problem = solution.problem
    if F is None:
        u = (problem.W @ r.ravel()).reshape(r.shape) + h  # type: ignore[attr-defined]
        return OneSided(r, u, None, piece)
    v = problem.solve_M(problem.H @ r.ravel() + F)  # type: ignore[attr-defined]
    return OneSided(r, (problem.H.T @ v).reshape(r.shape) + h, v, piece)  # type: ignore[attr-defined]
