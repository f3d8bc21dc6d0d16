"""All solutions of small 2D problems, against every pattern solved one by one."""

import itertools
from fractions import Fraction

import numpy as np
import pytest

import amontons as am
from amontons.analysis.solutions import pattern_search
from amontons.analysis.solutions.enumerate import enumerate_solutions
from amontons.mechanics.ready.gallery import one_contact_2d, random_delassus
from amontons.mechanics.ready.hild import hild_triangle


def all_by_brute_force(W, q, mu):
    """(pattern, r) of every status pattern, from one full system in (r, u) each."""
    nc = len(mu)
    found = []
    for pattern in itertools.product("fs+-", repeat=nc):
        rows, right = [np.hstack([-W, np.eye(2 * nc)])], [q.ravel()]
        for i, letter in enumerate(pattern):
            law = np.zeros((2, 4 * nc))
            n, t = 2 * i, 2 * i + 1
            if letter == "f":
                law[0, n] = law[1, t] = 1
            elif letter == "s":
                law[0, 2 * nc + n] = law[1, 2 * nc + t] = 1
            else:
                law[0, 2 * nc + n] = law[1, t] = 1
                law[1, n] = -mu[i] if letter == "+" else mu[i]
            rows.append(law)
            right.append(np.zeros(2))
        z = np.linalg.solve(np.vstack(rows), np.concatenate(right))
        r, u = z[: 2 * nc].reshape(nc, 2), z[2 * nc :].reshape(nc, 2)
        ok = {
            "f": u[:, 0],
            "s": mu * r[:, 0] - np.abs(r[:, 1]),
            "+": np.minimum(r[:, 0], -u[:, 1]),
            "-": np.minimum(r[:, 0], u[:, 1]),
        }
        if all(ok[letter][i] >= 0 for i, letter in enumerate(pattern)):
            found.append(("".join(pattern), r))
    return found


def coupled_problem(seed):
    """Strong coupling of normal and tangential directions, much friction, any load."""
    random = np.random.default_rng(seed)
    nc = int(random.integers(1, 6))
    A = random.standard_normal((2 * nc, 2 * nc))
    W = A @ A.T + 0.05 * np.eye(2 * nc)
    q = random.standard_normal((nc, 2)) * [1, 3]
    mu = random.uniform(0.1, 4.0, nc) * 10.0 ** random.uniform(-1, 0.5)
    if seed % 3 == 0:  # contacts that have three solutions each, weakly coupled
        W = np.kron(np.eye(nc), [[1.0, 0.8], [0.8, 1.0]]) + 0.02 * A @ A.T
        q = np.abs(q)
    return W, q, mu


@pytest.mark.parametrize("seed", range(60))
def test_same_solutions_as_all_patterns(seed):
    W, q, mu = coupled_problem(seed)
    expected = dict(all_by_brute_force(W, q, mu))
    found = am.all_solutions(am.FrictionProblem.from_delassus(W, q, mu))
    assert found.complete
    assert {s.pattern for s in found.solutions} == set(expected)
    for solution in found.solutions:
        assert solution.r == pytest.approx(expected[solution.pattern], rel=1e-6, abs=1e-9)
        assert solution.error < 1e-8
        assert solution.freedom == 0
    # degree theory: every load has an odd number of solutions, the orientations add up to 1
    assert sum(s.orientation for s in found.solutions) == 1


def test_three_independent_contacts_have_27_solutions():
    one = one_contact_2d(2.0)
    W, q = np.kron(np.eye(3), one.W), np.tile(one.q, (3, 1))
    found = am.all_solutions(am.FrictionProblem.from_delassus(W, q, [2.0] * 3))
    assert found.complete
    words = {"".join(letters) for letters in itertools.product("fs-", repeat=3)}
    assert {s.pattern for s in found.solutions} == words


def test_units_change_nothing():
    W, q, mu = coupled_problem(4)
    scale = 10.0 ** np.repeat(np.linspace(-4, 5, len(mu)), 2)
    own = am.all_solutions(am.FrictionProblem.from_delassus(W, q, mu))
    other = am.all_solutions(
        am.FrictionProblem.from_delassus(
            W * scale * scale[:, None], 1e7 * q * scale.reshape(q.shape), mu
        )
    )
    assert other.complete
    assert [s.pattern for s in other.solutions] == [s.pattern for s in own.solutions]


