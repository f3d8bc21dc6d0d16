"""The P-matrix and the full contact criterion in 2D and 3D: by hand, by the law, by loads."""

import numpy as np
import pytest
from scipy.optimize import minimize_scalar

import amontons as am
from amontons.analysis.certificates import slip_arcs
from amontons.analysis.certificates.energy_bound import energy_bound
from amontons.analysis.certificates.older_criteria import critical_discs
from amontons.core.clock import Deadline
from amontons.core.errors import InvalidInput, UnsupportedForm
from amontons.mechanics.ready.gallery import box_tower
from amontons.mechanics.ready.hild import hild_triangle


def spatial(W, mu=1.0, q=None):
    nc = len(W) // 3
    q = np.zeros((nc, 3)) if q is None else q
    return am.FrictionProblem.from_delassus(W, q, np.full(nc, mu))


def random_delassus(seed, nc):
    """Strongly coupled: the friction at which solutions are lost is of the order of one."""
    random = np.random.default_rng(seed)
    A = random.standard_normal((3 * nc, 3 * nc))
    return A @ A.T / nc + np.diag(random.uniform(0.2, 3, 3 * nc)) * random.uniform(0.05, 1)


def in_space(W, across):
    """W of a 2D problem with a second tangent of its own, W = across there."""
    nc = len(W) // 2
    whole = np.zeros((3 * nc, 3 * nc))
    plane = (3 * np.arange(nc)[:, None] + [0, 1]).ravel()
    second = 3 * np.arange(nc) + 2
    whole[np.ix_(plane, plane)] = W
    whole[np.ix_(second, second)] = across
    return whole


def planar(n):
    W = hild_triangle(n).assemble().condensed().W
    return W if isinstance(W, np.ndarray) else W.toarray()


def fails_with(W, d, mu, *, full=None):
    """Whether d has what a criterion at mu forbids, up to rounding."""
    y = (W @ d.ravel()).reshape(d.shape)
    size = np.abs(W).max()
    for x, u in zip(d, y, strict=True):
        speed = np.linalg.norm(u[1:])
        if full and abs(u[0]) > 1e-9 * size or x[0] * u[0] > 1e-9 * size:
            return False
        if speed < 1e-9 * size:
            continue
        n = u[1:] / speed
        pressed = abs(x[0])
        if full == "printed":  # r_T . n <= c |r|, c = mu / sqrt(1 + mu^2)
            pressed = np.linalg.norm(x) / np.sqrt(1 + mu**2)
        if x[1:] @ n > mu * pressed + 1e-6:
            return False
    return True


@pytest.mark.parametrize(("n", "p", "full"), [(1, 2.2, 2.2), (2, 1.9324, 2.1747)])
@pytest.mark.parametrize("compliance", [0.5, 1.0])
def test_the_triangle_in_2d_and_in_space(n, p, full, compliance):
    flat = hild_triangle(n).assemble()
    found = am.p_matrix_friction(flat), am.full_contact_friction(flat)
    for one, value in zip(found, (p, full), strict=True):
        assert one.upper == pytest.approx(value, abs=1e-4)
        assert one.upper * (1 - 2e-6) < one.lower < one.upper
    W = planar(n)
    assert fails_with(W, found[1].difference, found[1].upper * (1 + 1e-9), full="sharp")
    space = spatial(in_space(W, compliance * W[1::2, 1::2]))
    safe = am.p_matrix_friction(space)
    assert safe.lower < p and safe.upper == pytest.approx(p, abs=1e-4)
    assert am.full_contact_friction(space, sharp=True).upper == pytest.approx(full, abs=1e-4)
    given = am.p_matrix_friction(space, given_tangents=True)
    assert given.upper == pytest.approx(p, abs=1e-4)
    assert am.full_contact_friction(space).upper <= full + 1e-4  # smaller for two contacts


