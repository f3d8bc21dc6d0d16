"""Multipliers of every contact, and singular pieces in 3D: never on the wrong side."""

import numpy as np
import pytest

import amontons as am
from amontons.analysis.certificates import bounds_in_space
from amontons.analysis.certificates import contact_multipliers as contact_multipliers_module
from amontons.analysis.certificates.contact_multipliers import (
    ContactMultipliers,
    contact_multipliers,
    holds,
)
from amontons.analysis.certificates.critical_friction import critical_friction
from amontons.analysis.certificates.energy_bound import energy_bound
from amontons.core.clock import RATE, Deadline
from amontons.core.errors import TimeUp


def random_problem(seed, d, contacts=None):
    """Any definite W, any friction, also none."""
    random = np.random.default_rng(seed)
    nc = int(random.integers(1, 4)) if contacts is None else contacts
    A = random.standard_normal((d * nc, d * nc))
    W = A @ A.T / nc + np.diag(random.uniform(0.2, 3, d * nc)) * random.uniform(0.1, 3)
    mu = random.uniform(0.1, 2.0, nc)
    mu[random.random(nc) < 0.15] = 0.0
    return W, mu, am.FrictionProblem.from_delassus(W, random.standard_normal((nc, d)), mu)


def random_piece(random, W, mu):
    """Equations of a piece with any direction and any kappa, as the law has them (3D)."""
    nc = len(mu)
    J = np.zeros((3 * nc, 3 * nc))
    for i in range(nc):
        own = slice(3 * i, 3 * i + 3)
        kind = random.integers(4)
        angle, share = random.uniform(0, 2 * np.pi), random.uniform()
        t, p = (np.cos(angle), np.sin(angle)), (-np.sin(angle), np.cos(angle))
        if kind == 0:
            J[own, own] = np.eye(3)
        elif kind == 1 and mu[i] > 0:
            J[own] = W[own]
        else:
            share = share if mu[i] > 0 else 0.0
            J[3 * i] = W[3 * i]
            J[3 * i + 1, own] = mu[i], *t
            J[3 * i + 2] = share * (p @ W[3 * i + 1 : 3 * i + 3])
            J[3 * i + 2, 3 * i + 1 : 3 * i + 3] += (1 - share) * np.array(p)
    return J


def test_bounds_of_random_problems_in_2d_are_below_the_exact_ones():
    parts = []
    for seed in range(60):
        W, mu, problem = random_problem(seed, 2)
        if not mu.any():
            continue
        exact = am.critical_friction(problem)
        if not (exact.criterion == "determinants" and np.isfinite(exact.upper)):
            continue
        found = contact_multipliers(W, mu / mu.max())
        assert found.t <= exact.upper
        parts.append(found.t / exact.upper)
    assert len(parts) > 30
    assert np.median(parts) > 0.9


@pytest.mark.parametrize("seed", range(25))
def test_no_piece_below_the_bound_is_singular(seed):
    W, mu, problem = random_problem(seed, 3)
    if not mu.any():
        return
    bounds = am.critical_friction(problem)
    assert 0 < bounds.lower <= bounds.upper
    random, safe = np.random.default_rng(seed), mu / mu.max() * bounds.lower
    for _ in range(400):
        assert np.linalg.det(random_piece(random, W, safe)) > 0


@pytest.mark.parametrize("seed", range(12))
def test_witnesses_in_3d_have_a_null_vector_and_the_other_orientation(seed):
    W, mu, problem = random_problem(seed, 3)
    bounds = am.critical_friction(problem)
    if np.isinf(bounds.upper):
        assert bounds.witness is None
        return
    w = bounds.witness
    r, u = w.null_vector, (W @ w.null_vector.ravel()).reshape(-1, 3)
    small = 1e-6 * np.abs(u).max() + 1e-6
    for i, letter in enumerate(w.pattern):
        t = w.directions[i]
        if letter == "f":
            assert np.abs(r[i]).max() < small
        elif letter == "s":
            assert np.abs(u[i]).max() < small
        else:
            across = np.array([-t[1], t[0]])
            assert w.coefficients[i] == pytest.approx(w.friction * mu[i] / mu.max())
            assert abs(u[i, 0]) < small
            assert abs(t @ r[i, 1:] + w.coefficients[i] * r[i, 0]) < small
            assert abs(across @ (r if letter == "l" else u)[i, 1:]) < small


