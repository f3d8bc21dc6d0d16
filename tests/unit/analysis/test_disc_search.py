"""All solutions of 3D problems with proof: against brute force, and every proof checked."""

from dataclasses import replace

import numpy as np
import pytest
from brute_force_3d import random_problem_3d, solutions_by_brute_force
from disc_checker import accepted, balance_is_positive, law_is_negative

import amontons as am
from amontons.analysis.scaled import Scaled
from amontons.analysis.solutions.discs.search import DiscSearch, enumerate_discs
from amontons.analysis.solutions.discs.sets import Law, Region, copositive, negative_on_arc
from amontons.analysis.solutions.multistart import Finder
from amontons.core.clock import Deadline
from amontons.mechanics.ready.gallery import random_delassus, sphere_packing


def same(r, other):
    return np.abs(r - other).max() <= 1e-6 * (1 + np.abs(r).max())


def complete_list(W, q, mu):
    """All solutions with a proof that the separate checker accepts."""
    problem = am.FrictionProblem.from_delassus(W, q, mu)
    found = am.all_solutions(problem, keep_proof=True, time_limit=600)
    assert found.complete
    assert accepted(W, q, mu, found.proof, [s.r for s in found.solutions])
    return found


@pytest.mark.parametrize("seed", [1, 6, 12, 30])
def test_same_solutions_as_a_fine_search(seed):
    W, q, mu = random_problem_3d(seed)
    expected = solutions_by_brute_force(W, q, mu, angles=18, most=1500)
    found = complete_list(W, q, mu)
    assert len(found) == len(expected)
    for pattern, r in expected:
        (solution,) = (s for s in found.solutions if same(s.r, r))
        assert solution.pattern == pattern
        assert solution.error < 1e-8
    assert sum(s.orientation for s in found.solutions) == 1


@pytest.mark.parametrize("contacts", [4, 6])
def test_more_contacts(contacts):
    W, q, mu = random_problem_3d(contacts, contacts)
    found = complete_list(W, q, 0.3 * mu)
    assert len(found) == 1


def test_units_change_nothing():
    W, q, mu = random_problem_3d(12, contacts=2)
    scale = np.repeat([1e-3, 1e4], 3)
    own = complete_list(W, q, mu)
    other = complete_list(W * scale * scale[:, None], 1e5 * q * scale.reshape(q.shape), mu)
    assert [s.pattern for s in other.solutions] == [s.pattern for s in own.solutions]


def test_without_friction_there_is_one():
    problem = random_delassus(3, 3, 3).with_mu([0.0, 0.4, 0.0])
    found = am.all_solutions(problem)
    assert found.complete
    assert len(found) == 1


def test_a_contact_that_can_not_react():
    W = np.zeros((6, 6))
    W[:3, :3] = np.eye(3)
    penetrates = am.FrictionProblem.from_delassus(W, [[-1, 0, 0], [-1, 0, 0]], [0.5, 0.5])
    found = am.all_solutions(penetrates)
    assert found.complete
    assert len(found) == 0
    open_ = am.FrictionProblem.from_delassus(W, [[-1, 0, 0], [1, 0, 0]], [0.5, 0.5])
    found = am.all_solutions(open_)
    assert found.complete
    assert [s.pattern for s in found.solutions] == ["sf"]


def test_a_continuum_is_not_called_complete():
    # as in 2D: u_N = 0 for every r_N, since mu W_NT = W_NN and q_N = 0
    W = np.array([[1.0, 0.8, 0.0], [0.8, 1.0, 0.0], [0.0, 0.0, 1.0]])
    found = am.all_solutions(
        am.FrictionProblem.from_delassus(W, [[0, 1, 0]], [1.25]), time_limit=3
    )
    assert not found.complete
    assert found.solutions


def test_the_clock_stops_the_search():
    W, q, mu = random_problem_3d(15)
    found = am.all_solutions(am.FrictionProblem.from_delassus(W, q, mu), time_limit=0.3)
    assert not found.complete
    assert "stopped" in found.reason


