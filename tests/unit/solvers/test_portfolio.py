"""The race of methods that Auto runs on the Delassus form: its table, and who goes on."""

import math
from dataclasses import replace

import numpy as np
import pytest
from race_methods import UNIT, costs, falling, rolling, state_of

import amontons as am
from amontons.mechanics.ready.gallery import random_delassus
from amontons.solvers.auto import race
from amontons.solvers.auto.portfolio import MOST_TURNS, RESTARTS, TRACKS, Portfolio, restarts
from amontons.solvers.auto.race import LOST_CHUNKS, Chunk, Entry, Race, Track, whole_way
from amontons.solvers.auto.state import FEW, State, visits
from amontons.solvers.auto.tracks import polish
from amontons.solvers.contract import Judgement, Target
from amontons.solvers.sweeps.kernels import by_approach, sweep_data, watch_for
from amontons.solvers.sweeps.momentum import Momentum


def names_of(problem):
    race = Race(state_of(problem), TRACKS)
    race.enter()
    return [track.entry.name for track in race.tracks]


# ------------------------------------------------------------------ the table
def test_names_are_different():
    names = [entry.name for entry in TRACKS] + [stage.name for stage in RESTARTS]
    assert len(set(names)) == len(names)


def test_few_contacts_under_coulombs_law():
    names = names_of(random_delassus(0, 10))
    assert names[0] == "Anderson Gauss-Seidel"
    assert {"interior point", "smoothing Newton", "semismooth Newton", "restarts"} < set(names)
    assert "inexact Newton" not in names


def test_laws_without_a_cone_have_the_methods_that_need_none():
    names = names_of(replace(random_delassus(0, 10), law=am.Tresca(np.full(10, 0.3))))
    assert "semismooth Newton" in names
    assert not {"interior point", "smoothing Newton"} & set(names)


def test_contacts_that_gain_energy_are_swept_only():
    problem = random_delassus(0, 10)
    W = np.array(problem.W)
    W[0, 1] -= 3 * abs(W[0, 0])  # contact 0 alone
    other = am.FrictionProblem.from_delassus(W, problem.q, problem.mu)
    assert other.gains_energy
    assert all("Gauss-Seidel" in name for name in names_of(other))


def restarted(problem):
    """(turn, name) of the stages that run when none of them finds anything."""
    seen = []

    def nothing(stage):
        def run(state, row, turn):
            seen.append((turn, stage.name))
            return iter(())

        return replace(stage, run=run)

    assert not list(restarts(state_of(problem), tuple(map(nothing, RESTARTS))))
    return seen


def test_restarts_turn_after_turn():
    seen = restarted(random_delassus(0, 10))
    assert [n for t, n in seen if t == 0] == ["proximal point", "methods alone"]
    assert [n for t, n in seen if t == 1] == ["proximal point", "semismooth Newton, small"]
    assert max(turn for turn, _ in seen) == MOST_TURNS - 1
    bounds = replace(random_delassus(0, 10), law=am.Tresca(np.full(10, 0.3)))
    assert "proximal point" not in {name for _, name in restarted(bounds)}


@pytest.mark.parametrize("entry", TRACKS, ids=lambda entry: entry.name)
def test_no_track_is_needed_by_an_easy_problem(entry):
    problem = random_delassus(3, 12, rank=20)
    table = tuple(e for e in TRACKS if e is not entry)
    found = Portfolio(problem, Target(1e-8), np.zeros((12, 3)), table).iterates()
    assert any(problem.error(iterate.r) < 1e-8 for iterate in found)


@pytest.mark.parametrize("entry", TRACKS, ids=lambda entry: entry.name)
def test_every_track_alone_solves_an_easy_problem(entry):
    problem = random_delassus(3, 12, rank=40, mu=0.3)
    if not entry.when(state_of(problem)):
        pytest.skip("not for such a problem")
    found = Portfolio(problem, Target(1e-8), np.zeros((12, 3)), (entry,)).iterates()
    errors = [problem.error(iterate.r) for iterate, _ in zip(found, range(400), strict=False)]
    assert min(errors) < 1e-8
    assert all(b <= a * (1 + 1e-9) for a, b in zip(errors, errors[1:], strict=False))


