"""The methods of the race: generators that are sent a `Turn` and yield a chunk.

A chunk of sweeps costs about what was asked for; a Newton step is never halved.  All begin at
the start of the solve unless they say otherwise.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from functools import partial
from itertools import chain, cycle

import numpy as np
from numpy.typing import NDArray

from ...core.errors import SingularOperator
from ...linear.blocks import spatial
from ..contract import Breakdown, Iterate, Patience
from ..newton.alternating import Alternation
from ..newton.interior_point import InteriorPoint, Relaxation, sliding_speed
from ..newton.line_search import FullStep
from ..newton.semismooth import SemismoothNewton
from ..newton.smoothing import SmoothingNewton
from ..sweeps.kernels import Acceleration, counted, sweep_data, watch_for
from ..sweeps.momentum import Momentum
from ..sweeps.shared import sweeps as shared_sweeps
from .chunk import Chunk, Chunks
from .race import ENTRY
from .state import State, chunks_alone

Array = NDArray[np.float64]
DEPTH = 10  # past sweeps that Anderson acceleration combines
DEEP = 30  # of them where a track goes on from the best reaction of all
NEARER = 0.3  # error of that, of the track's own, at which it begins again from there
PATIENT = 600  # sweeps without halving its error, after which any better one will do
TAKEN = 0.1  # error of the best reaction, of its own, at which a track goes on from that
LEAST = 20  # sweeps of a chunk: a judgement costs as much as one
EARLY = 5  # of the first one on stacks, see `sweeps_on_stacks`
BETWEEN = 200  # accelerated sweeps after each relaxation, and on while they halve the error
RELAXED = 60  # steps of one relaxation at most
# First smoothing, times the error per contact of the reaction that it starts from, or 0, from
# zero, and how it shrinks; then, again and again, from the best of sweeps (True) or of all.
SMOOTHED = ((100.0, 0.3, True), (0.0, 0.3, True), (1000.0, 0.3, True), (0.0, 0.5, True))
AGAIN = ((100.0, 0.3, True), (100.0, 0.3, False), (1000.0, 0.3, True), (1000.0, 0.5, False))
PATIENCE = 30  # steps of smoothing Newton without halving its error
FLOP = 0.15  # nanoseconds of an operation of a step between deformable bodies
STALLED = 8  # steps of Newton's method without halving its error


# ---------------------------------------------------------------- sweeps
def aimed(watch: Array, goal: float) -> None:
    """Let sweeps go on where the goal has become another one."""
    if watch[0] != goal:
        watch[:] = watch_for(goal)


def sweeps_on_stacks(cost: float) -> int:
    """Of the first chunk on stacks of rigid bodies, where others may be much quicker then.

    cost: of one, ns; fewer, down to EARLY, where all cost more than to let others in.
    """
    return max(EARLY, min(int(ENTRY / cost), LEAST))


def momentum(state: State) -> Chunks:
    """Sweeps with Nesterov's momentum.

    Where they hover they go on from the best reaction of the others, once, if that is far
    better: what is left there may be no solution, from which they hover again.
    """
    data, cost = sweep_data(state.problem), state.momentum_cost
    memory, watch = Momentum(data, state.start), watch_for(state.goal)
    turn = yield Chunk(memory.r, 0, 0.0)
    mark, waited, begun = turn.error, 0, math.inf
    while True:
        if waited > PATIENT and state.error < TAKEN * min(turn.error, begun):
            memory, watch = Momentum(data, state.r), watch_for(state.goal)
            mark = begun = state.error
            waited = 0
        aimed(watch, state.goal)
        count, flops = memory.sweep(max(LEAST, int(turn.cost / cost)), watch)
        turn = yield Chunk(memory.r.copy(), count, cost * count, flops, watch[2])
        waited += count
        if turn.error < 0.5 * mark:
            mark, waited = turn.error, 0


def anderson(state: State) -> Chunks:
    """Accelerated sweeps, contacts in the order of their approach.

    They go on from the best reaction of the others where that is far better than theirs.
    What the first stage has done is taken from there.
    """
    memory, watch = Acceleration(state.data, state.start, DEPTH), watch_for(state.goal)
    cost, begun, least = state.accelerated_cost, state.begun, LEAST
    turn = yield Chunk(memory.r, 0, 0.0)
    if begun is not None:
        for r, count, flops, error in begun.chunks:
            turn = yield Chunk(r, count, cost * count, flops, error)
        memory.x, memory.history, memory.gram, memory.count = begun[2:6]
        memory.r, watch = begun.chunks[-1].r.copy(), begun.watch
    elif chunks_alone(state.problem) == 1:
        least = sweeps_on_stacks(cost)
    while True:
        if state.error < TAKEN * turn.error:
            memory, watch = Acceleration(state.data, state.r, DEPTH), watch_for(state.goal)
        aimed(watch, state.goal)
        count, flops = memory.sweep(max(least, int(turn.cost / cost)), watch)
        least = LEAST
        turn = yield Chunk(memory.r.copy(), count, cost * count, flops, watch[2])


def polish(state: State) -> Chunks:
    """Deeply accelerated sweeps from the best reaction of all, again when others have a better.

    Momentum comes near a packing that rolls and hovers there, as statuses go on changing.  From
    there a deep memory ends in some hundred sweeps; from the start it does not come so near.
    """
    cost = state.deep_cost
    turn = yield Chunk(state.start, 0, 0.0)
    while True:
        memory, watch = Acceleration(state.data, state.r, DEEP), watch_for(state.goal)
        first = mark = state.error
        waited, better = 0, False
        while not better:
            aimed(watch, state.goal)
            count, flops = memory.sweep(max(LEAST, int(turn.cost / cost)), watch)
            turn = yield Chunk(memory.r.copy(), count, cost * count, flops, watch[2])
            own, waited = min(turn.error, first), waited + count
            if own < 0.5 * mark:
                mark, waited = own, 0
            nearer = 0.99 if waited > PATIENT else NEARER
            better = state.error < nearer * own


def relaxed(relaxation: float, state: State) -> Chunks:
    """Sweeps with a relaxation, 1: none."""
    watch, r = watch_for(state.goal), state.start.copy()
    data, cost = sweep_data(state.problem, relaxation=relaxation), state.sweep_cost
    turn = yield Chunk(r, 0, 0.0)
    while True:
        sweeps = max(LEAST, int(turn.cost / cost))
        aimed(watch, state.goal)
        count, flops = counted(data, partial(shared_sweeps, data, r, sweeps, watch))
        turn = yield Chunk(r.copy(), count, cost * count, flops, watch[2])


# ---------------------------------------------------------------- Newton's kind
def interior_point(state: State) -> Chunks:
    """Steps on the relaxation without sliding, sweeps, those with the sliding found, and on."""
    problem = state.problem
    slip = np.zeros(problem.contacts)
    if state.start.any():
        slip = sliding_speed(problem, state.start[:, : problem.dimension])
    turn = yield Chunk(state.start, 0, 0.0)
    while True:
        relaxation, done = Relaxation.of(state.work, slip, InteriorPoint.shift), 0
        while done < RELAXED:
            each = state.relaxation_cost if relaxation.shares else state.step_cost
            steps = max(1, min(int(turn.cost / each), RELAXED - done))
            count = relaxation.advance(state.goal, state.affordable(steps))
            done += count
            turn = yield Chunk(relaxation.r.copy(), max(count, 1), max(count, 1) * each)
            if relaxation.ended:
                break
        slip = sliding_speed(problem, relaxation.r[:, : problem.dimension])
        memory = Acceleration(state.data, relaxation.r, DEPTH)
        watch, cost, left = watch_for(state.goal), state.accelerated_cost, BETWEEN
        mark = turn.error
        while left > 0:
            aimed(watch, state.goal)
            count, flops = memory.sweep(int(np.clip(turn.cost / cost, LEAST, left)), watch)
            left -= count
            turn = yield Chunk(memory.r.copy(), count, cost * count, flops, watch[2])
            if left <= 0 and turn.error < 0.5 * mark:
                left, mark = BETWEEN, turn.error


def smoothing_newton(state: State) -> Chunks:
    """Smoothing Newton from the best swept reaction, from zero when it stalls, and so on.

    A relaxation of the interior point may be nearer, but not to the sliding of a solution.
    From a swept point it takes half the steps that it takes from zero, where the smoothing is
    far above the error there.
    """
    root, x = math.sqrt(max(state.problem.contacts, 1)), state.start
    turn = yield Chunk(x, 0, 0.0)
    afar, first = 0.1 * state.problem.q_norm / root, True
    for smoothing, shrink, swept in chain(SMOOTHED, cycle(AGAIN)):
        r, error = (state.swept, state.swept_error) if swept else (state.r, state.error)
        x, sigma = r.copy(), min(smoothing * error / root, afar)
        if not smoothing:
            x, sigma = np.zeros_like(r), afar
        solver, patience = SmoothingNewton(shrink=shrink), Patience(PATIENCE)
        while not patience.waited > patience.most:
            steps = state.affordable(max(1, int(turn.cost / state.step_cost)))
            count, residual, sigma, found = state.work.newton(
                x, sigma, solver, goal=0.5 * state.goal, steps=steps
            )
            cost = max(abs(count), 1) * state.step_cost
            path = state.judge(x) if first and count > 0 else math.inf
            turn = yield Chunk(found, max(abs(count), 1), cost, path=path)
            if count < 0 or patience.over(residual):
                break
        first = False


def alternating(state: State) -> Chunks:
    """Newton's steps and sweeps in turn from the best reaction, again from a far better one.

    From any better one where steps lead nowhere.
    """
    _ = yield Chunk(state.start, 0, 0.0)
    while True:
        way = Alternation(state.problem, state.r, state.error)
        own = state.error
        while not state.error < (0.99 if way.stalled else NEARER) * own:
            count = way.advance(state.goal)
            cost = way.steps * state.alternation_cost + count * state.sweep_cost
            _ = yield Chunk(way.r, max(way.steps, 1), cost, error=way.error)
            own = min(own, way.error)


def inexact_newton(state: State) -> Chunks:
    """Steps between deformable bodies: full ones from the best reaction, then from the start.

    With a line search after that.
    """
    full, search = state.newton_kind(line_search=FullStep()), state.newton_kind()
    _ = yield Chunk(state.start, 0, 0.0)
    for solver, swept in ((full, True), (full, False), (search, True), (search, False)):
        for chunk in _stepped(state, solver, state.r if swept else state.start):
            _ = yield chunk


def semismooth_newton(state: State) -> Chunks:
    """Semismooth Newton from the best reaction, again whenever it stalls."""
    _ = yield Chunk(state.start, 0, 0.0)
    while True:
        none = True
        for chunk in _stepped(state, SemismoothNewton(), state.r):
            none = False
            _ = yield chunk
        if none:
            return


def _stepped(state: State, solver: SemismoothNewton, r: Array) -> Iterator[Chunk]:
    """Steps of Newton's method from r until it stalls or breaks down."""
    patience = Patience(STALLED)
    try:
        for found in solver.iterates(state.problem, state.iterate(r), state.target):
            cost = state.dense_step_cost if found.flops is None else FLOP * found.flops
            yield Chunk(spatial(found.r), 1, cost, found.flops, math.inf,
                        found.linear_iterations)  # fmt: skip
            if patience.over(state.latest):
                return
    except (Breakdown, SingularOperator):
        return


# ---------------------------------------------------------------- the last resort
Staged = Callable[[State], Iterator[Iterate]]


def staged(stages: Staged, state: State) -> Chunks:
    """Stages that start from the best reaction, and offer what they find themselves."""
    _ = yield Chunk(state.start, 0, 0.0)
    for found in stages(state):
        steps = state.step_cost * found.iterations
        cost = steps if found.flops is None else FLOP * found.flops
        yield Chunk(spatial(found.r), found.iterations, cost, found.flops, state.error,
                    found.linear_iterations)  # fmt: skip


__all__ = [
    "alternating", "anderson", "inexact_newton", "interior_point", "momentum", "polish",
    "relaxed", "semismooth_newton", "smoothing_newton", "staged",
]  # fmt: skip
