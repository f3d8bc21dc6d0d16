"""Shapes of rigid bodies, and where they meet."""

import itertools
from xml.etree import ElementTree

import meshio
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from PIL import Image
from scipy.optimize import linprog
from scipy.spatial.transform import Rotation

import amontons as am
from amontons.io.plots.rigid_film import rigid_figures
from amontons.io.plots.style import Units
from amontons.mechanics.multibody import Ball, Polyhedron, RigidBodies, RigidBody, cuboid
from amontons.mechanics.multibody.apart import edges_apart
from amontons.mechanics.multibody.meeting import meetings


def test_a_cuboid_has_volume_and_inertia_of_the_books():
    shape = cuboid((2.0, 3.0, 4.0))
    assert shape.volume == pytest.approx(24)
    np.testing.assert_allclose(shape.centre, 0, atol=1e-14)
    np.testing.assert_allclose(shape.inertia, 24 / 12 * np.diag([25, 20, 13]), atol=1e-12)
    assert len(shape.facets.normals) == 6 and len(shape.facets.edges) == 12
    assert all(len(loop) == 4 for loop in shape.facets.loops)


def test_a_tetrahedron_has_its_moments_wherever_it_lies():
    """Of the corner tetrahedron: volume 1/6, centre 1/4; second moments 1/60 and 1/120."""
    corner = np.vstack([np.zeros(3), np.eye(3)])
    shape = Polyhedron(corner + [5.0, -2.0, 1.0])
    assert shape.volume == pytest.approx(1 / 6)
    np.testing.assert_allclose(shape.centre, np.array([5.25, -1.75, 1.25]))
    second = np.full((3, 3), 1 / 120) + np.eye(3) / 120 - np.full((3, 3), 1 / 96)
    np.testing.assert_allclose(shape.inertia, np.trace(second) * np.eye(3) - second, atol=1e-14)


def test_faces_look_outwards_and_turn_anticlockwise():
    rng = np.random.default_rng(4)
    shape = Polyhedron(rng.standard_normal((20, 3)))
    facets, points = shape.facets, shape.points
    for normal, offset, loop in zip(facets.normals, facets.offsets, facets.loops, strict=True):
        assert (points @ normal <= offset + 1e-12).all()
        a, b, c = points[loop[:3]]
        assert np.cross(b - a, c - b) @ normal > 0


CORNER = np.vstack([np.zeros(3), np.eye(3)])


@pytest.mark.parametrize(
    "points",
    [np.zeros((3, 3)), np.eye(4)[:, :3] * [1, 1, 0], CORNER * 1e200, CORNER * 1e-200],
)
def test_points_in_a_plane_are_refused(points):
    with pytest.raises(am.InvalidInput, match="points"):
        Polyhedron(points)


@pytest.mark.parametrize("grid", [2, 5])
def test_faces_whose_coordinates_were_rounded_are_whole(grid):
    """Taken for two triangles, a face carried on one of them alone, and a stack rocked."""
    at = np.array(list(itertools.product(np.linspace(-0.5, 0.5, grid), repeat=3)))
    turn = Rotation.from_euler("xyz", [0.3, 0.2, 0.5])
    shape = Polyhedron(np.round(turn.apply(at * [0.4, 0.4, 0.2]), 6))
    assert len(shape.facets.loops) == 6
    assert shape.volume == pytest.approx(0.032, rel=1e-4)
    flat = np.roll(turn.inv().as_quat(), 1)
    bodies = [
        RigidBody(shape, position=(0.02 * k, 0, 0.1 + 0.2 * k), orientation=flat)
        for k in range(2)
    ]
    *_, last = am.evolve_rigid(RigidBodies(bodies, [am.Plane((0, 0, 1))]), step=5e-3, until=0.5)
    upper = last.meetings.master >= 0
    assert np.ptp(last.meetings.points[upper, 0]) > 0.37  # all of the overlap carries
    np.testing.assert_allclose(last.position, [b.position for b in bodies], atol=1e-4)
    np.testing.assert_allclose(last.rotation @ turn.as_matrix(), [np.eye(3)] * 2, atol=1e-4)


