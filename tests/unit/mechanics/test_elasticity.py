"""Stiffness, loads and stresses: patch test, hand formulas, rates of convergence."""

import numpy as np
import pytest
from scipy.sparse.linalg import spsolve

import amontons as am
from amontons.mechanics.elements.elasticity import body_load, cell_stress, stiffness, von_mises
from amontons.mechanics.meshes.cells import CELLS
from amontons.mechanics.meshes.facets import Cells
from amontons.mechanics.meshes.surfaces import surface_load

ALL = [("hex", 3), ("tet", 3), ("quad", 2), ("tri", 2)]
MATERIALS = [am.LinearElastic(200, 0.3), am.LinearElastic(200, 0.3, plane="stress"),
             am.LinearElastic(7, -0.4)]  # fmt: skip


def distorted(kind, dim, cells=3, seed=0):
    """A unit box whose inner points are moved at random."""
    mesh = am.box((1,) * dim, cells, kind)
    inner = ((mesh.points > 0) & (mesh.points < 1)).all(axis=1)
    moved = mesh.points.copy()
    shift = np.random.default_rng(seed).uniform(-0.06, 0.06, moved.shape)
    moved[inner] += shift[inner]
    return am.Mesh(moved, mesh.cells, mesh.surfaces)


def hooke(material, gradient):
    """Stress (3, 3) of a displacement gradient (dim, dim), Hooke's law with E and nu."""
    dim = len(gradient)
    strain = np.zeros((3, 3))
    strain[:dim, :dim] = (gradient + gradient.T) / 2
    E, nu = material.young, material.poisson
    if dim == 2 and material.plane == "stress":
        strain[2, 2] = -nu / (1 - nu) * (strain[0, 0] + strain[1, 1])
    return E / (1 + nu) * (strain + nu / (1 - 2 * nu) * np.trace(strain) * np.eye(3))


@pytest.mark.parametrize(("kind", "dim"), ALL)
@pytest.mark.parametrize("material", MATERIALS, ids=["strain", "stress", "auxetic"])
def test_patch_test_on_distorted_meshes(kind, dim, material):
    mesh = distorted(kind, dim)
    gradient = np.random.default_rng(1).normal(size=(dim, dim))
    exact = mesh.points @ gradient.T + 0.3
    K = stiffness(mesh, material)
    outer = np.unique(np.concatenate([b.nodes.ravel() for b in mesh.boundary]))
    fixed = np.zeros(mesh.points.shape, bool)
    fixed[outer] = True
    fixed = fixed.ravel()
    K = K.tocsr()
    u = np.where(fixed, exact.ravel(), 0.0)
    u[~fixed] = spsolve(K[~fixed][:, ~fixed].tocsc(), -(K @ u)[~fixed])
    np.testing.assert_allclose(u, exact.ravel(), atol=1e-13)
    stress = cell_stress(mesh, material, u.reshape(exact.shape))
    expected = hooke(material, gradient)
    np.testing.assert_allclose(stress, np.tile(expected, (mesh.cell_count, 1, 1)), atol=1e-10)
    forces = (K @ u).reshape(exact.shape)[mesh.surface_nodes("right")].sum(axis=0)
    edges = np.zeros(dim)  # corners of the right side carry the forces of their neighbours too
    for name, facets in mesh.surfaces.items():
        normal = {"left": (0, -1), "right": (0, 1), "front": (1, -1), "back": (1, 1),
                  "bottom": (dim - 1, -1), "top": (dim - 1, 1)}[name]  # fmt: skip
        traction = np.tile(expected[:dim, normal[0]] * normal[1], (len(mesh.points), 1))
        load = surface_load(mesh.points, facets, traction)
        edges += load[mesh.surface_nodes("right")].sum(axis=0)
    np.testing.assert_allclose(forces, edges, atol=1e-11)


