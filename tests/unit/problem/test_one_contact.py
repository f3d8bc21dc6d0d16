"""The compiled one-contact solver against every solution found in closed form by NumPy."""

import numpy as np
import pytest

import amontons as am
from amontons.problem.law import Coulomb, Tresca
from amontons.problem.law.single import solve_contact, solve_one
from amontons.problem.law.states import OPEN, SLIP, STICK

CASES = 10_000
RELATIVE = 1e-10  # accepted violation of the law, relative to |b|


# ------------------------------------------------------------------ random contacts
def random_contacts(seed, d, *, twist=0.0, cases=CASES):
    """A (cases, 3, 3) positive definite up to `twist`, b (cases, 3) and mu in [0, 3]."""
    rng = np.random.default_rng(seed)
    root = rng.standard_normal((cases, 3, 3))
    A = root @ root.swapaxes(1, 2) + 0.05 * np.eye(3)
    A += twist * rng.standard_normal((cases, 3, 3))
    b = rng.standard_normal((cases, 3))
    mu = np.where(rng.random(cases) < 0.05, 0.0, 3 * rng.random(cases))
    if d == 2:
        A[:, 2, :2] = A[:, :2, 2] = b[:, 2] = 0
        A[:, 2, 2] = np.abs(A[:, 1, 1]) + 0.1
    A[:, 0, 0] = np.abs(A[:, 0, 0])
    return np.ascontiguousarray(A), b, mu


def run(A, b, coefficient, tresca=False, guess=None):
    """Reactions (cases, 3) and states (cases,) of the compiled solver."""
    guess = np.zeros((len(A), 2)) if guess is None else guess
    law = (Tresca if tresca else Coulomb)(coefficient)
    found = np.array([
        solve_contact(A[k], *b[k], law.kind[k], law.parameters[k], *guess[k])
        for k in range(len(A))
    ])
    return found[:, :3], found[:, 3].astype(int)


def product(A, r):
    """A r for stacks."""
    return np.einsum("kij,kj->ki", A, r)


# ------------------------------------------------------------------ the law, in its own words
def local_velocity(A, b, r):
    """u = A r + b, |A|, and the size of the terms of u before they cancel."""
    size = np.maximum(np.linalg.norm(A, axis=(1, 2)), 1e-300)
    scale = np.linalg.norm(b, axis=1) + size * np.linalg.norm(r, axis=1)
    return product(A, r) + b, size, scale


def coulomb_violation(A, b, mu, r):
    """Largest violation of the disjunctive Coulomb law, relative to |b|; (cases,)."""
    u, size, scale = local_velocity(A, b, r)
    slip, pull = np.linalg.norm(u[:, 1:], axis=1), np.linalg.norm(r[:, 1:], axis=1)
    opposition = np.linalg.norm(
        slip[:, None] * r[:, 1:] + (mu * r[:, 0])[:, None] * u[:, 1:], axis=1
    )
    return np.max(
        [
            -u[:, 0] / scale,
            -r[:, 0] * size / scale,
            np.abs(np.minimum(r[:, 0] * size, u[:, 0])) / scale,
            (pull - mu * r[:, 0]) * size / scale,
            np.where(r[:, 0] > 0, opposition * size / scale**2, 0),
        ],
        axis=0,
    )


def tresca_violation(A, b, bound, r):
    """The same for given friction."""
    u, size, scale = local_velocity(A, b, r)
    slip, pull = np.linalg.norm(u[:, 1:], axis=1), np.linalg.norm(r[:, 1:], axis=1)
    opposition = np.linalg.norm(slip[:, None] * r[:, 1:] + bound[:, None] * u[:, 1:], axis=1)
    return np.max(
        [
            np.abs(np.minimum(r[:, 0] * size, u[:, 0])) / scale,
            (pull - bound) * size / scale,
            opposition * size / scale**2,
        ],
        axis=0,
    )