def test_a_column_with_many_sides_stands():
    """Faces of more than 64 corners were cut off after these, and carried on a part."""
    angle = np.linspace(0, 2 * np.pi, 161)[1:]
    ring = np.column_stack([0.1 * np.cos(angle), 0.1 * np.sin(angle)])
    column = Polyhedron(np.vstack([np.column_stack([ring, np.full(160, z)]) for z in (0, 0.4)]))
    slab = RigidBody(cuboid((1, 1, 0.1)), 1e4)
    found = met([slab, RigidBody(column, position=(0, 0, 0.25))], near=1e-6)
    assert len(found.gaps) == 160
    np.testing.assert_allclose(found.points.mean(axis=0), [0, 0, 0.05], atol=1e-9)


def met(bodies, planes=(), near=1.0):
    system = RigidBodies(bodies, planes)
    x = np.array([b.position for b in bodies])
    R = Rotation.from_quat(np.array([np.roll(b.orientation, -1) for b in bodies])).as_matrix()
    return meetings(system.packed, x, np.ascontiguousarray(R), np.full(len(bodies), near / 2))


def test_a_box_stands_on_a_plane_with_four_corners():
    found = met([RigidBody(cuboid((1, 1, 2)), position=(0, 0, 1.1))], [am.Plane((0, 0, 1))])
    np.testing.assert_allclose(np.sort(found.gaps), 0.1 * np.ones(4), atol=1e-14)
    np.testing.assert_allclose(found.normals, np.tile([0, 0, 1.0], (4, 1)))
    assert set(found.master) == {-1}


def test_boxes_meet_in_the_corners_of_what_overlaps():
    """One on the other, moved and turned: eight corners in an octagon, gaps alike."""
    turn = (np.cos(np.pi / 8), 0, 0, np.sin(np.pi / 8))
    lower = RigidBody(cuboid((2, 2, 1)))
    upper = RigidBody(cuboid((2, 2, 1)), position=(0, 0, 1.05), orientation=turn)
    found = met([lower, upper], near=0.2)
    assert len(found.gaps) == 8
    np.testing.assert_allclose(found.gaps, 0.05, atol=1e-14)
    np.testing.assert_allclose(np.abs(found.normals[:, 2]), 1)
    half = RigidBody(cuboid((1, 1, 1)), position=(1, 0, 1.05))
    found = met([lower, half], near=0.2)
    xs = np.sort(found.points[:, 0])
    np.testing.assert_allclose(xs, [0.5, 0.5, 1, 1], atol=1e-12)


def test_edges_that_cross_meet_in_a_point():
    """Two boxes turned onto their edges, one across the other."""
    r = 0.5 * np.sqrt(2)
    along_x = Rotation.from_euler("x", 45, degrees=True).as_quat()
    along_y = Rotation.from_euler("y", 45, degrees=True).as_quat()
    lower = RigidBody(cuboid((4, 1, 1)), orientation=np.roll(along_x, 1))
    upper = RigidBody(cuboid((1, 4, 1)), position=(0.3, -0.2, 2 * r + 0.01),
                      orientation=np.roll(along_y, 1))  # fmt: skip
    found = met([lower, upper], near=0.1)
    assert len(found.gaps) == 1
    assert found.gaps[0] == pytest.approx(0.01)
    np.testing.assert_allclose(found.points[0], [0.3, 0, r + 0.005], atol=1e-9)
    np.testing.assert_allclose(np.abs(found.normals[0]), [0, 0, 1], atol=1e-12)


@pytest.mark.parametrize(
    ("centre", "gap", "normal"),
    [((0, 0, 1.2), 0.2, (0, 0, 1)), ((0.5 + 0.6, 0, 0.5 + 0.8), 0.5, (0.6, 0, 0.8)),
     ((0.9, 0.9, 0.9), 0.4 * np.sqrt(3) - 0.5, np.ones(3) / np.sqrt(3)),
     ((0, 0, 0.45), -0.55, (0, 0, 1))],
)  # fmt: skip
def test_a_ball_meets_a_box_on_a_face_an_edge_a_corner_and_inside(centre, gap, normal):
    box, ball = RigidBody(cuboid((1, 1, 1))), RigidBody(Ball(0.5), position=centre)
    found = met([box, ball], near=2.0)
    assert len(found.gaps) == 1
    assert found.gaps[0] == pytest.approx(gap)
    np.testing.assert_allclose(found.normals[0], normal, atol=1e-12)
    assert (found.slave[0], found.master[0]) == (1, 0)


def overlap(first, second):
    """Whether two clouds of points have a convex combination in common."""
    n, m = len(first), len(second)
    A = np.zeros((5, n + m))
    A[:3, :n], A[:3, n:] = first.T, -second.T
    A[3, :n], A[4, n:] = 1, 1
    return linprog(np.zeros(n + m), A_eq=A, b_eq=[0, 0, 0, 1, 1], bounds=(0, None)).success


