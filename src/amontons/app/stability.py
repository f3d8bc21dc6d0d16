"""The verb `modes`: small motions about a sliding state."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy import sparse

from ..core.arrays import expect_shape, finite, number, sparse_matrix
from ..core.errors import InvalidInput, UnsupportedForm
from ..problem.friction import FrictionProblem
from ..problem.solution import FrictionSolution
from .api import solve
from .model_solution import ModelSolution

if TYPE_CHECKING:
    from ..analysis.stability.modes import Modes
    from ..mechanics.model import Model

ASYMMETRIC = 1e-9  # of the largest entry of a mass: what rounding may leave
FAR = 1e4  # times the largest displacement: the way that a given sliding has gone


def modes(
    target: Model | ModelSolution | FrictionSolution, count: int = 10, *, near: float = 0.0,
    velocity: Any = None, mass: Any = None, mass_damping: float = 0.0,
    stiffness_damping: float = 0.0, damping: Any = None, lumped: bool = False,
) -> Modes:  # fmt: skip
    """Complex modes of small motions about a solution, and which of them grow.

    target: a solution; a model is solved.  count modes nearest to the frequency `near`.
    velocity: motion of the slaves against what they meet, components or a function of x: the
    model is then solved as it slides that way everywhere, and in 3D slip that turns is damped.
    mass (n, n): of a discrete solution, whose M is the stiffness; damping (n, n): C;
    mass_damping, stiffness_damping: Rayleigh's.  Answers tell frequency, damping, shapes,
    `flutter()` and `divergence`.  Raises UnsupportedForm for large deformations, bodies that
    yield, the Delassus form, and constraints.
    """
    from ..analysis.gradients.linearised import Linearised
    from ..analysis.stability.modes import modes_of
    from ..analysis.stability.sliding import SlidingState

    if isinstance(target, FrictionSolution):
        if velocity is not None:
            raise InvalidInput("velocity: expected None, a discrete solution slides as it does")
        if mass is None:
            raise InvalidInput("mass: a discrete solution has none; expected (n, n)")
        if not target.problem.has_v:
            raise UnsupportedForm("modes: the problem is in its Delassus form; give M and H")
        K: Any = target.problem.M  # type: ignore[attr-defined]
        M = _symmetric("mass", mass, K.shape)
        C = _rayleigh(M, K, mass_damping, stiffness_damping, damping)
        return modes_of(SlidingState.of(Linearised.of(target), M, C), count, near)
    model = target.model if isinstance(target, ModelSolution) else target
    if not hasattr(model, "discrete_problem"):
        raise InvalidInput(
            f"target: expected a model or a solution, got {type(target).__name__}"
        )
    if model.kind is not FrictionProblem:
        raise UnsupportedForm("modes: expected linear elastic bodies of small kinematics")
    parts = model.discretisation
    if parts.eliminated is not None:
        raise UnsupportedForm("modes: models with constraints or rigid bodies have none yet")
    toward = speed = None
    if velocity is not None:
        found, toward, speed = _sliding(model, velocity)
    else:
        found = target.solution if isinstance(target, ModelSolution) else solve(model).solution
    from ..mechanics.steps.system import Inertia

    own = Inertia(model, mass_damping, stiffness_damping, lumped)
    M = own.M[parts.free][:, parts.free]
    C = _rayleigh(M, parts.M, mass_damping, stiffness_damping, damping)
    state = SlidingState.of(Linearised.of(found), M, C, toward=toward, speed=speed)
    return modes_of(state, count, near, model)


def _rayleigh(M: Any, K: Any, by_mass: float, by_stiffness: float, more: Any) -> Any:
    """C, None where nothing damps."""
    by_mass = number("mass_damping", by_mass)
    by_stiffness = number("stiffness_damping", by_stiffness)
    if not (by_mass or by_stiffness) and more is None:
        return None
    C = by_mass * M + by_stiffness * K
    return C if more is None else C + _matrix("damping", more, K.shape)


def _matrix(name: str, given: Any, shape: tuple[int, int]) -> sparse.csc_array:
    """A matrix of finite numbers, sparse or not, of the unknowns."""
    found = sparse_matrix(name, given if sparse.issparse(given) else finite(name, given, 2))
    expect_shape(name, found.shape, shape)
    return found


def _symmetric(name: str, given: Any, shape: tuple[int, int]) -> sparse.csc_array:
    """The same, with kinetic energy for every motion along one unknown."""
    found = _matrix(name, given, shape)
    if abs(found - found.T).max() > ASYMMETRIC * abs(found).max():
        raise InvalidInput(f"{name}: expected a symmetric matrix")
    least = float(found.diagonal().min(initial=0.0))
    if least < 0:
        raise InvalidInput(f"{name}: expected none below zero on the diagonal, got {least:g}")
    return found


def _sliding(model: Model, velocity: Any) -> tuple[FrictionSolution, Any, float]:
    """The state that slides by a velocity everywhere, its direction (nc, d - 1) and speed."""
    from ..mechanics.model.values import check_vector, vector_at

    check_vector(velocity, "velocity")
    sites = model.discretisation.sites
    v = vector_at(velocity, sites.points, "velocity")
    along = np.einsum("ckj,cj->ck", sites.frames[:, 1:], v)
    size = np.linalg.norm(along, axis=1)
    if not (size > 0).all():
        raise InvalidInput("velocity: expected a motion along the surface at every contact")
    toward = along / size[:, None]
    problem: Any = model.assemble()
    smooth = problem.law.with_mu(np.zeros(len(toward)))
    rest = solve(replace(problem, law=smooth), tolerance=1e-6)
    reach = FAR * float(np.abs(rest.u).max(initial=0.0) or 1.0)
    w = problem.w.copy()
    w[:, 1:] = reach * toward
    found = solve(replace(problem, w=w, u_scale=reach, guess=None), check=True)
    return found, toward, float(size.mean())