def hand_stiffness(points, kind, material, dim):
    """Stiffness of one cell by Voigt matrices, written apart from the library."""
    E, nu = material.young, material.poisson
    if dim == 3:
        lam, mu = E * nu / (1 + nu) / (1 - 2 * nu), E / 2 / (1 + nu)
        D = np.diag([2 * mu] * 3 + [mu] * 3)
        D[:3, :3] += lam
    elif material.plane == "strain":
        D = E / (1 + nu) / (1 - 2 * nu) * np.array(
            [[1 - nu, nu, 0], [nu, 1 - nu, 0], [0, 0, (1 - 2 * nu) / 2]])  # fmt: skip
    else:
        D = E / (1 - nu**2) * np.array([[1, nu, 0], [nu, 1, 0], [0, 0, (1 - nu) / 2]])
    g = 1 / np.sqrt(3)
    signs = np.array({
        "quad": [(-1, -1), (1, -1), (1, 1), (-1, 1)],
        "hex": [(-1, -1, -1), (1, -1, -1), (1, 1, -1), (-1, 1, -1),
                (-1, -1, 1), (1, -1, 1), (1, 1, 1), (-1, 1, 1)],
    }.get(kind, np.zeros((dim + 1, dim))))  # fmt: skip
    K = np.zeros((len(points) * dim,) * 2)
    for q in signs * g if kind in ("quad", "hex") else signs[:1]:
        if kind in ("quad", "hex"):
            factors = 1 + signs * q
            dN = np.stack([
                signs[:, k] * np.delete(factors, k, 1).prod(1) / 2**dim for k in range(dim)
            ], axis=1)  # fmt: skip
            weight = 1.0
        else:
            dN, weight = np.vstack([-np.ones(dim), np.eye(dim)]), 1 / (2 if dim == 2 else 6)
        J = points.T @ dN
        G = dN @ np.linalg.inv(J)
        B = np.zeros((3 if dim == 2 else 6, len(points) * dim))
        for a, slope in enumerate(G):
            if dim == 2:
                x, y = slope
                B[:, 2 * a : 2 * a + 2] = [[x, 0], [0, y], [y, x]]
            else:
                x, y, z = slope
                B[:, 3 * a : 3 * a + 3] = [
                    [x, 0, 0], [0, y, 0], [0, 0, z],
                    [y, x, 0], [0, z, y], [z, 0, x]]  # fmt: skip
        K += B.T @ D @ B * np.linalg.det(J) * weight
    return K


@pytest.mark.parametrize(("kind", "dim"), ALL)
@pytest.mark.parametrize("material", MATERIALS, ids=["strain", "stress", "auxetic"])
def test_one_distorted_cell_against_hand_formulas(kind, dim, material):
    cell = CELLS[kind]
    points = cell.corners + np.random.default_rng(2).uniform(-0.15, 0.15, cell.corners.shape)
    mesh = am.Mesh(points, (Cells(kind, np.arange(cell.nodes)[None]),))
    K = stiffness(mesh, material).toarray()
    expected = hand_stiffness(points, kind, material, dim)
    np.testing.assert_allclose(K, expected, atol=1e-13 * abs(expected).max())


@pytest.mark.parametrize("kind", ["wedge", "pyramid"])
def test_wedges_and_pyramids_take_linear_fields_exactly(kind):
    cell = CELLS[kind]
    mesh = am.Mesh(cell.corners, (Cells(kind, np.arange(cell.nodes)[None]),))
    material = am.LinearElastic(3, 0.25)
    gradient = np.random.default_rng(3).normal(size=(3, 3))
    u = mesh.points @ gradient.T
    energy = u.ravel() @ (stiffness(mesh, material) @ u.ravel())
    volume = 0.5 if kind == "wedge" else 1 / 3
    expected = (hooke(material, gradient) * gradient).sum() * volume
    assert energy == pytest.approx(expected, rel=1e-9)  # the apex is regularised
    np.testing.assert_allclose(cell_stress(mesh, material, u)[0], hooke(material, gradient))
    assert body_load(mesh, np.ones((len(u), 3))).sum() == pytest.approx(3 * volume)


@pytest.mark.parametrize(("kind", "dim"), ALL)
def test_rigid_motions_cost_nothing_and_the_matrix_is_symmetric(kind, dim):
    mesh = distorted(kind, dim)
    K = stiffness(mesh, am.LinearElastic(1, 0.3))
    assert abs(K - K.T).max() < 1e-14
    x = mesh.points - 0.2
    turn = np.stack([-x[:, 1], x[:, 0], *([0 * x[:, 0]] * (dim - 2))], axis=1)
    assert abs(K @ turn.ravel()).max() < 1e-14
    eigenvalues = np.linalg.eigvalsh(K.toarray())
    assert (eigenvalues > 1e-8).sum() == len(eigenvalues) - (3 if dim == 2 else 6)


