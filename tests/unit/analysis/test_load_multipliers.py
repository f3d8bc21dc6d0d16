"""Multipliers of every contact about a solution: the inequality, what is never proved."""

import numpy as np
import pytest

import amontons as am
from amontons.analysis.certificates.load_multipliers import (
    Reference,
    _Form,
    load_multipliers,
    proved_distance,
)
from amontons.analysis.certificates.one_load.answer import LoadOutcome
from amontons.analysis.certificates.one_load.certificate import certify_load
from amontons.analysis.scaled import Scaled
from amontons.mechanics.ready.hild import hild_triangle


def state(random, mu, d):
    """A point of Coulomb's law of any status."""
    status, normal = random.integers(4), random.exponential()
    way = random.standard_normal(d - 1)
    way /= np.linalg.norm(way)
    r, u = np.zeros(d), np.zeros(d)
    if status == 0:
        u[0], u[1:] = normal, random.exponential() * way
    elif status == 1:
        r[0], r[1:] = normal, mu * normal * random.random() * way
    else:
        r[0] = normal * (status == 2)
        r[1:], u[1:] = -mu * r[0] * way, random.exponential() * way
    return r, u


@pytest.mark.parametrize("d", [2, 3])
def test_no_contact_gains_between_two_points_of_the_law(d):
    """The inequalities (1) to (3) of the module, contact by contact, from the law alone."""
    random, gained, open_ones = np.random.default_rng(d), [], 0
    for _ in range(4000):
        mu = random.uniform(0.1, 2.0)
        (r0, u0), (r, u) = state(random, mu, d), state(random, mu, d)
        tau, sigma = random.exponential(size=2) + 0.01
        speed = np.linalg.norm(u0[1:])
        if not r0.any() and u0[0] > 0:
            way = random.standard_normal(d - 1)
            eta = sigma * mu * random.random() * way / np.linalg.norm(way)
            if sigma * mu * speed - eta @ u0[1:] > tau * u0[0]:
                continue
            open_ones += 1
        else:
            t = u0[1:] / speed if speed > 0 else -r0[1:] / (mu * r0[0] or 1.0)
            eta = sigma * mu * t
        dr, du = r - r0, u - u0
        gained.append(dr[0] * (tau * du[0] + eta @ du[1:]) + sigma * dr[1:] @ du[1:])
    assert max(gained) < 1e-12
    assert open_ones > 300


def scaled_of(W, q, mu):
    problem = am.FrictionProblem.from_delassus(W, q, mu)
    return problem, Scaled.of(problem)


def small_problem(seed):
    """One to four contacts in 2D, coupled so that some loads have several solutions."""
    random = np.random.default_rng(seed)
    nc = int(random.integers(1, 5))
    A = random.standard_normal((2 * nc, 2 * nc))
    W = np.kron(np.eye(nc), [[1.0, 0.8], [0.8, 1.0]]) + 0.1 * A @ A.T / (2 * nc)
    mu = random.uniform(0.2, 3.0, nc)
    mu[random.random(nc) < 0.1] = 0.0
    q = random.standard_normal((nc, 2))
    q = np.abs(q) if seed % 2 else q
    return am.FrictionProblem.from_delassus(W, q, mu)


def test_what_is_proved_has_one_solution():
    """Against the enumeration of all patterns, about each of the solutions."""
    proved = several = 0
    for seed in range(40):
        problem = small_problem(seed)
        truth = am.all_solutions(problem)
        assert truth.complete
        scaled = Scaled.of(problem)
        for one in truth.solutions:
            found = load_multipliers(scaled, one.r / scaled.to_r)
            assert not (found.proved and len(truth) > 1)
            proved += found.proved
        several += len(truth) > 1
    assert proved > 20
    assert several > 5


def test_threshold_of_one_contact():
    """Open at u = (1, -3); beside it the contact sticks from mu = 11/7 on: W r = -q has
    r_T = 11/7 r_N."""
    W = np.array([[1.0, -0.8], [-0.8, 1.0]])
    for mu, alone in ((1.5, True), (1.57, True), (1.573, False), (3.0, False)):
        problem, scaled = scaled_of(W, np.array([[1.0, -3.0]]), np.array([mu]))
        found = load_multipliers(scaled, np.zeros((1, 2)))
        assert found.proved is alone
        assert (len(am.all_solutions(problem)) == 1) is alone


def cube(cells):
    block = am.Body(am.box((1, 1, 1), cells=cells), am.LinearElastic(young=200, poisson=0.3))
    return am.Model(
        [block],
        supports=[am.Fix("top", lambda x: (0, 0.2, 0.06 - 0.15 * x[0]))],
        contacts=[am.Contact("bottom", am.Plane(normal=(0, 0, 1)), mu=1.0)],
    ).assemble().condensed()  # fmt: skip


