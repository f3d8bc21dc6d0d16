"""The critical friction: published values, all determinants one by one, witnesses, rounding."""

import json
from fractions import Fraction
from itertools import product

import numpy as np
import pytest
from uniqueness_checker import check_witness, piece_matrix, smallest_determinant

import amontons as am
from amontons.analysis.certificates import disc_pieces
from amontons.analysis.certificates.critical_friction import critical_friction
from amontons.analysis.certificates.determinant_search import NEGATIVE, POSITIVE, UNKNOWN
from amontons.analysis.certificates.energy_bound import energy_bound
from amontons.analysis.certificates.exact_threshold import first_failure
from amontons.analysis.certificates.status_pieces import Pieces
from amontons.analysis.multipliers.rounding import determinant_sign, is_positive_definite
from amontons.analysis.statuses import FREE, MINUS, PLUS, STICK
from amontons.core.clock import Deadline
from amontons.core.errors import InvalidInput
from amontons.mechanics.ready.gallery import box_tower, one_contact_2d
from amontons.mechanics.ready.hild import hild_triangle, mesh_of_triangle


def random_problem(seed, contacts=None, size=1.0):
    """Any definite W, coupled a little or much, any shape of friction."""
    random = np.random.default_rng(seed)
    nc = int(random.integers(1, 6)) if contacts is None else contacts
    A = random.standard_normal((2 * nc, 2 * nc))
    W = A @ A.T / nc + np.diag(random.uniform(0.2, 3, 2 * nc)) * random.uniform(0.1, 3)
    mu = random.uniform(0.1, 2.0, nc)
    mu[random.random(nc) < 0.2] = 0.0
    q = random.standard_normal((nc, 2))
    return am.FrictionProblem.from_delassus(W * size, q, mu)


def dense(problem):
    W = problem.condensed().W
    return W if isinstance(W, np.ndarray) else W.toarray()


def test_one_contact_by_hand():
    # W_NN - mu W_NT = 1 - .8 mu vanishes at 1.25, slip-
    found = critical_friction(one_contact_2d())
    assert found.upper == pytest.approx(1.25)
    assert 1.25 * (1 - 1e-5) < found.lower < 1.25 <= found.upper
    assert found.witness.pattern == "-"
    assert found.witness.coefficients == pytest.approx([-1.25])
    assert found.criterion == "determinants"


@pytest.mark.parametrize(
    ("n", "value"),
    list(
        enumerate(
            [2.2, 1.9324, 1.8517, 2.0263, 1.7949, 1.7287, 1.5792, 1.5488, 1.4672, 1.4403], 1
        )
    ),
)
def test_structured_triangles_have_the_listed_thresholds(n, value):
    problem = hild_triangle(n).assemble()
    found = critical_friction(problem)
    assert found.upper == pytest.approx(value, abs=1.5e-4)  # listed to four digits
    assert found.upper * (1 - 2e-6) < found.lower < found.upper
    assert found.p_matrix <= found.upper * (1 + 1e-9)
    if n <= 7:
        assert found.p_matrix == pytest.approx(value, abs=1.5e-4)
    assert found.full_contact > found.upper - 1e-9
    assert check_witness(dense(problem), np.ones(n), found.witness, found.upper)


def test_published_coefficients_of_unstructured_meshes(shared):
    # [Rey] tab:mu_crit prints the first multiple of 0.01 that fails, and two digits
    data = json.loads((shared / "reference" / "rey" / "enumeration.json").read_text())
    printed = {1: (2.2, 2.2), 3: (1.41, 2.12), 4: (1.79, 2.18), 5: (1.63, 2.15)}
    meshes = next(v for k, v in data["families"].items() if k.startswith("gmsh"))
    meshes = {"1": data["families"]["structured n^2 similar triangles"]["1"], **meshes}
    for n, listed in meshes.items():
        mesh = mesh_of_triangle(listed["nodes"], listed["triangles"])
        found = critical_friction(hild_triangle(mesh).assemble())
        listed = listed["thresholds"]
        assert found.p_matrix == pytest.approx(listed["mu_P"], abs=1.5e-4)
        assert found.upper == pytest.approx(listed["mu_star"], abs=1.5e-4)
        assert found.full_contact == pytest.approx(listed["mu_full_contact"], abs=6e-4)
        if int(n) in printed:
            p, full = printed[int(n)]
            first_failing = np.ceil(100 * found.p_matrix - 1e-9) / 100
            assert first_failing == pytest.approx(p, abs=1e-9)
            assert found.full_contact == pytest.approx(full, abs=5.1e-3)


