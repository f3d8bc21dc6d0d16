"""Curved surfaces over their facets: exact for second order, circles, spheres, edges."""

import numpy as np
import pytest

import amontons as am
from amontons.mechanics.contact.curvature import heights, slopes, surface_normals
from amontons.mechanics.contact.mortar import mortar_contact, mortar_obstacle
from amontons.mechanics.contact.segments import Surface


def mapped(mesh, position):
    return am.Mesh(position(mesh.points), mesh.cells, mesh.surfaces)


def ring(inside, outside, around, layers=0):
    """A quarter of a ring about the origin, the last axis its own."""
    size, cells = ((1, 1), (1, around)) if not layers else ((1, 1, 0.3), (1, around, layers))

    def position(x):
        r, angle = inside + (outside - inside) * x[:, 0], np.pi / 2 * x[:, 1]
        return np.column_stack([r * np.cos(angle), r * np.sin(angle), x[:, 2:]])

    return mapped(am.box(size, cells), position)


def cap(radius, height, cells, kind, up):
    """A block whose bottom (top) is a piece of a sphere of that radius about its pole."""

    def position(x):
        x = x - [0.5, 0.5, 0]
        square = (x[:, :2] ** 2).sum(axis=1)
        sag = radius - np.sqrt(radius**2 - square)
        face = np.isclose(x[:, 2], 1 if up else 0)
        return x + np.column_stack([0 * x[:, :2], face * (-sag if up else sag) + height])

    return mapped(am.box((1, 1, 1), cells, kind), position)


def test_second_order_is_exact():
    rng = np.random.default_rng(0)
    matrix = rng.normal(size=(2, 2))
    matrix = matrix + matrix.T
    x = np.array([[0, 0], [1, 0.2], [1.3, 1.1], [-0.1, 0.9]])

    def z(x):
        return np.einsum("...i,ij,...j->...", x, matrix, x) / 2 + x @ [0.3, -0.1]

    phi = rng.uniform(0.1, 1, (1, 6, 4))
    phi /= phi.sum(axis=2, keepdims=True)
    slope = x @ matrix + [0.3, -0.1]
    found = heights(phi, slope[None], x[None])[0]
    np.testing.assert_allclose(found, z(phi[0] @ x) - phi[0] @ z(x), atol=1e-14)


@pytest.mark.parametrize("layers", [0, 2])
@pytest.mark.parametrize(("slave", "master"), [(7, 11), (16, 9)])
def test_gaps_between_rings_are_those_of_circles(slave, master, layers):
    """Facets alone would be wrong by up to 1 - cos(pi / 4 / 7) = 0.6 per cent of the radius."""
    inner, outer = ring(0.5, 1.0, slave, layers), ring(1.01, 1.5, master, layers and layers + 1)
    rows, _, found = mortar_contact(inner, "right", outer, "left")
    assert found.all()
    np.testing.assert_allclose(rows.gap, 0.01, atol=1.5e-4)
    finer = [ring(0.5, 1.0, 2 * slave, layers), ring(1.01, 1.5, 2 * master, layers and 1)]
    gap = mortar_contact(finer[0], "right", finer[1], "left")[0].gap
    np.testing.assert_allclose(gap, 0.01, atol=1.5e-5)


@pytest.mark.parametrize("kind", ["hex", "tet"])
def test_a_ball_in_its_socket(kind):
    """Upper bottom and lower top on concentric spheres of radius 2 and 2.01, flat 3e-3 off."""
    upper = cap(2.0, 0.0, (5, 5, 1), kind, up=False)
    lower = mapped(am.box((1, 1, 1), (8, 7, 1), kind), lambda x: x - [0.5, 0.5, 1])
    square = (lower.points[:, :2] ** 2).sum(axis=1)
    z = 2.0 - np.sqrt(2.01**2 - square)
    lower = mapped(
        lower, lambda x: np.column_stack([x[:, :2], np.where(x[:, 2] == 0, z, x[:, 2])])
    )
    gap = mortar_contact(upper, "bottom", lower, "top")[0].gap
    np.testing.assert_allclose(gap, 0.01, atol=6e-4)
    assert abs(gap - 0.01).mean() < 2e-4


def test_normals_reach_the_rim():
    """Also at corners: the pole of an eighth of a sphere."""
    mesh = cap(2.0, 0.0, (6, 6, 1), "hex", up=False)
    normals = surface_normals(mesh.points, mesh.surface("bottom"))
    on = mesh.surface_nodes("bottom")
    exact = mesh.points[on] - [0, 0, 2.0]
    exact /= np.linalg.norm(exact, axis=1, keepdims=True)
    assert abs(normals[on] - exact).max() < 2e-3


def test_edges_and_planes_stay_what_they_are():
    roof = mapped(
        am.box((2, 1), (6, 2)),
        lambda x: x + np.outer(abs(x[:, 0] - 1) * (x[:, 1] == 0), [0, 0.3]),
    )
    for name in ("bottom", "top"):
        surface = Surface.of(roof.points, roof.surface(name), name)
        np.testing.assert_allclose(surface.slopes, 0, atol=1e-14)
    folded = Surface.of(roof.points, (*roof.surface("bottom"), *roof.surface("left")), "both")
    np.testing.assert_allclose(folded.slopes, 0, atol=1e-14)


def test_obstacles_see_the_curved_surface():
    """A disc on a plane: averages of the gap of the circle, not of its chords."""
    mesh = ring(0.5, 1.0, 8)
    rows, _ = mortar_obstacle(mesh, "right", am.Sphere((0, 0), 0.9))
    np.testing.assert_allclose(rows.gap, 0.1, atol=1e-4)


def test_slopes_of_a_circle():
    mesh = ring(0.5, 1.0, 3)
    surface = Surface.of(mesh.points, mesh.surface("right"), "right")
    again = slopes(mesh.points, surface.blocks, surface.nodes, surface.real, surface.normal)
    np.testing.assert_array_equal(again, surface.slopes)
    assert np.linalg.norm(again, axis=2).max() == pytest.approx(np.tan(np.pi / 12), rel=1e-6)