@given(seed=st.integers(0, 10**6), distance=st.floats(0.3, 3.0))
@settings(max_examples=60, deadline=None)
def test_polyhedra_overlap_exactly_where_their_gap_is_negative(seed, distance):
    rng = np.random.default_rng(seed)
    shapes = [Polyhedron(rng.standard_normal((8, 3))) for _ in range(2)]
    direction = rng.standard_normal(3)
    direction *= distance / np.linalg.norm(direction)
    bodies = [RigidBody(shapes[0], position=(0, 0, 0)),
              RigidBody(shapes[1], position=direction,
                        orientation=rng.standard_normal(4))]  # fmt: skip
    clouds = [
        (b.shape.points - b.shape.centre) @ Rotation.from_quat(
            np.roll(b.orientation, -1)).as_matrix().T + b.position for b in bodies
    ]  # fmt: skip
    found = met(bodies, near=100.0)
    gap = found.gaps.min()
    if abs(gap) > 1e-7:
        assert (gap < 0) == overlap(*clouds)
    swapped = met(bodies[::-1], near=100.0)
    assert swapped.gaps.min() == pytest.approx(gap, abs=5e-3 * distance + 5e-3)
    # normals lead from the master into the slave
    between = np.array([b.position for b in bodies])
    apart = between[found.slave] - between[found.master]
    if gap > 0.2:
        assert ((found.normals * apart).sum(axis=1) > 0).all()


def test_many_bodies_find_the_pairs_that_all_against_all_find():
    rng = np.random.default_rng(0)
    bodies = [RigidBody(Ball(0.3), position=p) for p in rng.uniform(0, 3, (60, 3))]
    found = met(bodies, near=0.1)
    x = np.array([b.position for b in bodies])
    gaps = np.linalg.norm(x[:, None] - x, axis=2) - 0.6
    expected = {(i, j) for i, j in zip(*np.nonzero(np.triu(gaps <= 0.1, 1)), strict=True)}
    pairs = {(min(p), max(p)) for p in zip(found.slave, found.master, strict=True)}
    assert pairs == {(int(i), int(j)) for i, j in expected}


def test_surfaces_for_viewers(tmp_path):
    """Closed, of the volume of the bodies, where these are; velocities are those of points."""
    spin = (0.0, 0.0, 2.0)
    brick = am.cuboid((1, 2, 3))
    bodies = [am.RigidBody(brick, position=(5, 0, 9), spin=spin, velocity=(1, 0, 0)),
              am.RigidBody(am.Ball(0.5), position=(0, 0, 9))]  # fmt: skip
    system = am.RigidBodies(bodies, gravity=(0, 0, 0))
    (step,) = am.evolve_rigid(system, step=1e-3, until=1e-3)
    am.write_rigid(step, tmp_path / "bodies.vtu")
    read = meshio.read(tmp_path / "bodies.vtu")
    corners, body = read.points[read.cells[0].data], read.cell_data["body"][0]
    volume = np.einsum("ij,ij->i", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])) / 6
    assert volume[body == 0].sum() == pytest.approx(6)
    assert volume[body == 1].sum() == pytest.approx(np.pi / 6, rel=0.05)
    arms = read.points[:8] - step.position[0]
    expected = np.array([1, 0, 0]) + np.cross(spin, arms)
    np.testing.assert_allclose(read.point_data["velocity"][:8], expected, atol=1e-12)
    am.write_rigid(step, tmp_path / "bodies.ply")
    assert len(meshio.read(tmp_path / "bodies.ply").cells[0].data) == len(body)


@pytest.mark.parametrize(
    ("points", "edges", "directions"),
    [(np.asarray(cuboid((1, 2, 3)).points), 12, 3),
     (np.concatenate([np.eye(3), -np.eye(3)]) * [1, 2, 3], 12, 6),
     ([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)], 6, 6)],
)  # fmt: skip
def test_parallel_edges_are_one_direction(points, edges, directions):
    facets, corners = Polyhedron(points).facets, np.asarray(Polyhedron(points).points)
    assert len(facets.edges) == edges and len(facets.lines) == directions
    along = corners[facets.edges[:, 1]] - corners[facets.edges[:, 0]]
    for group in np.split(along, facets.lines[1:]):
        assert np.abs(np.cross(group, group[0])).max() < 1e-12


