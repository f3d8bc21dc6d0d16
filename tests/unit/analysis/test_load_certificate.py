"""One load: certificates checked again without the package, enumeration as the truth."""

from types import SimpleNamespace

import numpy as np
import pytest
from load_certificate_checker import check_load
from scipy import sparse

import amontons as am
from amontons.analysis.certificates.one_load import certificate
from amontons.analysis.certificates.one_load.answer import LoadOutcome
from amontons.analysis.certificates.one_load.certificate import certify_load
from amontons.core.errors import InvalidInput, UnsupportedForm
from amontons.mechanics.ready.gallery import one_contact_2d, random_delassus
from amontons.mechanics.ready.hild import hild_triangle


def dense(problem):
    return problem.W.toarray() if sparse.issparse(problem.W) else problem.W


def checked(problem, certificate):
    """Distance by the checker, relative as in the certificate."""
    branches = [(b.pattern, b.multipliers) for b in certificate.branches]
    return check_load(dense(problem), problem.q, problem.mu, certificate.r0, branches)


def small_problem(seed):
    """Up to seven contacts, much friction, loads and couplings of several kinds."""
    random = np.random.default_rng(seed)
    nc = int(random.integers(1, 8))
    A = random.standard_normal((2 * nc, 2 * nc))
    W = A @ A.T / (2 * nc) + 0.05 * np.eye(2 * nc)
    q = random.standard_normal((nc, 2)) * [1, 2]
    mu = np.full(nc, random.uniform(0.5, 4.0))
    if seed % 3 == 1:  # contacts with three solutions each, weakly coupled
        W = np.kron(np.eye(nc), [[1.0, 0.8], [0.8, 1.0]]) + 0.1 * A @ A.T / (2 * nc)
        q = np.abs(q)
    if seed % 3 == 2:
        mu = random.uniform(0.0, 3.0, nc) * (random.random(nc) < 0.8)
    return am.FrictionProblem.from_delassus(W, q, mu)


@pytest.mark.parametrize("seed", range(30))
def test_agrees_with_enumeration(seed):
    problem = small_problem(seed)
    truth = am.all_solutions(problem)
    assert truth.complete
    start = truth.solutions[seed % len(truth)]
    answer = certify_load(problem, start)
    if len(truth) == 1 and not truth.solutions[0].freedom:
        assert answer.outcome is LoadOutcome.CERTIFIED
        assert answer.other is None
        distance = checked(problem, answer)
        assert distance <= 1e-5 * (1 + np.abs(start.r).max())
        assert answer.distance <= 1e-6
    else:
        assert answer.outcome is LoadOutcome.REFUTED
        assert problem.error(answer.other.r) < 1e-8
        assert np.abs(answer.other.r - start.r).max() > 1e-6 * np.abs(start.r).max()
        assert any(answer.other.pattern in (s.pattern, *s.touching) for s in truth.solutions)


def test_the_checker_refuses_wrong_certificates():
    problem = hild_triangle(5, mu=1.5).assemble().condensed()
    answer = certify_load(problem, am.solve(problem))
    assert answer.outcome is LoadOutcome.CERTIFIED
    checked(problem, answer)
    (branch,) = answer.branches
    right = (dense(problem), problem.q, problem.mu, answer.r0)
    with pytest.raises(AssertionError):  # three solutions exist there
        check_load(
            right[0],
            right[1],
            problem.mu * 2.2,
            right[3],
            [(branch.pattern, branch.multipliers)],
        )
    with pytest.raises(AssertionError):
        check_load(*right, [(branch.pattern, -branch.multipliers)])
    with pytest.raises(AssertionError, match="left out"):
        check_load(*right, [("f....", branch.multipliers)])


def test_branches_cover_all_patterns_and_are_all_needed():
    problem = hild_triangle(6, mu=2.9).assemble().condensed()
    answer = certify_load(problem, am.solve(problem))
    assert answer.outcome is LoadOutcome.CERTIFIED
    assert len(answer.branches) > 1
    assert answer.examined > len(answer.branches)
    checked(problem, answer)
    branches = [(b.pattern, b.multipliers) for b in answer.branches[1:]]
    with pytest.raises(AssertionError, match="left out"):
        check_load(dense(problem), problem.q, problem.mu, answer.r0, branches)