# ------------------------------------------------------------------ all solutions, by NumPy
def slip_directions(tangential):
    """All angles t (cases, 4), NaN where missing, with u_T parallel to (cos t, sin t).

    `tangential` maps angles (k,) to the numerators of u_T, (cases, k, 2): trigonometric
    polynomials of degree one.  The cross product with the direction has degree two: eight
    samples give its Fourier coefficients, a companion matrix its roots.
    """

    def cross(t):
        v = tangential(t)
        return np.cos(t) * v[..., 1] - np.sin(t) * v[..., 0]

    samples = cross(2 * np.pi * np.arange(8) / 8)
    modes = np.fft.fft(samples, axis=1)[:, [6, 7, 0, 1, 2]]  # z^-2 … z^2
    degenerate = np.abs(modes[:, -1]) <= 1e-14 * np.abs(modes).max(axis=1)
    modes[degenerate, -1] = 1
    companion = np.zeros((len(modes), 4, 4), dtype=complex)
    companion[:, 1:, :3] = np.eye(3)
    companion[:, :, 3] = -modes[:, :4] / modes[:, 4:]
    z = np.linalg.eigvals(companion)
    z[degenerate] = np.nan
    for k in np.flatnonzero(degenerate):
        roots = np.roots(modes[k, 3::-1])
        z[k, : len(roots)] = roots
    angles = np.angle(z)
    angles[np.abs(np.abs(z) - 1) > 1e-5] = np.nan
    return angles


def coulomb_solutions(A, b, mu):
    """Candidates (cases, 6, 3) [open, stick, slip x 4], and which of them satisfy the law."""
    n = len(A)
    regular = np.abs(np.linalg.det(A)) > 1e-13
    safe = np.where(regular[:, None, None], A, np.eye(3))
    stick = np.where(regular[:, None], -np.linalg.solve(safe, b[:, :, None])[:, :, 0], np.nan)

    def parts(t):
        """Denominator of r_N and numerator of u_T at angles t, (cases, k[, 2])."""
        e = np.stack([np.cos(t), np.sin(t)], axis=-1)
        if e.ndim == 2:
            e = np.broadcast_to(e, (n, *e.shape))
        below = A[:, None, 0, 0] - mu[:, None] * np.einsum("kj,kaj->ka", A[:, 0, 1:], e)
        push = A[:, None, 1:, 0] - mu[:, None, None] * np.einsum(
            "kij,kaj->kai", A[:, 1:, 1:], e
        )
        return e, below, b[:, None, 1:] * below[..., None] - b[:, None, :1] * push

    def numerator(t):
        return parts(t)[2]

    t = slip_directions(numerator)
    for _ in range(3):  # polish the roots of the polynomial
        e, _, v = parts(t)
        across = np.stack([-e[..., 1], e[..., 0]], axis=-1)
        turned = parts(t + 1e-6)[2] - parts(t - 1e-6)[2]
        slope = (turned / 2e-6 * across).sum(-1) - (v * e).sum(-1)
        with np.errstate(all="ignore"):
            step = (v * across).sum(-1) / slope
        t = t - np.where(np.abs(step) < 1e-3, step, 0)
    e, below, _ = parts(t)
    normal = -b[:, :1] / np.where(below != 0, below, np.nan)
    slip = np.concatenate(
        [normal[..., None], -mu[:, None, None] * normal[..., None] * e], axis=-1
    )
    candidates = np.concatenate([np.zeros((n, 1, 3)), stick[:, None], slip], axis=1)
    fits = np.stack(
        [
            coulomb_violation(A, b, mu, np.nan_to_num(candidates[:, k], nan=-1.0)) < 1e-9
            for k in range(6)
        ],
        axis=1,
    )
    return candidates, fits & ~np.isnan(candidates).any(axis=2)


def distance_to_nearest(r, candidates, fits):
    """Distance of r to the nearest solution of the oracle, relative to its size; (cases,)."""
    apart = np.linalg.norm(candidates - r[:, None], axis=2)
    apart = np.where(fits, apart, np.inf).min(axis=1)
    return apart / np.maximum(np.linalg.norm(r, axis=1), 1e-3)


# ------------------------------------------------------------------ Coulomb
@pytest.mark.parametrize("d", [2, 3])
@pytest.mark.parametrize("twist", [0.0, 0.3], ids=["spd", "unsymmetric"])
def test_coulomb_is_one_of_all_solutions(d, twist):
    A, b, mu = random_contacts(1, d, twist=twist)
    candidates, fits = coulomb_solutions(A, b, mu)
    r, state = run(A, b, mu)
    exists = fits.any(axis=1)
    assert exists.sum() > 0.95 * CASES
    assert (twist > 0) or exists.all()  # positive definite: there is always a solution
    assert coulomb_violation(A, b, mu, r)[exists].max() < RELATIVE
    assert distance_to_nearest(r, candidates, fits)[exists].max() < 1e-6
    assert np.bincount(state, minlength=3).min() > 1000  # every branch is hit
    assert (fits.sum(axis=1) > 1).sum() > 100  # and cases with several solutions are there
    np.testing.assert_array_equal(state == OPEN, b[:, 0] >= 0)
    u = product(A, r) + b
    assert np.abs(u[exists & (state == STICK)]).max() < 1e-9


