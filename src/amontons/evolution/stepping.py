"""The loop over steps: times, warm starts, failures."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from ..errors import InvalidInput, NotConverged
from ..model import Model
from ..problem import Form, FrictionProblem
from ..solution import FrictionSolution
from ..solve import drive
from ..solvers.base import Iterate, Solver
from ..solvers.nonlinear_newton import nonlinear_solver
from .large_steps import LargeSlowModel
from .moreau_jean import Local, MoreauJean
from .quasi_static import QuasiStatic
from .state import State, TimeStep, at_rest
from .system import Motion

WHOLE = 1e-9  # the end may miss a whole number of steps by this part of a step


def evolve(
    model: Model,
    method: MoreauJean | QuasiStatic,
    *,
    until: float,
    start: State | None = None,
    solver: Solver | None = None,
    tolerance: float = 1e-8,
    check: bool = True,
) -> Iterator[TimeStep]:
    """The steps of a model up to the time `until`, each solved from the reactions of the last.

    start: by default the undeformed model at rest at time 0; any `step.state` goes on from
    there and gives the same numbers as an evolution without a stop.  Supports and loads may
    depend on time: expressions in t, or functions of (x, t).  check: raise NotConverged, which
    carries the solution of the step, instead of going on with it.  Raises InvalidInput at the
    time at which supports hold other components than at time 0, or push a contact node that
    they hold into what it meets.

    The problem of a step is `step.problem`.
    """
    prepared = method.prepare(model, tolerance)
    if isinstance(prepared, LargeSlowModel):
        solver = nonlinear_solver(solver)  # type: ignore[assignment]
    state = start if start is not None else at_rest(model)
    _check(state, prepared.motion, method.step, until)
    state = prepared.begin(state)

    def solve(
        problem: FrictionProblem, first: Iterate, local: Local | None
    ) -> FrictionSolution:
        if local is None or getattr(solver, "form", None) is Form.GLOBAL:
            solution = drive(problem, solver, tolerance=tolerance, start=first)
        else:
            found = drive(local(problem), solver, tolerance=tolerance, start=first)
            u, v = problem.velocity(found.r)
            solution = replace(found, problem=problem, u=u, v=v)
        solution = prepared.explained(solution)
        if check and not solution.converged:
            record = solution.convergence
            raise NotConverged(f"step {state.index + 1}: {record}. {record.advice}",
                               solution)  # fmt: skip
        return solution

    first = state.time - state.index * method.step
    while state.time < until - WHOLE * method.step:
        step = prepared.advance(state, first + (state.index + 1) * method.step, solve)
        state = step.state
        yield step


def _check(state: State, motion: Motion, step: float, until: float) -> None:
    """Raise InvalidInput for a state of another model, or an end that is not ahead."""
    parts = motion.parts
    shapes = {"displacement": (parts.dofs,), "velocity": (parts.dofs,),
              "force": parts.carried.shape, "slip": parts.carried[:, 1:].shape}  # fmt: skip
    for name, wanted in shapes.items():
        found = getattr(state, name).shape
        if found != wanted:
            raise InvalidInput(
                f"start: expected {name} of shape {wanted}, got {found}: "
                "it belongs to another model"
            )
    if not (np.isfinite(until) and until > state.time - WHOLE * step):
        raise InvalidInput(f"until: expected a time after {state.time:g}, got {until!r}")
