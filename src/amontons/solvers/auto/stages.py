"""The stages of the restarts, one function each: what runs, from where, until when.

`portfolio` has the table that says which of them run, in which order.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import islice

import numpy as np
from numpy.typing import NDArray

from ...core.errors import SingularOperator
from ...linear.blocks import spatial
from ..contract import Breakdown, Iterate, Patience, Solver
from ..newton.functions import JeanMoreau, NaturalMap
from ..newton.interior_point import InteriorPoint
from ..newton.semismooth import SemismoothNewton
from ..newton.smoothing import ProximalPoint, SmoothingNewton
from ..sweeps.gauss_seidel import GaussSeidel
from .state import State

Array = NDArray[np.float64]
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

    steps: at most so many of Newton; patience: so many iterates without progress.  0: there is
    no such limit.
    needs_cone: it runs under Coulomb's law only.
    """

    name: str
    run: Callable[[State, Stage, int], Iterator[Iterate]]
    when: Callable[[State, int], bool] = always
    steps: int = 0
    patience: int = 0
    needs_cone: bool = False


# ---------------------------------------------------------------- Newton and others
def proximal_point(state: State, stage: Stage, turn: int) -> Iterator[Iterate]:
    """Proximal point while it makes progress."""
    x = state.r.copy()
    state.work.sweeps(x, 10)
    patience = Patience(stage.patience, mark=state.error)
    for iterate in ProximalPoint(alpha=1e-2 * 0.1**turn).steps(
        state.work, x, state.target.deadline
    ):
        yield state.offer(spatial(iterate.r), iterate.iterations, "proximal point")
        if patience.over(state.error):
            return


def semismooth_steps(state: State, stage: Stage, turn: int) -> Iterator[Iterate]:
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
