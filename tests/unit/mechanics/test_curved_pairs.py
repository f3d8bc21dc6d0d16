"""Fits of curved bodies: Lamé's pressure where an overlap is less than facets cut off."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import amontons as am
from amontons.mechanics.contact.mortar import mortar_contact, mortar_obstacle
from amontons.mechanics.contact.primitives import shapes_of
from amontons.mechanics.contact.segments import Surface
from amontons.mechanics.contact.turned import turned
from amontons.mechanics.meshes import second_order
from verify.press_fits import Fit, measured

HALF_PERCENT = 5e-3


# ------------------------------------------------------------------ the press fit in 3D
@pytest.mark.parametrize(
    "fit",
    [
        Fit((2, 9, 3), (2, 9, 3)), Fit((2, 9, 3), (2, 13, 4)), Fit((2, 13, 4), (2, 9, 3)),
        Fit((1, 5, 2), (1, 5, 2), order=2), Fit((1, 5, 2), (1, 7, 3), order=2),
        Fit((2, 6, 3), (2, 8, 4), "tet", order=2),
        Fit((2, 6, 3), (2, 8, 4), order=2, arcs=False),
        Fit((2, 9, 3), (2, 13, 4), slave="hub"), Fit((3, 10, 5), (3, 14, 7), uneven=0.25),
        Fit((1, 6, 2), (1, 8, 3), order=2, uneven=0.25),
    ],
)  # fmt: skip
def test_pressure_and_push_out_force_of_a_press_fit(fit):
    """Facets cut off up to 0.25 mm where the tubes overlap by 0.0025."""
    pressure, force = measured(fit)
    assert pressure == pytest.approx(6.1523, rel=HALF_PERCENT)
    assert force == pytest.approx(1468.9, rel=HALF_PERCENT)


def test_nitsche_has_the_same_press_fit():
    """Its pressure varies within a facet; the force is right."""
    first = Fit((2, 9, 3), (2, 13, 4), method="nitsche")
    second = Fit((1, 5, 2), (1, 7, 3), order=2, method="nitsche")
    assert measured(first, pushed=False)[0] == pytest.approx(6.1523, rel=1.1e-2)
    assert measured(second, pushed=False)[0] == pytest.approx(6.1523, rel=2e-3)


# ------------------------------------------------------------------ shapes
def surface_of(points, cells, name="top", kind=None):
    """The top of a block whose points (n, 3) are those of a function of (u, v)."""
    mesh = am.box((1, 1, 1), (*cells, 1), kind)
    top = np.isclose(mesh.points[:, 2], 1)
    x = mesh.points.copy()
    x[top] = points(x[top, 0], x[top, 1])
    return Surface.of(x, mesh.surface(name), name)


def cylinder(u, v):
    return np.c_[2 * np.sin(u - 0.5), v, 2 * np.cos(u - 0.5)]


def cone(u, v):
    r = 2 + 0.4 * v
    return np.c_[r * np.sin(u - 0.5), v, r * np.cos(u - 0.5)]


def ball(u, v):
    x, y = u - 0.5, v - 0.5
    return np.c_[x, y, np.sqrt(4 - x**2 - y**2)]


def ellipsoid(u, v):
    x, y = u - 0.5, v - 0.5
    return np.c_[x, y, 3 * np.sqrt(1 - x**2 - y**2 / 4)]


def flat(u, v):
    return np.c_[u, v, 1 + 0.2 * u]


def shapes(surface):
    return surface.shapes.every


@pytest.mark.parametrize("kind", ["hex", "tet"])
def test_shapes_are_found_wherever_they_lie(kind):
    turn = Rotation.from_rotvec([0.3, -1.1, 0.7]).as_matrix()
    for points, radius in ((cylinder, 2), (cone, None), (ball, 2)):

        def placed(u, v, points=points):
            return 1e3 * (points(u, v) @ turn.T) + [5, -70, 3e3]

        (shape,) = shapes(surface_of(placed, (5, 4), kind=kind))
        if radius is not None:
            assert shape.radius == pytest.approx(1e3 * radius, rel=1e-9)
            assert shape.taper == pytest.approx(0, abs=1e-9)
        assert (shape.axis is None) == (points is ball)
        if shape.axis is not None:
            assert abs(shape.axis @ turn[:, 1]) == pytest.approx(1)
        if points is cone:
            assert abs(shape.taper) == pytest.approx(0.4)


def test_two_rings_of_nodes_are_a_cylinder_and_no_ball():
    (shape,) = shapes(surface_of(cylinder, (5, 1)))
    assert shape.axis is not None


@pytest.mark.parametrize("points", [ellipsoid, flat])
def test_other_surfaces_are_left_as_they_are(points):
    assert not shapes(surface_of(points, (5, 4)))


def test_no_shape_goes_over_an_edge():
    """A block with a round top: that alone."""
    mesh = am.box((1, 1, 1), (6, 3, 2))
    x = mesh.points.copy()
    angle = np.pi / 2 * (x[:, 0] - 0.5)
    x[:, 0] = np.where(mesh.points[:, 2] == 1, 0.5 * np.sin(angle), x[:, 0] - 0.5)
    x[:, 2] = np.where(mesh.points[:, 2] == 1, 0.5 * np.cos(angle) + 1, x[:, 2])
    both = (*mesh.surface("top"), *mesh.surface("left"))
    surface = Surface.of(x, both, "both")
    (shape,) = shapes(surface)
    assert shape.radius == pytest.approx(0.5)
    assert set(surface.shapes.of) == {-1, 0}


def test_nodes_that_are_rounded_or_moved_by_less_than_facets_cut_off():
    rng = np.random.default_rng(1)
    sagitta = 2 * (1 - np.cos(0.1))

    def moved(amount):
        return lambda u, v: cylinder(u, v) * (1 + amount * rng.uniform(-1, 1, len(u)))[:, None]

    assert shapes(surface_of(moved(1e-3 * sagitta / 2), (5, 4)))
    assert not shapes(surface_of(moved(0.1 * sagitta), (5, 4)))


def test_the_distance_of_a_cone_goes_across_it():
    (shape,) = shapes(surface_of(cone, (5, 4)))
    out, slopes = shape.distance(np.array([0, 0.5, 3.0]))
    assert out == pytest.approx((3 - 2.2) / np.hypot(1, 0.4))
    assert np.linalg.norm(slopes) == pytest.approx(1)
    back = shape.along(np.array([[0, 0.5, 3.0]]), np.array([[0, 0, 1.0]]), np.zeros(1))
    assert back == pytest.approx(-0.8)


def test_a_line_of_facets_in_2d_is_a_circle():
    nodes = np.stack([np.arange(8), np.arange(1, 9)], axis=1)
    angle = np.linspace(0.2, 1.4, 9)
    x = np.c_[3 * np.cos(angle), 3 * np.sin(angle)]
    middle = (x[:-1] + x[1:]) / 2
    normal = middle / np.linalg.norm(middle, axis=1, keepdims=True)
    (shape,) = shapes_of(x, nodes, np.full(8, 2), normal).every
    assert (shape.radius, shape.side) == (pytest.approx(3), 1)
    (hollow,) = shapes_of(x, nodes, np.full(8, 2), -normal).every
    assert hollow.side == -1


# ------------------------------------------------------------------ gaps and frames
def test_gaps_of_uneven_facets_are_those_of_cylinders():
    """0.0025 where averaged normals of the same meshes would be off by as much."""
    for order in (1, 2):
        model = Fit((1, 9, 4), (1, 7, 3), order=order, uneven=0.25).model(0.0)
        inner, outer = (body.mesh for body in model.bodies)
        rows = mortar_contact(inner, "outer", outer, "inner")[0]
        np.testing.assert_allclose(rows.gap, -0.0025, rtol=0.02)


def test_uneven_facets_press_on_an_obstacle_as_the_true_ball():
    mesh = am.box((1, 1, 1), (4, 4, 1))
    x = mesh.points.copy()
    low = x[:, 2] == 0
    x[:, :2] -= 0.5
    x[:, :2] += 0.03 * np.sin(9 * x[:, [1, 0]])
    x[low, 2] = 3 - np.sqrt(9 - (x[low, :2] ** 2).sum(axis=1))
    ball = am.Mesh(x, mesh.cells, mesh.surfaces)
    socket = am.LevelSet(lambda x: 3.1 - np.linalg.norm(x - [0, 0, 3], axis=1))
    rows, _ = mortar_obstacle(ball, "bottom", socket)
    np.testing.assert_allclose(rows.gap, 0.1, rtol=2e-3)


def test_frames_turn_by_the_smallest_rotation():
    start = Rotation.from_rotvec([0.4, 0.1, -2]).as_matrix()
    turn = Rotation.from_rotvec(0.3 * start[1])  # about the first tangent
    found = turned(start, turn.apply(start[0]))
    np.testing.assert_allclose(found, turn.apply(start), atol=1e-15)


def test_forces_of_curved_fits_cancel():
    """Action and reaction: the sum of all forces is zero."""
    inner, outer = (second_order(mesh) for mesh in Fit((1, 5, 2), (1, 7, 3)).tubes())
    rows, on_master, _ = mortar_contact(inner, "outer", outer, "inner")
    r = np.random.default_rng(0).uniform(0, 1, rows.H.shape[1])
    one, other = (rows.H @ r).reshape(-1, 3), (on_master @ r).reshape(-1, 3)
    size = np.abs(one).sum()
    np.testing.assert_allclose(one.sum(axis=0) + other.sum(axis=0), 0, atol=1e-12 * size)
