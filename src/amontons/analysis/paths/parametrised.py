"""From a model or a problem and the name of a parameter to a path and a first point."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, Any, cast

import numpy as np
from numpy.typing import NDArray

from ...core.arrays import real
from ...core.errors import InvalidInput, NotConverged, SingularOperator
from ...mechanics.model.large_deformation import LargeDeformation
from ...mechanics.steps.system import Motion
from ...problem.friction import Form, FrictionProblem
from ...problem.protocol import Problem
from ...problem.solution import Outcome
from ...solvers.driver import drive
from .friction_path import FrictionPath
from .large_path import LargePath
from .load_path import LoadPath, load_path
from .path import PathProblem
from .rubbing_path import rubbing_path
from .starting import exact_state

if TYPE_CHECKING:
    from ...mechanics.model import Model

Array = NDArray[np.float64]
PARAMETERS = ("load", "friction")
START = 1e-10  # error of the solution from which continuation starts


def path_of(
    problem: Model | FrictionProblem, parameter: str, interval: tuple[float, float],
    base: Model | FrictionProblem | None = None,
) -> FrictionPath | LargePath:  # fmt: skip
    """The problems that a parameter runs through.

    "load": loads and supports that depend on time t are taken at t; where none does, all of
    them grow with the parameter as load factor, f of a problem in global form, q in Delassus
    form.  base, for "load": the problem at 0, `problem` being that at 1.  "friction": the
    coefficients keep their ratios, the parameter is the largest.
    """
    if parameter not in PARAMETERS:
        raise InvalidInput(
            f"parameter: expected one of {', '.join(PARAMETERS)}, got {parameter!r}"
        )
    if parameter == "friction":
        if base is not None:
            raise InvalidInput("base: expected none where friction is the parameter")
        if interval[0] < 0:
            raise InvalidInput(f"interval: expected friction >= 0, got {interval[0]:g}")
        over = rubbing_path if problem.kind is LargeDeformation else _rubbing
        return over(cast(Any, problem))
    return UNDER_LOAD.get(problem.kind, _of_reactions)(problem, interval, base)


def _rubbing(problem: Model | FrictionProblem) -> FrictionPath:
    return FrictionPath.friction(_discrete(problem))


def _of_displacements(problem: Any, interval: tuple[float, float], base: Any) -> LoadPath:
    """Of a model in large deformations."""
    if base is not None:
        raise InvalidInput("base: expected none for a model with hyperelastic laws")
    return load_path(problem, interval)


def _of_reactions(
    problem: Model | FrictionProblem, interval: tuple[float, float],
    base: Model | FrictionProblem | None,
) -> FrictionPath:  # fmt: skip
    """Of a problem that is linear but for its law, or a model of such."""
    if base is not None:
        return _between(_discrete(base), _discrete(problem))
    if isinstance(problem, FrictionProblem):
        _discrete(problem)
        nothing = problem.f if problem.form is Form.GLOBAL else problem.q
        assert nothing is not None
        return _between(problem.with_load(np.zeros_like(nothing)), problem)
    motion = Motion(problem)
    if not motion.is_timed:
        return _between(problem.with_load(0.0).assemble(), problem.with_load(1.0).assemble())
    return _in_time(motion, interval)


UNDER_LOAD: dict[type[Problem], Callable[..., FrictionPath | LoadPath]] = {  # by kind
    LargeDeformation: _of_displacements,
}


def _in_time(motion: Motion, interval: tuple[float, float]) -> FrictionPath:
    """Loads and supports at the time t, straight lines between the ends of the interval."""
    a, b = interval
    ends = motion.straight(
        interval, "follow it in parts, or with base=, from one load to another"
    )
    whole = motion.parts
    before = np.zeros((len(whole.gap), whole.carried.shape[1] - 1))
    steps = (motion.body.increment(*end, before) for end in ends)
    first, last = (cast(FrictionProblem, step) for step in steps)
    path = _between(first, last)
    return _between(path.at(-a / (b - a)), path.at((1 - a) / (b - a)))


def _between(start: FrictionProblem, end: FrictionProblem) -> FrictionPath:
    """A path whose ends share the factor of M, or W."""
    path = FrictionPath(start, end)
    same: dict[str, Any] = {"_shared": start._shared}
    same |= {"M": start.M, "H": start.H} if start.form is Form.GLOBAL else {"W": start.W}
    return FrictionPath(start, replace(end, **same), path.name)


def _discrete(problem: Model | FrictionProblem) -> FrictionProblem:
    """The problem, or that of a model; raises InvalidInput where it has no contacts."""
    discrete = problem if isinstance(problem, FrictionProblem) else problem.assemble()
    if not discrete.contacts:
        raise InvalidInput("problem: expected contacts, got none: there is nothing to follow")
    return discrete


def state_of(path: PathProblem, start: object) -> Array:
    """The unknowns of a start: a solution, reactions (nc, d), or the unknowns themselves."""
    if isinstance(path, LargePath):
        start = getattr(start, "v", start)
    r = getattr(start, "r", start)
    values = real("start", r)
    if not isinstance(path, FrictionPath):
        return values.ravel()
    wanted = (path.start.contacts, path.start.dimension)
    if values.shape != wanted:
        raise InvalidInput(f"start: expected reactions of shape {wanted}, got {values.shape}")
    return path.state(values)


def first_state(path: FrictionPath | LargePath, p: float) -> Array:
    """A solution to begin with: exact in 2D under Coulomb's law, else from a solver.

    Raises NotConverged where the solver finds none.
    """
    if isinstance(path, LargePath):
        return path.found_at(p)
    if path.start.dimension == 2 and not path.tresca:
        try:
            return exact_state(path, p)
        except SingularOperator:
            pass  # W is not positive definite: a solver may still find a solution
    found = drive(path.at(p), tolerance=START, time_limit=path.deadline)
    if found.convergence.outcome is not Outcome.CONVERGED:
        raise NotConverged(f"start: no solution at {p:g}: {found.convergence}", found)
    return path.state(found.r)
