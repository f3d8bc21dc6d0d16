"""Element loops against truths that need no other code: modes, energies, a beam, patterns."""

from itertools import product
from math import factorial

import numpy as np
import pytest
from scipy.sparse.linalg import spsolve

import amontons as am
from amontons.mechanics.elements import stiffness
from amontons.mechanics.elements.hyperelasticity import HyperelasticBody
from amontons.mechanics.elements.pattern import node_pattern
from amontons.mechanics.meshes import Cells, second_order
from amontons.mechanics.meshes.cells import CELLS
from amontons.mechanics.meshes.quadratic_cells import gauss
from amontons.mechanics.meshes.surfaces import surface_load

KINDS = [(kind, dim, order) for kind, dim in (("tri", 2), ("quad", 2), ("tet", 3), ("hex", 3))
         for order in (1, 2)]  # fmt: skip
LAW = am.LinearElastic(200, 0.3)


def mesh_of(kind, dim, order, *, sheared=True, cells=2):
    """A box under an affine map: quadratic fields are quadratic in the cells too."""
    mesh = am.box((1,) * dim, cells, kind)
    slope = np.eye(dim) + 0.2 * sheared * np.random.default_rng(0).normal(size=(dim, dim))
    mesh = am.Mesh(mesh.points @ slope.T, mesh.cells, mesh.surfaces)
    return second_order(mesh) if order == 2 else mesh


@pytest.mark.parametrize(("kind", "dim", "order"), KINDS)
def test_the_null_space_is_that_of_rigid_motions(kind, dim, order):
    mesh = mesh_of(kind, dim, order, cells=1)
    K = stiffness(mesh, LAW)
    assert abs(K - K.T).max() == 0.0
    values, vectors = np.linalg.eigh(K.toarray())
    count = {2: 3, 3: 6}[dim]
    assert values[count - 1] < 1e-12 * values[-1] < 1e-6 * values[-1] < values[count]
    x = mesh.points - mesh.points.mean(axis=0)
    for i in range(dim):
        for j in range(i + 1):
            mode = np.zeros_like(x)
            if i == j:
                mode[:, i] = 1.0
            else:
                mode[:, i], mode[:, j] = x[:, j], -x[:, i]
            inside = vectors[:, :count] @ (vectors[:, :count].T @ mode.ravel())
            np.testing.assert_allclose(inside, mode.ravel(), atol=1e-10)


def exact_energy(mesh, law, field):
    """Twice the energy of a polynomial displacement, by differences in 4^dim points a cell.

    field maps points (..., dim); its gradient is exact for quadratic fields.
    """
    total, step = 0.0, 1e-3
    dim = mesh.dim
    for block in mesh.cells:
        cell = CELLS[block.kind]
        for at, weight in zip(*gauss(dim, block.kind[:3] in ("tri", "tet"), 4), strict=True):
            coordinates = mesh.points[block.nodes]
            x = np.einsum("a,kac->kc", cell.shape(at), coordinates)
            volume = weight * np.linalg.det(cell.jacobians(coordinates, at))
            slope = np.stack([
                (field(x + h) - field(x - h)) / (2 * step) for h in step * np.eye(dim)
            ], axis=2)  # fmt: skip
            strain = (slope + slope.swapaxes(1, 2)) / 2
            trace = np.trace(strain, axis1=1, axis2=2)
            density = 2 * law.shear * (strain**2).sum(axis=(1, 2))
            total += volume @ (density + law.lame_lambda(dim) * trace**2)
    return total


@pytest.mark.parametrize("plane", ["strain", "stress"])
@pytest.mark.parametrize(("kind", "dim", "order"), KINDS)
def test_energies_of_polynomial_fields_are_exact(kind, dim, order, plane):
    mesh, law = mesh_of(kind, dim, order), am.LinearElastic(200, 0.3, plane=plane)
    rng = np.random.default_rng(1)
    A, G = rng.normal(size=(dim, dim, dim)), rng.normal(size=(dim, dim))

    def field(x):
        return (order - 1) * np.einsum("ijk,nj,nk->ni", A, x, x) + x @ G.T

    u = field(mesh.points).ravel()
    assert u @ (stiffness(mesh, law) @ u) == pytest.approx(
        exact_energy(mesh, law, field), rel=1e-9
    )


