"""FrictionProblem: what it rejects, what it condenses to, and what its variants share."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import sparse

from amontons.core.errors import InvalidInput, SingularOperator, UnsupportedForm
from amontons.problem.friction import Form, FrictionProblem
from amontons.problem.judge.measures import Measure
from amontons.problem.law import Coulomb, Tresca

NAN = np.nan


def global_arguments(nc=2, d=3, n=9, seed=0, *, block_diagonal=False):
    rng = np.random.default_rng(seed)
    root = rng.standard_normal((n, n))
    if block_diagonal:
        root = np.kron(np.eye(n // 3), np.ones((3, 3))) * root
    return {
        "M": root @ root.T + np.eye(n),
        "H": rng.standard_normal((n, nc * d)),
        "f": rng.standard_normal(n),
        "w": rng.standard_normal((nc, d)),
        "mu": np.full(nc, 0.4),
    }


def coupled_arguments(n=60):
    """A chain longer than the largest block that is inverted densely."""
    arguments = global_arguments(n=n)
    arguments["M"] = sparse.diags_array([-1.0, 3.0, -1.0], offsets=[-1, 0, 1], shape=(n, n))
    return arguments


def changed(array, index, value):
    out = np.array(array, dtype=float)
    out[index] = value
    return out


GLOBAL_FAULTS = [
    ("M", lambda a: a["M"][:, :-1], r"M: expected shape \(9, 9\), got \(9, 8\)"),
    ("M", lambda a: changed(a["M"], (1, 2), NAN), r"M\[1, 2\]: .*finite.*nan"),
    ("M", lambda a: changed(a["M"], (0, 0), np.inf), r"M\[0, 0\]: .*finite.*inf"),
    ("H", lambda a: a["H"][:-1], r"H: expected shape \(9, 6\), got \(8, 6\)"),
    ("H", lambda a: a["H"][:, :-1], r"H: expected shape \(9, 6\), got \(9, 5\)"),
    ("H", lambda a: changed(a["H"], (3, 4), NAN), r"H\[3, 4\]: .*finite.*nan"),
    ("f", lambda a: a["f"][:-1], r"f: expected shape \(9,\), got \(8,\)"),
    ("f", lambda a: a["f"][:, None], r"f: expected shape \(9,\), got \(9, 1\)"),
    ("f", lambda a: changed(a["f"], 5, np.inf), r"f\[5\]: .*finite.*inf"),
    ("w", lambda a: a["w"][:-1], r"w: expected shape \(2, 2\) or \(2, 3\).* got \(1, 3\)"),
    ("w", lambda a: np.zeros((2, 4)), r"w: .*got \(2, 4\)"),
    ("w", lambda a: changed(a["w"], (1, 0), NAN), r"w\[1, 0\]: .*finite.*nan"),
    ("mu", lambda a: [0.4, -0.1], r"mu\[1\]: .*>= 0.*-0.1"),
    ("mu", lambda a: [NAN, 0.1], r"mu\[0\]: .*nan"),
    ("mu", lambda a: [[0.4, 0.4]], r"mu: expected shape \(nc,\), got \(1, 2\)"),
    ("mu", lambda a: [0.4] * 3, r"w: expected shape \(3, 2\) or \(3, 3\).* got \(2, 3\)"),
]


@pytest.mark.parametrize(("name", "fault", "message"), GLOBAL_FAULTS)
def test_global_form_rejects(name, fault, message):
    arguments = global_arguments()
    arguments[name] = fault(arguments)
    with pytest.raises(InvalidInput, match=message):
        FrictionProblem.from_global(**arguments)


def test_near_nullspace_must_have_the_rows_of_M():
    with pytest.raises(InvalidInput, match="near_nullspace: expected 9 rows, got 8"):
        FrictionProblem.from_global(**global_arguments(), near_nullspace=np.ones((8, 1)))


DELASSUS_FAULTS = [
    ({"W": np.eye(5)}, r"W: expected shape \(6, 6\), got \(5, 5\)"),
    ({"W": sparse.eye_array(5)}, r"W: expected shape \(6, 6\), got \(5, 5\)"),
    ({"W": changed(np.eye(6), (2, 3), NAN)}, r"W\[2, 3\]: .*finite.*nan"),
    ({"W": sparse.csr_array(changed(np.eye(6), (2, 3), NAN))}, r"W\[2, 3\]: .*finite.*nan"),
    ({"q": np.zeros((3, 3))}, r"q: expected shape \(2, 2\) or \(2, 3\).* got \(3, 3\)"),
    ({"q": np.zeros(7)}, r"q: .*got \(7,\)"),
    ({"q": changed(np.zeros((2, 3)), (0, 2), -np.inf)}, r"q\[0, 2\]: .*finite.*-inf"),
    ({"mu": [0.4, -2.0]}, r"mu\[1\]: .*-2"),
]


@pytest.mark.parametrize(("fault", "message"), DELASSUS_FAULTS)
def test_delassus_form_rejects(fault, message):
    arguments = {"W": np.eye(6), "q": np.zeros((2, 3)), "mu": [0.4, 0.4]} | fault
    with pytest.raises(InvalidInput, match=message):
        FrictionProblem.from_delassus(**arguments)


def test_flat_vectors_of_fclib_are_rows():
    problem = FrictionProblem.from_delassus(np.eye(6), np.arange(6.0), [0.4, 0.4])
    np.testing.assert_array_equal(problem.q, [[0, 1, 2], [3, 4, 5]])
    assert (problem.dimension, problem.contacts, problem.unknowns) == (3, 2, 6)


def test_arrays_are_copies_and_read_only():
    arguments = global_arguments()
    problem = FrictionProblem.from_global(**arguments)
    arguments["f"][:] = 99
    assert problem.f.max() < 99
    local = problem.condensed()
    for array in (problem.f, problem.w, problem.mu, problem.M.data, local.q, local.W.data):
        with pytest.raises(ValueError, match=r"read-only|WRITEABLE"):
            np.asarray(array).flat[0] = 1


@pytest.mark.parametrize("d", [2, 3])
@pytest.mark.parametrize("kind", ["coupled", "blocks", "unsymmetric", "chain"])
def test_condensed_is_the_dense_formula(kind, d):
    arguments = global_arguments(d=d, block_diagonal=kind == "blocks")
    if kind == "unsymmetric":
        arguments["M"] = arguments["M"] + np.triu(np.ones((9, 9)), 1)
    if kind == "chain":
        arguments = coupled_arguments() | {
            "H": np.random.default_rng(1).standard_normal((60, 2 * d)), "w": np.ones((2, d)),
        }  # fmt: skip
    problem = FrictionProblem.from_global(**arguments)
    assert (problem.small_blocks is None) == (kind == "chain")
    M, H = np.array(problem.M.todense()), arguments["H"]
    local = problem.condensed()
    W = local.W.toarray() if sparse.issparse(local.W) else local.W
    np.testing.assert_allclose(W, H.T @ np.linalg.solve(M, H), rtol=1e-9, atol=1e-12)
    q = arguments["w"] + (H.T @ np.linalg.solve(M, arguments["f"])).reshape(2, d)
    np.testing.assert_allclose(local.q, q, rtol=1e-9, atol=1e-12)
    assert local.condensed() is local
    assert (np.abs(W - W.T).max() > 1e-3) == (kind == "unsymmetric")
    r = np.random.default_rng(2).standard_normal((2, d))
    u, v = problem.velocity(r)
    np.testing.assert_allclose(u, local.velocity(r)[0], atol=1e-10)
    np.testing.assert_allclose(M @ v, H @ r.ravel() + arguments["f"], atol=1e-10)


def test_a_block_without_mass_is_named():
    arguments = global_arguments(block_diagonal=True)
    arguments["M"][3:6, 3:6] = 0
    problem = FrictionProblem.from_global(**arguments)
    with pytest.raises(SingularOperator, match=r"unknowns \[3\]"):
        problem.condensed()
    assert problem.measure is Measure.RESIDUAL


def test_a_floating_body_has_only_the_residual_measure():
    arguments = coupled_arguments()
    stiffness = sparse.diags_array(
        [-1.0, 2.0, -1.0], offsets=[-1, 0, 1], shape=(60, 60)
    ).tolil()
    stiffness[0, 0] = stiffness[59, 59] = 1
    problem = FrictionProblem.from_global(**(arguments | {"M": stiffness}))
    with pytest.raises(SingularOperator):
        problem.condensed()
    assert problem.measure is Measure.RESIDUAL
    assert problem.error(np.zeros((2, 3))) == np.inf  # there is no v to judge
    assert np.isfinite(problem.error(np.zeros((2, 3)), np.zeros(60)))


def test_wrong_form_and_law_are_type_errors():
    problem = FrictionProblem.from_global(**global_arguments())
    with pytest.raises(UnsupportedForm, match=r"condensed\(\)"):
        _ = problem.blocks
    with pytest.raises(UnsupportedForm, match="global"):
        problem.condensed().factor()
    given = FrictionProblem.from_delassus(np.eye(3), [[0, 0, 0]], Tresca([1.0]))
    with pytest.raises(UnsupportedForm, match="Tresca"):
        _ = given.mu


def test_forms():
    problem = FrictionProblem.from_global(**global_arguments())
    assert problem.form is Form.GLOBAL
    assert problem.condensed().form is Form.DELASSUS


# ------------------------------------------------------------------ variants
def test_variants_share_the_factor_and_nothing_stale():
    problem = FrictionProblem.from_global(**coupled_arguments())
    factor, local = problem.factor(), problem.condensed()
    rougher, loaded = problem.with_mu(0.9), problem.with_load(2 * problem.f)
    assert rougher.factor() is factor
    assert loaded.factor() is factor
    assert rougher.condensed().W is local.W
    assert rougher.condensed().blocks is local.blocks
    np.testing.assert_array_equal(rougher.condensed().mu, [0.9, 0.9])
    np.testing.assert_array_equal(problem.condensed().mu, [0.4, 0.4])
    np.testing.assert_allclose(
        loaded.condensed().q - problem.w, 2 * (local.q - problem.w), rtol=1e-12
    )
    np.testing.assert_array_equal(rougher.condensed().kernel_data[5][:, 0], [0.9, 0.9])
    assert loaded.condensed().q_norm == pytest.approx(np.linalg.norm(loaded.condensed().q))


def test_another_matrix_gets_another_factor():
    problem = FrictionProblem.from_global(**coupled_arguments())
    factor, W = problem.factor(), problem.condensed().W
    stiffer = replace(problem, M=sparse.csc_array(10 * problem.M))
    assert stiffer.factor() is not factor
    np.testing.assert_allclose(stiffer.condensed().W, W / 10)
    np.testing.assert_allclose(problem.condensed().W, W)
    np.testing.assert_allclose(problem.with_mu(1.0).condensed().W, W)
    np.testing.assert_allclose(stiffer.rho, 10 * problem.rho)


def test_local_variants():
    problem = FrictionProblem.from_delassus(2 * np.eye(4), [[-1, 1], [-1, 0]], [0.1, 0.2])
    other = problem.with_load([[-2, 1], [3, 0]])
    np.testing.assert_array_equal(other.kernel_data[3], [[-2, 1, 0], [3, 0, 0]])
    assert other.blocks is problem.blocks
    np.testing.assert_array_equal(problem.with_mu([0.3, 0.4]).kernel_data[5][:, 0], [0.3, 0.4])
    with pytest.raises(InvalidInput, match=r"q: .*got \(1, 2\)"):
        problem.with_load([[1, 2]])
    with pytest.raises(InvalidInput, match=r"mu\[0\]"):
        problem.with_mu(-1)


@pytest.mark.parametrize("W", [np.zeros((0, 0)), sparse.csr_array((0, 0))])
def test_no_contacts_at_all(W):
    problem = FrictionProblem.from_delassus(W, np.zeros((0, 3)), [])
    assert problem.error(np.zeros((0, 3))) == 0
    free = FrictionProblem.from_global(
        np.eye(3), np.zeros((3, 0)), np.ones(3), np.zeros((0, 3)), []
    )
    assert free.error(np.zeros((0, 3))) == 0
    np.testing.assert_allclose(free.velocity(np.zeros((0, 3)))[1], 1)


def test_a_law_may_be_given_instead_of_numbers():
    law = Coulomb([0.3])
    assert FrictionProblem.from_delassus(np.eye(2), [[0, 0]], law).law is law


@pytest.mark.parametrize(("given", "words"), [
    ({"W": np.eye(4), "q": np.zeros(4)}, r"q: expected shape \(2, 2\) or \(2, 3\).*got \(4,\)"),
    ({"W": np.eye(4), "q": np.zeros((3, 2))}, r"got \(3, 2\)"),
    ({"W": np.eye(4)}, "got no q"),
    ({}, "got no M"),
    ({"W": np.eye(4), "q": np.zeros((2, 2)), "law": 0.3}, "law: expected a law.*got 0.3"),
])  # fmt: skip
def test_what_is_no_problem_is_refused_when_it_is_made(given, words):
    with pytest.raises(InvalidInput, match=words):
        FrictionProblem(**({"law": Coulomb([0.3, 0.3])} | given))
