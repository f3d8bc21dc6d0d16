"""Faces that contacts share between rigid bodies: found in W, and steps with them."""

import numpy as np
import pytest
from scipy import sparse

import amontons as am
from amontons.mechanics.ready.gallery import random_delassus
from amontons.solvers.auto.race import Track, chunks_alone
from amontons.solvers.auto.state import is_stacked
from amontons.solvers.newton.cone_steps import scaled_blocks_inplace
from amontons.solvers.newton.face_steps import (
    face_memory,
    factorise_faces_inplace,
    step_by_faces_inplace,
)
from amontons.solvers.newton.faces import NONE, FaceMatrix
from amontons.solvers.newton.interior_point import Relaxation
from amontons.solvers.newton.smoothing import Workspace

POINTS = 12  # contacts of a face


def pile(bodies=5, seed=3):
    """W and q of blocks on each other, POINTS on a face, and two contacts of the last alone."""
    random = np.random.default_rng(seed)
    pairs = [(b, b - 1) for b in range(bodies) for _ in range(POINTS)] + [(bodies - 1, -1)] * 2
    H = np.zeros((6 * bodies, 3 * len(pairs)))
    for i, (upper, lower) in enumerate(pairs):
        turned = np.linalg.qr(random.standard_normal((3, 3)))[0]
        frame = turned if i >= POINTS * bodies else np.eye(3)
        place = random.uniform(-1, 1, 2)
        for body, sign in ((upper, 1.0), (lower, -1.0)):
            if body >= 0:
                arm = np.append(-0.5 * sign, place)
                for a in range(3):
                    H[6 * body : 6 * body + 6, 3 * i + a] = sign * np.append(
                        frame[a], np.cross(arm, frame[a])
                    )
    mass = random.uniform(1, 2, 6 * bodies)
    W = H.T @ (H / mass[:, None])
    q = H.T @ np.tile([-1.0, 0.2, 0.1, 0, 0, 0], bodies)
    return W, q.reshape(-1, 3)


def problem_of(W, q, mu=0.5):
    return am.FrictionProblem.from_delassus(sparse.csr_array(W), q, np.full(len(q), mu))


def solved(found, E, inverse, f, blocks):
    """(W + E)^-1 f by faces."""
    symbolic, faces = found.symbolic.arrays, found.faces
    memory, fill = face_memory(faces), len(symbolic[2])
    U, L = np.empty((fill, 3, 3)), np.empty((fill, 3, 3))
    assert factorise_faces_inplace(faces, E, inverse, symbolic, U, L, memory)
    dr, du = np.empty_like(f), np.empty_like(f)
    W = blocks.indptr, blocks.indices, blocks.data
    step_by_faces_inplace(W, faces, E, inverse, symbolic, U, L, memory, f, 2, dr, du)
    return dr


def test_faces_of_a_pile_and_a_step():
    """One face for each body, rank six, and the solution of a dense matrix."""
    W, q = pile()
    problem = problem_of(W, q)
    found = FaceMatrix.of(problem)
    assert found.faces.rank.tolist() == [6] * 5
    assert (found.faces.face[-2:] == -1).all()
    random = np.random.default_rng(1)
    E = random.standard_normal((len(q), 3, 3))
    E = E @ E.transpose(0, 2, 1) * 10.0 ** random.uniform(-4, 2, (len(q), 1, 1))
    E += 1e-5 * np.eye(3)
    f = random.standard_normal(q.shape)
    whole = W.copy()
    for i in range(len(q)):
        whole[3 * i : 3 * i + 3, 3 * i : 3 * i + 3] += E[i]
    dr = solved(found, E, np.linalg.inv(E), f, problem.blocks)
    left = whole @ dr.ravel() - f.ravel()
    assert np.linalg.norm(left) <= 1e-9 * np.linalg.norm(f)


@pytest.mark.parametrize("mu", [0.05, 0.5, 3.0])
@pytest.mark.parametrize("inside", [0.5, 1e-7])
def test_scaling_takes_reactions_to_velocities(mu, inside):
    """E r = (y_N mu, y_T) for x = (mu r_N, r_T), near the sides of the cones as well."""
    x, y = np.array([[1.0, 0.6, 0.8]]), np.array([[2.0, -1.2, -1.6]])
    x[0, 1:] *= 1 - inside
    y[0, 1:] *= 1 - inside
    beta, w, lam = np.empty(1), np.empty((1, 3)), np.empty((1, 3))
    E, inverse = np.empty((1, 3, 3)), np.empty((1, 3, 3))
    scaled_blocks_inplace(x, y, mu, 0.0, 0, beta, w, lam, E, inverse)
    r, u = x[0] / [mu, 1, 1], y[0] * [mu, 1, 1]
    assert np.allclose(E[0] @ r, u, rtol=0, atol=1e-14 * np.abs(E).max() * np.abs(r).max())
    size = np.abs(inverse).max() * np.abs(u).max()
    assert np.allclose(inverse[0] @ u, r, rtol=0, atol=1e-14 * size)
    scaled_blocks_inplace(x, y, mu, 1e-3, 0, beta, w, lam, E, inverse)
    assert np.linalg.eigvalsh(E[0])[0] >= 0.999e-3
    size = np.abs(E).max() * np.abs(inverse).max()
    assert np.allclose(E[0] @ inverse[0], np.eye(3), rtol=0, atol=1e-14 * size)


