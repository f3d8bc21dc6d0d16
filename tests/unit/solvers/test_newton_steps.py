"""Newton steps in the Delassus form: every way gives the solution of the whole equation."""

import numpy as np
import pytest
from scipy import sparse

import amontons as am
from amontons.solvers.newton import steps as newton_steps
from amontons.solvers.newton.joints import Joints
from amontons.solvers.newton.steps import Condensed, State, coupled_contacts


def chain(bodies=4, per_joint=15, d=3, seed=0):
    """W of deformable bodies one on another: joint k presses body k against body k - 1."""
    rng = np.random.default_rng(seed)
    m = per_joint * d
    n = 3 * m
    M, H = [], np.zeros((bodies * n, bodies * m))
    for k in range(bodies):
        root = rng.standard_normal((n, n)) / np.sqrt(n)
        M.append(root @ root.T + np.eye(n))
        for body in (k - 1, k):
            if body >= 0:
                H[body * n : (body + 1) * n, k * m : (k + 1) * m] = rng.standard_normal((n, m))
    W = H.T @ np.linalg.solve(np.asarray(sparse.block_diag(M).todense()), H)
    W = sparse.csr_array(np.where(np.abs(W) > 1e-12, 0.5 * (W + W.T), 0.0))
    q = rng.standard_normal((bodies * per_joint, d))
    q[:, 0] -= 0.5
    return am.FrictionProblem.from_delassus(W, q, np.full(len(q), 0.5))


def linearised(problem, seed=1, share_open=0.3):
    """F, A, B as Newton has them: some contacts open, the others stick or slide."""
    rng = np.random.default_rng(seed)
    d, nc = problem.dimension, problem.contacts
    F = rng.standard_normal((nc, d))
    A, B = np.tile(np.eye(d), (nc, 1, 1)), np.zeros((nc, d, d))
    closed = np.flatnonzero(rng.random(nc) >= share_open)
    A[closed, 0, 0] = 0
    B[closed, 0, 0] = 1
    for i in closed:
        slides = rng.random()
        A[i, 1:, 1:] *= slides
        B[i, 1:, 1:] = (1 - slides) * np.eye(d - 1)
        A[i, 1:, 0] = 0.3 * slides
    return F, A, B


def whole(problem, F, A, B):
    """dr of the dense equation."""
    W, (nc, d) = problem.W.toarray(), F.shape
    matrix = np.zeros((nc * d, nc * d))
    for i in range(nc):
        rows = slice(i * d, (i + 1) * d)
        matrix[rows] = B[i] @ W[rows]
        matrix[rows, rows] += A[i]
    return np.linalg.solve(matrix, -F.ravel()).reshape(F.shape)


@pytest.fixture
def never_small(monkeypatch):
    """Joints, and sparse factors, for problems of any size; never blocks of contacts."""
    monkeypatch.setattr(newton_steps, "DENSE_UNKNOWNS", 0)
    monkeypatch.setattr(Condensed, "in_blocks", staticmethod(lambda problem: False))


@pytest.mark.parametrize("d", [2, 3])
@pytest.mark.parametrize("share_open", [0.0, 0.3, 0.9])
def test_joints_give_the_exact_step(never_small, d, share_open):
    problem = chain(d=d)
    assert Joints.exact(problem) is not None
    F, A, B = linearised(problem, share_open=share_open)
    found, flops = Condensed(problem)._by_joints(F, A, B, coupled_contacts(A, B))
    expected = whole(problem, F, A, B)
    np.testing.assert_allclose(found, expected, atol=1e-9 * np.abs(expected).max())
    left = problem.dimension * len(coupled_contacts(A, B))
    assert 0 < flops < 3 * (3 / d * left) ** 3 + 1e6


@pytest.mark.parametrize("way", ["joints", "sparse", "dense", "blocks"])
def test_all_ways_agree_and_tell_their_operations(monkeypatch, way):
    problem = chain()
    F, A, B = linearised(problem)
    monkeypatch.setattr(
        Condensed, "in_blocks", staticmethod(lambda problem: way == "blocks")
    )
    monkeypatch.setattr(newton_steps, "DENSE_UNKNOWNS", 10**6 if way == "dense" else 0)
    if way in ("sparse", "dense"):
        monkeypatch.setattr(Joints, "exact", classmethod(lambda cls, problem: None))
    u = np.zeros_like(F)
    step, count = Condensed(problem).step(State(u, u), (F, A, B), 0.1)
    expected = whole(problem, F, A, B)
    np.testing.assert_allclose(step.r, expected, atol=1e-8 * np.abs(expected).max())
    np.testing.assert_allclose(step.u.ravel(), problem.W @ step.r.ravel())
    assert count == 0
    assert step.flops > 1000


def test_a_part_of_a_problem_uses_the_joints_of_the_whole(never_small):
    problem = chain()
    some = np.flatnonzero(np.arange(problem.contacts) % 4 > 0)
    part = problem.restricted(some)
    F, A, B = linearised(part)
    found, _ = Condensed(part)._by_joints(F, A, B, coupled_contacts(A, B))
    expected = whole(part, F, A, B)
    np.testing.assert_allclose(found, expected, atol=1e-9 * np.abs(expected).max())


def test_a_joint_without_inverse_goes_another_way(never_small):
    problem = chain()
    F, A, B = linearised(problem, share_open=0.0)
    A[0], B[0] = 0.0, 0.0  # a row of zeros
    assert Condensed(problem)._by_joints(F, A, B, coupled_contacts(A, B)) is None


def test_all_open_needs_no_factor(never_small):
    problem = chain()
    F, A, B = linearised(problem, share_open=1.1)
    step, _ = Condensed(problem).step(State(F, F), (F, A, B), 0.1)
    np.testing.assert_array_equal(step.r, -F)
