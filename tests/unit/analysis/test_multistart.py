"""Solutions from many starts: nothing found that is none, and small problems found whole."""

import numpy as np
import pytest
from brute_force_3d import random_problem_3d, solutions_by_brute_force

import amontons as am
from amontons.analysis.scaled import Scaled
from amontons.analysis.solutions.multistart import multistart
from amontons.analysis.solutions.newton_batch import deflation
from amontons.mechanics.ready.gallery import one_contact_2d, random_delassus
from amontons.mechanics.ready.hild import hild_triangle


def same(r, other):
    return np.abs(r - other).max() <= 1e-6 * (1 + np.abs(r).max())


def assert_same_solutions(found, expected):
    """Both lists of reactions hold the same, in any order."""
    assert len(found) == len(expected)
    for r in expected:
        assert any(same(r, other) for other in found)


@pytest.mark.parametrize(("n", "mu"), [(1, 3.5), (3, 2.0), (5, 4.8), (7, 3.5), (8, 4.3)])
def test_the_triangle_as_the_exact_list_has_it(n, mu):
    problem = hild_triangle(n, mu=mu).assemble().condensed()
    exact, found = am.all_solutions(problem), multistart(problem, starts=300)
    assert not found.complete
    assert_same_solutions([s.r for s in found.solutions], [s.r for s in exact.solutions])
    for s in found.solutions:
        (other,) = (e for e in exact.solutions if same(e.r, s.r))
        assert {s.pattern, *s.touching} >= {other.pattern}
        assert s.orientation == other.orientation
        assert s.energy == pytest.approx(other.energy, rel=1e-6, abs=1e-12)
        assert s.error < 1e-8


@pytest.mark.parametrize("seed", range(8))
def test_loads_with_open_sticking_and_slipping_contacts(seed):
    random = np.random.default_rng(seed)
    local = hild_triangle(int(random.integers(3, 8)), mu=random.uniform(0.5, 5)).assemble()
    local = local.condensed()
    q = np.abs(local.q).max() * random.standard_normal(local.q.shape) * [1, 2]
    problem = am.FrictionProblem.from_delassus(local.W, q, local.mu)
    exact, found = am.all_solutions(problem), multistart(problem, starts=300, seed=seed)
    assert_same_solutions([s.r for s in found.solutions], [s.r for s in exact.solutions])


@pytest.mark.parametrize("seed", [0, 1, 3, 6, 7, 12])
def test_three_dimensions_against_brute_force(seed):
    W, q, mu = random_problem_3d(seed, contacts=2)
    expected = solutions_by_brute_force(W, q, mu)
    found = am.multistart(am.FrictionProblem.from_delassus(W, q, mu), starts=400)
    assert_same_solutions([s.r for s in found.solutions], [r for _, r in expected])
    assert {s.pattern for s in found.solutions} == {pattern for pattern, _ in expected}
    assert sum(s.orientation for s in found.solutions) == 1


def test_some_of_these_have_many_solutions():
    counts = [len(solutions_by_brute_force(*random_problem_3d(seed, 2))) for seed in (0, 3, 6)]
    assert max(counts) >= 5


def test_units_change_nothing():
    W, q, mu = random_problem_3d(3, contacts=2)
    scale = np.repeat([1e-4, 1e5], 3)
    own = multistart(am.FrictionProblem.from_delassus(W, q, mu), starts=200)
    other = multistart(
        am.FrictionProblem.from_delassus(
            W * scale * scale[:, None], 1e7 * q * scale.reshape(q.shape), mu
        ),
        starts=200,
    )
    assert [s.pattern for s in other.solutions] == [s.pattern for s in own.solutions]
    for s, t in zip(own.solutions, other.solutions, strict=True):
        assert t.energy == pytest.approx(1e14 * s.energy)


def test_one_contact_has_open_stick_and_slip():
    found = multistart(one_contact_2d(2.0), starts=50)
    assert [(s.pattern, s.orientation) for s in found.solutions] == [
        ("s", 1), ("-", -1), ("f", 1)
    ]  # fmt: skip
    assert "add up to 1" in found.reason


def test_a_connected_set_is_one_entry():
    W = np.array([[1.0, 0.8], [0.8, 1.0]])
    found = multistart(am.FrictionProblem.from_delassus(W, [[0.0, 1.0]], [1.25]), starts=200)
    assert len(found) == 1
    assert found.solutions[0].orientation == 0
    assert found.solutions[0].freedom == 1
    assert "singular" in found.reason


