"""The stages of the portfolio, one function each: what runs, from where, until when.

`portfolio` has the table that says which of them run, in which order.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from itertools import islice

import numpy as np
from numpy.typing import NDArray

from ...core.errors import SingularOperator
from ...linear.blocks import spatial
from ..contract import Breakdown, Iterate, Patience, Solver
from ..newton.functions import JeanMoreau, NaturalMap
from ..newton.inexact import InexactNewton
from ..newton.interior_point import STAGE, InteriorPoint, sliding_speed
from ..newton.line_search import FullStep
from ..newton.semismooth import SemismoothNewton
from ..newton.smoothing import ProximalPoint, SmoothingNewton
from ..sweeps.gauss_seidel import GaussSeidel
from ..sweeps.kernels import Acceleration, watch_for
from .state import State

Array = NDArray[np.float64]
SWEEPS = "Anderson Gauss-Seidel"  # name of the stages
DEPTH = 10  # past sweeps that Anderson acceleration combines
CHUNK = 40  # sweeps between two looks at their rate
LOOK = 0.1  # the same beside joints, part of Newton's cost
SLOWER = 1.5  # sweeps beside joints get slower than their first rate promises
HOPELESS = 8.0  # sweeps that promise to cost this many times Newton are left at once
RACE_FIRST = 50.0  # sweeps that a Newton step costs, from which relaxed sweeps come first
SEMISMOOTH_CONTACTS = 600  # above, a dense factor costs more than it brings
# Methods from the start, and the iterates without halving their error after which they end.
ALONE_SMALL: tuple[tuple[Solver, int], ...] = (
    (SemismoothNewton(function=NaturalMap()), 15),
    (SemismoothNewton(function=JeanMoreau()), 15),
)
ALONE_ANY_LAW: tuple[tuple[Solver, int], ...] = (
    (SemismoothNewton(function=JeanMoreau()), 15),
    (GaussSeidel(batch=2000), 40),
    (GaussSeidel(batch=2000, relaxation=0.7), 40),
)
ALONE: tuple[tuple[Solver, int], ...] = (
    (SmoothingNewton(batch=5), 6),
    (ProximalPoint(), 25),
    (InteriorPoint(), 8),
    (GaussSeidel(batch=2000, relaxation=1.3), 40),
    (GaussSeidel(batch=2000, relaxation=0.9), 40),
)


def always(state: State, turn: int) -> bool:
    """Whatever the problem."""
    return True


@dataclass(frozen=True)
class Stage:
    """A row of the table: run(state, stage, turn) where when(state, turn) holds.

    steps: at most so many, sweeps or those of Newton; patience: so many iterates without
    progress; share: of the cost of Newton that sweeps may take.  0: there is no such limit.
    needs_cone: it runs under Coulomb's law only.
    """

    name: str
    run: Callable[[State, Stage, int], Iterator[Iterate]]
    when: Callable[[State, int], bool] = always
    steps: int = 0
    patience: int = 0
    share: float = 0.0
    needs_cone: bool = False


# ---------------------------------------------------------------- deformable bodies
def sweeps_at_joints(state: State, stage: Stage, turn: int) -> Iterator[Iterate]:
    """Accelerated sweeps until they have cost, or promise to cost, more than Newton."""
    cost, joints = state.accelerated_cost, state.joints
    assert joints is not None
    memory, watch = Acceleration(state.data, state.r, DEPTH), watch_for(state.goal)
    spent, last = 0.0, state.error
    while True:
        newton = joints.newton_cost(math.log10(max(min(state.error / state.goal, 1e12), 1.0)))
        count, flops = memory.sweep(int(np.clip(LOOK * newton / cost, 5, CHUNK)), watch)
        yield state.offer(memory.r.copy(), count, SWEEPS, flops, watch[2])
        spent += cost * count
        promise = cost * state.sweeps_left(last, count)
        last = state.latest
        if spent + SLOWER * promise > stage.share * newton:
            return


def newton_from_start(state: State, stage: Stage, turn: int) -> Iterator[Iterate]:
    """Full steps from the start, from where it takes fewer of them than from a swept point."""
    return _inexact(state, stage, state.newton_kind(line_search=FullStep()), state.start)


def newton_from_best(state: State, stage: Stage, turn: int) -> Iterator[Iterate]:
    """Full steps from the best point."""
    return _inexact(state, stage, state.newton_kind(line_search=FullStep()), state.r)


def newton_with_line_search(state: State, stage: Stage, turn: int) -> Iterator[Iterate]:
    """Steps with a line search from the start."""
    return _inexact(state, stage, state.newton_kind(), state.start)


def _inexact(
    state: State, stage: Stage, solver: SemismoothNewton, r: Array
) -> Iterator[Iterate]:
    """Newton from r until it stalls."""
    name = "inexact Newton" if isinstance(solver, InexactNewton) else "semismooth Newton"
    patience = Patience(stage.patience)
    try:
        for iterate in solver.iterates(state.problem, state.iterate(r), state.target):
            found = state.offer(spatial(iterate.r), 1, name, iterate.flops)
            yield replace(found, linear_iterations=iterate.linear_iterations)
            if patience.over(state.latest):
                return
    except (Breakdown, SingularOperator):
        return


# ---------------------------------------------------------------- sweeps
def accelerated_sweeps(state: State, stage: Stage, turn: int) -> Iterator[Iterate]:
    """Accelerated sweeps while they promise an end before Newton, or have cost less than it."""
    memory = Acceleration(state.data, state.r, DEPTH)
    done, state.spent, last = 0, 0.0, state.error
    watch = watch_for(state.goal)
    while done < stage.steps:
        count, flops = memory.sweep(max(CHUNK, done // 4), watch)
        yield state.offer(memory.r.copy(), count, SWEEPS, flops, watch[2])
        done, state.spent = done + count, state.spent + state.accelerated_cost * count
        promise = state.accelerated_cost * state.sweeps_left(last, count)
        last, newton = state.latest, state.newton_cost()
        if promise > (1.0 if state.spent > stage.share * newton else HOPELESS) * newton:
            break


def race(state: State, stage: Stage, turn: int) -> Iterator[Iterate]:
    """Relaxed sweeps for what is left of the cost of one Newton, where its steps are dear."""
    left = (stage.share * state.newton_cost() - state.spent) / state.sweep_cost
    patience = Patience(stage.patience, 0.7, state.error)
    while left > 0 and state.error > state.goal:
        iterate = _relaxed(state, 100)
        left -= iterate.iterations
        yield iterate
        if patience.over(state.error):
            return


def newton_is_dear(state: State, turn: int) -> bool:
    """Where a step takes as long as many sweeps."""
    return state.step_cost > RACE_FIRST * state.sweep_cost


def matching_sweeps(state: State, stage: Stage, turn: int) -> Iterator[Iterate]:
    """Relaxed sweeps worth what Newton has cost, until so many of them gain nothing."""
    state.race.enter(state.r)
    mark, count = state.error, 0
    while state.budget > 0 and count < stage.steps and state.error > state.goal:
        iterate = _relaxed(state, 100)
        count += iterate.iterations
        state.budget -= iterate.iterations * state.sweep_cost
        yield iterate
        if state.error < 0.7 * mark:
            mark, count = state.error, 0
    state.budget = 0.0


def _relaxed(state: State, sweeps: int) -> Iterate:
    """Sweeps of the race between relaxations (see `Race`)."""
    race = state.race  # which begins with sweeps of its own
    track, count, flops = race.run(sweeps, state.goal)
    name = f"Gauss-Seidel, relaxation {track.relaxation:g}"
    return state.offer(track.r.copy(), count, name, flops, track.error)


# ---------------------------------------------------------------- Newton and others
def smoothing_newton(state: State, stage: Stage, turn: int) -> Iterator[Iterate]:
    """Smoothing Newton from the best point and from zero, in several variants."""
    root = math.sqrt(state.problem.contacts)
    nearby = max(state.error, state.goal) / root
    afar = 0.1 * state.problem.q_norm / root
    zero = np.zeros_like(state.r)
    starts = [(state.r, 10 * nearby, 0.3), (zero, afar, 0.3)]
    if state.problem.contacts <= 300 or turn:  # variants are cheap there
        starts += [(state.r, nearby, 0.3), (zero, 10 * afar, 0.5)]
    for origin, sigma, shrink in starts:
        count, _, _, found = state.work.newton(
            origin.copy(), sigma, SmoothingNewton(shrink=shrink), goal=0.5 * state.goal,
            steps=state.affordable(stage.steps), patience=stage.patience,
        )  # fmt: skip
        state.budget += abs(count) * state.step_cost
        yield state.offer(found, abs(count), "smoothing Newton")


def interior_point(state: State, stage: Stage, turn: int) -> Iterator[Iterate]:
    """Convex relaxations and sweeps from them, until some of both bring nothing.

    The first time without sliding: that of an unfinished reaction is mostly noise.
    """
    solver = InteriorPoint(steps=state.affordable(stage.steps))
    slip = np.zeros(state.problem.contacts)
    if turn:
        slip = sliding_speed(state.problem, state.r[:, : state.problem.dimension])
    patience = Patience(stage.patience, 0.1, state.error)
    for iterate in solver.relaxations(state.work, slip, state.target):
        if iterate.stage == STAGE:
            state.budget += iterate.iterations * state.step_cost
        yield state.offer(spatial(iterate.r), iterate.iterations, iterate.stage)
        if patience.over(state.error):
            return


def proximal_point(state: State, stage: Stage, turn: int) -> Iterator[Iterate]:
    """Proximal point while it makes progress."""
    x = state.r.copy()
    state.work.sweeps(x, 10)
    patience = Patience(stage.patience, mark=state.error)
    for iterate in ProximalPoint(alpha=1e-2 * 0.1**turn).steps(
        state.work, x, state.target.deadline
    ):
        state.budget += iterate.iterations * state.step_cost
        yield state.offer(spatial(iterate.r), iterate.iterations, "proximal point")
        if patience.over(state.error):
            return


def semismooth_newton(state: State, stage: Stage, turn: int) -> Iterator[Iterate]:
    """Semismooth Newton from the best point."""
    try:
        newton = SemismoothNewton().iterates(
            state.problem, state.iterate(state.r), state.target
        )
        for iterate in islice(newton, stage.steps):
            yield state.offer(spatial(iterate.r), 1, "semismooth Newton", iterate.flops)
    except (Breakdown, SingularOperator):
        return


def methods_alone(state: State, stage: Stage, turn: int) -> Iterator[Iterate]:
    """Every method by itself, from the start and then from disturbed best reactions.

    The best reaction may be a trap in which whatever starts from it stays.
    """
    r = state.start
    if turn:
        random = np.random.default_rng(turn)
        r = state.r * random.uniform(0.0, 2.0, (len(state.r), 1))
    start = state.iterate(r)
    small = state.problem.contacts <= SEMISMOOTH_CONTACTS
    methods = (ALONE_SMALL if small else ()) + ALONE if state.is_coulomb else ALONE_ANY_LAW
    for solver, most in methods:
        patience = Patience(most)
        try:
            for iterate in solver.iterates(state.problem, start, state.target):
                name = type(solver).__name__
                yield state.offer(spatial(iterate.r), iterate.iterations, name, iterate.flops)
                if patience.over(state.latest):
                    break
        except (Breakdown, SingularOperator):
            continue
