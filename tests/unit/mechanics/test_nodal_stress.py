"""Stress at nodes and in cells: exact for what the elements hold, and for laws by hand."""

import numpy as np
import pytest

import amontons as am
from amontons.mechanics.elements.nodal_stress import stress_of
from amontons.mechanics.meshes.order import second_order

E, NU = 200.0, 0.3
G = E / (2 * (1 + NU))
LAME = E * NU / ((1 + NU) * (1 - 2 * NU))


def mesh_of(kind, order=1):
    dim = 2 if kind in ("tri", "quad") else 3
    mesh = am.box((1.0,) * dim, 2, kind=kind) if kind != "pyramid" else pyramids()
    inner = np.abs(mesh.points - 0.5).max(axis=1) < 0.4
    points = mesh.points + 0.07 * np.sin(7 * mesh.points[:, ::-1]) * inner[:, None]
    mesh = am.Mesh(points, mesh.cells, mesh.surfaces)
    return second_order(mesh) if order == 2 else mesh


def pyramids():
    """The unit cube as six pyramids."""
    corners = np.array([(x, y, z) for z in (0, 1) for y in (0, 1) for x in (0, 1)], dtype=float)
    points = np.vstack([corners, np.full(3, 0.5)])
    sides = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    return am.Mesh(points, (am.Cells("pyramid", np.array([(*s, 8) for s in sides])),))


def hooke(gradient, plane="strain"):
    """By hand, (3, 3)."""
    dim = len(gradient)
    strain = np.zeros((3, 3))
    strain[:dim, :dim] = (gradient + gradient.T) / 2
    if plane == "stress":
        strain[2, 2] = -NU / (1 - NU) * (strain[0, 0] + strain[1, 1])
    return 2 * G * strain + LAME * np.trace(strain) * np.eye(3)


@pytest.mark.parametrize("kind", ["tri", "quad", "tet", "hex", "pyramid"])
@pytest.mark.parametrize("order", [1, 2])
def test_a_uniform_stress_with_shear_is_exact(kind, order):
    if kind == "pyramid" and order == 2:
        pytest.skip("no pyramids of second order")
    mesh = mesh_of(kind, order)
    gradient = np.random.default_rng(1).normal(size=(mesh.dim, mesh.dim))
    cells, nodes = stress_of(mesh, am.LinearElastic(E, NU), mesh.points @ gradient.T)
    for stress in (cells, nodes):
        np.testing.assert_allclose(stress, np.broadcast_to(hooke(gradient), stress.shape),
                                   atol=1e-10 * E)  # fmt: skip


def test_plane_stress_has_none_across():
    mesh, gradient = mesh_of("quad"), np.array([[0.01, 0.02], [-0.005, 0.03]])
    law = am.LinearElastic(E, NU, plane="stress")
    for stress in stress_of(mesh, law, mesh.points @ gradient.T):
        wanted = np.broadcast_to(hooke(gradient, "stress"), stress.shape)
        np.testing.assert_allclose(stress, wanted, atol=1e-12 * E)


@pytest.mark.parametrize("kind", ["tri", "quad", "tet", "hex"])
def test_second_order_bends_exactly(kind):
    """Quadratic displacements: the stress at nodes is linear, and exact there."""
    dim = 2 if kind in ("tri", "quad") else 3
    mesh = second_order(am.box((1.0,) * dim, 2, kind=kind))
    x = mesh.points
    u = np.zeros_like(x)
    u[:, 0], u[:, 1] = x[:, 0] * x[:, 1], -0.5 * x[:, 0] ** 2 + 0.3 * x[:, 1] ** 2
    _, nodes = stress_of(mesh, am.LinearElastic(E, NU), u)
    for point, stress in zip(x, nodes, strict=True):
        gradient = np.zeros((dim, dim))
        gradient[0, :2] = point[1], point[0]
        gradient[1, :2] = -point[0], 0.6 * point[1]
        np.testing.assert_allclose(stress, hooke(gradient), atol=1e-9 * E)


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("order", [1, 2])
def test_cauchy_stress_of_a_uniform_stretch_by_hand(dim, order):
    """Neo-Hookean: sigma_i = (G (l_i^2 - 1) + lame ln J) / J for principal stretches l_i."""
    mesh = mesh_of("quad" if dim == 2 else "hex", order)
    stretch = np.array([1.3, 0.8, 1.1])[:dim]
    cells, nodes = stress_of(mesh, am.NeoHookean(E, NU), mesh.points * (stretch - 1))
    full = np.ones(3)
    full[:dim] = stretch
    J = full.prod()
    wanted = np.diag((G * (full**2 - 1) + LAME * np.log(J)) / J)
    for stress in (*cells, *nodes):
        np.testing.assert_allclose(stress, wanted, atol=1e-11 * E)


def test_a_node_between_two_regions_has_the_mean():
    mesh = am.box((1, 1), (2, 1))
    (block,) = mesh.cells
    two = am.Mesh(mesh.points, (am.Cells("quad", block.nodes[:1], "soft"),
                                am.Cells("quad", block.nodes[1:], "hard")))  # fmt: skip
    laws = {"soft": am.LinearElastic(E, NU), "hard": am.LinearElastic(3 * E, NU)}
    gradient = np.array([[0.01, 0.0], [0.0, 0.0]])
    cells, nodes = stress_of(two, laws, two.points @ gradient.T)
    xx = hooke(gradient)[0, 0]
    np.testing.assert_allclose(cells[:, 0, 0], [xx, 3 * xx])
    wanted = np.select([two.points[:, 0] < 0.25, two.points[:, 0] > 0.75], [xx, 3 * xx], 2 * xx)
    np.testing.assert_allclose(nodes[:, 0, 0], wanted)


def test_cells_turned_over_at_a_corner_still_have_stresses():
    """The centre is fine, a corner is not: the mean of the centres is written there."""
    mesh = am.box((1, 1), 1)
    u = np.zeros_like(mesh.points)
    corner = np.flatnonzero(mesh.points.sum(axis=1) == 2)
    u[corner] = -0.9
    cells, nodes = stress_of(mesh, am.NeoHookean(E, NU), u)
    np.testing.assert_allclose(nodes, np.broadcast_to(cells[0], nodes.shape))
