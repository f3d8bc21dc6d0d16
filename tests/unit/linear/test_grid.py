"""The stiffness of a box without a matrix: the same as stored, in products, rows and solves."""

import numpy as np
import pytest
from scipy import sparse

import amontons as am
from amontons.linear import GeometricMultigrid, grid
from amontons.linear.geometric import MultigridFactor
from amontons.linear.grid_matrix import GridMatrix
from amontons.linear.patched import PatchedOperator, Rows
from amontons.linear.transfer import Transfer
from amontons.mechanics.model import assembly
from amontons.solvers import ContactMultigrid, SemismoothNewton
from amontons.solvers.driver import drive

SHAPES = [(4, 4, 4), (6, 4, 2), (2, 4, 1)]


def model(cells=(4, 4, 4), symmetric=False):
    """A pressed and dragged box of cells of unequal sides, in quarter symmetry if wanted."""
    size = np.array([1, 1.2, 0.9]) * cells / 4
    supports = [am.Fix("top", (0.01, 0.02, -0.03))]
    if symmetric:
        supports = [
            am.Fix("left", (0, None, None)),
            am.Fix("front", (None, 0, None)),
            am.Fix("top", (None, None, -0.03)),
        ]
    return am.Model(
        [am.Body(am.box(size, cells=cells), am.LinearElastic(50, 0.3))],
        supports=supports,
        contacts=[am.Contact("bottom", am.Plane(normal=(0, 0, 1)), mu=0.4)],
    )


@pytest.fixture
def unstored(monkeypatch):
    """Boxes of any size are operators."""
    monkeypatch.setattr(assembly, "GRID_FROM", 1)


@pytest.mark.parametrize("symmetric", [False, True], ids=["clamped", "symmetric"])
@pytest.mark.parametrize("cells", SHAPES[:2])
def test_products_and_parts(cells, symmetric, monkeypatch):
    stored = model(cells, symmetric).assemble()
    monkeypatch.setattr(assembly, "GRID_FROM", 1)
    problem = model(cells, symmetric).assemble()
    grid, M = problem.M, sparse.csr_array(stored.M)
    assert isinstance(grid, GridMatrix)
    size = abs(M).max()
    v = np.cos(np.arange(problem.unknowns))
    assert np.abs(grid @ v - M @ v).max() < 1e-13 * size * 81
    assert np.abs(grid.diagonal() - M.diagonal()).max() < 1e-13 * size
    assert abs(grid.tocsc() - M).max() < 1e-13 * size
    index = np.arange(3, problem.unknowns, 4)
    assert abs(grid.part(index) - M[index][:, index]).max() < 1e-13 * size
    assert np.abs(problem.f - stored.f).max() < 1e-12 * np.abs(stored.f).max()
    assert np.abs(problem.rho - stored.rho).max() < 1e-12 * stored.rho.max()


def test_a_grid_of_one_cell_across(unstored):
    problem = model((2, 4, 1)).assemble()  # odd: no box is coarser in all directions
    assert sparse.issparse(problem.M)


def test_a_grid_of_stretched_cells(unstored):
    body = am.Body(am.box((4, 4, 1), cells=4), am.LinearElastic(50, 0.3))
    contact = am.Contact("bottom", am.Plane((0, 0, 1)), mu=0.4)
    problem = am.Model([body], [am.Fix("top", (0, 0, 0))], [contact]).assemble()
    assert sparse.issparse(problem.M)  # its next level is not halved in all directions


@pytest.mark.parametrize("symmetric", [False, True], ids=["clamped", "symmetric"])
def test_linear_solves(symmetric, unstored):
    problem = model((8, 4, 8), symmetric).assemble()
    factor = GeometricMultigrid(tolerance=1e-10).factor(problem.M)
    b = np.sin(np.arange(problem.unknowns))
    x = factor.solve(b)
    assert np.linalg.norm(problem.M @ x - b) <= 1e-9 * np.linalg.norm(b)
    assert factor.iterations <= 30


@pytest.mark.parametrize("solver", [am.Direct()])
def test_other_linear_solvers_store_it(solver, unstored):
    problem = model((4, 4, 4)).assemble()
    x = solver.factor(problem.M, problem.near_nullspace).solve(problem.f)
    assert np.linalg.norm(problem.M @ x - problem.f) <= 1e-8 * np.linalg.norm(problem.f)


@pytest.mark.parametrize("symmetric", [False, True], ids=["clamped", "symmetric"])
def test_the_same_contact_solution(symmetric, monkeypatch):
    expected = drive(model((8, 8, 4), symmetric).assemble(), tolerance=1e-10)
    monkeypatch.setattr(assembly, "GRID_FROM", 1)
    problem = model((8, 8, 4), symmetric).assemble()
    found = drive(problem, ContactMultigrid(), tolerance=1e-10)
    assert found.converged, str(found)
    assert found.convergence.iterations <= 25
    assert np.abs(found.r - expected.r).max() < 1e-7 * np.abs(expected.r).max()


