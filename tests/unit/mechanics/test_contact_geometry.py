"""Obstacles: gaps, normals, local frames; nodal contact rows."""

import numpy as np
import pytest

import amontons as am
from amontons.mechanics.contact import frames, nodal_contact

RNG = np.random.default_rng(0)


@pytest.mark.parametrize("dim", [2, 3])
def test_frames_are_right_handed_and_orthonormal(dim):
    normals = RNG.normal(size=(200, dim))
    normals[:dim], normals[dim : 2 * dim] = np.eye(dim), -np.eye(dim)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    axes = frames(normals)
    np.testing.assert_array_equal(axes[:, 0], normals)
    np.testing.assert_allclose(
        axes @ axes.swapaxes(1, 2), np.tile(np.eye(dim), (200, 1, 1)), atol=1e-14
    )
    sign = 1 if dim == 3 else -1  # in 2D the tangent is the normal turned clockwise
    np.testing.assert_allclose(np.linalg.det(axes), sign)


def test_frames_of_the_usual_normals():
    np.testing.assert_array_equal(frames(np.array([[0.0, 1]]))[0], [[0, 1], [1, 0]])
    np.testing.assert_array_equal(
        frames(np.array([[0.0, 0, 1]]))[0], [[0, 0, 1], [1, 0, 0], [0, 1, 0]]
    )


def test_plane_takes_any_length_of_normal():
    plane = am.Plane(normal=(0, 0, 5), point=(9, 9, 1))
    points = RNG.normal(size=(7, 3))
    np.testing.assert_allclose(plane.gap(points), points[:, 2] - 1)
    np.testing.assert_allclose(plane.normals(points), [[0, 0, 1]] * 7)
    slope = am.Plane(normal=(3, 4))
    assert slope.gap(np.array([[3.0, 4.0]]))[0] == pytest.approx(5)


def test_sphere_and_disc():
    ball = am.Sphere(center=(0, 0, -2), radius=2)
    np.testing.assert_allclose(ball.gap(np.array([[0, 0, 0.5], [0, 0, -1]])), [0.5, -1])
    np.testing.assert_allclose(ball.normals(np.array([[3.0, 0, -2]])), [[1, 0, 0]])
    disc = am.Sphere(center=(1, 1), radius=1)
    np.testing.assert_allclose(disc.gap(np.array([[4.0, 5.0]])), [4])


@pytest.mark.parametrize("scale", [1e-6, 1.0, 1e6])
@pytest.mark.parametrize("shape", [am.Plane((1, 2, 2), (0.1, 0, 0)), am.Sphere((1, 2, 3), 0.7)])
def test_level_set_agrees_with_the_exact_shapes(shape, scale):
    points = scale * RNG.normal(size=(50, 3))
    function = lambda x: scale * shape.gap(x / scale)  # noqa: E731
    level = am.LevelSet(function)
    np.testing.assert_allclose(
        level.gap(points), function(points), rtol=1e-8, atol=1e-9 * scale
    )
    np.testing.assert_allclose(level.normals(points), shape.normals(points / scale), atol=1e-8)


def test_level_set_with_its_own_gradient_and_any_slope():
    level = am.LevelSet(lambda x: 10 * x[:, 1], lambda x: np.tile([0.0, 10.0], (len(x), 1)))
    np.testing.assert_allclose(level.gap(np.array([[5.0, 0.3]])), [0.3])
    np.testing.assert_allclose(level.normals(np.array([[5.0, 0.3]])), [[0, 1]])


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: am.Plane((0, 0, 0)), "length > 0"),
        (lambda: am.Plane((0, 1, 0, 0)), "normal"),
        (lambda: am.Plane((0, np.nan, 0)), "normal"),
        (lambda: am.Plane((0, 1), (0, 0, 1)), "point"),
        (lambda: am.Sphere((0, 0, 0), -1), "radius"),
        (lambda: am.Sphere((0, 0, 0), np.inf), "radius"),
        (lambda: am.Sphere((0,), 1), "center"),
        (lambda: am.LevelSet("x"), "callable"),
        (lambda: am.LevelSet(np.sin, 3), "callable"),
        (lambda: am.Plane((0, 1)).gap(np.zeros((4, 3))), "2D, the mesh in 3D"),
        (lambda: am.Sphere((0, 1), 1).normals(np.array([[0.0, 1.0]])), "no normal"),
        (lambda: am.LevelSet(lambda x: x).gap(np.ones((4, 2))), "expected values of shape"),
        (lambda: am.LevelSet(lambda x: x[:, 0] * np.nan).gap(np.ones((4, 2))), "finite"),
        (lambda: am.LevelSet(lambda x: 0 * x[:, 0]).gap(np.ones((4, 2))), "gradient is zero"),
        (
            lambda: am.LevelSet(lambda x: x[:, 0], lambda x: x[:, 0]).gap(np.ones((4, 2))),
            "gradient",
        ),
    ],
)
def test_bad_obstacles_are_rejected(make, words):
    with pytest.raises(am.InvalidInput, match=words):
        make()


def test_nodal_rows_measure_gap_and_slip():
    mesh = am.box((1, 1, 1), 3, "tet")
    rows = nodal_contact(mesh, "bottom", am.Plane((0, 0, 1), (0, 0, -0.1)))
    assert rows.weights.sum() == pytest.approx(1)
    np.testing.assert_allclose(rows.gap, 0.1)
    move = RNG.normal(size=mesh.points.shape)
    local = (rows.H.T @ move.ravel()).reshape(-1, 3)
    np.testing.assert_allclose(local, move[rows.nodes][:, [2, 0, 1]])


def test_inner_surfaces_are_no_slaves():
    mesh = am.box((1, 1, 1), 2)
    middle = [b for b in mesh.cells]
    inner = am.Facets("quad", middle[0].nodes[:4, 4:])
    glued = am.Mesh(mesh.points, mesh.cells, {"middle": (inner,)})
    with pytest.raises(am.InvalidInput, match="between two cells"):
        nodal_contact(glued, "middle", am.Plane((0, 0, 1)))