@pytest.mark.parametrize("n", [10, 25])
def test_each_of_three_solutions_is_refuted(n):
    problem = hild_triangle(n, mu=3.5).assemble().condensed()
    for solution in (
        am.all_solutions(hild_triangle(10, mu=3.5)).solutions
        if n == 10
        else [am.solve(problem)]
    ):
        answer = certify_load(problem, solution)
        assert answer.outcome is LoadOutcome.REFUTED
        assert problem.error(answer.other.r) < 1e-8
        assert answer.other.pattern != solution.pattern


@pytest.mark.parametrize("mu", [1.2, 1.39, 1.41, 2.0])
def test_one_contact_has_other_solutions_from_mu_1_4(mu):
    problem = one_contact_2d(mu)
    for solution in am.all_solutions(problem).solutions:
        answer = certify_load(problem, solution)
        expected = LoadOutcome.CERTIFIED if mu < 1.4 else LoadOutcome.REFUTED
        assert answer.outcome is expected


def test_mixed_statuses_on_a_hundred_contacts(monkeypatch):
    monkeypatch.setattr(certificate, "FEW", {2: 1000, 3: 1000})
    problem = hild_triangle(100, mu=0.6).assemble().condensed()
    x = np.linspace(0, 1, 100)
    q = np.column_stack([np.cos(5 * x) - 0.2, 0.5 * np.sin(7 * x)])
    problem = am.FrictionProblem.from_delassus(problem.W, q, problem.mu)
    solution = am.solve(problem)
    assert min(solution.counts.values()) > 0
    answer = certify_load(problem, solution)
    assert answer.outcome is LoadOutcome.CERTIFIED
    assert checked(problem, answer) <= 1e-6 * np.abs(solution.r).max()


def test_units_change_nothing():
    problem = small_problem(3)
    scale = 10.0 ** np.repeat(np.linspace(-4, 5, problem.contacts), 2)
    W, q = problem.W * scale * scale[:, None], 1e7 * problem.q * scale.reshape(-1, 2)
    other = am.FrictionProblem.from_delassus(W, q, problem.mu)
    first = certify_load(problem, am.all_solutions(problem).solutions[0])
    second = certify_load(other, am.all_solutions(other).solutions[0])
    assert first.outcome is second.outcome
    assert len(first.branches) == len(second.branches)


def test_solutions_on_the_border_of_statuses():
    # r = 0 and u = 0 at one contact, r_T = mu r_N with u_T = 0 at another, u_N = 0 at a third
    W = np.eye(6) + 0.1
    r = np.array([[0, 0], [1, 0.5], [0, 0]])
    u = np.array([[0, 0], [0, 0], [0, 1.0]])
    q = u - (W @ r.ravel()).reshape(3, 2)
    problem = am.FrictionProblem.from_delassus(W, q, [0.5] * 3)
    solution = am.all_solutions(problem).solutions[0]
    assert solution.touching
    answer = certify_load(problem, solution)
    assert answer.outcome is LoadOutcome.CERTIFIED
    checked(problem, answer)


def test_continuum_and_self_stress():
    problem = am.FrictionProblem.from_delassus([[1.0, 0.8], [0.8, 1.0]], [[0.0, 1.0]], [1.25])
    (solution,) = am.all_solutions(problem).solutions
    assert certify_load(problem, solution).outcome is LoadOutcome.REFUTED
    W = np.kron(np.ones((2, 2)), np.diag([1.0, 0.0])) + np.diag([0.0, 1.0, 0.0, 1.0])
    problem = am.FrictionProblem.from_delassus(W, [[-1.0, 0.0], [-1.0, 0.0]], [0.3, 0.3])
    answer = certify_load(problem, am.all_solutions(problem).solutions[0])
    assert answer.outcome is LoadOutcome.REFUTED
    assert problem.error(answer.other.r) < 1e-8