def test_step_where_faces_are_singular_in_double_precision():
    """Normals alone press, twenty powers of ten apart: (W + E) dr = f in all components.

    Rounding of f, here about 1e-15, comes into dr times E^-1 = 1e10, and one more solution
    takes as much off what is left again: two solutions leave (30 1e-15 1e10)^2 at most, a
    second call with what is left nothing but rounding.
    """
    W, q = pile()
    problem = problem_of(W, q)
    found = FaceMatrix.of(problem)
    size = np.tile([1e-10, 1e10, 1e10], (len(q), 1))
    E, inverse = np.eye(3) * size[:, None], np.eye(3) / size[:, None]
    exact = np.random.default_rng(2).standard_normal(q.shape) / size.clip(1)
    f = (W @ exact.ravel()).reshape(q.shape) + size * exact
    dr, left = np.zeros_like(f), f
    for most in (1e-7, 1e-13):
        dr += solved(found, E, inverse, left, problem.blocks)
        left = f - (W @ dr.ravel()).reshape(q.shape) - size * dr
        assert np.abs(left).max() <= most * np.abs(f).max()


@pytest.mark.parametrize("mu", [0.0, 0.5, 2.0])
def test_relaxation_keeps_its_digits_with_faces(mu):
    """To the last digits by faces alone: the factor of the whole is never called for."""
    problem = problem_of(*pile(), mu)
    work = Workspace.of(problem)
    relaxation = Relaxation.of(work, np.zeros(problem.contacts), 1e-10)
    assert relaxation.advance(1e-11 * problem.q_norm, 40) < 30
    assert work.sharing.faces is not NONE
    assert relaxation.shares
    assert problem.error(relaxation.r) <= 1e-11 * problem.q_norm


def test_relaxation_is_the_same_with_faces():
    """Reactions are not unique, the motion is; finite to the end, where no goal is met."""
    problem = problem_of(*pile())
    ends = []
    for known in (True, False):
        work = Workspace.of(problem)
        if not known:
            work.__dict__["sharing"] = FaceMatrix(NONE, work.symbolic)
        relaxation = Relaxation.of(work, np.full(problem.contacts, 0.1), 1e-10)
        for _ in range(20):
            relaxation.advance(0.0, 5)
        assert np.isfinite(relaxation.r).all()
        ends.append(problem.velocity(relaxation.r)[0])
    assert work.sharing.faces is NONE
    assert np.abs(ends[0] - ends[1]).max() <= 1e-5 * problem.q_norm


@pytest.mark.parametrize("size", [1e-3, 1e-6])
def test_no_face_where_w_says_otherwise(size):
    """One block of W that is not that of rigid bodies."""
    W, q = pile()
    W[0:3, 30:33] += size
    W[30:33, 0:3] += size
    problem = problem_of(W, q)
    assert FaceMatrix.of(problem).faces is NONE


def test_stacks_are_told_from_w_alone():
    """In any order and unit; not where W is full of deformation, nor spheres or other laws."""
    W, q = pile()
    problem = problem_of(W, q)
    assert is_stacked(problem)
    other = np.random.default_rng(5).permutation(len(q))
    rows = (3 * other[:, None] + np.arange(3)).ravel()
    assert is_stacked(problem_of(1e-7 * W[np.ix_(rows, rows)], q[other]))
    assert not is_stacked(problem_of(W + 1e-3 * np.diag(np.diag(W)), q))
    assert not is_stacked(am.SpherePacking(40, seed=1).problem().condensed())
    assert not is_stacked(random_delassus(0, 10))
    tresca = am.Tresca(np.full(len(q), 0.3))
    assert not is_stacked(am.FrictionProblem.from_delassus(sparse.csr_array(W), q, tresca))


def test_a_stack_goes_to_the_interior_point_after_a_chunk(monkeypatch):
    """After 5 to 20 sweeps, where all others have 60; many at once have the same bits."""
    order, advance = [], Track.advance

    def noted(track, growth):
        order.append(track.entry.name)
        return advance(track, growth)

    monkeypatch.setattr(Track, "advance", noted)
    problem = problem_of(*pile(60))
    assert chunks_alone(problem) == 1
    alone = am.drive(problem, tolerance=1e-9)
    assert alone.converged
    assert order[1] == "interior point"
    assert np.array_equal(am.solve_many([problem], tolerance=1e-9)[0].r, alone.r)