def test_what_a_list_resolves_is_told_in_no_units():
    """Units are powers of two inside, up to 1.4 off for |W_ii|^1/2 and for the load each."""
    W, r = np.array([[1.0, 0.8], [0.8, 1.0]]), np.array([[1.0, 0.5]])
    q = -(W @ r.ravel()).reshape(1, 2)  # sticks, on the border of slip at mu = 1/2
    found = {}
    for a, b in itertools.product((1.0, 1.2, 1.4, 1.45, 1.7, 1.95), repeat=2):
        problem = am.FrictionProblem.from_delassus(a * W, b * q, [0.5])
        found[a, b] = am.all_solutions(problem)
    assert all(one.complete for one in found.values())
    told = np.array([one.resolution for one in found.values()])
    assert told.max() <= 1.3 * told.min()  # rounding is a small part of DATA


def test_one_contact_with_three_solutions():
    found = am.all_solutions(one_contact_2d(2.0))
    assert [(s.pattern, s.orientation) for s in found.solutions] == [
        ("s", 1), ("f", 1), ("-", -1)
    ]  # fmt: skip
    assert found.solutions[2].r == pytest.approx(np.array([[1 / 3, -2 / 3]]))
    assert found.solutions[2].u[0, 0] == pytest.approx(0, abs=1e-12)
    assert [s.pattern for s in am.all_solutions(one_contact_2d(1.0)).solutions] == ["f"]


def test_two_solutions_where_stick_and_slip_meet():
    found = am.all_solutions(hild_triangle(3, mu=3.0))
    assert found.complete
    assert sorted(s.pattern for s in found.solutions) == ["fff", "sss"]
    stick = next(s for s in found.solutions if s.pattern == "sss")
    assert "+++" in stick.touching  # r_T = 3 r_N lies on the cone


def test_a_continuum_of_solutions_is_one_entry():
    # mu W_NT = W_NN and q_N = 0: u_N = 0 for every r_N, slip- up to r_N = q_T / (mu - 0.8)
    W = np.array([[1.0, 0.8], [0.8, 1.0]])
    problem = am.FrictionProblem.from_delassus(W, [[0.0, 1.0]], [1.25])
    found = am.all_solutions(problem)
    assert found.complete
    (solution,) = found.solutions
    assert (solution.pattern, solution.freedom, solution.orientation) == ("-", 1, 0)
    assert set(solution.touching) == {"f", "s"}
    assert 0 < solution.r[0, 0] < 1 / 0.45
    assert problem.error(solution.r) < 1e-12


def test_a_continuum_beside_an_isolated_contact():
    W = np.kron(np.eye(2), np.array([[1.0, 0.8], [0.8, 1.0]]))
    problem = am.FrictionProblem.from_delassus(W, [[0.0, 1.0], [0.2, 1.0]], [1.25, 2.0])
    found = am.all_solutions(problem)
    assert sorted(s.pattern for s in found.solutions) == ["--", "-f", "-s"]
    assert [s.freedom for s in found.solutions] == [1, 1, 1]


def test_a_plane_of_solutions():
    # two contacts that see only the sum of their normal reactions, without friction
    W = np.kron(np.ones((2, 2)), np.diag([1.0, 0.0])) + np.diag([0.0, 1.0, 0.0, 1.0])
    problem = am.FrictionProblem.from_delassus(W, [[-1.0, 0.0], [-1.0, 0.0]], [0.0, 0.0])
    found = am.all_solutions(problem)
    assert found.complete  # W is singular, but r_N >= 0 leaves no self-stress
    (solution,) = found.solutions
    assert (solution.pattern, solution.freedom) == ("++", 1)
    assert solution.r[:, 0].sum() == pytest.approx(1)
    assert set(solution.touching) == {"f+", "+f"}


def test_no_solution_with_proof():
    # a contact that can not react, and penetrates
    found = am.all_solutions(am.FrictionProblem.from_delassus(np.zeros((2, 2)), [[-1, 0]], [1]))
    assert found.solutions == ()
    assert found.complete