@pytest.mark.parametrize("decades", [2, 4, 6])
def test_coulomb_with_stiff_and_soft_directions(decades):
    rng = np.random.default_rng(decades)
    frames = np.linalg.qr(rng.standard_normal((2000, 3, 3)))[0]
    A = (frames * 10 ** rng.uniform(-decades, 0, (2000, 1, 3))) @ frames.swapaxes(1, 2)
    b, mu = rng.standard_normal((2000, 3)), 3 * rng.random(2000)
    r, _ = run(A, b, mu)
    assert coulomb_violation(A, b, mu, r).max() < RELATIVE


@pytest.mark.parametrize("slip", [0.0, 1e-15, 1e-12, 1e-8])
def test_coulomb_on_the_edge_between_stick_and_slip(slip):
    A, b, mu = random_contacts(7, 3)
    rng = np.random.default_rng(8)
    t, normal = rng.uniform(0, 2 * np.pi, CASES), rng.random(CASES)
    e = np.stack([np.cos(t), np.sin(t)], axis=1)
    edge = np.column_stack([normal, -(mu * normal)[:, None] * e])
    b = np.column_stack([np.zeros(CASES), slip * e]) - product(A, edge)
    r, state = run(A, b, mu, guess=rng.standard_normal((CASES, 2)))
    assert coulomb_violation(A, b, mu, r).max() < RELATIVE
    assert (state == SLIP).sum() > 1000


def test_slip_direction_is_found_from_any_guess():
    A, b, mu = random_contacts(11, 3)
    for turn in range(4):
        guess = np.tile([np.cos(turn * np.pi / 2), np.sin(turn * np.pi / 2)], (CASES, 1))
        r, _ = run(A, b, mu, guess=guess)
        assert coulomb_violation(A, b, mu, r).max() < RELATIVE


@pytest.mark.parametrize("tresca", [False, True])
@pytest.mark.parametrize(
    ("stiffness", "load"), [(1e9, 1), (1e-9, 1), (1, 1e9), (1, 1e-9), (1e9, 1e-9)]
)
def test_units_of_r_and_u_do_not_matter(stiffness, load, tresca):
    A, b, number = random_contacts(12, 3, cases=1000)
    r, state = run(A, b, number, tresca)
    unit = load / stiffness
    scaled, same = run(stiffness * A, load * b, number * (unit if tresca else 1), tresca)
    np.testing.assert_array_equal(same, state)
    np.testing.assert_allclose(scaled, unit * r, rtol=1e-7, atol=1e-9 * unit)


def test_a_planar_contact_has_no_reaction_out_of_its_plane():
    A, b, mu = random_contacts(13, 2)
    r, _ = run(A, b, mu)
    assert np.abs(r[:, 2]).max() <= 1e-12 * np.abs(r).max()


# ------------------------------------------------------------------ degenerate contacts
def test_frictionless():
    A, b, _ = random_contacts(2, 3, cases=500)
    r, state = run(A, b, np.zeros(500))
    np.testing.assert_allclose(r[:, 0], np.maximum(-b[:, 0] / A[:, 0, 0], 0))
    assert not r[:, 1:].any()
    np.testing.assert_array_equal(state, np.where(b[:, 0] >= 0, OPEN, SLIP))


def test_no_load_is_open():
    r, u, state = solve_one(np.eye(3), np.zeros(3), 0.5)
    assert state == OPEN
    assert not r.any()
    assert not u.any()


def test_a_contact_that_can_not_react_stays_open():
    A = np.diag([0.0, 1.0, 1.0])
    r, u, state = solve_one(A, [-1.0, 0.5, 0.0], 0.5)
    assert state == OPEN
    assert not r.any()
    np.testing.assert_array_equal(u, [-1.0, 0.5, 0.0])


def test_only_the_normal_is_compliant():
    A = np.diag([2.0, 0.0, 0.0])
    r, u, state = solve_one(A, [-1.0, 3.0, 4.0], 0.5)
    assert state == SLIP
    np.testing.assert_allclose(r, [0.5, -0.15, -0.2])
    np.testing.assert_allclose(u, [0, 3, 4])


def test_nothing_can_slide_so_it_sticks():
    r, u, state = solve_one(np.diag([2.0, 0.0, 0.0]), [-1.0, 0.0, 0.0], 0.5)
    assert state == STICK
    np.testing.assert_allclose(r, [0.5, 0, 0])
    assert not u.any()


