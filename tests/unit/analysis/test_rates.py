"""Whether a body can jump: against all rates of random states in 2D, counted piece by piece."""

import itertools

import numpy as np
import pytest

import amontons as am
from amontons.analysis.certificates.rates import RateVerdict, rates

LETTERS = {"o": "o", "k": "k", "c": "kl", "g": "okpm"}  # pieces of the rates of a state


def state_of(seed, d=2, kinds="okccg", strength=1.0):
    """A problem, its solution as reactions, and what each contact does there."""
    random = np.random.default_rng(seed)
    nc = int(random.integers(1, 5))
    A = random.standard_normal((d * nc, d * nc))
    W = A @ A.T / (d * nc) + 0.05 * np.eye(d * nc)
    mu = strength * random.uniform(0.3, 3.0, nc)
    word = "".join(random.choice(list(kinds), nc))
    r, u = np.zeros((2, nc, d))
    for i, letter in enumerate(word):
        turn = random.standard_normal(d - 1)
        turn /= np.linalg.norm(turn)
        if letter == "o":
            u[i, 0] = random.uniform(0.5, 1)
        elif letter in "kc":
            r[i, 0] = random.uniform(0.5, 1)
            part = 1.0 if letter == "c" else random.uniform(0, 0.9)
            r[i, 1:] = part * mu[i] * r[i, 0] * turn
            if letter == "c" and random.random() < 0.7:  # else it is about to slip
                u[i, 1:] = -turn
    q = u - (W @ r.ravel()).reshape(nc, d)
    return am.FrictionProblem.from_delassus(W, q, mu), r, word


class Found:
    """What a solver would give."""

    def __init__(self, r):
        self.r = r


def piece(W, mu, r, word, letters):
    """(equations, inequalities): A r' + B u' = 0 and C r' + D u' >= 0 on one piece."""
    nc = len(mu)
    equations, inequalities = [], []

    def row(*entries):
        out = np.zeros((2, 2 * nc))
        for part, place, value in entries:
            out[part, place] += value
        return out

    for i, letter in enumerate(letters):
        N, T = 2 * i, 2 * i + 1
        t = -np.sign(r[i, 1])
        slack = row((0, N, mu[i]), (0, T, t))
        if letter == "o":
            equations += [row((0, N, 1)), row((0, T, 1))]
            inequalities += [row((1, N, 1))] if word[i] == "g" else []
            continue
        equations.append(row((1, N, 1)))
        if word[i] == "g":
            inequalities.append(row((0, N, 1)))
        if letter == "k":
            equations.append(row((1, T, 1)))
            inequalities += [slack] if word[i] == "c" else []
            if word[i] == "g":
                inequalities += [row((0, N, mu[i]), (0, T, s)) for s in (1, -1)]
        elif letter == "l":
            equations.append(slack)
            inequalities.append(row((1, T, t)))
        else:
            s = 1 if letter == "p" else -1
            equations.append(row((0, N, mu[i]), (0, T, -s)))
            inequalities.append(row((1, T, -s)))
    return np.array(equations), np.array(inequalities).reshape(-1, 2, 2 * nc)


def solved(W, system, q):
    """r' of a piece, None where the equations are singular."""
    A = system[0][:, 0] + system[0][:, 1] @ W
    if abs(np.linalg.det(A)) < 1e-12:
        return None
    return np.linalg.solve(A, -system[0][:, 1] @ q)


def count(W, mu, r, word, q):
    """How many rates a change q' of the load has."""
    found = []
    for letters in itertools.product(*(LETTERS[x] for x in word)):
        system = piece(W, mu, r, word, letters)
        rate = solved(W, system, q)
        if rate is None:
            continue
        values = system[1][:, 0] @ rate + system[1][:, 1] @ (W @ rate + q)
        new = all(np.abs(rate - other).max() > 1e-9 for other in found)
        if (values >= -1e-12).all() and new:
            found.append(rate)
    return len(found)


def changes(W, mu, r, word, random):
    """Changes of the load that a random piece answers, all of whose inequalities hold."""
    choices = list(itertools.product(*(LETTERS[x] for x in word)))
    for letters in random.permutation(choices)[:20]:
        equations, inequalities = piece(W, mu, r, word, letters)
        both = np.vstack([equations, inequalities]).reshape(-1, 2 * W.shape[0])
        right = np.concatenate([np.zeros(len(equations)), random.random(len(inequalities))])
        x = np.linalg.lstsq(both, right, rcond=None)[0]
        x += (np.eye(len(x)) - np.linalg.pinv(both) @ both) @ random.standard_normal(len(x))
        yield x[len(W) :] - W @ x[: len(W)]


@pytest.mark.parametrize("first", range(0, 60, 10))
def test_against_all_rates_of_random_states(first):
    for seed in range(first, first + 10):
        problem, r, word = state_of(seed)
        found = rates(problem, Found(r))
        assert found.verdict is not RateVerdict.UNDECIDED
        expected = [np.flatnonzero([x == kind for x in word]).tolist() for kind in "cgko"]
        sets = found.sliding, found.grazing, found.sticking, found.open
        assert [x.tolist() for x in sets] == expected
        random = np.random.default_rng(seed)
        W, mu = np.asarray(problem.W), problem.mu
        counts = [count(W, mu, r, word, q) for q in changes(W, mu, r, word, random)]
        if found.jump_possible:
            assert any(n != 1 for n in counts)
        else:
            assert all(n == 1 for n in counts)


def test_both_verdicts_are_met():
    verdicts = [rates(problem, Found(r)).jump_possible
                for problem, r, _ in map(state_of, range(60))]  # fmt: skip
    assert 5 <= sum(verdicts) <= 55


