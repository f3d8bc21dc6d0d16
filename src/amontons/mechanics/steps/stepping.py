"""The loop over steps: times, warm starts, failures."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from ...core.clock import NEVER, Deadline, check_seconds
from ...core.errors import Interrupted, InvalidInput, NotConverged, shown
from ...problem.friction import Form, FrictionProblem
from ...problem.solution import FrictionSolution
from ...solvers.contract import Iterate, Solver, check_at_least, check_solves, taken_by
from ...solvers.driver import drive
from ..model import Model
from ..model.values import is_number
from .moreau_jean import Local, MoreauJean
from .quasi_static import QuasiStatic
from .schedule import Schedule, Stage, carried_over
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
    contact_tolerance: float | None = None,
    max_iterations: int | None = None,
    time_limit: float | None = None,
    deadline: Deadline = NEVER,
    check: bool = True,
) -> Iterator[TimeStep]:
    """The steps of a model up to the time `until`, each solved from the reactions of the last.

    start: by default the undeformed model at rest at time 0; any `step.state` goes on from
    there and gives the same numbers as an evolution without a stop.  Supports and loads may
    depend on time: expressions in t, or functions of (x, t).  tolerance, contact_tolerance,
    max_iterations: of each solve; time_limit: seconds for each step; deadline: of all steps
    together, also met in the middle of one.  check: raise NotConverged (Interrupted after
    Ctrl-C), which carries the solution of the step, instead of going on with it.  What can not
    begin is refused at once, not with the first step.  Raises InvalidInput at the time at which
    supports hold other components than at time 0, or push a contact node that they hold into
    what it meets.

    The problem of a step is `step.problem`.
    """
    if time_limit is not None:
        check_seconds(time_limit)
    if max_iterations is not None:
        check_at_least(1, max_iterations=max_iterations)
    if not hasattr(method, "prepare"):
        raise InvalidInput(
            f"method: expected QuasiStatic(step) or MoreauJean(step), got {shown(method)}"
        )
    own = _stage_of(start, method)
    prepared = method.prepare(model if own is None else own.model(start), tolerance)  # type: ignore[arg-type]
    if solver is not None:
        check_solves(solver, model.kind)
    state = start if start is not None else at_rest(model)
    _check(state, prepared.motion, method.step, until)
    state = prepared.begin(state)

    def solved(problem: FrictionProblem, first: Iterate, limit: Deadline) -> FrictionSolution:
        return drive(
            problem, solver, tolerance=tolerance, contact_tolerance=contact_tolerance,
            start=first, max_iterations=max_iterations, time_limit=limit,
        )  # fmt: skip

    def advanced(state: State, time: float, prepared: Any) -> TimeStep:
        limit = deadline if time_limit is None else deadline.within(time_limit)

        def solve(
            problem: Any, first: Iterate, local: Local | None
        ) -> FrictionSolution:
            if local is None or taken_by(solver).form is Form.GLOBAL:
                solution = solved(problem, first, limit)
            else:
                found = solved(local(problem), first, limit)
                u, v = problem.velocity(found.r)
                known = replace(problem, law=found.problem.law)  # coefficients that it found
                solution = replace(found, problem=known, u=u, v=v)
            solution = prepared.explained(solution)
            if check and not solution.converged:
                record = solution.convergence
                kind = Interrupted if record.by_user else NotConverged
                raise kind(f"step {state.index + 1}: {record}. {record.advice}", solution)
            return solution

        return prepared.advance(state, time, solve, limit)

    def steps(state: State, now: Any) -> Iterator[TimeStep]:
        first, near = state.time - state.index * method.step, WHOLE * method.step
        stage = own
        while not at_end(state.time, until, method.step):
            time = first + (state.index + 1) * method.step
            if isinstance(method, Schedule):
                time = method.after(state.time, near) or time
                begun = method.stage_at(state.time, near)
                if begun is not None and begun is not stage:
                    later = method.prepare(begun.model(state), tolerance)
                    state = carried_over(state, now.motion, later.motion)
                    stage, now = begun, later
            step = advanced(state, time, now)
            state = step.state
            yield step

    return steps(state, prepared)


def _stage_of(start: State | None, method: MoreauJean | QuasiStatic) -> Stage | None:
    """The stage to which a state belongs; None for the first one."""
    if start is None or not isinstance(method, Schedule):
        return None
    return method.stage_at(start.time - 2 * WHOLE * method.step, WHOLE * method.step)


def at_end(time: float, until: float, step: float) -> bool:
    """True where steps of that size have come from `time` to the end."""
    return time >= until - WHOLE * step


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
    ahead = is_number(until) and np.isfinite(until) and until > state.time - WHOLE * step
    if not ahead:
        raise InvalidInput(f"until: expected a time after {state.time:g}, got {until!r}")