def swept_alone(state, sweeps):
    """Error of the deep track alone after so many sweeps at least; the track."""
    track = Track(next(e for e in TRACKS if e.chunks is polish), state)
    done = 0
    while done < sweeps and state.error > state.goal:
        done += track.advance().iterations
    return state.error, track


def test_the_deep_track_ends_what_momentum_comes_near_to():
    state = state_of(rolling(40, 0.6))
    near = Momentum(sweep_data(state.problem), state.start)
    near.sweep(60, watch_for(0.0))
    state.offer(near.r, 60, "momentum")
    before = state.error
    assert swept_alone(state, 400)[0] < 1e-2 * before


def test_the_deep_track_goes_on_from_a_better_reaction_of_others():
    problem = rolling(40, 0.6)
    state = state_of(problem)
    _, track = swept_alone(state, 20)
    better = am.drive(problem, tolerance=1e-7).r
    state.offer(better, 1, "another")
    track.advance()  # sweeps from its own, and sees the better one
    track.advance()
    assert state.latest < 1e-5 * problem.q_norm


def test_many_contacts_that_are_all_coupled_are_swept_as_they_are_numbered():
    few, meshed = random_delassus(0, FEW), random_delassus(0, FEW + 1)
    assert list(state_of(meshed).data.order) == list(range(FEW + 1))
    assert list(state_of(few).data.order) == list(by_approach(few.kernel_data[3]))
    for problem in (few, meshed):
        q, blocks = problem.kernel_data[3], len(problem.blocks.indices)
        assert list(visits(q, blocks)) == list(state_of(problem).data.order)


# ------------------------------------------------------------------ who goes on
def test_the_track_that_promises_the_end_first_goes_on():
    spent, done = costs(Entry("slow", falling(0.9, 1.0), share=0.1),
                        Entry("fast", falling(0.5, 1.0), share=0.1))  # fmt: skip
    assert done
    assert spent["fast"] > 20
    assert spent["slow"] <= 30


def test_dear_steps_count_by_their_cost():
    spent, done = costs(Entry("cheap", falling(0.9, 1.0), share=0.1),
                        Entry("dear", falling(0.5, 100.0), share=0.1), most=1000)  # fmt: skip
    assert done
    assert spent["cheap"] > 150
    assert spent["dear"] <= 300


def test_a_first_track_that_is_nearly_there_goes_on_alone():
    spent, done = costs(Entry("first", falling(0.1, 0.01)), Entry("other", falling(0.01, 0.01)))
    assert done
    assert list(spent) == ["first"]


def test_a_first_track_that_ends_on_stacks_leaves_no_other_in_its_place(monkeypatch):
    monkeypatch.setattr(race, "chunks_alone", lambda problem: 1)
    monkeypatch.setattr(State, "is_stacked", True)
    spent, done = costs(Entry("first", falling(0.1, 0.01, count=1)),
                        Entry("dear", falling(0.99, 1e3), stacked=50),
                        Entry("other", falling(0.1, 1.0), share=0.1), most=9000)  # fmt: skip
    assert done
    assert set(spent) == {"dear", "other"}
    assert spent["dear"] == pytest.approx(1e3, rel=0.01)  # the one chunk before others


@pytest.mark.parametrize(("fall", "idle"), [(0.99, True), (0.5, False)])
def test_what_follows_on_stacks_leaves_unless_it_comes_nearer(monkeypatch, fall, idle):
    monkeypatch.setattr(State, "is_stacked", True)
    monkeypatch.setattr(Track, "soon", lambda track: math.inf)
    second = Entry("second", falling(fall, 1.0), stacked=400)
    table = Entry("first", falling(0.9, 1.0)), second
    racing = Race(state_of(random_delassus(0, 10)), table)
    racing.tracks[0].advance()
    list(racing._on_stacks(racing.tracks[0]))
    track = next(t for t in racing.tracks if t.entry is second)
    assert track.idle == idle
    assert (len(track.errors) == race.IDLE + 1) == idle


