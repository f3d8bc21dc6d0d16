"""The race of `Auto`: what waits for the sweeps, and who takes whose reaction."""

import numpy as np
import pytest
from race_methods import UNIT, costs, falling, rolling, state_of

from amontons.mechanics.ready.gallery import random_delassus
from amontons.solvers.auto.race import LULL, Chunk, Entry, Race, Track, Turn
from amontons.solvers.auto.tracks import LEAST, PATIENT, TAKEN, momentum
from amontons.solvers.sweeps.kernels import sweep_data, watch_for
from amontons.solvers.sweeps.momentum import Momentum


def needed(state):
    """What steps usually need."""
    return 20 * UNIT


def dear(name, waits):
    """Steps that lead nowhere and usually need 20 units."""
    return Entry(name, falling(1.0, 4.0), needs=needed, waits=waits)


@pytest.mark.parametrize(("waits", "begun"), [(needed, 0), (None, 1)])
def test_dear_steps_wait_until_sweeps_have_cost_what_they_need(waits, begun):
    spent, _ = costs(Entry("sweeps", falling(0.99, 1.0), share=0.1), dear("a", waits), most=18)
    assert (spent["a"] > 0) == begun


def test_dear_steps_together_cost_no_more_than_sweeps_before_the_next_ones_begin():
    sweeps = Entry("sweeps", falling(0.99, 1.0), share=0.1)
    table = (sweeps, dear("a", needed), dear("b", needed))
    race = Race(state_of(random_delassus(0, 10)), table)
    for _ in race.iterates():
        cost = {t.entry.name: t.cost / UNIT for t in race.tracks}
        begun = [n for n in "ab" if cost.get(n, 0) > 0]
        if cost["sweeps"] > 60 or len(begun) == 2:
            break
    assert len(begun) == 2
    assert cost["sweeps"] >= cost["a"] + 20


def test_an_error_that_stands_is_taken_to_stand_longer():
    def stands(state):
        yield Chunk(state.start, 0, 0.0)
        for k in range(60):
            error = state.first_error * 0.1 ** min(k + 1, 5)
            _ = yield Chunk(state.start, 1, UNIT, error=error)

    track = Track(Entry("stands", stands), state_of(random_delassus(0, 10)))
    for _ in range(5):
        track.advance()
    assert track.rest(track.cost) == track.promise
    for _ in range(3):
        track.advance()
    assert track.rest(track.cost) >= LULL * 3 * UNIT


def test_momentum_that_hovers_goes_on_from_a_far_better_reaction_once():
    state = state_of(rolling(20, 0.6))
    state.goal = 0.0  # sweeps never end
    better, watch = np.full_like(state.r, 0.01), watch_for(state.goal)
    state.r, state.error = better, 0.5 * TAKEN * state.first_error
    expected = Momentum(sweep_data(state.problem), better.copy())
    expected.sweep(LEAST, watch)
    chunks, hovers = momentum(state), Turn(0.0, state.first_error)
    next(chunks)
    for _ in range(PATIENT // LEAST + 1):
        assert not np.array_equal(chunks.send(hovers).r, expected.r)
    for _ in range(2 * PATIENT // LEAST):
        np.testing.assert_array_equal(chunks.send(hovers).r, expected.r)
        expected.sweep(LEAST, watch)
