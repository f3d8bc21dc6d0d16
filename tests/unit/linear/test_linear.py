"""Linear solvers against dense NumPy, and how they refuse what can not be solved."""

from types import SimpleNamespace

import numpy as np
import pytest
from scipy import sparse

import amontons as am
from amontons.core.errors import InvalidInput, MissingDependency, SingularOperator
from amontons.linear import Direct, GeometricMultigrid, direct
from amontons.linear.direct import Backend
from amontons.linear.small_blocks import LARGEST_BLOCK, block_diagonal_inverse

INSTALLED = [backend for backend in Backend if backend.installed]


def grid_elasticity(n=8):
    """Springs along edges and diagonals of an n x n grid, bottom held; (2 n², 2 n²), modes."""
    points = np.stack(np.meshgrid(np.arange(n), np.arange(n), indexing="ij"), -1).reshape(-1, 2)
    rows, columns, values = [], [], []
    for step in ([1, 0], [0, 1], [1, 1], [1, -1]):
        e = np.array(step) / np.linalg.norm(step)
        block = np.outer(e, e)
        for a, p in enumerate(points):
            q = p + step
            if ((q >= 0) & (q < n)).all():
                b = q[0] * n + q[1]
                for i, j, sign in ((a, a, 1), (b, b, 1), (a, b, -1), (b, a, -1)):
                    rows += [2 * i, 2 * i, 2 * i + 1, 2 * i + 1]
                    columns += [2 * j, 2 * j + 1, 2 * j, 2 * j + 1]
                    values += list(sign * block.ravel())
    held = np.repeat(points[:, 1] == 0, 2)
    K = sparse.csc_array((values, (rows, columns)), shape=(2 * n * n, 2 * n * n))
    modes = np.zeros((2 * n * n, 3))
    modes[::2, 0] = modes[1::2, 1] = 1
    modes[::2, 2], modes[1::2, 2] = -points[:, 1], points[:, 0]
    return K + sparse.diags_array(held.astype(float)), modes


@pytest.mark.parametrize("backend", [None, *INSTALLED])
@pytest.mark.parametrize("kind", ["symmetric", "unsymmetric", "indefinite"])
def test_direct_against_dense(backend, kind):
    A, _ = grid_elasticity()
    rng = np.random.default_rng(0)
    if kind == "unsymmetric":
        A = sparse.csc_array(A + sparse.random_array(A.shape, density=0.02, rng=rng))
    if kind == "indefinite":
        A = sparse.csc_array(A - sparse.eye_array(A.shape[0]))
    factor = Direct(backend).factor(A)
    for b in (rng.standard_normal(A.shape[0]), rng.standard_normal((A.shape[0], 3))):
        x = factor.solve(b)
        assert x.shape == b.shape
        np.testing.assert_allclose(x, np.linalg.solve(A.toarray(), b), rtol=1e-8, atol=1e-8)
    assert factor.exact
    assert factor.iterations == 0
    assert backend in (None, factor.backend)


def singular_parts(parts, rng, size=20, border=6):
    """Dense blocks of rank size - 1, made regular by a border: a well-posed whole.

    Pivots within a block leave the last of each as rounding.
    """
    n = parts * size
    A = 6 * np.eye(n + border)
    for k in range(parts):
        block = rng.standard_normal((size, size))
        block[:, -1] = block[:, :-1] @ rng.standard_normal(size - 1)
        A[k * size : (k + 1) * size, k * size : (k + 1) * size] = block
    A[:n, n:], A[n:, :n] = rng.standard_normal((n, border)), rng.standard_normal((border, n))
    return sparse.csc_array(A)


@pytest.mark.parametrize("backend", [None, *INSTALLED])
@pytest.mark.parametrize("parts", [1, 4])
def test_direct_where_pivots_of_a_part_are_rounding(backend, parts):
    rng = np.random.default_rng(parts)
    A = singular_parts(parts, rng)
    assert np.linalg.cond(A.toarray()) < 1e4
    factor = Direct(backend).factor(A)
    assert backend in (None, factor.backend)
    for b in (rng.standard_normal(A.shape[0]), rng.standard_normal((A.shape[0], 2))):
        exact = np.linalg.solve(A.toarray(), b)
        np.testing.assert_allclose(factor.solve(b), exact, rtol=0, atol=1e-11)


@pytest.mark.parametrize("directions", [2, 20])
def test_a_factor_that_is_wrong_in_a_few_directions_is_corrected(directions):
    n = 80
    rng = np.random.default_rng(0)
    A = rng.standard_normal((n, n)) + 20 * np.eye(n)
    error = 30 * rng.standard_normal((n, directions)) @ rng.standard_normal((directions, n))
    inverse = np.linalg.inv(A + error)
    solve = direct.checked(sparse.csc_array(A), lambda b: inverse @ b)
    for b in (rng.standard_normal(n), rng.standard_normal((n, 2)), np.zeros(n)):
        np.testing.assert_allclose(solve(b), np.linalg.solve(A, b), rtol=0, atol=1e-12)