def test_regions_and_arcs_count_what_they_cost():
    """No region is begun in less time than it takes, and proofs between directions count."""
    problem = am.FrictionProblem.from_delassus(np.eye(3), [[-1.0, 0.0, 0.0]], [0.5])
    scaled = Scaled.of(problem)
    finder = Finder(scaled, np.random.default_rng(0), 1e-10)
    assert not DiscSearch(scaled, finder, Deadline.counted(1e-3)).affords_step
    assert DiscSearch(scaled, finder, Deadline.counted(1.0)).affords_step
    deadline = Deadline.counted(1.0)
    negative_on_arc(Law(0.5, None), Region("l"), -np.eye(7), 0.0, deadline)
    assert deadline.time > 1e-4


def test_no_load_and_bad_input():
    rest = am.all_solutions(am.FrictionProblem.from_delassus(np.eye(3), [[0.0] * 3], [0.5]))
    assert "q is zero" in rest.reason
    with pytest.raises(am.InvalidInput, match="time_limit"):
        enumerate_discs(random_delassus(0, 2, 3), time_limit=0)
    with pytest.raises(am.UnsupportedForm, match="Tresca"):
        am.all_solutions(
            am.FrictionProblem.from_delassus(np.eye(3), [[-1.0, 0, 0]], am.Tresca([1.0]))
        )


# ---------------------------------------------------------------- the proofs themselves
def test_the_checker_refuses_wrong_proofs():
    W, q, mu = random_problem_3d(6)
    found = complete_list(W, q, mu)
    solutions = [s.r for s in found.solutions]
    assert not accepted(W, q, mu, found.proof, solutions[:-1])
    fewer = replace(found.proof, boxes=found.proof.boxes[1:])
    assert not accepted(W, q, mu, fewer, solutions)
    box = found.proof.boxes[0]
    assert not balance_is_positive(W, q, replace(box, V=-box.V))
    assert not law_is_negative(
        W, q, mu, replace(box, V=np.tile(np.eye(len(box.V[0])), (len(mu), 1, 1)))
    )
    wider = replace(box, letters="." * len(mu))
    assert not (balance_is_positive(W, q, wider) and law_is_negative(W, q, mu, wider))


def test_no_proof_for_one_solution_of_several():
    from amontons.analysis.scaled import Scaled
    from amontons.analysis.solutions.discs.multipliers import BoxProblem
    
    W, q, mu = random_problem_3d(12)
    problem = am.FrictionProblem.from_delassus(W, q, mu)
    scaled = Scaled.of(problem)
    solutions = am.multistart(problem, starts=200).solutions
    assert len(solutions) == 9
    for solution in solutions[:2]:
        answer = BoxProblem(scaled, [Region()] * 2, solution.r / scaled.to_r).solve()
        assert answer.proof is None


def test_copositive_matrices():
    random = np.random.default_rng(0)
    Q = random.standard_normal((400, 3, 3)) + 0.8 * np.eye(3)
    Q = (Q + np.swapaxes(Q, 1, 2)) / 2
    x = random.dirichlet([0.4, 0.4, 0.4], 4000)
    least = np.einsum("ki,jil,kl->jk", x, Q, x).min(axis=1)
    answer = copositive(Q)
    assert not answer[least < 0].any()
    assert answer[least > 0.02].all()
    assert 50 < answer.sum() < 350


def test_a_form_that_is_positive_between_samples_is_refused():
    law = Law(0.5, None)
    V = -np.diag([1.0, 1, 1, 1, 1, 1, 1])
    assert negative_on_arc(law, Region("l"), V, 0.0) is None
    n = np.array([0, -np.sin(1.0), np.cos(1.0), 0, 0, 0, 0])  # zero at one direction only
    V = V * 1e-3 + np.diag([0.25, 0, 0, 0, 0, 0, 0]) - 40 * np.outer(n, n)
    angle = negative_on_arc(law, Region("l"), V, 0.0)
    assert angle is not None
    assert min(abs(angle - 1.0), abs(abs(angle - 1.0) - np.pi)) < 0.3
    away = Region("l", 1.0 + np.pi / 2, 0.8)
    assert negative_on_arc(law, away, V, 0.0) is None


@pytest.mark.parametrize("search", [am.all_solutions, am.multistart])
def test_a_stopped_search_lists_what_a_solver_finds(search):
    """780 unknowns: a batch of Newton's method takes longer than the limit."""
    problem = sphere_packing().condensed()
    am.solve(problem)  # compiles, so that the limit is one of computing
    found = search(problem, time_limit=2.0)
    assert not found.complete
    assert len(found.solutions) >= 1
    assert max(solution.error for solution in found.solutions) <= 1e-8
