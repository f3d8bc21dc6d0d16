"""The stiffness of a box without a matrix: the same as stored, in products, rows and solves."""

import numpy as np
import pytest
from scipy import sparse

import amontons as am
from amontons.linear import GeometricMultigrid
from amontons.linear.grid_matrix import GridMatrix
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


def test_other_solvers_get_the_stored_matrix(unstored):
    problem = model().assemble()
    assert isinstance(problem.M, GridMatrix)
    solution = drive(problem, SemismoothNewton(), tolerance=1e-8)
    assert solution.converged
    assert drive(problem).converged


def test_the_stored_matrix_comes_with_the_levels(monkeypatch):
    stored = model((8, 8, 4)).assemble()
    monkeypatch.setattr(assembly, "GRID_FROM", 1)
    problem = model((8, 8, 4)).assemble().assembled()
    assert len(problem.levels) == len(stored.levels) > 0
    for ours, theirs in zip(problem.levels, stored.levels, strict=True):
        assert abs(ours - theirs).max() == 0
