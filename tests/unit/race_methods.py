"""Problems and made-up methods for tests of the race of `Auto`."""

import numpy as np

import amontons as am
from amontons.mechanics.ready.gallery import random_delassus
from amontons.solvers.auto.race import Chunk, Race
from amontons.solvers.auto.state import State
from amontons.solvers.contract import Target

UNIT = 1e6  # nanoseconds: far more than letting a track in costs


def state_of(problem, tolerance=1e-8):
    return State(problem, Target(tolerance), np.zeros((problem.contacts, 3)))


def rolling(count, mu):
    """A time step of spheres that turn at random, condensed."""
    packing = am.SpherePacking(count, mu=mu, seed=1)
    still, random = packing.problem(1e-3), np.random.default_rng(3)
    omega = np.zeros((count, 6))
    omega[:, 3:] = 10 * random.standard_normal((count, 3))
    f = still.f + still.M @ omega.ravel()
    return am.FrictionProblem.from_global(still.M, still.H, f, still.w, still.mu).condensed()


def falling(factor, cost, count=10**6):
    """A method whose error falls by a factor with every chunk of that cost; it may end."""

    def chunks(state):
        error = state.first_error
        yield Chunk(state.start, 0, 0.0)
        for _ in range(count):
            error *= factor
            _ = yield Chunk(state.start, 1, cost * UNIT, error=error)

    return chunks


def costs(*entries, most=200):
    """Cost of each track in UNIT when they have cost so much together, or at the goal."""
    state = state_of(random_delassus(0, 10))
    race = Race(state, entries)
    for _ in race.iterates():
        if state.error <= state.goal or race.total >= most * UNIT:
            break
    return {t.entry.name: t.cost / UNIT for t in race.tracks}, state.error <= state.goal