@pytest.mark.parametrize("seed", range(20))
def test_one_sliding_contact_in_space(seed):
    """D is one over its tangential compliance with the coupling to its normal, by hand."""
    problem, r, word = state_of(seed, 3, "c", 0.7)
    if len(word) > 1:
        problem = am.FrictionProblem.from_delassus(
            np.asarray(problem.W)[:3, :3], problem.q[:1], problem.mu[:1]
        )
        r = r[:1]
    problem = problem.with_load(-(np.asarray(problem.W) @ r.ravel()).reshape(1, 3))
    W, mu, t = np.asarray(problem.W), problem.mu[0], -r[0, 1:] / np.linalg.norm(r[0, 1:])
    found = rates(problem, Found(r))
    # slip along t alone: W r' = (0, t) has f = mu r_N' + t.r_T'
    rate = np.linalg.solve(W, [0, *t])
    f = mu * rate[0] + t @ rate[1:]
    assert found.jump_possible == (f < 0)
    scale = found.D[0, 0] / f
    assert scale > 0


def test_what_is_open_or_stuck_is_not_in_doubt():
    problem, r, _ = state_of(3, 3, "ok")
    found = rates(problem, Found(r))
    assert found.jump_possible is False
    assert not len(found.sliding)
    assert "no contact is at a border" in str(found)


def test_many_sliding_contacts_in_space_by_the_inequality():
    block = am.Body(am.box((1, 1, 1), cells=4), am.LinearElastic(young=200, poisson=0.3))
    model = am.Model(
        [block], supports=[am.Fix("top", lambda x: (0, 0.2, 0.06 - 0.15 * x[0]))],
        contacts=[am.Contact("bottom", am.Plane(normal=(0, 0, 1)), mu=0.3)],
    )  # fmt: skip
    solution = am.solve(model, tolerance=1e-10)
    found = am.rates(solution.problem, solution.solution)
    assert found.jump_possible is False
    assert found.margin > 0.1
    assert len(found.sliding) > 8


def test_the_step_that_jumps_and_no_other_may_jump():
    """The brake arm lets go at t = 1.68691, where the path of its solutions turns back."""
    model = am.read_case("example:release").model
    method, last, told = am.QuasiStatic(0.05, crossing=am.PathCrossing()), None, []
    for step in am.evolve(model, method, until=1.8):
        found = am.rates(step.problem, step.solution, last)
        told.append((found.jump_possible, step.passage.jumped))
        last = step.solution.r
    assert set(told) == {(False, False), (True, True)}


@pytest.mark.parametrize("seed", range(40))
def test_between_two_states_all_pieces_are_asked(seed):
    """No jump is as much as every combination of the pieces having the orientation of all."""
    problem, r, word = state_of(seed, kinds="okc")
    W, mu = np.asarray(problem.W), problem.mu
    random = np.random.default_rng(seed)
    before = r.copy()
    pieces = [{"o": "o", "k": "k", "c": "k" + "pm"[int(x[1] < 0)]}[kind]
              for kind, x in zip(word, r, strict=True)]  # fmt: skip
    for i, kind in enumerate(word):
        if random.random() < 0.5:  # closed or opened, or slid the other way
            before[i] = [0.0, 0.0] if kind != "o" else [1.0, 0.1 * mu[i]]
            before[i] = -r[i] * [-1, 1] if kind == "c" and random.random() < 0.5 else before[i]
            pieces[i] = "okpm"
    signs = {np.sign(orientation(W, mu, letters)) for letters in itertools.product(*pieces)}
    found = rates(problem, Found(r), before)
    assert found.verdict is not RateVerdict.UNDECIDED
    assert found.jump_possible == (signs != {1.0})


def orientation(W, mu, letters):
    """Determinant of a piece of the law for x = r - u."""
    rows = []
    one = np.eye(len(W))
    for i, letter in enumerate(letters):
        N, T = 2 * i, 2 * i + 1
        s = {"p": mu[i], "m": -mu[i]}.get(letter, 0.0)
        rows += {"o": [one[N], one[T]], "k": [W[N], W[T]]}.get(
            letter, [W[N], one[T] - s * one[N]]
        )
    return np.linalg.det(np.array(rows))


def test_a_singular_W_leaves_it_undecided():
    W = np.kron(np.ones((2, 2)), np.eye(2))  # two contacts at one point, both stuck
    r = np.array([[1.0, 0.0], [1.0, 0.0]])
    problem = am.FrictionProblem.from_delassus(W, -(W @ r.ravel()).reshape(2, 2), [0.5, 0.5])
    found = rates(problem, Found(r))
    assert found.jump_possible is None
    assert "can not be eliminated" in found.reason


def test_errors_say_what_is_wrong():
    problem, r, _ = state_of(0)
    for given in ((Found(r[:0]), None), (Found(r), r[:0])):
        with pytest.raises(am.InvalidInput, match="expected shape"):
            rates(problem, *given)
    one = am.FrictionProblem.from_delassus(np.eye(2), [[-1.0, 0]], [0.3])
    found = am.solve(one)
    for given, match in (
        ((one, None), "solution: expected a FrictionSolution"), ((None, found), "problem: exp"),
        ((one, found, [1.0, 0.0]), "last"), ((one, found, [[np.nan, 0.0]]), "last.*finite"),
    ):  # fmt: skip
        with pytest.raises(am.InvalidInput, match=match):
            rates(*given)
    tresca = am.FrictionProblem.from_delassus(np.eye(2), [[-1.0, 0]], am.Tresca([1.0]))
    with pytest.raises(am.UnsupportedLaw, match="expected Coulomb"):
        rates(tresca, am.solve(tresca))