def test_no_solution_that_is_jammed_has_no_proof():
    # u_N = r_N - r_T - 1, u_T = -u_N - 1: slip+ needs (1 - mu) r_N = 1; W r = 0 for r = (1, 1)
    W = np.array([[1.0, -1.0], [-1.0, 1.0]])
    found = am.all_solutions(am.FrictionProblem.from_delassus(W, [[-1.0, 0.0]], [1.5]))
    assert found.solutions == ()
    assert not found.complete
    assert "singular" in found.reason
    found = am.all_solutions(am.FrictionProblem.from_delassus(W, [[-1.0, 0.0]], [0.5]))
    assert [s.pattern for s in found.solutions] == ["+"]
    assert found.solutions[0].r == pytest.approx(np.array([[2.0, 1.0]]))
    assert found.complete


@pytest.mark.parametrize("rank", [4, 6])
def test_solutions_of_singular_problems_satisfy_the_judge(rank):
    for seed in range(5):
        problem = random_delassus(seed, 4, 2, rank=rank)
        found = am.all_solutions(problem)
        assert found.solutions
        assert all(problem.error(s.r) < 1e-8 for s in found.solutions)


def test_no_load_and_no_contacts():
    rest = am.all_solutions(am.FrictionProblem.from_delassus(np.eye(2), [[0.0, 0.0]], [0.5]))
    assert not rest.complete
    assert "q is zero" in rest.reason
    assert rest.solutions[0].pattern == "f"
    empty = am.FrictionProblem.from_delassus(np.zeros((0, 0)), np.zeros((0, 2)), np.zeros(0))
    assert am.all_solutions(empty).complete


def test_the_clock_stops_the_search(monkeypatch):
    monkeypatch.setattr("amontons.analysis.solutions.pattern_leaves.NODES", 5)
    found = am.all_solutions(hild_triangle(6, mu=3.5), time_limit=1e-9)
    assert not found.complete
    assert "stopped" in found.reason
    assert found.examined < 100
    assert am.all_solutions(hild_triangle(6, mu=3.5)).complete