def test_without_friction_there_is_one_solution():
    for dimension in (2, 3):
        problem = random_delassus(5, 6, dimension).with_mu(0.0)
        found = multistart(problem, starts=60)
        assert len(found) == 1
        assert found.solutions[0].orientation == 1
        assert set(found.solutions[0].pattern) <= set("f+l")


def test_a_contact_that_can_not_react():
    W = np.zeros((4, 4))
    W[:2, :2] = [[1.0, 0.2], [0.2, 1.0]]
    penetrates = am.FrictionProblem.from_delassus(W, [[-1, 0], [-1, 0]], [0.5, 0.5])
    assert len(multistart(penetrates, starts=50)) == 0
    open_ = am.FrictionProblem.from_delassus(W, [[-1, 0], [1, 0]], [0.5, 0.5])
    assert [s.pattern for s in multistart(open_, starts=50).solutions] == ["sf"]


@pytest.mark.parametrize(("q", "mu"), [([-1.0, 1.0], 1.0), ([-1.0, 0.5], 0.0)])
def test_a_step_onto_a_known_solution_can_not_be_deflated(q, mu):
    problem = am.FrictionProblem.from_delassus(np.eye(2), [q], [mu])
    assert len(multistart(problem, starts=50)) == 1


def test_huge_reactions_that_swallow_the_load_are_no_solutions():
    # u_N = r_N + r_T + 0.2 >= 0.2 in the cone; r = 1e17 (1, -1) leaves q below rounding
    problem = am.FrictionProblem.from_delassus(np.ones((2, 2)), [[0.2, 0.1]], [1.0])
    found = multistart(problem, starts=200)
    assert [s.pattern for s in found.solutions] == ["f"]


def test_a_deflated_step_turns_away_from_a_known_solution():
    known, dr = np.zeros((1, 1, 2)), np.array([[[-1.0, 0.0]]])
    far, near = np.array([[[100.0, 0.0]]]), np.array([[[0.5, 0.0]]])
    assert deflation(far, dr, known) == pytest.approx([1.0], abs=1e-3)
    assert deflation(near, dr, known) < 0
    assert deflation(near, -dr, known) > 0


def test_a_scaled_problem_gives_velocities_in_its_units():
    problem = random_delassus(3, 4, 3)
    scaled = Scaled.of(problem)
    r = np.random.default_rng(0).standard_normal((4, 3))
    u = scaled.velocity(r[None])[0] * scaled.to_u
    assert u == pytest.approx(problem.velocity(r * scaled.to_r)[0])


def test_the_same_seed_gives_the_same_list():
    problem = hild_triangle(5, mu=4.0)
    one, two = (am.multistart(problem, starts=100, seed=4) for _ in range(2))
    assert [s.pattern for s in one.solutions] == [s.pattern for s in two.solutions]


def test_no_load_no_contacts_and_bad_input():
    rest = multistart(am.FrictionProblem.from_delassus(np.eye(3), [[0.0] * 3], [0.5]))
    assert "q is zero" in rest.reason
    with pytest.raises(am.InvalidInput, match="starts"):
        multistart(one_contact_2d(), starts=0)
    with pytest.raises(am.InvalidInput, match="time_limit"):
        multistart(one_contact_2d(), time_limit=0)
    with pytest.raises(am.UnsupportedForm, match="Tresca"):
        multistart(am.FrictionProblem.from_delassus(np.eye(2), [[-1.0, 0]], am.Tresca([1.0])))


def test_the_clock_stops_the_search():
    found = multistart(hild_triangle(4, mu=2.0).assemble(), starts=10**6, time_limit=0.2)
    assert found.examined < 10**5


def test_many_contacts_are_searched_from_many_starts():
    many = am.FrictionProblem.from_delassus(np.eye(402), -np.ones((201, 2)), np.ones(201))
    found = am.all_solutions(many, time_limit=1e-9)
    assert {s.pattern for s in found.solutions} <= {"s" * 201}
    assert not found.complete
    assert "more than 200 contacts" in found.reason


def test_starts_that_are_no_number_are_refused_by_name():
    for name, wrong in (("starts", 0), ("starts", "many"), ("starts", 1.5), ("seed", -1)):
        with pytest.raises(am.InvalidInput, match=f"{name}: expected a whole number"):
            multistart(one_contact_2d(2.0), **{name: wrong})
