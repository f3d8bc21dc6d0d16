"""Quadratic multipliers: thresholds known in closed form, every matrix formed again here."""

import numpy as np
import pytest
from scipy import sparse

from amontons.analysis.multipliers.lmi import (
    Family,
    LmiOutcome,
    Slacks,
    energy_rows,
    find_multipliers,
    restricted,
)
from amontons.analysis.multipliers.rounding import congruence, is_positive_definite, unit_scale
from amontons.mechanics.ready.gallery import one_contact_2d
from amontons.mechanics.ready.hild import hild_triangle


def hild_rows(n):
    """Energy rows of Hild's triangle, whatever mu."""
    W = hild_triangle(n).assemble().condensed().W
    return energy_rows(W.toarray() if sparse.issparse(W) else W)


FREE = np.eye(4)[:, 2:]
STICK = np.eye(4)[:, :2]


def with_extra(tensor, extra, matrix):
    """The same slacks minus extra * matrix."""
    tensor = tensor.copy()
    tensor[:, 10 + extra] -= matrix
    return tensor


def every_load(nodes, mu):
    """Node-wise multipliers that exclude singular pieces for slopes |r_T| <= mu r_N."""
    each = np.arange(nodes)
    slip = np.tile(np.eye(4)[:, [0, 1, 3]], (nodes, 1, 1))  # r_N, r_T, u_T
    sign = np.zeros((nodes, 11, 1, 1))
    sign[:, 10] = 1
    slacks = (
        Slacks(each, restricted(np.tile(FREE, (nodes, 1, 1)), 1)),
        Slacks(each, restricted(np.tile(STICK, (nodes, 1, 1)), 1)),
        Slacks(each, with_extra(restricted(slip, 1), 0, np.diag([mu**2, -1.0, 0.0]))),
        Slacks(each, sign),
    )
    return Family(np.arange(4 * nodes).reshape(nodes, 4), slacks, np.ones(1))


def one_load(mu, z):
    """Copositive multipliers of one open contact whose solution is z = (0, 0, u_N, u_T)."""
    slacks, extra = [Slacks(np.array([0]), restricted(FREE[None], 9))], 0
    for rays in (
        [(1, mu, 0, 0), (1, -mu, 0, 0)],
        [(1, mu, 0, 0), (0, 0, 0, -1)],
        [(1, -mu, 0, 0), (0, 0, 0, 1)],
    ):
        tensor = restricted(np.array([*rays, [-a for a in z]], dtype=float).T[None], 9)
        for a, b in ((0, 1), (0, 2), (1, 2)):
            tensor[:, 10 + extra, a, b] = tensor[:, 10 + extra, b, a] = -1
            number = np.zeros((1, 19, 1, 1))
            number[:, 10 + extra] = 1
            slacks.append(Slacks(np.array([0]), number))
            extra += 1
        slacks.append(Slacks(np.array([0]), tensor))
    return Family(np.array([[0, 1, 2, 3]]), tuple(slacks), np.ones(9))


def assert_consistent(Z, families, answer):
    """M and all slacks of multipliers that were found, formed entry by entry."""
    M = np.zeros((Z.shape[1],) * 2)
    for family, W, extras in zip(families, answer.W, answer.extras, strict=True):
        for rows, own in zip(family.rows, W, strict=True):
            M += Z[rows].T @ own @ Z[rows]
        k = family.size
        for slacks in family.slacks:
            for owner, tensor in zip(slacks.owner, slacks.tensor, strict=True):
                entries = [W[owner, a, b] for a in range(k) for b in range(a, k)]
                x = np.concatenate([entries, extras[owner]])
                assert np.linalg.eigvalsh(np.tensordot(x, tensor, 1)).min() > 0
    least = np.linalg.eigvalsh(M)[0]
    assert least > 0
    assert answer.t == pytest.approx(least, rel=1e-6, abs=1e-9)
    assert answer.bound >= least