@pytest.mark.parametrize("symmetric", [False, True], ids=["clamped", "symmetric"])
def test_coarse_levels_that_are_not_stored(symmetric, unstored, monkeypatch):
    """The same solution in as many cycles, to a few, and as many iterations without contact."""
    counts = []
    for least in (10**9, 100):
        monkeypatch.setattr(grid, "UNSTORED_FROM", least)
        problem = model((16, 8, 8), symmetric).assemble()
        stored = [level.A.is_stored for level in problem.hierarchy.levels]
        assert stored == [False, least > 100, *[True] * (len(stored) - 2)]
        found = drive(problem, ContactMultigrid(), tolerance=1e-10)
        assert found.converged
        factor = GeometricMultigrid(tolerance=1e-10).factor(problem.M)
        factor.solve(problem.f)
        counts.append((found.convergence.iterations, factor.iterations, found.r))
    assert abs(counts[0][0] - counts[1][0]) <= 4
    assert abs(counts[0][1] - counts[1][1]) <= 4
    assert np.abs(counts[0][2] - counts[1][2]).max() < 1e-7 * np.abs(counts[0][2]).max()


def test_rows_of_its_own(unstored):
    """A whole that is patched: smoothing leaves a solution alone, and ends at one."""
    A = model((4, 4, 4)).assemble().M.blocks
    node = np.array([3, 31, 32, 60])
    rows = Rows.of(A.stored(), node)
    own = PatchedOperator(A, rows)
    own.data[rows.indices == np.repeat(node, np.diff(rows.indptr))] *= 1.5
    own.inverse /= 1.5
    whole = own.stored()
    used = A.used.astype(float)
    x = np.cos(np.arange(3.0 * A.nodes)).reshape(-1, 3) * used
    b, y = np.empty_like(x), x.copy()
    whole.times(x, b)
    b *= used
    for backward in (False, True):
        own.smooth(b, y, np.zeros(A.nodes, dtype=bool), backward)
    np.testing.assert_allclose(y, x, atol=1e-12)
    y, r = np.empty_like(x), np.empty_like(x)
    own.first_smooth(b, y, r)
    zero = np.zeros_like(x)
    own.smooth(b, zero, np.zeros(A.nodes, dtype=bool), False)
    np.testing.assert_array_equal(y, zero)
    whole.times(y, x)
    np.testing.assert_allclose(r, (b - x) * used, atol=1e-12 * np.abs(b).max())


@pytest.mark.parametrize("cells", [(4, 6, 8), (2, 2, 2)])
def test_interpolation_in_a_box_without_a_matrix(cells):
    level = am.box(cells, cells).levels[0]
    shape = tuple(n + 1 for n in reversed(cells))
    none = np.empty(0, dtype=np.int64)
    stored, free = Transfer.nodal(level, none, none), Transfer.nodal(level, none, none, shape)
    rng = np.random.default_rng(0)
    coarse, fine = (rng.standard_normal((n, 3)) for n in level.shape[::-1])
    for P in (stored, free):
        out = fine.copy()
        P.add(coarse, out)
        np.testing.assert_allclose(out, fine + level @ coarse, atol=1e-14)
        P.restrict(fine, back := np.empty_like(coarse))
        np.testing.assert_allclose(back, level.T @ fine, atol=1e-13)
        few = np.where(fine[:, 1] > 1, fine[:, 0], 0.0)
        np.testing.assert_array_equal(P.restrict_few(few), P.scalar().T @ few)


def test_rigid_modes_are_those_of_the_stored_matrix(monkeypatch):
    expected = model((4, 4, 4)).assemble().near_nullspace
    monkeypatch.setattr(assembly, "GRID_FROM", 1)
    problem = model((4, 4, 4)).assemble()
    assert problem.near_nullspace is None and problem.is_mesh
    np.testing.assert_array_equal(problem.assembled().near_nullspace, expected)


def test_other_solvers_get_the_stored_matrix(unstored):
    problem = model().assemble()
    assert isinstance(problem.M, GridMatrix)
    solution = drive(problem, SemismoothNewton(), tolerance=1e-8)
    assert solution.converged
    assert drive(problem).converged


def test_w_of_many_contacts_comes_from_a_direct_factor(unstored, monkeypatch):
    """Cycles for each column would take far longer."""
    problem = model((8, 8, 2)).assemble()
    assert problem.contacts >= 60 and not problem.factor().exact
    with monkeypatch.context() as patch:
        patch.setattr(MultigridFactor, "solve", None)
        W = problem.matrices.delassus()
    H = problem.H.toarray()
    expected = H.T @ np.linalg.solve(problem.matrices.stored().toarray(), H)
    np.testing.assert_allclose(W, expected, atol=1e-12 * np.abs(expected).max())


def test_the_stored_matrix_comes_with_the_levels(monkeypatch):
    stored = model((8, 8, 4)).assemble()
    monkeypatch.setattr(assembly, "GRID_FROM", 1)
    problem = model((8, 8, 4)).assemble().assembled()
    assert len(problem.levels) == len(stored.levels) > 0
    for ours, theirs in zip(problem.levels, stored.levels, strict=True):
        assert abs(ours - theirs).max() == 0
