"""How contact surfaces are laid flat in figures: what is kept, and what is left out."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import amontons as am
from amontons.io.plots.contact_pairs import contact_pairs
from amontons.io.plots.surface_maps import _node_patches
from amontons.io.plots.surface_views import Projection, Unrolled, view_of

RADIUS, UP = 3.0, np.array([0.0, 0.0, 1.0])


def on_a_cone(slope, angles, *, inwards=False):
    """Points and outward normals around the z axis, at three heights."""
    angle, height = (a.ravel() for a in np.meshgrid(angles, [0.0, 1.0, 2.0]))
    out = np.column_stack([np.cos(angle), np.sin(angle), np.zeros_like(angle)])
    points = (RADIUS + slope * height)[:, None] * out + height[:, None] * UP
    normals = (out - slope * UP) / np.hypot(1, slope)
    return points, -normals if inwards else normals, angle, height


@pytest.mark.parametrize("inwards", [False, True])
def test_lays_a_cylinder_flat_without_stretching_it(inwards):
    turned = Rotation.from_rotvec([0.3, -1.1, 0.7]).as_matrix()
    points, normals, angle, height = on_a_cone(0.0, np.arange(-1.5, 2.2, 0.05), inwards=inwards)
    view = view_of(points @ turned.T + [5, -4, 2], normals @ turned.T)
    assert isinstance(view, Unrolled)
    assert view.names == ("arc around the axis", "along the axis")
    flat = view.laid(points[:, None] @ turned.T + [5, -4, 2])[:, 0]
    lengths = np.linalg.norm(flat[:, None] - flat, axis=2)
    arcs = np.hypot(RADIUS * (angle[:, None] - angle), height[:, None] - height)
    np.testing.assert_allclose(lengths, arcs, atol=1e-10)


def test_vectors_turn_with_the_surface():
    points, normals, angle, _ = on_a_cone(0.2, np.arange(-2.9, 3.0, 0.1))
    view = view_of(points, normals)
    assert view.names == ("arc around z from x", "z")
    around = np.cross(UP, normals)
    along = view.turned(points, 2.0 * around / np.linalg.norm(around, axis=1)[:, None] + UP)
    np.testing.assert_allclose(along, np.tile([2.0, 1.0], (len(points), 1)), atol=1e-12)
    arc = view.laid(points[:, None])[:, 0, 0] / view.radius
    np.testing.assert_allclose(arc, angle, atol=1e-12)


def test_projects_what_turns_around_no_axis():
    cube = np.vstack([np.eye(3)[:2], -np.eye(3)[:2]])
    around = np.repeat(cube, 3, axis=0)
    along = np.cross(UP, around)
    offsets = np.tile([-0.9, 0.0, 0.9], 4)[:, None]
    heights = np.tile([0.0, 1.0, 0.5], 4)[:, None] * UP
    assert isinstance(view_of(around + offsets * along + heights, around), Projection)
    ball = np.random.default_rng(1).normal(size=(50, 3))
    ball /= np.linalg.norm(ball, axis=1)[:, None]
    assert isinstance(view_of(2.0 * ball, ball), Projection)


def test_leaves_out_the_far_side_of_a_body():
    steel = am.LinearElastic(2e5, 0.3)
    angles = np.linspace(0, 2 * np.pi, 17)
    roller = am.Body(am.ring([0.5, 1.0], angles, [0, 1]), steel, name="roller")
    plane = am.Plane((1, 0, 0), point=(-1.0, 0, 0))
    model = am.Model(
        [roller],
        supports=[am.Fix("inner", (-0.01, 0.001, 0))],
        contacts=[am.Contact("outer", plane, mu=0.2, method="mortar")],
    )
    solution = am.solve(model)
    (pair,) = contact_pairs(solution.solution, solution.fields, model)
    view = view_of(pair.points, pair.frames[:, 0])
    patches, owner = _node_patches(model, pair, view)
    assert len(patches) == 4 * 16  # all facets have contacts here
    near = pair.node[pair.points[:, 0] < -0.9]
    kept = np.isin(pair.node, near)
    less = type(pair)(**{
        name: value[kept] if isinstance(value, np.ndarray) else value
        for name, value in vars(pair).items()
    })  # fmt: skip
    patches, owner = _node_patches(model, less, view_of(less.points, less.frames[:, 0]))
    assert 0 < len(patches) < 4 * 5
    assert set(owner[owner >= 0]) == set(range(len(near)))
