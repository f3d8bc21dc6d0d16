"""Faces that contacts share between rigid bodies: found in W, and steps with them."""

import numpy as np
import pytest
from scipy import sparse

import amontons as am
from amontons.solvers.newton.block_lu import factorise_inplace
from amontons.solvers.newton.face_steps import (
    add_step_inplace,
    face_matrix_inplace,
    missed_inplace,
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


def solved(found, E, f, W):
    """(W + E)^-1 f by faces."""
    faces, nc = found.faces, len(f)
    order, upper_start, upper, lower_start, lower = found.symbolic.arrays
    units = len(faces.indptr) - 1
    data, K = np.empty((len(faces.indices), 3, 3)), np.empty((len(faces.rank), 6, 6))
    inverse = np.linalg.inv(E)
    face_matrix_inplace(faces, E, inverse, data, K)
    U, L = np.empty((len(upper), 3, 3)), np.empty((len(upper), 3, 3))
    pivots = np.empty((units, 3, 3))
    assert factorise_inplace(
        faces.indptr, faces.indices, data, np.zeros((units, 3, 3)), order, upper_start, upper,
        lower_start, lower, U, L, pivots, np.zeros((units, 3, 3)),
    )  # fmt: skip
    factor = order, upper_start, upper, lower_start, lower, U, L, pivots
    dr, rest = np.zeros((nc, 3)), np.empty((nc, 3))
    h, p = np.empty((units, 3)), np.empty((units, 3))
    for _ in range(2):
        missed_inplace(E, f, dr, (W @ dr.ravel()).reshape(nc, 3), rest)
        add_step_inplace(faces, inverse, K, factor, rest, h, p, dr)
    return dr


def test_faces_of_a_pile_and_a_step():
    """One face for each body, rank six, and the solution of a dense matrix."""
    W, q = pile()
    problem = problem_of(W, q)
    found = FaceMatrix.of(problem, Workspace.of(problem).symbolic)
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
    dr = solved(found, E, f, W)
    left = whole @ dr.ravel() - f.ravel()
    assert np.linalg.norm(left) <= 1e-9 * np.linalg.norm(f)


def test_relaxation_is_the_same_with_faces():
    """Reactions are not unique, the motion is."""
    problem = problem_of(*pile())
    ends = []
    for known in (True, False):
        work = Workspace.of(problem)
        if not known:
            work.__dict__["sharing"] = FaceMatrix(NONE, work.symbolic)
        relaxation = Relaxation.of(work, np.full(problem.contacts, 0.1), 1e-10)
        while not relaxation.ended:
            relaxation.advance(0.0, 60)
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
    symbolic = Workspace.of(problem).symbolic
    assert FaceMatrix.of(problem, symbolic).faces is NONE