@pytest.mark.parametrize(("kind", "dim"), ALL)
def test_second_order_convergence_to_a_manufactured_solution(kind, dim):
    material = am.LinearElastic(2.0, 0.25)
    lame, shear = material.lame_lambda(dim), material.shear

    def exact(x):  # the same bump in every component, zero on the boundary
        return np.repeat(np.sin(np.pi * x).prod(axis=1)[:, None], dim, axis=1)

    def force(x):
        s, c = np.sin(np.pi * x), np.cos(np.pi * x)
        bump = s.prod(axis=1)
        mixed = np.zeros_like(x)
        for i in range(dim):  # d_i div u = sum_j d_i d_j bump
            for j in range(dim):
                keep = [k for k in range(dim) if k not in (i, j)]
                rest = s[:, keep].prod(axis=1)
                mixed[:, i] += -bump if i == j else c[:, i] * c[:, j] * rest
        return np.pi**2 * (shear * dim * bump[:, None] - (lame + shear) * mixed)

    errors = []
    sizes = (4, 8, 16) if dim == 2 else (4, 8)
    for n in sizes:
        mesh = am.box((1,) * dim, n, kind)
        K = stiffness(mesh, material).tocsr()
        free = ((mesh.points > 1e-9) & (mesh.points < 1 - 1e-9)).all(axis=1).repeat(dim)
        u = np.zeros(mesh.points.size)
        load = body_load(mesh, force(mesh.points)).ravel()
        u[free] = spsolve(K[free][:, free].tocsc(), load[free])
        errors.append(np.abs(u.reshape(-1, dim) - exact(mesh.points)).max())
    assert np.log2(errors[-2] / errors[-1]) > 1.7


def test_tractions_and_body_forces_sum_up():
    mesh = am.box((2, 3, 4), 2, "tet")
    value = mesh.points * [1, 0, 0] + [0, 2, 0]
    load = surface_load(mesh.points, mesh.surface("top"), value)
    np.testing.assert_allclose(load.sum(axis=0), [6 * 1.0, 12, 0])  # mean of x is 1
    load = body_load(mesh, value)
    np.testing.assert_allclose(load.sum(axis=0), [24 * 1.0, 48, 0])
    with pytest.raises(am.InvalidInput, match="did you mean 'default'"):
        body_load(mesh, value, "defalt")


def test_materials_by_region():
    mesh = am.box((2, 1), (2, 1))
    nodes = mesh.cells[0].nodes
    two = am.Mesh(mesh.points, (Cells("quad", nodes[:1], "a"), Cells("quad", nodes[1:], "b")))
    soft, hard = am.LinearElastic(1, 0.2), am.LinearElastic(10, 0.2)
    mixed = stiffness(two, {"a": soft, "b": hard}).toarray()
    left = stiffness(two, soft).toarray()
    alone = np.flatnonzero(two.points[:, 0] == 0)  # nodes of region a only
    np.testing.assert_allclose(mixed[2 * alone], left[2 * alone])
    alone = np.flatnonzero(two.points[:, 0] == 2)
    np.testing.assert_allclose(mixed[2 * alone], 10 * left[2 * alone])
    u = two.points * [0.1, 0]
    stress = cell_stress(two, {"a": soft, "b": hard}, u)
    np.testing.assert_allclose(stress[1], 10 * stress[0], atol=1e-14)
    with pytest.raises(am.InvalidInput, match="for region 'b', got none"):
        stiffness(two, {"a": soft})
    with pytest.raises(am.InvalidInput, match="region 'c': not found, known: a, b"):
        stiffness(two, {"a": soft, "b": soft, "c": soft})


def test_von_mises_of_known_states():
    stress = np.zeros((3, 3, 3))
    stress[0] = np.diag([5.0, 0, 0])
    stress[1] = 4 * np.eye(3)
    stress[2, 0, 1] = stress[2, 1, 0] = 2.0
    np.testing.assert_allclose(von_mises(stress), [5, 0, 2 * np.sqrt(3)])


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ((0, 0.3), "young"),
        ((-1, 0.3), "young"),
        ((np.nan, 0.3), "young"),
        ((1, 0.5), "incompressible"),
        ((1, 0.7), "incompressible"),
        ((1, -1), "poisson"),
        ((1, np.nan), "poisson"),
        ((1, 0.3, "strian"), "plane"),
    ],
)
def test_bad_materials_are_rejected(arguments, words):
    with pytest.raises(am.InvalidInput, match=words):
        am.LinearElastic(*arguments)