@pytest.mark.parametrize("mu", [0.0, 1e-12, 1e-3, 50.0])
def test_no_slight_and_huge_friction(mu):
    problem = random_delassus(5, 4, 2, mu=mu)
    truth = am.all_solutions(problem)
    answer = certify_load(problem, truth.solutions[0])
    unique = len(truth) == 1
    assert answer.outcome is (LoadOutcome.CERTIFIED if unique else LoadOutcome.REFUTED)
    if unique:
        checked(problem, answer)


def test_unsymmetric_w():
    problem = small_problem(0)
    skew = np.triu(np.ones_like(problem.W), 1)
    W = problem.W + 0.2 * (skew - skew.T)
    problem = am.FrictionProblem.from_delassus(W, problem.q, 0.5 * problem.mu)
    truth = am.all_solutions(problem)
    answer = certify_load(problem, truth.solutions[0])
    assert answer.outcome.name == ("CERTIFIED" if len(truth) == 1 else "REFUTED")
    if len(truth) == 1:
        checked(problem, answer)


@pytest.mark.parametrize("q", [(0.2, 1.0), (0.2, 0.1)])
def test_branches_in_which_nothing_can_move(q):
    # open is the only solution, and the singular W leaves no room for a proof
    problem = am.FrictionProblem.from_delassus(np.ones((2, 2)), [q], [1.0])
    assert (
        certify_load(problem, am.solve(problem), time_limit=5).outcome
        is not LoadOutcome.REFUTED
    )


def test_a_regular_piece_has_one_solution():
    # both contacts stick; other points of the same piece miss the law by less than rounding
    W = np.array([
        [1.16777347e-09, 7.62480327e-07, -1.36089254e-11, -1.24572511e-06],
        [7.62480327e-07, 1.12364953e-03, -1.52152646e-08, -2.83672553e-03],
        [-1.36089254e-11, -1.52152646e-08, 2.70556876e-13, 3.30182870e-08],
        [-1.24572511e-06, -2.83672553e-03, 3.30182870e-08, 1.65361200e-02],
    ])  # fmt: skip
    q = np.array([[-6.29308773e-13, -1.29132462e-09], [-1.06269424e-14, -6.98781477e-11]])
    problem = am.FrictionProblem.from_delassus(W, q, [2.0, 2.0])
    solution = SimpleNamespace(r=np.linalg.solve(W, -q.ravel()).reshape(2, 2))
    found = certify_load(problem, solution, time_limit=5)
    assert found.outcome is not LoadOutcome.REFUTED


def test_no_contact_and_contacts_that_can_not_react():
    empty = am.FrictionProblem.from_delassus(np.zeros((0, 0)), np.zeros((0, 2)), np.zeros(0))
    assert certify_load(empty, am.solve(empty)).outcome is LoadOutcome.CERTIFIED
    W = np.zeros((4, 4))
    W[:2, :2] = np.eye(2)
    problem = am.FrictionProblem.from_delassus(W, [[-1.0, 0.2], [0.5, 0.0]], [0.5, 0.5])
    answer = certify_load(problem, am.solve(problem))
    assert answer.outcome is LoadOutcome.CERTIFIED


def test_what_is_refused():
    problem = small_problem(1)
    wrong = am.solve(problem)
    with pytest.raises(InvalidInput, match="solution of the problem"):
        certify_load(problem.with_load(-problem.q), wrong)
    with pytest.raises(InvalidInput, match="time_limit"):
        certify_load(problem, am.solve(problem), time_limit=0)
    with pytest.raises(InvalidInput, match="reactions"):
        certify_load(problem, am.solve(one_contact_2d()))
    tresca = am.FrictionProblem.from_delassus(np.eye(2), [[-1.0, 0.0]], am.Tresca(np.ones(1)))
    with pytest.raises(UnsupportedForm):
        certify_load(tresca, am.solve(tresca))


def test_the_clock():
    problem = hild_triangle(25, mu=2.9).assemble().condensed()
    answer = certify_load(problem, am.solve(problem), time_limit=0.01)
    assert answer.outcome is LoadOutcome.UNDECIDED
    assert "stopped" in answer.reason
    assert not answer.branches


