"""The first-order system as a complementarity problem, and what is known of its solutions."""

import numpy as np
import pytest

import amontons as am
from amontons.analysis.paths.contact_rates import contact_rates
from amontons.analysis.paths.first_order import first_order
from amontons.analysis.paths.friction_path import FrictionPath
from amontons.analysis.paths.rate_claims import is_P_matrix, strictly_copositive

KINDS = ("f", "s", "l", "ci", "z0", "zl", "zi")


def random_path(seed, kinds, friction):
    """(path, state at 0): contacts of given kinds, else random."""
    rng = np.random.default_rng(seed)
    n = len(kinds)
    B = rng.standard_normal((2 * n, 2 * n + 1))
    W = B @ B.T / (2 * n) + 0.05 * np.eye(2 * n)
    mu = np.where(np.array(kinds) == "z0", 0.0, friction * rng.uniform(0.5, 1.5, n))
    r, u = np.zeros((n, 2)), np.zeros((n, 2))
    for i, kind in enumerate(kinds):
        sign = rng.choice([-1.0, 1.0])
        if kind in ("s", "l", "ci"):
            r[i, 0] = rng.uniform(0.5, 2)
            r[i, 1] = sign * mu[i] * r[i, 0] * (rng.uniform(0, 0.9) if kind == "s" else 1)
        if kind == "f":
            u[i] = rng.uniform(0.5, 2), rng.standard_normal()
        if kind in ("l", "zl"):
            u[i, 1] = -sign * rng.uniform(0.5, 2)
    q = u - (W @ r.ravel()).reshape(n, 2)
    ends = [q, q + rng.standard_normal((n, 2))]
    path = FrictionPath(*(am.FrictionProblem.from_delassus(W, x, mu) for x in ends))
    return path, path.state(r)


def random_kinds(seed):
    rng = np.random.default_rng(1000 + seed)
    border = list(rng.choice(KINDS[3:], rng.integers(1, 5)))
    return border + list(rng.choice(KINDS[:3], rng.integers(0, 4)))


def test_claims_and_searches_agree_with_enumeration_on_200_problems():
    proved, several, none = 0, 0, 0
    for seed in range(200):
        path, y = random_path(seed, random_kinds(seed), [0.1, 0.5, 1.0, 2.5][seed % 4])
        system = first_order(path, y, 0.0)
        rates = contact_rates(path, y, 0.0)
        for sense in (1.0, -1.0):
            expected = [t for t in system.tangents if t.rate * sense > 1e-9]
            found, search = rates.tangents(sense)
            assert search.finished
            assert len(found) == len(expected), (seed, sense)
            for change, piece in found:
                gap = [np.abs(t.direction / abs(t.rate) - change).max() for t in expected]
                nearest = expected[int(np.argmin(gap))]
                assert min(gap) <= 1e-8 * max(1.0, np.abs(change).max())
                assert piece in nearest.pieces
            if rates.existence is am.Claim.PROVED:
                assert expected, seed
                proved += 1
            if rates.uniqueness is am.Claim.PROVED:
                assert len(expected) <= 1, seed
                assert rates.full_rank is am.Claim.PROVED
            several, none = several + (len(expected) > 1), none + (not expected)
    assert proved > 100
    assert several > 10
    assert none > 5  # the cases are of all sorts


def test_twenty_contacts_at_rest():
    path, y = random_path(7, ["zi"] * 20, 0.6)
    system = first_order(path, y, 0.0)
    assert system.complete, system.reason
    assert sorted(np.sign([t.rate for t in system.tangents])) == [-1, 1]
    for t in system.tangents:
        ahead = y + 1e-3 * t.direction
        assert np.abs(path.residual(ahead, 1e-3 * t.rate)).max() < 1e-12
        assert path.piece(ahead, 1e-3 * t.rate) in t.pieces
    point = am.follow(path.end, base=path.start, start=np.zeros((20, 2)), at=0.0)[0]
    assert len(point.sets.at_rest) == 20
    assert point.rates.existence is am.Claim.PROVED


def test_small_friction_is_enough_and_much_is_not():
    """[LR] corollaries 1 and 2: a tangent, and one only, below some friction."""
    path, y = random_path(3, ["ci", "ci", "zl", "zi", "s"], 1.0)
    rates = contact_rates(path, y, 0.0)
    for claim in ("existence", "uniqueness"):
        bound = rates.friction_bound(claim)
        assert 0 < bound < np.inf
        assert getattr(rates.with_friction(0.99 * bound), claim) is am.Claim.PROVED
        assert getattr(rates.with_friction(1.01 * bound), claim) is not am.Claim.PROVED
    assert "uniqueness" in str(rates)


def test_large_friction_leaves_nothing_or_a_set():
    """[LR] example 4: a / b = F, no tangent forth at impending slip, and a set at rest."""
    a, b = 2.0, 1.0
    M = np.array([[a, -b], [-b, a]])
    H = np.diag([-1.0, 1.0])

    def path(first, last):
        return FrictionPath(*(
            am.FrictionProblem.from_global(M, H, load, [[0.0, 0.0]], [a / b])
            for load in (first, last)
        ))  # fmt: skip

    impending = path((1, 0), (1, -1))
    rates = contact_rates(impending, impending.state([[1.0, 2.0]]), 2.0)
    assert list(rates.sets.impending) == [0]
    assert rates.existence is not am.Claim.PROVED
    assert rates.uniqueness is not am.Claim.PROVED
    assert len(rates.solutions(1.0)) == 0
    at_rest = path((0, 0), (b, -a))
    system = first_order(at_rest, np.zeros(2), 0.0)
    (cone,) = system.cones
    assert cone.piece == "+"
    assert cone.edges.shape == (2, 3)
    assert not len(cone.lines)


@pytest.mark.parametrize(("D", "holds"), [
    (np.eye(2), am.Claim.PROVED), (np.array([[1.0, -2], [5, 1]]), am.Claim.PROVED),
    (np.array([[1.0, -5], [2, 1]]), am.Claim.REFUTED), (-np.eye(1), am.Claim.REFUTED),
    (np.array([[1.0, -1], [-1, 1]]), am.Claim.UNDECIDED), (np.zeros((0, 0)), am.Claim.PROVED),
])  # fmt: skip
def test_strict_copositivity(D, holds):
    assert strictly_copositive(D, len(D), np.zeros(0)) is holds


def test_principal_minors_with_slip_either_way():
    D = np.array([[1.0, 0.8], [0.8, 1.0]])  # of one contact at rest
    assert is_P_matrix(D, 0, np.array([1.0])) is am.Claim.PROVED
    assert is_P_matrix(D, 0, np.array([1.3])) is am.Claim.REFUTED
    assert is_P_matrix(np.array([[1.0, 2], [-1, 1]]), 2, np.zeros(0)) is am.Claim.PROVED
    assert is_P_matrix(np.array([[1.0, 2], [1, 1]]), 2, np.zeros(0)) is am.Claim.REFUTED


def test_three_dimensions_are_refused():
    W = np.eye(3)
    problem = am.FrictionProblem.from_delassus(W, [[-1.0, 0, 0]], [0.5])
    path = FrictionPath(problem.with_load(np.zeros((1, 3))), problem)
    with pytest.raises(am.UnsupportedForm, match="2D"):
        contact_rates(path, np.zeros(3), 0.0)