def test_a_factor_of_another_matrix_is_refused():
    rng = np.random.default_rng(0)
    A, inverse = rng.standard_normal((2, 200, 200))
    with pytest.raises(SingularOperator, match="trial solve failed"):
        direct.checked(sparse.csc_array(A), lambda b: inverse @ b)


@pytest.mark.parametrize("backend", [None, *INSTALLED])
def test_direct_refuses_a_singular_matrix(backend):
    free = sparse.diags_array([-1.0, 2.0, -1.0], offsets=[-1, 0, 1], shape=(80, 80)).tolil()
    free[0, 0] = free[79, 79] = 1
    with pytest.raises(SingularOperator, match="matrix"):
        Direct(backend).factor(sparse.csc_array(free))


@pytest.mark.parametrize("backend", INSTALLED)
@pytest.mark.parametrize(("kind", "order", "cells"), [
    ("tri", 1, 16), ("quad", 1, 16), ("tri", 2, 3), ("tet", 2, 2), ("hex", 1, 2)])  # fmt: skip
def test_direct_refuses_blocks_that_nothing_holds_upright(backend, kind, order, cells):
    """Their entries are round numbers: a trial product alone may leave no rounding to see."""
    dim = 3 if kind in ("tet", "hex") else 2
    sides = [am.Fix("left", (0.0, *(None,) * (dim - 1)))]
    sides += [am.Fix("front", (None, 0.0, None))] if dim == 3 else []
    mesh = am.box((1.0,) * dim, cells, kind)
    body = am.Body(mesh, am.LinearElastic(1000.0, 0.3), order=order)
    plane = am.Plane((0.0,) * (dim - 1) + (1.0,))
    model = am.Model([body], sides, [am.Contact("bottom", mu=0.0, obstacle=plane)])
    with pytest.raises(SingularOperator, match="matrix"):
        Direct(backend).factor(model.assemble().M)


def test_direct_names_an_empty_column():
    with pytest.raises(SingularOperator, match="column 1 is empty"):
        Direct().factor(sparse.csc_array(np.diag([1.0, 0.0, 2.0])))


def test_direct_rejects_rectangles_and_negative_threads():
    with pytest.raises(InvalidInput, match=r"square.*\(2, 3\)"):
        Direct().factor(sparse.csc_array(np.ones((2, 3))))
    with pytest.raises(InvalidInput, match="threads: .*-1"):
        Direct(threads=-1)


def test_a_missing_backend_says_what_to_install(monkeypatch):
    monkeypatch.setattr(Backend, "installed", property(lambda self: False))
    with pytest.raises(MissingDependency, match="pypardiso"):
        Direct(Backend.PARDISO)


def test_a_package_that_does_not_load_is_passed_over(monkeypatch):
    """A wheel for another NumPy: it is found, and raises ImportError."""

    def broken(matrix, threads):
        raise ImportError("numpy.core.multiarray failed to import")

    monkeypatch.setattr(Backend, "installed", property(lambda self: True))
    for backend in (Backend.MUMPS, Backend.RSLAB, Backend.PARDISO):
        monkeypatch.setitem(direct._FACTORISE, backend, broken)
    A = sparse.csc_array([[2.0, 1.0], [0.0, 3.0]])
    found = Direct().factor(A)
    assert found.backend is Backend.SUPERLU
    np.testing.assert_allclose(A @ found.solve(np.ones(2)), 1)


def test_mumps_comes_first_where_a_matrix_is_not_symmetric(monkeypatch):
    monkeypatch.setattr(Backend, "installed", property(lambda self: True))
    symmetric = sparse.csc_array([[2.0, 1.0], [1.0, 3.0]])
    other = sparse.csc_array([[2.0, 1.0], [0.0, 3.0]])
    assert direct._by_merit(other)[0] is Backend.MUMPS
    assert direct._by_merit(symmetric)[0] is Backend.RSLAB
    monkeypatch.setattr(Backend, "installed", property(lambda self: False))
    with pytest.raises(MissingDependency, match=r"amontons\[mumps\]"):
        Direct(Backend.MUMPS)


@pytest.mark.parametrize("backend", [b for b in Backend if b.installed])
def test_factors_tell_their_operations(backend):
    n = 60
    A = sparse.csc_array(np.random.default_rng(0).standard_normal((n, n)) + n * np.eye(n))
    found = Direct(backend).factor(A)
    dense = 2 / 3 * n**3
    assert found.flops is None or 0.5 * dense < found.flops < 2 * dense