@pytest.mark.parametrize("rank", [1, 2])
def test_singular_blocks(rank):
    rng = np.random.default_rng(rank)
    root = rng.standard_normal((3000, 3, rank))
    A, mu = root @ root.swapaxes(1, 2), rng.random(3000)
    motion = rng.standard_normal((3000, 3))
    b = product(A, motion)  # in the range: the contact sticks, slips or is open
    r, _ = run(A, b, mu)
    assert coulomb_violation(A, b, mu, r).max() < 1e-7


def test_large_friction_has_several_solutions_and_takes_the_first():
    A = np.array([[1, 0.8, 0], [0.8, 1, 0], [0, 0, 1]])
    b = np.array([[0.2, 1.0, 0.0]])
    for mu, count in [(0.5, 1), (1.0, 1), (1.2, 1), (2.0, 3)]:
        _, fits = coulomb_solutions(A[None], b, np.array([mu]))
        assert fits.sum() == count
        r, _, state = solve_one(A, b[0], mu)
        assert state == OPEN
        assert not r.any()


def test_friction_of_five():
    A, b, _ = random_contacts(14, 3)
    mu = np.full(CASES, 5.0)
    r, _ = run(A, b, mu)
    assert coulomb_violation(A, b, mu, r).max() < RELATIVE


def test_without_a_solution_something_bounded_comes_back():
    A, b, mu = random_contacts(1, 3, twist=0.3)
    missing = ~coulomb_solutions(A, b, mu)[1].any(axis=1)
    r, _ = run(A[missing], b[missing], mu[missing])
    assert len(r) > 100
    assert np.abs(r).max() < 1e6


# ------------------------------------------------------------------ Tresca
@pytest.mark.parametrize("d", [2, 3])
def test_tresca(d):
    A, b, bound = random_contacts(21, d)
    bound = bound / 3
    r, state = run(A, b, bound, tresca=True)
    assert tresca_violation(A, b, bound, r).max() < RELATIVE
    assert np.bincount(state, minlength=3).min() > 500


def test_tresca_of_an_open_contact_still_rubs():
    r, u, state = solve_one(np.eye(3), [1.0, 3.0, 0.0], Tresca([2.0]))
    assert state == OPEN
    np.testing.assert_allclose(r, [0, -2, 0])
    np.testing.assert_allclose(u, [1, 1, 0])


def test_tresca_without_a_bound_is_frictionless():
    A, b, _ = random_contacts(22, 3, cases=500)
    r, _ = run(A, b, np.zeros(500), tresca=True)
    np.testing.assert_allclose(r[:, 0], np.maximum(-b[:, 0] / A[:, 0, 0], 0))
    assert not r[:, 1:].any()


def test_tresca_nothing_moves():
    r, u, state = solve_one(np.diag([1.0, 0, 0]), [-1.0, 0, 0], Tresca([0.3]))
    assert state == STICK
    np.testing.assert_allclose(r, [1, 0, 0])
    assert not u.any()


# ------------------------------------------------------------------ the oracle itself
def test_the_oracle_counts_solutions_of_a_hand_made_contact():
    """W = [[1, .8], [.8, 1]], q = (.2, 1), mu = 2: open, stick and one slip."""
    A = np.array([[[1, 0.8, 0], [0.8, 1, 0], [0, 0, 1]]])
    candidates, fits = coulomb_solutions(A, np.array([[0.2, 1.0, 0.0]]), np.array([2.0]))
    found = candidates[fits]
    np.testing.assert_allclose(found[0], 0)
    np.testing.assert_allclose(found[1], [5 / 3, -7 / 3, 0], atol=1e-12)
    np.testing.assert_allclose(found[2], [1 / 3, -2 / 3, 0], atol=1e-9)


@pytest.mark.parametrize("d", [2, 3])
def test_what_rounding_leaves_of_a_singular_block_holds_nothing(d):
    """W of rank 1: no reaction of 1e16 sticks there, the contact slips, or rests."""
    random = np.random.default_rng(5)
    for _ in range(300):
        g = random.standard_normal(d)
        W, mu = np.outer(g, g), random.uniform(0.2, 2.0)
        r = np.append(1.0, random.standard_normal(d - 1))
        r[1:] *= mu / np.linalg.norm(r[1:])  # slips against its reaction
        u = np.append(0.0, -random.uniform(0.1, 1.0) * r[1:])
        problem = am.FrictionProblem.from_delassus(W, (u - W @ r)[None], [mu])
        solution = am.drive(problem, am.GaussSeidel(), tolerance=1e-10, max_iterations=200)
        assert np.abs(solution.r).max() < 1e6
