"""Contacts with moments: the cone, its problem and its sweeps, against the law itself."""

import numpy as np
import pytest

import amontons as am
from amontons.problem.law.rolling import projected_inplace

ROWS = (3, 5, 6)


def parts(problem):
    """Columns of shear, spin and rolling with their coefficients."""
    law = problem.law
    return {
        3: [(slice(1, 2), law.mu), (slice(2, 3), law.rolling)],
        5: [(slice(1, 3), law.mu), (slice(3, 5), law.rolling)],
        6: [(slice(1, 3), law.mu), (slice(3, 4), law.torsion), (slice(4, 6), law.rolling)],
    }[problem.rows]


def random_problem(seed, contacts, rows, singular=False, length=1.0):
    """With a solution, as q is in the range of H; moments in another unit of length."""
    rng = np.random.default_rng(seed)
    n = contacts * rows
    H = rng.standard_normal((n, max(rows, 2 * n // 3) if singular else n + 2)) / np.sqrt(n)
    q = (H @ rng.standard_normal(H.shape[1])).reshape(contacts, rows)
    unit = np.ones(rows)
    unit[2 if rows == 3 else 3 :] = length
    D = np.tile(unit, contacts)
    mu, rolling, torsion = rng.uniform(0.05, 0.6, (3, contacts))
    law = am.RollingFriction(mu, rolling / length, torsion / length if rows == 6 else 0)
    return am.RollingProblem(D[:, None] * (H @ H.T) * D, q * unit, law)


@pytest.mark.parametrize("rows", ROWS)
@pytest.mark.parametrize("singular", [False, True])
def test_solutions_obey_the_law_word_by_word(rows, singular):
    """Signs, complementarity, bounds, and moments opposed to what they resist."""
    told = np.zeros(4)
    for seed in range(12):
        problem = random_problem(seed, 1 + seed, rows, singular)
        s = am.solve(problem, tolerance=1e-10)
        r, u = s.r, s.u
        np.testing.assert_allclose(u.ravel(), problem.W @ r.ravel() + problem.q.ravel(),
                                   atol=1e-12)  # fmt: skip
        assert r[:, 0].min() >= 0 and u[:, 0].min() > -1e-8
        assert np.abs(r[:, 0] * u[:, 0]).max() < 1e-8
        for columns, a in parts(problem):
            moment, turned = r[:, columns], u[:, columns]
            assert (np.linalg.norm(moment, axis=1) <= a * r[:, 0] + 1e-8).all()
            work = a * r[:, 0] * np.linalg.norm(turned, axis=1)
            np.testing.assert_allclose((moment * turned).sum(axis=1), -work, atol=1e-8)
        told += [flags.sum() for flags in problem.regimes(r)]
    assert told[0] > 20 and told[1] > 10 and told[3] > 10 and bool(told[2]) is (rows == 6)


def test_a_given_slip_makes_it_convex_and_no_other_point_is_better():
    """Of 1/2 r W r + (q + s n) r on the cone: by projected gradients, and at random points."""
    rng = np.random.default_rng(0)
    for seed in range(3, 6):
        problem = random_problem(seed, 3, 6)
        r = am.solve(problem, tolerance=1e-11).r
        W, q = problem.W.toarray(), np.array(problem.q)
        u = (W @ r.ravel()).reshape(r.shape) + q
        for columns, a in parts(problem):
            q[:, 0] += a * np.linalg.norm(u[:, columns], axis=1)

        def energy(x, W=W, q=q):
            return 0.5 * x.ravel() @ W @ x.ravel() + q.ravel() @ x.ravel()

        def inside(x, problem=problem):
            out = np.empty_like(x)
            for i, row in enumerate(x):
                projected_inplace(row, problem.law.coefficients[i], out[i])
            return out

        least, step = energy(r), 1 / np.linalg.norm(W, 2)
        x = y = inside(np.zeros_like(r))
        for k in range(3000):
            before, x = x, inside(y - step * ((W @ y.ravel()).reshape(y.shape) + q))
            y = x + k / (k + 3) * (x - before)
        assert abs(energy(x) - least) < 1e-6 * abs(least)
        for _ in range(100):
            other = inside(r + rng.standard_normal(r.shape) * 10.0 ** rng.uniform(-6, 0))
            assert energy(other) >= least - 1e-9 * abs(least)


def test_the_projection_is_the_nearest_point():
    """(z - p).(k - p) <= 0 for all k of the cone, and p in it."""
    rng = np.random.default_rng(1)
    p = np.empty(6)
    for _ in range(300):
        z = rng.standard_normal(6) * 10.0 ** rng.uniform(-2, 2, 6)
        a = rng.uniform(0, 2, 3) * (rng.random(3) > 0.2)
        projected_inplace(z, a, p)
        size = [np.hypot(p[1], p[2]), abs(p[3]), np.hypot(p[4], p[5])]
        assert p[0] >= 0 and (size <= a * p[0] * (1 + 1e-12)).all()
        assert abs((z - p) @ p) < 1e-10 * (z @ z)
        k = rng.standard_normal((50, 6))
        k[:, 0] = np.max(np.abs(np.column_stack([
            np.hypot(k[:, 1], k[:, 2]), k[:, 3], np.hypot(k[:, 4], k[:, 5])
        ])) / np.where(a > 0, a, 1), axis=1)  # fmt: skip
        k[:, 1:] *= np.repeat(a > 0, (2, 1, 2))
        assert ((k - p) @ (z - p) <= 1e-10 * (z @ z) * (1 + np.abs(k).max())).all()


def test_units_of_moments_change_nothing():
    a, b = random_problem(3, 4, 6), random_problem(3, 4, 6, length=37.0)
    ra, rb = (am.solve(p, tolerance=1e-12).r for p in (a, b))
    np.testing.assert_allclose(rb[:, :3], ra[:, :3], atol=1e-12)
    np.testing.assert_allclose(37.0 * rb[:, 3:], ra[:, 3:], atol=1e-12)
    assert a.error(1.1 * ra) == pytest.approx(b.error(1.1 * rb), rel=1e-9)


def test_without_moments_it_is_coulombs_law():
    """Rolling and torsion of 0: the forces are those of a FrictionProblem."""
    problem = random_problem(5, 4, 6)
    law = am.RollingFriction(problem.law.mu)
    r = am.solve(am.RollingProblem(problem.W, problem.q, law), tolerance=1e-12).r
    own = (6 * np.arange(4)[:, None] + np.arange(3)).ravel()
    W = problem.W.toarray()[np.ix_(own, own)]
    plain = am.FrictionProblem.from_delassus(W, problem.q[:, :3], law.mu)
    np.testing.assert_allclose(r[:, :3], am.solve(plain, tolerance=1e-12).r, atol=1e-9)
    assert not r[:, 3:].any()


def test_open_pressed_and_empty():
    law = am.RollingFriction(0.3, 0.1, 0.1)
    away = am.solve(am.RollingProblem(np.eye(6), [[1.0, 2, 0, 0, 0, 3]], law))
    assert not away.r.any() and away.counts["open"] == 1
    held = am.solve(am.RollingProblem(np.eye(6), [[-1.0, 0.2, 0, 0.01, 0, -0.02]], law))
    np.testing.assert_allclose(held.r, [[1, -0.2, 0, -0.01, 0, 0.02]], atol=1e-12)
    assert held.counts["stick"] == 1 and (held.margin >= 0).all()
    none = am.RollingProblem(np.zeros((0, 0)), np.zeros((0, 6)), am.RollingFriction([]))
    assert am.solve(none).converged


def test_what_has_no_solution_fails_with_a_status():
    law = am.RollingFriction(0.3, 0.1)
    with pytest.raises(am.NotConverged) as failed:
        am.solve(am.RollingProblem(np.zeros((6, 6)), [[-1.0, 0, 0, 0, 0, 0]], law))
    assert not failed.value.solution.converged


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda law: am.RollingProblem(np.eye(4), [[-1.0, 0, 0, 0]], law), "N, T1, T2, S"),
        (lambda law: am.RollingProblem(np.eye(5), [[-1.0, 0, 0, 0, 0]], law), "six rows"),
        (lambda law: am.RollingProblem(np.eye(5), [[-1.0] + [0] * 5], law), r"W: expected"),
        (lambda law: am.RollingProblem(np.tri(6), [[-1.0] + [0] * 5], law), "symmetric"),
        (lambda law: am.RollingProblem(np.eye(6), [[np.nan] + [0] * 5], law), "q"),
        (lambda law: am.RollingProblem(np.eye(6), [[-1.0] + [0] * 5], am.Coulomb(0.3)), "law"),
        (lambda law: am.RollingFriction(0.3, rolling=-1), r"rolling\[0\]"),
        (lambda law: am.RollingFriction([0.3, 0.2], torsion=[1, 2, 3]), "mu"),
        (lambda law: am.FrictionProblem.from_delassus(np.eye(3), [[-1.0, 0, 0]], law), "law"),
        (lambda law: am.uniqueness(random_problem(0, 2, 6)), "RollingProblem"),
    ],
)
def test_what_does_not_fit_is_refused_in_words(make, words):
    with pytest.raises(am.InvalidInput, match=words):
        make(am.RollingFriction(0.3, 0.1, 0.1))


def test_other_solvers_say_who_takes_it():
    with pytest.raises(am.UnsupportedForm, match="RollingSweeps"):
        am.solve(random_problem(0, 2, 6), am.GaussSeidel())