@pytest.mark.parametrize("seed", range(25))
def test_all_determinants_one_by_one(seed):
    problem = random_problem(seed)
    W, mu = dense(problem), problem.mu
    shape = mu / mu.max() if mu.max() > 0 else np.ones_like(mu)
    found = critical_friction(problem)
    assert smallest_determinant(W, found.lower * shape) > 0
    if np.isfinite(found.upper):
        assert found.lower > found.upper * (1 - 1e-4)
        assert smallest_determinant(W, found.upper * (1 + 1e-6) * shape) < 0
        assert check_witness(W, shape, found.witness, found.upper)
        E = piece_matrix(W, found.witness.pattern, found.witness.coefficients)
        assert np.linalg.svd(E, compute_uv=False)[-1] < 1e-9 * np.linalg.norm(W)
    assert energy_bound(W, shape)[0] <= found.upper
    for older, states in ((found.p_matrix, "fs+-"), (found.full_contact, "s+-")):
        if older is not None and np.isfinite(older):
            assert smallest_determinant(W, older * (1 - 1e-5) * shape, states) > 0


@pytest.mark.parametrize("seed", range(6))
def test_units_and_order_change_nothing(seed):
    problem = random_problem(seed, contacts=4)
    found = critical_friction(problem)
    order = np.random.default_rng(seed).permutation(4)
    rows = (2 * order[:, None] + [0, 1]).ravel()
    scale = 10.0 ** np.random.default_rng(seed).uniform(-6, 6)
    W = scale * dense(problem)[np.ix_(rows, rows)]
    other = am.FrictionProblem.from_delassus(W, problem.q[order], problem.mu[order])
    again = critical_friction(other)
    assert again.upper == pytest.approx(found.upper, rel=1e-9)
    assert "".join(np.array(list(found.witness.pattern))[order]) == again.witness.pattern


def test_a_pivot_within_rounding_of_zero_is_no_proof():
    W = one_contact_2d().W  # as stored: .8 and 1.25 .8 are not exact
    dense_w = np.asarray(W if isinstance(W, np.ndarray) else W.toarray())
    allowed = np.array([[True, True, True, True, False]])
    exact = Fraction(1) / Fraction(float(dense_w[0, 1]))
    signs = {}
    for step in range(-40, 41):
        m = float(exact) * (1 + step * 2.0**-53)
        signs[step] = first_failure(dense_w, np.array([m]), allowed)[0]
        truth = 1 - Fraction(m) * Fraction(float(dense_w[0, 1]))
        assert signs[step] == UNKNOWN or (signs[step] == POSITIVE) == (truth > 0)
    assert signs[0] == UNKNOWN
    assert (signs[-40], signs[40]) == (POSITIVE, NEGATIVE)


def test_signs_of_determinants_are_proved():
    random = np.random.default_rng(0)
    for _ in range(50):
        A = random.standard_normal((5, 5))
        assert determinant_sign(A) == np.sign(np.linalg.det(A))
    A[0] = A[1] + A[2]
    assert determinant_sign(A) == 0
    A[0, 0] += 1e-13
    assert determinant_sign(A, 1e-12) == 0
    assert determinant_sign(np.zeros((2, 2))) == 0
    assert is_positive_definite(np.diag([1.0, 1e-8]))
    assert not is_positive_definite(np.diag([1.0, 1e-8]), 1e-7)
    assert not is_positive_definite(np.diag([1.0, -1e-8]))
    v = np.array([[1.0, 1.0], [1.0, 1.0]])
    assert not is_positive_definite(v)


def test_without_coupling_every_friction_is_safe():
    W = np.diag([1.0, 2.0, 3.0, 4.0])
    W[1, 3] = W[3, 1] = 0.5
    found = critical_friction(am.FrictionProblem.from_delassus(W, np.ones((2, 2)), [1.0, 1.0]))
    assert (found.lower, found.upper, found.witness) == (np.inf, np.inf, None)