def test_broken_promises_count_less():
    def stalling(state):
        error = state.first_error
        yield Chunk(state.start, 0, 0.0)
        for k in range(10**6):  # as if the end were near, again and again
            error *= 0.5 if k < 20 else 0.99
            _ = yield Chunk(state.start, 1, UNIT, error=error)

    spent, done = costs(Entry("stalls", stalling),
                        Entry("steady", falling(0.9, 1.0), share=0.1), most=1000)  # fmt: skip
    assert done
    assert spent["stalls"] < 120
    assert spent["steady"] > 150


def plateau(state):
    """A method that stands for thirty chunks, then falls as if it had always."""
    error = state.first_error
    yield Chunk(state.start, 0, 0.0)
    for k in range(10**6):
        error *= 0.9999 if k < 30 else 0.1
        _ = yield Chunk(state.start, 1, UNIT, error=error)


def test_a_plateau_is_taken_to_last_as_long_again():
    steady = Entry("steady", falling(0.9, 3.0))
    stands = Entry("stands", plateau, share=0.02)
    assert costs(steady, stands, most=1000)[0]["stands"] < 15  # by its rate it would never end
    spent, done = costs(
        steady, replace(stands, again=5.0, trial=lambda state: UNIT), most=1000
    )
    assert done
    assert spent["stands"] == pytest.approx(40, rel=0.2)


def test_a_cheap_trial_comes_before_dear_steps():
    dear = Entry("dear", falling(1.0, 20.0), needs=lambda state: 1e3 * UNIT)
    found = Entry("found", falling(0.1, 0.1), share=0.02, optimism=1e3)
    slow = Entry("slow", falling(1.0, 1.0))
    assert costs(slow, dear, found, most=60)[0]["dear"] > 40
    spent, done = costs(
        slow, dear, replace(found, again=5.0, trial=lambda state: UNIT), most=60
    )
    assert done
    assert spent["dear"] == 0


def test_tracks_without_progress_share_what_they_cost():
    spent, done = costs(Entry("a", falling(1.0, 1.0)), Entry("b", falling(1.0, 3.0)))
    assert not done
    assert spent["a"] == pytest.approx(spent["b"], rel=0.1)


def test_a_method_of_newtons_kind_is_given_time():
    def late(state):
        yield Chunk(state.start, 0, 0.0)
        for k in range(20):
            error = state.first_error * (1e-12 if k == 9 else 1.0)
            _ = yield Chunk(state.start, 1, UNIT, error=error)

    spent, done = costs(Entry("slow", falling(0.999, 1.0)),
                        Entry("late", late, needs=lambda state: 20.0 * UNIT))  # fmt: skip
    assert done
    assert spent["late"] == pytest.approx(10, rel=0.05)


def test_the_rate_is_told_from_where_a_method_has_got_to():
    def smoothed(state):
        where, best = 100 * state.first_error, state.first_error
        yield Chunk(state.start, 0, 0.0)
        for _ in range(60):  # far above its start at first
            where *= 0.5
            best = where if where <= state.goal else best
            yield Chunk(state.start, 1, UNIT, error=best, path=where)

    spent, done = costs(Entry("slow", falling(0.9, 1.0)),
                        Entry("smoothed", smoothed, share=0.3, needs=lambda state: 5 * UNIT),
                        most=400)  # fmt: skip
    assert done
    assert spent["smoothed"] > 30
    assert spent["slow"] < 80


def test_a_method_that_begins_again_promises_by_its_best_error_alone():
    def begins_again(state):
        yield Chunk(state.start, 0, 0.0)
        for k in range(10**6):
            path = 0.5**k * state.first_error if k < 12 else math.inf
            _ = yield Chunk(state.start, 1, UNIT, error=state.first_error, path=path)

    state = state_of(random_delassus(0, 10))
    track = Track(Entry("again", begins_again), state)
    for _ in range(10):
        track.advance()
    assert track.promise < 100 * UNIT
    for _ in range(10):
        track.advance()
    assert track.promise == math.inf