def test_the_cube_between_its_bounds():
    """25 contacts: .580 and .768 were found elsewhere, by other programs."""
    body = am.Body(am.box((1, 1, 1), 4), am.LinearElastic(200, 0.3))
    contact = am.Contact("bottom", am.Plane((0, 0, 1)), mu=0.5)
    model = am.Model([body], [am.Fix("top", (0, 0.2, -0.06))], [contact])
    bounds = am.critical_friction(model)
    assert 0.58 < bounds.lower < bounds.upper < 0.78
    assert bounds.criterion == "contact multipliers"
    verdict = am.uniqueness(model)
    assert verdict.verdict.value == "unique_every_load"
    assert verdict.lower > 0.5
    assert np.isinf(verdict.upper)  # nobody needs it then, and it takes most of the time
    W = model.assemble().condensed().W
    assert bounds.lower > 1.3 * energy_bound(np.asarray(W), np.ones(25))[0]


def test_multipliers_are_in_the_units_of_the_problem():
    W, mu, problem = random_problem(4, 3, contacts=3)
    shape = mu / mu.max()
    by = am.critical_friction(problem).multipliers
    assert by.t > 0
    assert holds(W, shape, by.t, by)
    assert not holds(W, shape, 1.05 * by.expected, by)
    assert not holds(W, shape, np.inf, by)
    wrong = ContactMultipliers(by.t, -by.tau, by.sigma, by.alpha, by.f)
    assert not holds(W, shape, by.t, wrong)
    units = np.repeat([1e-5, 3.0, 7e4], 3)
    other = contact_multipliers(W * units * units[:, None], shape)
    assert other.t == pytest.approx(contact_multipliers(W, shape).t, rel=0.02)


def test_an_eigenvalue_that_was_missed_before_the_proof_leaves_a_bound(monkeypatch):
    """t of the search is 1 % too large, and there is time for two proofs."""
    W, mu, _ = random_problem(4, 3, contacts=3)
    form = contact_multipliers_module._Form.of(W, mu / mu.max())
    x = np.zeros(form.unknowns)
    true = form.sharpened(x)
    monkeypatch.setattr(type(form), "sharpened", lambda self, x: 1.01 * true)
    found = form.proved(x, Deadline.counted(2.5 * form.proof / RATE), np.inf)
    assert 0.98 * true < found.t < true


def test_many_contacts_begin_with_few():
    """A half plane by its logarithm: more contacts than are searched at once."""
    x = np.linspace(0, 1, 90)
    log = -np.log(np.abs(x[:, None] - x) + 0.004)
    W = np.zeros((90, 2, 90, 2))
    W[:, 0, :, 0] = W[:, 1, :, 1] = log + 2.0
    W[:, 0, :, 1] = 0.3 * np.sign(x[:, None] - x)
    W[:, 1, :, 0] = -W[:, 0, :, 1]
    W = W.reshape(180, 180)
    shape = np.ones(90)
    found = contact_multipliers(W, shape)
    assert found.t > 1.2 * energy_bound(W, shape)[0] > 0
    assert contact_multipliers(W, shape, wanted=0.5 * found.t).t >= 0.5 * found.t
    with pytest.raises(TimeUp):
        contact_multipliers(W, shape, Deadline.counted(1e-9))


def test_nothing_to_react():
    assert contact_multipliers(np.zeros((4, 4)), np.ones(2)).t == np.inf
    assert contact_multipliers(np.ones((4, 4)), np.ones(2)).t == 0.0


def test_a_search_that_is_cut_leaves_time_for_its_proof():
    """A search that took all of its time once gave no bound at all, as if W were singular."""
    W, mu, _ = random_problem(0, 3, contacts=12)
    told = []
    for seconds in np.geomspace(1e-6, 1e-2, 25):
        try:
            found = contact_multipliers(W, mu / mu.max(), Deadline.counted(seconds))
        except TimeUp:
            assert not told
            continue
        assert found.t > 0
        told.append(found.t)
    assert len(told) > 10


def test_a_search_of_many_contacts_that_is_cut_leaves_time_for_its_proof():
    """The search of a part of them once took all, and what it had found was thrown away."""
    W, mu, _ = random_problem(0, 3, contacts=80)
    for seconds in (4e-3, 1e-2, 4e-2):
        assert contact_multipliers(W, mu / mu.max(), Deadline.counted(seconds)).t > 0


def test_only_where_the_energy_gives_no_bound_is_w_called_singular(monkeypatch):
    _, _, problem = random_problem(3, 3, contacts=3)
    ones = np.ones(3)
    nothing = ContactMultipliers(0.0, ones, ones, ones, np.zeros((3, 2)))
    monkeypatch.setattr(bounds_in_space, "contact_multipliers", lambda *_, **__: nothing)
    bounds = critical_friction(problem, brief=True)
    assert bounds.criterion == "energy"
    assert bounds.reason == bounds_in_space.NOT_PROVED
    singular = am.FrictionProblem.from_delassus(np.ones((6, 6)), np.ones((2, 3)), ones[:2])
    assert "W is singular" in critical_friction(singular).reason