def test_a_soft_second_tangent_makes_the_planar_value_unsafe():
    # K_NT = 3 / 34.56 along the plane, K_TT = (6.6 / 34.56, 1 / 26.4): least of
    # n . K_TT n / |K_NT n| is 2 sqrt(k_2 (k_1 - k_2)) / K_NT < 2.2 where k_1 > 2 k_2
    W = in_space(np.array([[6.6, -3.0], [-3.0, 6.6]]), 26.4)
    k1, k2, coupling = 6.6 / 34.56, 1 / 26.4, 3 / 34.56
    value = 2 * np.sqrt(k2 * (k1 - k2)) / coupling
    problem = spatial(W)
    for found in (am.p_matrix_friction(problem), critical_discs(problem),
                  am.full_contact_friction(problem, sharp=True)):  # fmt: skip
        assert found.upper == pytest.approx(value)
        assert found.lower == pytest.approx(value, rel=0.011)
    assert am.p_matrix_friction(problem, given_tangents=True).upper == pytest.approx(2.2)
    mu = 0.5 * (value + 2.2)
    q = load_with_a_piece(W, critical_discs(problem).difference, mu)
    several = am.all_solutions(spatial(W, mu, q))
    assert several.at_least >= 2


def load_with_a_piece(W, d, mu):
    """q of a contact that slips slowly along y_T of the difference d, r_N = 1."""
    y = (W @ d.ravel())[1:]
    along = -np.sign(d[0, 0]) * y / np.linalg.norm(y)
    r, u = np.array([1.0, *(-mu * along)]), np.array([0.0, *(1e-3 * along)])
    return (u - W @ r).reshape(1, 3)


@pytest.mark.parametrize("seed", range(4))
def test_one_contact_by_a_single_angle(seed):
    W = random_delassus(seed, 1)
    K = np.linalg.inv(W)

    def ratio(theta, sharp):
        n, t = np.array([[np.cos(theta), np.sin(theta)], [-np.sin(theta), np.cos(theta)]])
        work, push, turn = n @ K[1:, 1:] @ n, K[0, 1:] @ n, t @ K[1:, 1:] @ n
        return work / (abs(push) if sharp else np.hypot(push, turn))

    problem = spatial(W)
    for sharp in (True, False):
        grid = np.linspace(0, np.pi, 721)
        best = grid[np.argmin([ratio(x, sharp) for x in grid])]
        least = minimize_scalar(ratio, bounds=(best - 0.01, best + 0.01), args=(sharp,),
                                method="bounded", options={"xatol": 1e-10}).fun  # fmt: skip
        found = am.full_contact_friction(problem, sharp=sharp)
        assert found.upper == pytest.approx(least, rel=1e-6)
        assert 0.98 * least < found.lower < least
    assert am.p_matrix_friction(problem).upper == pytest.approx(
        am.full_contact_friction(problem, sharp=True).upper, rel=1e-6
    )


@pytest.mark.parametrize(("seed", "nc"), [(1, 1), (1, 2), (4, 2)])
def test_order_witnesses_and_another_basis(seed, nc):
    W = random_delassus(seed, nc)
    problem = spatial(W)
    safe, critical = am.p_matrix_friction(problem), critical_discs(problem)
    sharp, printed = (am.full_contact_friction(problem, sharp=s) for s in (True, False))
    assert energy_bound(W, np.ones(nc))[0] <= safe.lower
    assert safe.upper <= critical.upper * (1 + 1e-6)
    assert critical.upper <= sharp.upper * (1 + 1e-6)
    assert printed.upper <= sharp.upper * (1 + 1e-6)
    assert fails_with(W, safe.difference, safe.upper)
    assert fails_with(W, sharp.difference, sharp.upper, full="sharp")
    assert fails_with(W, printed.difference, printed.upper, full="printed")
    assert not fails_with(W, printed.difference, 0.99 * printed.upper, full="printed")
    turn = np.eye(3 * nc)
    for p in range(nc):
        c, s = np.cos(0.4 + p), np.sin(0.4 + p)
        turn[3 * p + 1 : 3 * p + 3, 3 * p + 1 : 3 * p + 3] = [[c, -s], [s, c]]
    turned = spatial(turn.T @ W @ turn * 1e3)
    assert am.p_matrix_friction(turned).upper == pytest.approx(safe.upper, rel=1e-5)
    assert am.full_contact_friction(turned).upper == pytest.approx(printed.upper, rel=1e-5)
    given = [am.p_matrix_friction(x, given_tangents=True).upper for x in (problem, turned)]
    assert abs(given[0] - given[1]) > 1e-3 * given[0]