def test_a_cube_is_decided_and_its_proof_holds_alone():
    """The matrix and the sides by numpy, from W, q, mu and the multipliers."""
    problem = cube(8)
    answer = certify_load(problem, am.solve(problem, tolerance=1e-10))
    assert answer.outcome is LoadOutcome.CERTIFIED
    assert answer.distance < 1e-8
    by, W = answer.multipliers, np.asarray(problem.W)
    assert by.proved
    u = problem.q + (W @ by.r0.ravel()).reshape(by.r0.shape)
    assert set(by.statuses) == set("fsl")
    E = np.zeros_like(W)
    for i, letter in enumerate(by.statuses):
        speed = np.linalg.norm(u[i, 1:])
        t = -by.r0[i, 1:] / by.r0[i, 0] if letter == "s" else u[i, 1:] / speed
        if by.pinned[i]:
            assert by.eta[i] == pytest.approx(by.sigma[i] * t, rel=1e-5, abs=1e-8)
        else:
            assert letter == "f"
            assert np.linalg.norm(by.eta[i]) <= by.sigma[i]
            assert by.sigma[i] * speed - by.eta[i] @ u[i, 1:] <= by.tau[i] * u[i, 0]
        E[3 * i, 3 * i : 3 * i + 3] = by.tau[i], *by.eta[i]
        E[[3 * i + 1, 3 * i + 2], [3 * i + 1, 3 * i + 2]] = by.sigma[i]
    assert np.linalg.eigvalsh(E @ W + (E @ W).T)[0] > 0


def test_reach_hardly_falls_with_the_mesh():
    """Other than for every load, where it falls with the square root of the mesh."""
    reached = []
    for problem in (cube(4), cube(8)):
        scaled = Scaled.of(problem)
        r = am.solve(problem, tolerance=1e-10).r / scaled.to_r
        form = _Form(scaled, Reference.of(scaled, r))
        reached.append(form.sharpened(form.constant(1.0)))
    assert min(reached) > 1.0
    assert reached[1] > 0.93 * reached[0]


@pytest.mark.parametrize("d", [2, 3])
def test_slope_is_the_derivative(d):
    random = np.random.default_rng(3)
    A = random.standard_normal((6 * d, 6 * d))
    q = random.standard_normal((6, d))
    problem, scaled = scaled_of(A @ A.T + np.eye(6 * d), q, random.uniform(0.1, 0.4, 6))
    r = am.solve(problem, tolerance=1e-11).r / scaled.to_r
    form = _Form(scaled, Reference.of(scaled, r))
    x = form.constant(0.5) + 0.05 * random.standard_normal(6 * (d + 1))
    way = random.standard_normal(len(x))
    value, slope = form.value(x, 20.0)
    assert abs(value) < 10
    step = 1e-6
    ends = [form.value(x + sign * step * way, 20.0)[0] for sign in (1, -1)]
    assert slope @ way == pytest.approx((ends[0] - ends[1]) / (2 * step), rel=1e-3)


def test_idle_and_frictionless_contacts_and_other_units():
    """A contact that can not react, one without friction: the rest is proved as before."""
    problem = hild_triangle(30).assemble().condensed()
    W, q, mu = np.array(problem.W), problem.q, np.full(30, 1.0)
    mu[4], W[20:22], W[:, 20:22] = 0.0, 0.0, 0.0
    q = np.array(q)
    q[10] = 1.0, 0.0
    unit = np.repeat(10.0 ** np.random.default_rng(0).integers(-3, 4, 30), 2)
    for factor in (np.ones(60), unit):
        scaled = scaled_of(W * factor * factor[:, None], q * factor.reshape(-1, 2), mu)[1]
        found = load_multipliers(scaled, np.zeros((30, 2)))
        assert found.proved
        assert found.distance == 0.0


def test_a_contact_that_touches_and_can_not_react_may_have_any_reaction():
    W = np.zeros((4, 4))
    W[:2, :2] = np.eye(2)
    scaled = scaled_of(W, np.array([[1.0, 0.0], [0.0, 0.0]]), np.full(2, 0.5))[1]
    assert not load_multipliers(scaled, np.zeros((2, 2))).proved


def test_rough_solutions_are_near_nothing():
    """What misses the balance by more than the load proves no more than its distance."""
    problem = cube(4)
    scaled = Scaled.of(problem)
    r = am.solve(problem, tolerance=1e-10).r / scaled.to_r
    near = load_multipliers(scaled, r)
    off = load_multipliers(scaled, r * (1 + 1e-3))
    assert near.distance < 1e-7
    assert off.distance > 1e-4
    assert not load_multipliers(scaled, r * (1 + 1e-3), near=1e-6).proved


def test_forged_multipliers_are_no_proof():
    problem = cube(4)
    scaled = Scaled.of(problem)
    z0 = Reference.of(scaled, am.solve(problem, tolerance=1e-10).r / scaled.to_r)
    by = load_multipliers(scaled, z0.r)
    assert proved_distance(scaled, z0, by.tau, by.sigma, by.eta, by.pinned) is not None
    forged = {
        "closed contacts let go": (by.tau, by.sigma, by.eta, np.zeros_like(by.pinned)),
        "a negative number": (-by.tau, by.sigma, by.eta, by.pinned),
        "no number": (by.tau * np.nan, by.sigma, by.eta, by.pinned),
        "outside of the disc": (by.tau, by.sigma, by.eta + 9.0, by.pinned),
        "too little of the normals": (by.tau * 1e-3, by.sigma, by.eta, by.pinned),
    }
    for name, given in forged.items():
        assert proved_distance(scaled, z0, *given) is None, name