def test_operations_beyond_the_integers_of_a_sparse_factor(monkeypatch):
    n = 60_000
    rows = SimpleNamespace(indptr=np.array([0, n, 2 * n], dtype=np.int32))
    factor = SimpleNamespace(L=rows, U=SimpleNamespace(tocsr=lambda: rows), solve=None)
    monkeypatch.setattr("scipy.sparse.linalg.splu", lambda matrix, permc_spec: factor)
    _, flops = direct._superlu(sparse.csc_array(np.eye(2)), 0)
    assert flops == 2 * 2 * n**2


def test_direct_leaves_its_argument_alone():
    A = sparse.csc_array(([1.0, 2.0, 3.0], [1, 0, 1], [0, 2, 3]), shape=(2, 2))
    indices = A.indices.copy()
    Direct().factor(A)
    np.testing.assert_array_equal(A.indices, indices)


@pytest.mark.parametrize("with_modes", [False, True])
def test_conjugate_gradients_with_algebraic_levels(with_modes):
    A, modes = grid_elasticity(24)
    solver = GeometricMultigrid(dimension=2)
    factor = solver.factor(A, modes if with_modes else None)
    b = np.random.default_rng(1).standard_normal((A.shape[0], 2))
    x = factor.solve(b)
    assert np.linalg.norm(A @ x - b) <= 1e-9 * np.linalg.norm(b)
    assert 0 < factor.iterations <= (60 if with_modes else 200)
    assert not factor.exact
    np.testing.assert_allclose(factor.solve(b[:, 0]), x[:, 0], rtol=1e-6, atol=1e-8)


def test_conjugate_gradients_say_when_they_fail():
    A, modes = grid_elasticity(12)
    factor = GeometricMultigrid(dimension=2, max_iterations=1).factor(A, modes)
    with pytest.raises(SingularOperator, match="1 iterations"):
        factor.solve(np.ones(A.shape[0]))


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: GeometricMultigrid(tolerance=0.0), "tolerance"),
        (lambda: GeometricMultigrid(max_iterations=0), "max_iterations"),
        (lambda: GeometricMultigrid(dimension=1), "dimension"),
    ],
)
def test_options_are_checked(make, message):
    with pytest.raises(InvalidInput, match=message):
        make()


def test_small_blocks():
    rng = np.random.default_rng(2)
    blocks = [rng.standard_normal((k, k)) + 4 * np.eye(k) for k in (3, 1, 6, 3)]
    order = rng.permutation(13)
    A = sparse.block_diag(blocks, format="csc")[np.ix_(order, order)]
    inverse = block_diagonal_inverse(sparse.csc_array(A))
    np.testing.assert_allclose(inverse.toarray(), np.linalg.inv(A.toarray()), atol=1e-12)
    n = LARGEST_BLOCK + 1
    chain = sparse.diags_array([-1.0, 3.0, -1.0], offsets=[-1, 0, 1], shape=(n, n))
    assert block_diagonal_inverse(sparse.csc_array(chain)) is None
    assert block_diagonal_inverse(sparse.csc_array((0, 0))).shape == (0, 0)


def test_a_singular_small_block_is_named():
    A = np.eye(6)
    A[3:5, 3:5] = 1
    with pytest.raises(SingularOperator, match=r"unknowns \[3, 4\]"):
        block_diagonal_inverse(sparse.csc_array(A))


def test_superlu_is_not_asked_for_what_no_permutation_can_factorise(capfd):
    """Its kernels print complaints about their own arguments then, into any output."""
    free, held = 60, 40  # more unknowns without stiffness than rows that hold them
    rows = sparse.random(free, held, 0.3, random_state=49)
    matrix = sparse.block_array([[None, rows], [rows.T, None]], format="csc")
    with pytest.raises(SingularOperator, match="at most 80 of 100 pivots"):
        Direct(Backend.SUPERLU).factor(matrix)
    assert capfd.readouterr().out == ""


def test_multigrid_on_many_loose_parts():
    """Each is one aggregate, and these have no neighbours: nothing whole to invert below."""
    rng, parts = np.random.default_rng(0), 700
    blocks = rng.standard_normal((parts, 12, 12))
    blocks = blocks @ blocks.swapaxes(1, 2) + 12 * np.eye(12)
    M = sparse.csc_array(sparse.block_diag(list(blocks), format="csc"))
    x, y, z = rng.random((4 * parts, 3)).T
    modes = np.zeros((4 * parts, 3, 6))
    modes[:, range(3), range(3)] = 1
    modes[:, 0, 3], modes[:, 1, 3] = -y, x
    modes[:, 1, 4], modes[:, 2, 4] = -z, y
    modes[:, 2, 5], modes[:, 0, 5] = -x, z
    factor = GeometricMultigrid().factor(M, modes.reshape(-1, 6))
    assert factor.hierarchy.levels[-1].A.nodes < 10
    b = rng.standard_normal(M.shape[0])
    assert np.abs(M @ factor.solve(b) - b).max() < 1e-9