def test_shared_multipliers_are_complete_certificates(monkeypatch):
    # few multipliers on a subspace first, as for many contacts
    monkeypatch.setattr(certificate, "FEW", {2: 1000, 3: 1000})
    monkeypatch.setattr("amontons.analysis.solutions.discs.multipliers.LARGE", 1)
    monkeypatch.setattr("amontons.analysis.solutions.discs.reduction.SETS", 4)
    called = []

    def never(*arguments, **options):
        called.append(arguments)

    problem = hild_triangle(40, mu=0.5).assemble().condensed()
    q = np.column_stack(
        [np.cos(np.linspace(0, 5, 40)) - 0.2, np.sin(np.linspace(0, 9, 40)) / 2]
    )
    for other in (problem, am.FrictionProblem.from_delassus(problem.W, q, problem.mu)):
        with monkeypatch.context() as patch:
            patch.setattr(
                "amontons.analysis.solutions.discs.multipliers.find_multipliers", never
            )
            answer = certify_load(other, am.solve(other))
        assert not called
        assert answer.outcome is LoadOutcome.CERTIFIED
        checked(other, answer)
    three = hild_triangle(10, mu=3.5).assemble().condensed()
    assert certify_load(three, am.solve(three)).outcome is LoadOutcome.REFUTED


def test_few_unknowns_and_many_give_the_same_matrix(monkeypatch):
    from amontons.analysis.multipliers import program
    from amontons.analysis.multipliers.lmi import restricted
    from amontons.analysis.multipliers.normal import Normal
    from amontons.analysis.multipliers.steps import start

    random = np.random.default_rng(0)
    Z = random.standard_normal((4 * 30, 5))
    rows, each = np.arange(120).reshape(30, 4), np.arange(30)
    share = sparse.csr_array((np.ones(30), (each, each % 2)), shape=(30, 2))
    slacks = (program.Slacks(each, restricted(np.tile(np.eye(4), (30, 1, 1)))),)
    family = program.Family(rows, slacks, np.ones(0), share)
    few = program.Program(Z, (family,))
    assert few.few is not None
    monkeypatch.setattr(program, "FEW", 0)
    many = program.Program(Z, (family,))
    assert many.few is None
    point = start(few)
    inverse = [np.linalg.inv(B) for B in point.S]
    right = random.standard_normal((few.unknowns, 2))
    answers = [Normal(p, point.X, inverse)(right) for p in (few, many)]
    assert answers[0] == pytest.approx(answers[1], rel=1e-8)


def test_a_rough_solution_is_good_enough():
    problem = hild_triangle(12, mu=0.7).assemble().condensed()
    x = np.linspace(0, 1, 12)
    q = np.column_stack([np.cos(5 * x) - 0.2, np.sin(7 * x) / 2])
    problem = am.FrictionProblem.from_delassus(problem.W, q, problem.mu)
    for tolerance in (1e-6, 1e-10):
        answer = certify_load(problem, am.solve(problem, am.GaussSeidel(), tolerance=tolerance))
        assert answer.outcome is LoadOutcome.CERTIFIED
        assert answer.distance < 1e-8
        assert problem.error(answer.r0) < 1e-12


def test_too_many_contacts_are_undecided_where_sharing_fails(monkeypatch):
    monkeypatch.setattr("amontons.analysis.solutions.discs.multipliers.LARGE", 1)
    monkeypatch.setattr("amontons.analysis.solutions.discs.multipliers.LARGEST", 5)
    monkeypatch.setattr("amontons.analysis.solutions.discs.reduction.SETS", 2)
    problem = hild_triangle(15, mu=2.9).assemble().condensed()
    answer = certify_load(problem, am.solve(problem))
    assert answer.outcome is LoadOutcome.UNDECIDED
    assert "contacts" in answer.reason
    three = hild_triangle(15, mu=3.5).assemble().condensed()
    assert certify_load(three, am.solve(three)).outcome is LoadOutcome.REFUTED