def test_a_race_goes_on_to_a_tighter_goal():
    state = state_of(random_delassus(0, 10))
    race = Race(state, (Entry("a", falling(0.5, 1.0)), Entry("b", falling(0.4, 1.0))))
    iterates, first = race.iterates(), state.goal
    next(iterates)
    while state.error > first:
        iterates.send(Judgement(1.0, goal=state.target.tolerance))
    before = race.total
    iterates.send(Judgement(0.0, 1.0, goal=1e-4 * state.target.tolerance))
    while state.error > 1e-4 * first:
        next(iterates)
    assert state.goal == pytest.approx(1e-4 * first)
    assert race.total < 3 * before


def test_the_last_resort_has_its_share_and_no_more():
    spent, done = costs(
        Entry("slow", falling(0.9999, 1.0)),
        Entry("last", falling(1.0, 1.0), 0.2, needs=lambda state: 30 * UNIT, last=True),
        most=500,
    )
    assert not done
    assert spent["last"] == pytest.approx(100, abs=5)


def test_a_method_that_ends_leaves_the_race():
    ending = Entry("ends", falling(0.1, 1.0, count=3))
    spent, done = costs(ending, Entry("on", falling(0.5, 1.0)))
    assert done
    assert list(spent) == ["on"]


def test_the_race_ends_when_every_method_has():
    race = Race(state_of(random_delassus(0, 10)), (Entry("a", falling(0.9, 1.0, count=5)),))
    assert sum(iterate.iterations for iterate in race.iterates()) == 5
    assert not race.tracks


def test_the_race_ends_where_nothing_helps():
    state = state_of(random_delassus(0, 10))
    race = Race(state, (Entry("a", falling(1.0, 1.0)), Entry("b", falling(1.0, 3.0))))
    assert len(list(race.iterates())) < 200
    assert LOST_CHUNKS < race.chunks < 2 * LOST_CHUNKS


def test_the_race_goes_on_while_a_track_falls_just_above_the_best():
    def from_there(part, factor):
        def chunks(state):
            yield Chunk(state.start, 0, 0.0)
            for k in range(10**6):
                error = part * factor**k * state.first_error
                _ = yield Chunk(state.start, 1, UNIT, error=error)

        return chunks

    state = state_of(random_delassus(0, 10))
    race = Race(state, (Entry("stands", from_there(1e-4, 1.0)),
                        Entry("falls", from_there(8e-4, 0.997))))  # fmt: skip
    below = 5e-5 * state.first_error
    assert any(state.error < below for _ in race.iterates())
    assert race.chunks > LOST_CHUNKS


def test_what_is_not_handed_out_is_counted():
    race = Race(state_of(random_delassus(0, 10)), (Entry("a", falling(0.9, 0.01, count=7)),))
    found = list(race.iterates())
    assert len(found) == 1  # all of them together cost less than a judgement is worth
    assert found[0].iterations == 7


def test_first_error_is_that_of_a_given_start():
    problem = random_delassus(3, 12)
    r = am.drive(problem, tolerance=1e-4).r
    state = State(problem, Target(1e-8), r)
    assert state.first_error == pytest.approx(state.judge(r))
    assert state_of(problem).first_error == problem.q_norm < math.inf


def test_the_whole_way_is_foreseen_near_the_goal_only():
    """At the mean rate until the best error was almost there, not while it stands."""
    fall = [(0.0, 1.0), (1e6, 1e-3), (2e6, 2e-6), (5e6, 1.9e-6)]
    assert whole_way(fall, 1e-6) == pytest.approx(2e6 * np.log(1e6) / np.log(1 / 1.9e-6))
    assert whole_way(fall, 1e-12) == np.inf
    assert whole_way(fall[:1], 1e-6) == np.inf