@pytest.mark.parametrize(
    ("n", "below", "above"),
    # exact thresholds 2.2, 1.9324; with a multiplier per node 2.1998, 1.9317; 1.479 at n = 7
    [(1, 2.199, 2.201), (2, 1.931, 1.933), (7, 1.477, 1.5)],
)
def test_threshold_of_every_load(n, below, above):
    Z = hild_rows(n)
    family = every_load(n, below)
    answer = find_multipliers(Z, [family])
    assert answer.outcome is LmiOutcome.FOUND
    assert_consistent(Z, [family], answer)
    refused = find_multipliers(Z, [every_load(n, above)])
    assert refused.outcome is LmiOutcome.NONE
    assert refused.t < 0
    assert refused.t < refused.bound < 1e-9
    low = refused.lowest
    (W,) = refused.W
    z = (Z @ low).reshape(n, 4)
    assert np.einsum("ci,cij,cj->", z, W, z) == pytest.approx(refused.t * (low @ low), rel=1e-6)


@pytest.mark.parametrize(
    ("mu", "outcome"), [(1.2, "FOUND"), (1.39, "FOUND"), (1.41, "NONE"), (2.0, "NONE")]
)
def test_one_contact_has_other_solutions_from_mu_1_4(mu, outcome):
    problem = one_contact_2d(mu)
    family = one_load(mu, (0, 0, *problem.q[0]))
    Z = energy_rows(problem.W)
    answer = find_multipliers(Z, [family])
    assert answer.outcome.name == outcome
    if outcome == "FOUND":
        assert_consistent(Z, [family], answer)


def test_tied_sets_have_equal_multipliers_and_prove_less():
    n = 6
    Z = hild_rows(n)
    found = {}
    for mu in (0.3, 1.6):
        free = every_load(n, mu)
        tied = Family(free.rows, free.slacks, free.feasible, sparse.csr_array(np.ones((n, 1))))
        found[mu] = [find_multipliers(Z, [f]) for f in (free, tied)]
    assert [a.outcome.name for a in found[0.3]] == ["FOUND", "FOUND"]
    assert [a.outcome.name for a in found[1.6]] == ["FOUND", "NONE"]
    assert_consistent(Z, [free], found[1.6][0])
    (W,) = found[0.3][1].W
    assert W == pytest.approx(np.tile(W[0], (n, 1, 1)))


def test_overlapping_sets_of_two_sizes():
    # a multiplier on the pair of contacts 1 and 2 beside one on each contact
    Z = hild_rows(3)
    nodes = every_load(3, 1.8)
    bound = np.eye(8)[None]  # nothing but its sign is asked of the pair
    pair = Family(
        np.arange(4, 12)[None], (Slacks(np.array([0]), restricted(bound)),), np.ones(0)
    )
    answer = find_multipliers(Z, [nodes, pair])
    assert answer.outcome is LmiOutcome.FOUND
    assert_consistent(Z, [nodes, pair], answer)


def test_the_caller_has_the_last_word():
    Z = hild_rows(3)
    asked = []

    def never(W, extras):
        asked.append(W)
        return False

    answer = find_multipliers(Z, [every_load(3, 1.0)], accept=never)
    assert asked
    assert answer.outcome is LmiOutcome.STALLED
    quick = find_multipliers(Z, [every_load(3, 1.0)], accept=never, time_limit=1e-9)
    assert quick.outcome is LmiOutcome.TIME_LIMIT


# ------------------------------------------------------------------- rounding
def test_units_do_not_matter_after_scaling():
    random = np.random.default_rng(4)
    A = random.standard_normal((8, 8))
    A = A @ A.T + 0.1 * np.eye(8)
    units = 10.0 ** np.linspace(-60, 60, 8)
    other = A * units * units[:, None]
    scale = unit_scale(other)
    scaled = other * scale * scale[:, None]
    assert (scaled / scale / scale[:, None] == other).all()  # exact: powers of two
    assert np.abs(np.diag(scaled)).max() <= 2
    assert is_positive_definite(scaled)
    assert (unit_scale(np.diag([-1.0, 0.0, np.nan])) == 1).all()


def test_error_of_a_congruence_covers_rounding():
    from fractions import Fraction

    random = np.random.default_rng(5)
    G, W = random.standard_normal((4, 3)), random.standard_normal((4, 4)) * 1e8
    value, error = congruence(G, W)
    exact = [[Fraction(x) for x in row] for row in G], [[Fraction(x) for x in row] for row in W]
    for i in range(3):
        for j in range(3):
            sum_ = sum(
                exact[0][k][i] * exact[1][k][m] * exact[0][m][j]
                for k in range(4)
                for m in range(4)
            )
            assert abs(Fraction(value[i, j]) - sum_) <= Fraction(error[i, j])
    assert error.max() < 1e-4