def test_edges_are_as_far_apart_as_the_best_pair_of_all_that_are_outermost():
    """Against all pairs of edges, whose common normals separate the bodies or do not."""
    rng = np.random.default_rng(4)
    for _ in range(40):
        shapes = (cuboid(rng.uniform(0.5, 1, 3)), Polyhedron(rng.standard_normal((8, 3)) / 2))
        at = np.array([[0, 0, 0], rng.uniform(0.4, 1.2, 3)])
        bodies = [RigidBody(s, position=p, orientation=rng.standard_normal(4))
                  for s, p in zip(shapes, at, strict=True)]  # fmt: skip
        packed = RigidBodies(bodies).packed
        R = np.array([Rotation.from_quat(b.orientation, scalar_first=True).as_matrix()
                      for b in bodies])  # fmt: skip
        each = [slice(*packed.first_vertex[[k, k + 1]]) for k in range(2)]
        v = np.concatenate([at[k] + packed.vertices[each[k]] @ R[k].T for k in range(2)])
        found = edges_apart(0, 1, packed.first_vertex, v, packed.edges, packed.first_line,
                            packed.lines, at)  # fmt: skip
        ends = [packed.edges[slice(*packed.first_edge[[k, k + 1]])] for k in range(2)]
        best = -np.inf
        for a in ends[0]:
            for b in ends[1]:
                m = np.cross(v[a[1]] - v[a[0]], v[b[1]] - v[b[0]])
                m *= np.sign(m @ (at[1] - at[0])) / np.linalg.norm(m)
                top, bottom = (v[each[0]] @ m).max(), (v[each[1]] @ m).min()
                if v[a] @ m == pytest.approx(top) and v[b] @ m == pytest.approx(bottom):
                    best = max(best, bottom - top)
        assert found[0] == pytest.approx(best, abs=1e-12)


def fall():
    """A brick and a ball that fall on a floor."""
    bodies = [RigidBody(cuboid((0.2, 0.1, 0.1)), position=(0, 0, 0.06)),
              RigidBody(Ball(0.05), position=(0.02, 0, 0.2))]  # fmt: skip
    system = RigidBodies(bodies, [am.Plane((0, 0, 1))])
    return am.evolve_rigid(system, step=5e-3, until=0.1)


def test_steps_are_written_with_a_list_that_viewers_open(tmp_path):
    steps = list(am.export_rigid(fall(), tmp_path / "fall", every=5))
    assert len(steps) == 20
    sets = ElementTree.parse(tmp_path / "fall" / "steps.pvd").getroot().iter("DataSet")
    found = [(float(s.get("timestep")), s.get("file")) for s in sets]
    assert [time for time, _ in found] == [step.time for step in steps[4::5]]
    for step, (_, name) in zip(steps[4::5], found, strict=True):
        read = meshio.read(tmp_path / "fall" / name)
        np.testing.assert_allclose(read.points[:8].mean(axis=0), step.position[0], atol=1e-12)
    with pytest.raises(am.InvalidInput, match="every"):
        am.export_rigid(fall(), tmp_path, every=0)


def test_a_film_shows_bodies_where_they_are(tmp_path):
    """The same view in all pictures, another one in each."""
    steps = list(fall())
    path = am.film(steps[::6], tmp_path / "fall.gif")
    with Image.open(path) as film:
        assert film.n_frames == 4
        pictures = []
        for k in range(4):
            film.seek(k)
            pictures.append(np.asarray(film.convert("RGB"), dtype=int))
    assert all(np.abs(a - b).max() > 30 for a, b in itertools.pairwise(pictures))
    with pytest.raises(am.InvalidInput, match="steps"):
        am.film([*steps, 1], path)
    figure = next(rigid_figures(steps[-1:], Units()))
    marked = [len(line.get_xdata()) for line in figure.axes[0].get_lines()]
    assert marked == [int((steps[-1].status == status).sum()) for status in am.ContactStatus]
    assert sum(marked) == len(steps[-1].r) > 0
    axes = figure.axes[0]
    for line in axes.get_lines():
        for places, (low, high) in ((line.get_xdata(), axes.get_xlim()),
                                    (line.get_ydata(), axes.get_ylim())):  # fmt: skip
            assert all(low <= place <= high for place in places)
    assert np.ptp(axes.get_xlim()) == axes.get_images()[0].get_size()[1]  # nothing grew