@pytest.mark.parametrize(("seed", "nc"), [(2, 1), (3, 1), (8, 1), (1, 2)])
def test_no_load_has_several_solutions_below_and_some_has_above(seed, nc):
    W = random_delassus(seed, nc)
    problem = spatial(W)
    safe, critical = am.p_matrix_friction(problem), critical_discs(problem)
    random = np.random.default_rng(seed)
    for _ in range(8):
        q = random.standard_normal((nc, 3))
        q[:, 0] -= 1
        below = am.multistart(spatial(W, 0.999 * safe.lower, q), starts=30)
        assert len(below.solutions) == 1
    if nc == 1:
        mu = 1.03 * critical.upper
        q = load_with_a_piece(W, critical.difference, mu)
        assert len(am.multistart(spatial(W, mu, q), starts=200).solutions) > 1
        below = spatial(W, 0.98 * critical.lower, q)
        assert len(am.multistart(below, starts=200).solutions) == 1


def test_given_tangents_are_not_safe_for_discs():
    W = random_delassus(3, 1)
    problem = spatial(W)
    critical = critical_discs(problem)
    mu = 0.95 * am.p_matrix_friction(problem, given_tangents=True).upper
    assert mu > 1.02 * critical.upper
    q = load_with_a_piece(W, critical.difference, mu)
    assert am.all_solutions(spatial(W, mu, q)).at_least >= 2


def test_without_coupling_only_the_printed_number_is_finite():
    # K_TT = diag(1, 1/4): least of n . K n / |t . K n| is 2 sqrt(k_1 k_2) / (k_1 - k_2)
    problem = spatial(np.diag([1.0, 1.0, 4.0]))
    assert am.p_matrix_friction(problem).lower == np.inf
    assert am.full_contact_friction(problem, sharp=True).lower == np.inf
    assert am.full_contact_friction(problem).upper == pytest.approx(2 * 0.5 / 0.75)


def test_limits_and_bad_input():
    three = spatial(random_delassus(0, 3))
    stopped = am.p_matrix_friction(three, time_limit=Deadline.counted(1e-3))
    assert stopped.reason == "time is up" and stopped.lower <= stopped.upper
    v = np.array([1.0, 0.3, -1.0])
    singular = am.p_matrix_friction(spatial(np.eye(3) - np.outer(v, v) / (v @ v)))
    assert singular.lower == 0 and "singular" in singular.reason
    for ask in (am.p_matrix_friction, am.full_contact_friction):
        with pytest.raises(UnsupportedForm, match="4 contacts at most"):
            ask(spatial(np.eye(15)))
        with pytest.raises(InvalidInput, match="gap"):
            ask(three, gap=2)
        with pytest.raises(InvalidInput, match="time_limit"):
            ask(three, time_limit=0)
    with pytest.raises(UnsupportedForm, match="contacts at most"):
        am.full_contact_friction(hild_triangle(13))
    with pytest.raises(am.AmontonsError):
        am.p_matrix_friction(box_tower())


@pytest.mark.parametrize("ask", [am.p_matrix_friction, am.full_contact_friction])
@pytest.mark.parametrize("d", [2, 3])
def test_any_friction_is_safe_where_nothing_can_react(ask, d):
    empty = am.FrictionProblem.from_delassus(np.zeros((0, 0)), np.zeros((0, d)), np.zeros(0))
    found = ask(empty)
    assert found.lower == found.upper == np.inf
    assert "no contact" in found.reason


@pytest.mark.parametrize("M", [[[1, -2], [-3, 1]], [[1, -1], [-1, 1]], [[1, -2], [-0.5, 1]]])
def test_reactions_of_a_part_that_fails(M):
    """Also where it is singular, at the threshold itself."""
    rho = slip_arcs._opposed(np.array(M, dtype=float))
    assert (rho > 0).all()
    assert (M @ rho <= 1e-12 * rho.max()).all()