def test_contacts_that_can_not_react_are_left_out():
    W = np.zeros((4, 4))
    W[2:, 2:] = [[1.0, 0.8], [0.8, 1.0]]
    found = critical_friction(am.FrictionProblem.from_delassus(W, np.ones((2, 2)), [1.0, 0.5]))
    assert found.upper == pytest.approx(2.5)  # t 0.5 = 1.25
    assert found.witness.pattern == "f-"


def test_a_contact_without_friction_does_not_stick():
    # if it could, a pattern would be singular at half of this friction
    A = np.random.default_rng(1).standard_normal((4, 5))
    problem = am.FrictionProblem.from_delassus(A @ A.T / 4, np.ones((2, 2)), [1.0, 0.0])
    pieces = Pieces.of(problem)
    patterns = product((FREE, PLUS, MINUS, STICK), (FREE, PLUS))
    found = [pieces.threshold(np.array(states)) for states in patterns]
    least = min(answer[0] for answer in found if answer is not None)
    assert critical_friction(problem).upper == pytest.approx(least)


def test_singular_w_has_no_safe_friction():
    v = np.array([1.0, 0.3, -1.0, 0.4])
    W = np.eye(4) - np.outer(v, v) / (v @ v)
    found = critical_friction(am.FrictionProblem.from_delassus(W, np.ones((2, 2)), [1.0, 1.0]))
    assert found.lower == 0
    assert "singular" in found.reason


@pytest.mark.parametrize("mu", [[1.0, 1.0], [0.5, 0.0], [0.0, 2.0]])
def test_a_contact_given_twice_has_no_safe_friction(mu):
    block = np.array([[1.0, 0.5], [0.5, 2.0]])  # entries without rounding: exactly singular
    problem = am.FrictionProblem.from_delassus(np.tile(block, (2, 2)), np.ones((2, 2)), mu)
    found = critical_friction(problem)
    assert found.lower == 0
    assert "singular" in found.reason
    assert found.upper > 0


def test_bad_input_is_refused():
    blocks = critical_friction(box_tower())
    assert (blocks.lower, blocks.upper, blocks.criterion) == (0.0, np.inf, "none")
    assert "singular" in blocks.reason
    with pytest.raises(InvalidInput, match="time_limit"):
        critical_friction(one_contact_2d(), time_limit=0)
    with pytest.raises(InvalidInput, match="gap"):
        critical_friction(one_contact_2d(), gap=2)


def test_a_search_in_space_counts_what_it_does():
    """24 descents take more than .05 s; before, hundredths of it were counted."""
    random = np.random.default_rng(3)
    A = random.standard_normal((6, 7))
    problem = am.FrictionProblem.from_delassus(A @ A.T, np.ones((2, 3)), [0.3, 0.3])
    deadline = Deadline.counted(60.0)
    critical_friction(problem, time_limit=deadline)
    assert deadline.time > 0.05


@pytest.mark.parametrize("seed", range(8))
def test_responses_of_a_piece_are_those_of_its_equations(seed):
    """Against the inverse of all equations; the reduced ones have the same determinant."""
    random, k = np.random.default_rng(seed), 5
    A = random.standard_normal((3 * k, 3 * k))
    form = disc_pieces._Form(A @ A.T / k + np.eye(3 * k), random.uniform(0.2, 1, k))
    states = np.full(k, seed) if seed < 4 else random.integers(0, 4, k)
    angle, t = random.uniform(0, 6, k), 1.3
    piece = states, np.stack([np.cos(angle), np.sin(angle)], axis=1), t
    J, own = disc_pieces.equations(form.W, form.shape, *piece), np.arange(k)
    inverse = np.linalg.inv(J)
    r, u = form.responses(*piece)
    for found, all_of in ((r, inverse), (u, form.W @ inverse)):
        np.testing.assert_allclose(found, all_of.reshape(k, 3, k, 3)[own, :, own], atol=1e-10)
    V, R, _, _ = disc_pieces.bases(form.shape, *piece)
    assert np.linalg.det(V.T @ form.W @ R) == pytest.approx(np.linalg.det(J), rel=1e-9)