def test_proofs_hold_up_when_checked_from_the_problem():
    """The compiled proof of infeasibility refuses multipliers that prove nothing."""
    W, q, _ = coupled_problem(0)
    m = len(W)
    states = np.full(m // 2, pattern_search.CLOSED, dtype=np.int8)
    box = np.full(2 * m, 1e3)
    for seed in range(50):
        y = np.random.default_rng(seed).standard_normal(m)
        x = np.random.default_rng(seed + 1).random(
            m
        )  # some a, b >= 0: feasible by construction
        u = np.zeros(m)
        u[1::2] = (W @ x)[1::2] + q.ravel()[1::2]
        c = u - W @ x
        assert not pattern_search._proved(y, W, c, states, -box, box)


def test_bad_input_is_refused():
    with pytest.raises(am.UnsupportedForm, match="2D"):
        enumerate_solutions(random_delassus(0, 2, 3))
    many = am.FrictionProblem.from_delassus(np.eye(402), np.ones((201, 2)), np.ones(201))
    with pytest.raises(am.InvalidInput, match="at most 200, got 201"):
        enumerate_solutions(many)
    with pytest.raises(am.UnsupportedForm, match="Tresca"):
        am.all_solutions(
            am.FrictionProblem.from_delassus(np.eye(2), [[-1.0, 0]], am.Tresca([1.0]))
        )
    with pytest.raises(am.InvalidInput, match="time_limit"):
        enumerate_solutions(one_contact_2d(), time_limit=-1)
    with pytest.raises(am.InvalidInput, match="expected a Model"):
        am.all_solutions(3)


# ------------------------------------------- a checker that shares no code with the search
SIGNS = {  # allowed signs of a, b, u_N, u_T, where r = a (1, mu) + b (1, -mu)
    ".": ("+", "+", "+", "*"), "c": ("+", "+", "0", "*"), "f": ("0", "0", "+", "*"),
    "s": ("+", "+", "0", "0"), "+": ("+", "0", "0", "-"), "-": ("0", "+", "0", "+"),
}  # fmt: skip
STANDS_FOR = {".": "fs+-", "c": "s+-"}


def largest_value(direction, centre, shape, radius):
    """Maximum of direction . z over the ellipsoid centre + radius shape^(1/2) ball."""
    return direction @ centre + radius * np.sqrt(direction @ shape @ direction)


def box(W, q, mu):
    """Ranges of a, b, u_N, u_T in r W r + q r <= 0, and a little more, (nc, 4, 2)."""
    inverse = np.linalg.inv(W)
    centre, radius = -inverse @ q / 2, np.sqrt(q @ inverse @ q) / 2
    out = np.empty((len(mu), 4, 2))
    for i, coefficient in enumerate(mu):
        n, t = np.eye(len(q))[2 * i : 2 * i + 2]
        a, b = (n + t / coefficient) / 2, (n - t / coefficient) / 2
        for k, (direction, shift) in enumerate(
            [(a, 0), (b, 0), (W @ n, q @ n), (W @ t, q @ t)]
        ):
            out[i, k, 0] = shift - largest_value(-direction, centre, inverse, radius)
            out[i, k, 1] = shift + largest_value(direction, centre, inverse, radius)
    room = 1e-7 * np.abs(out).sum(axis=2)  # far above rounding here
    return out + room[..., None] * [-1, 1]


def excluded(W, q, mu, bounds, word, y):
    """In exact arithmetic: y u - (W y) r, with the signs of `word`, is never y q."""
    exact = [[Fraction(x) for x in row] for row in W]
    y, m = [Fraction(x) for x in y], len(q)
    pull = [-sum(exact[k][j] * y[k] for k in range(m)) for j in range(m)]
    least = most = Fraction(0)
    for i, letter in enumerate(word):
        slope, (n, t) = Fraction(mu[i]), (2 * i, 2 * i + 1)
        weights = (pull[n] + slope * pull[t], pull[n] - slope * pull[t], y[n], y[t])
        for k, (weight, sign) in enumerate(zip(weights, SIGNS[letter], strict=True)):
            low, high = (Fraction(x) for x in bounds[i, k])
            low = max(low, 0) if sign in "0+" else low
            high = min(high, 0) if sign in "0-" else high
            if low > high:
                return True
            least += min(weight * high, weight * low)
            most += max(weight * high, weight * low)
    right = sum(a * Fraction(b) for a, b in zip(y, q, strict=True))
    return not least <= right <= most


def check(problem):
    """Every pattern is a listed solution or excluded by multipliers that hold."""
    found = am.all_solutions(problem, keep_proof=True)
    W, q, mu = problem.W, problem.q.ravel(), problem.mu
    bounds = box(W, q, mu)
    covered = {w for s in found.solutions for w in (s.pattern, *s.touching)}
    for word, y in zip(found.proof.patterns, found.proof.multipliers, strict=True):
        assert excluded(W, q, mu, bounds, word, y.ravel()), word
        choices = (STANDS_FOR.get(letter, letter) for letter in word)
        covered |= {"".join(letters) for letters in itertools.product(*choices)}
    assert len(covered) == 4 ** len(mu)


@pytest.mark.parametrize("seed", range(12))
def test_proofs_are_accepted_by_a_separate_checker(seed):
    W, q, mu = coupled_problem(seed)
    check(am.FrictionProblem.from_delassus(W, q, mu))


def test_the_proof_for_the_triangle_is_accepted():
    local = hild_triangle(5, mu=3.5).assemble().condensed()
    check(am.FrictionProblem.from_delassus(local.W.toarray(), local.q, local.mu))


def test_the_checker_refuses_a_wrong_proof():
    W, q, mu = coupled_problem(2)
    found = am.all_solutions(am.FrictionProblem.from_delassus(W, q, mu), keep_proof=True)
    bounds, word = box(W, q.ravel(), mu), found.solutions[0].pattern
    for y in found.proof.multipliers:
        assert not excluded(W, q.ravel(), mu, bounds, word, y.ravel())


def test_energy_is_that_above_the_state_without_contact():
    model = hild_triangle(3, mu=3.5)
    problem = model.assemble()
    free = problem.velocity(np.zeros((3, 2)))[1]
    for solution in am.all_solutions(model).solutions:
        v = problem.velocity(solution.r)[1]
        potential = [x @ (problem.M @ x) / 2 - problem.f @ x for x in (v, free)]
        assert solution.energy == pytest.approx(potential[0] - potential[1], abs=1e-9)