@pytest.mark.parametrize(("kind", "dim"), [("tri", 2), ("quad", 2), ("tet", 3), ("hex", 3)])
def test_a_bent_beam(kind, dim):
    """Pure bending by a linear traction: u = k x y, v = -k (x^2 + nu (y^2 - z^2)) / 2, ..."""
    k, law = 1e-3, am.LinearElastic(200, 0.3, plane="stress")
    size, cells = ((4, 1), (4, 1)) if dim == 2 else ((4, 1, 1), (4, 1, 1))
    mesh = second_order(am.box(size, cells, kind))
    x, y, *z = mesh.points.T
    y = y - 0.5
    z = z[0] - 0.5 if dim == 3 else 0.0 * y
    parts = [k * x * y, -k * (x**2 + law.poisson * (y**2 - z**2)) / 2, -k * law.poisson * y * z]
    exact = np.stack(parts[:dim], axis=1)
    traction = np.zeros_like(mesh.points)
    traction[:, 0] = law.young * k * y
    load = surface_load(mesh.points, mesh.surface("right"), traction).ravel()
    held = np.zeros(mesh.points.shape, dtype=bool)
    held[mesh.surface_nodes("left")] = True
    free = ~held.ravel()
    K = stiffness(mesh, law).tocsr()
    u = exact.ravel().copy()
    u[free] = spsolve(K[free][:, free].tocsc(), (load - K[:, ~free] @ u[~free])[free])
    np.testing.assert_allclose(u, exact.ravel(), atol=1e-12)


def test_a_cantilever_has_the_deflection_of_timoshenko():
    """Plane stress, L = 10, h = 1: P L^3 / (3 E I) + 6 P L / (5 G h), to a part in 300."""
    law = am.LinearElastic(1000, 0.25, plane="stress")
    mesh = second_order(am.box((10, 1), (40, 4)))
    traction = np.zeros_like(mesh.points)
    y = mesh.points[:, 1] - 0.5
    traction[:, 1] = 1.5 * (1 - 4 * y**2)  # the shear of a beam, resultant 1
    load = surface_load(mesh.points, mesh.surface("right"), traction).ravel()
    free = np.ones(mesh.points.shape, dtype=bool)
    free[mesh.surface_nodes("left")] = False
    free = free.ravel()
    u = np.zeros(mesh.points.size)
    K = stiffness(mesh, law).tocsr()
    u[free] = spsolve(K[free][:, free].tocsc(), load[free])
    tip = u[1::2][mesh.surface_nodes("right")].mean()
    assert tip == pytest.approx(10**3 / (3 * 1000 / 12) + 1.2 * 10 / 400, rel=1 / 300)


@pytest.mark.parametrize(("kind", "dim", "order"), KINDS)
def test_the_tangent_at_rest_is_the_stiffness(kind, dim, order):
    mesh = mesh_of(kind, dim, order)
    K = stiffness(mesh, LAW)
    body = HyperelasticBody(mesh, am.NeoHookean(LAW.young, LAW.poisson))
    forces, blocks = body.tangent(np.zeros_like(mesh.points))
    assert np.abs(blocks - K.data).max() < 1e-13 * np.abs(K.data).max()
    assert np.array_equal(body.columns, K.indices) and np.array_equal(body.pointers, K.indptr)
    assert np.abs(forces).max() < 1e-13 * LAW.young


def test_the_pattern_of_mixed_cells_is_that_of_all_pairs():
    mesh = am.box((2, 1, 1), (2, 1, 1))
    first, second = mesh.cells[0].nodes
    wedges = np.array([second[[0, 1, 2, 4, 5, 6]], second[[0, 2, 3, 4, 6, 7]]])
    cells = (Cells("hex", first[None]), Cells("wedge", wedges))
    n = len(mesh.points)
    pairs = [b.nodes[:, :, None] * n + b.nodes[:, None, :] for b in cells]
    keys = np.unique(np.concatenate([p.ravel() for p in pairs]))
    pointers, columns = node_pattern(cells, n)
    rows = np.repeat(np.arange(n), np.diff(pointers))
    np.testing.assert_array_equal(rows * n + columns, keys)


@pytest.mark.parametrize(("kind", "rule", "degree", "count"), [
    ("tri", "stiffness", 1, 1), ("tet", "stiffness", 1, 1), ("tri6", "stiffness", 2, 3),
    ("tet10", "stiffness", 2, 4), ("tri6", "gauss", 5, 9), ("tet10", "gauss", 5, 14),
])  # fmt: skip
def test_rules_on_simplices_are_exact_to_their_degree(kind, rule, degree, count):
    points, weights = getattr(CELLS[kind], rule)
    assert len(weights) == count and (weights > 0).all()
    assert (points > 0).all() and (points.sum(axis=1) < 1).all()
    for powers in product(range(degree + 1), repeat=CELLS[kind].dim):
        if sum(powers) <= degree:
            exact = np.prod([factorial(p) for p in powers]) / factorial(
                sum(powers) + CELLS[kind].dim
            )
            assert weights @ (points**powers).prod(axis=1) == pytest.approx(exact, rel=1e-13)
