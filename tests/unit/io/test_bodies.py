"""What is in front is what is seen, and every body is."""

from dataclasses import replace
from io import BytesIO

import numpy as np
import pytest
from legible import faults
from matplotlib.colors import to_rgb
from PIL import Image

import amontons as am
from amontons.io.plots import (
    COLOURS,
    Camera,
    Frame,
    draw_film,
    picture,
    series_figure,
    status_figure,
    step_figure,
)
from amontons.io.plots.bodies import STONE, draw_bodies
from amontons.io.plots.faces import plot
from amontons.io.plots.layout import Sheet
from amontons.io.plots.raster import seen
from amontons.io.plots.scene import Scene, magnification
from amontons.problem.solution import ContactStatus


def moved(mesh, by):
    return replace(mesh, points=mesh.points + np.array(by), levels=(), grid=None)


def two_bodies():
    """A bracket on a plate that is broader than it."""
    plate = am.Body(am.box((3, 2, 0.3), cells=(6, 4, 1)), am.LinearElastic(200, 0.3), "plate")
    mesh = moved(am.box((1, 0.6, 1.2), cells=(3, 2, 4)), (0.8, 0.7, 0.3))
    bracket = am.Body(mesh, am.LinearElastic(100, 0.3), "bracket")
    return am.Model(
        [plate, bracket],
        [am.Fix("plate.bottom", 0.0), am.Fix("bracket.top", (0.03, 0, -0.02))],
        [am.Contact("bracket.bottom", master="plate.top", mu=0.4)], name="bracket",
    )  # fmt: skip


@pytest.fixture(scope="module")
def solved():
    return am.solve(two_bodies())


# ------------------------------------------------------------------------- depth buffer
SQUARE = np.array([[2.0, 3.0], [12.0, 3.0], [12.0, 9.0], [2.0, 9.0]])


def triangles(corners, depths):
    """A square as two triangles, with the depth of each corner."""
    full = np.column_stack([corners, depths])
    return full[[[0, 1, 2], [0, 2, 3]]]


def test_a_square_covers_the_pixels_whose_centres_it_has():
    found = seen(triangles(SQUARE, [0.0] * 4), (12, 16))
    expected = np.zeros((12, 16), dtype=bool)
    expected[3:9, 2:12] = True
    assert ((found.triangle >= 0) == expected).all()
    assert (found.depth[expected] == 0).all()
    assert np.isneginf(found.depth[~expected]).all()


@pytest.mark.parametrize("order", [1, -1])
def test_what_is_nearer_hides_what_is_behind_in_any_order(order):
    near, far = triangles(SQUARE, [1.0] * 4), triangles(SQUARE + 3.0, [0.0] * 4)
    both = np.concatenate([near, far][::order])
    found = seen(both, (16, 20))
    first = (found.triangle // 2) == (0 if order == 1 else 1)
    assert first.sum() == 60  # the near square, whole
    assert (found.triangle >= 0).sum() == 60 + 60 - 7 * 3


def test_surfaces_that_cross_are_cut_where_they_cross():
    """One slopes from depth 0 to 1, the other back: each is in front on its half."""
    one = triangles(SQUARE, [0.0, 1.0, 1.0, 0.0])
    other = triangles(SQUARE, [1.0, 0.0, 0.0, 1.0])
    found = seen(np.concatenate([one, other]), (12, 16))
    assert (found.triangle[3:9, 2:7] // 2 == 1).all()
    assert (found.triangle[3:9, 7:12] // 2 == 0).all()


def test_depths_and_corners_are_interpolated():
    found = seen(triangles(SQUARE, [0.0, 10.0, 10.0, 0.0]), (12, 16))
    assert found.depth[5, 2:12] == pytest.approx(np.arange(10) + 0.5, abs=1e-5)
    assert found.triangle[3, 11] == 0 and found.corner[3, 11] == 1  # near (12, 3)
    assert found.triangle[8, 2] == 1 and found.corner[8, 2] == 2  # near (2, 9)


@pytest.mark.parametrize("size", [3.0, 40.0, 900.0])
def test_areas_are_those_of_triangles_also_beyond_the_picture(size):
    corners = np.array([[[0.3, 0.2, 0], [size, 0.2, 0], [0.3, size, 0]]])
    found = seen(corners, (1000, 1000))
    area = 0.5 * (size - 0.3) * (size - 0.2)
    assert (found.triangle >= 0).sum() == pytest.approx(area, abs=4 * size)
    assert (seen(corners, (10, 10)).triangle >= 0).sum() <= 100
    assert not (seen(corners - 2000.0, (10, 10)).triangle >= 0).any()


def test_the_usual_cameras():
    front = Camera.at(0, 0)
    assert np.allclose(front.project(np.eye(3)), [[1, 0], [0, 0], [0, 1]])
    assert np.allclose(front.depth(np.eye(3)), [0, -1, 0])
    assert np.allclose(Camera.at(90, 0).project(np.eye(3)), [[0, 0], [1, 0], [0, 1]])
    assert np.allclose(Camera.at(0, 90).project(np.eye(3)), [[1, 0], [0, 1], [0, 0]])
    for camera in (Camera.at(30, 20), Camera.of(np.array([[0.0, 0, 0], [1, 5, 2]]))):
        basis = np.vstack([camera.plane, camera.toward])
        assert np.allclose(basis @ basis.T, np.eye(3))
        assert np.linalg.det(basis) == pytest.approx(1)


# ------------------------------------------------------------------------------- bodies
def drawn(model, displacement=None, status=None, camera=None):
    """The image of the bodies, and the share of the picture that each takes."""
    scene = Scene.of(model, camera)
    if displacement is None:
        displacement = [np.zeros_like(body.mesh.points) for body in model.bodies]
    axes = Sheet(4, 3).panel(0.1, 0.1, 3.8, 2.8)
    image = draw_bodies(axes, scene, scene.moved(displacement, 1.0), status)
    owner = image.front.triangle
    body = np.where(owner >= 0, scene.body_of[image.triangles[np.maximum(owner, 0), 0]], -1)
    return image, [float((body == k).mean()) for k in range(len(model.bodies))]


def test_both_bodies_are_seen():
    _, (plate, bracket) = drawn(two_bodies())
    assert plate > 0.1
    assert bracket > 0.03


def test_a_body_behind_another_is_not_seen():
    model = two_bodies()
    _, (plate, bracket) = drawn(model, camera=Camera.at(0, -90))  # from below
    assert plate > 0.2
    assert bracket == 0.0
    _, (plate, bracket) = drawn(model, camera=Camera.at(0, 90))  # a plan
    assert bracket / (plate + bracket) == pytest.approx(0.6 / 6.0, rel=0.02)


def test_contacts_that_look_at_the_viewer_have_the_colour_of_their_status():
    model = two_bodies()
    for status in ContactStatus:
        said = np.full(12, int(status), dtype=np.int8)
        image, _ = drawn(model, [np.zeros_like(model.bodies[0].mesh.points),
                                 np.zeros_like(model.bodies[1].mesh.points) + [0, 0, 3]],
                         said, Camera.at(20, -30))  # fmt: skip
        assert share_of(image.colours, COLOURS[status]) > 0.005, status
        for other in {ContactStatus.SLIP, ContactStatus.STICK} - {status}:
            assert share_of(image.colours, COLOURS[other]) < 0.001


def test_edges_behind_a_body_are_hidden():
    model = two_bodies()
    image, _ = drawn(model)
    scene = Scene.of(model)
    bottom = model.bodies[1].mesh.surface_nodes("bottom")
    points = model.bodies[1].mesh.points[bottom]
    shown = image.visible(scene.camera.project(points), scene.camera.depth(points))
    front = points[:, 1] == points[:, 1].min()
    back = (points[:, 1] == points[:, 1].max()) & (points[:, 0] < points[:, 0].max())
    assert shown[front].all()
    assert not shown[back].any()


def test_magnified_displacements_can_be_seen(solved):
    scene = Scene.of(solved.model)
    frame = Frame(0.0, solved.displacement, solved.status)
    factor = magnification(scene, [frame])
    assert factor == 10.0  # 0.03 of a picture of 3.6
    small = tuple(1e-3 * u for u in solved.displacement)
    assert magnification(scene, [replace(frame, displacement=small)]) == 10_000.0
    large = tuple(100 * u for u in solved.displacement)
    assert magnification(scene, [replace(frame, displacement=large)]) == 1.0
    none = tuple(0 * u for u in solved.displacement)
    assert magnification(scene, [replace(frame, displacement=none)]) == 1.0


# ------------------------------------------------------------------------------ figures
def pixels(figure):
    return np.asarray(Image.open(BytesIO(picture(figure))).convert("RGB")).astype(float)


def share_of(image, colour):
    """Share of the pixels with a shade of a colour, black and white left out."""
    wanted = np.array(to_rgb(colour))
    image = np.asarray(image, dtype=float)
    size = np.linalg.norm(image, axis=-1)
    cosine = image @ wanted / np.maximum(size, 1) / np.linalg.norm(wanted)
    return float(((cosine > 0.99997) & (size > 100)).mean())


def test_the_status_figure_shows_all_bodies_and_the_contact_zone(solved):
    figure = solved.plot(title="bracket")
    shown = pixels(figure)
    left = shown[:, : int(shown.shape[1] * 3.9 / 13)]
    for colour in STONE[:2]:
        assert share_of(left, colour) > 0.02
    titles = [axes.get_title() for axes in figure.axes]
    assert titles[0] == "Bodies, displacements × 10"
    assert "Contact status" in titles
    assert faults(figure) == []


def test_steps_show_all_bodies():
    model = two_bodies()
    steps = list(am.evolve(model, am.QuasiStatic(0.5), until=1.0))
    frames = [Frame.of(step) for step in steps]
    for figure in (step_figure(model, frames[-1], magnify=10.0), steps[-1].plot(), plot(steps),
                   series_figure(model, frames)):  # fmt: skip
        shown = pixels(figure)
        for colour in STONE[:2]:
            assert share_of(shown, colour) > 0.01
        assert faults(figure) == []


@pytest.mark.parametrize("dimension", [2, 3])
def test_an_unconverged_figure_is_legible_below_its_stamp(dimension):
    body = am.Body(am.box((1,) * dimension, cells=4), am.LinearElastic(200.0, 0.3))
    plane = am.Plane((0,) * (dimension - 1) + (1,))
    push = (0.02,) + (0.0,) * (dimension - 2) + (-0.05,)
    model = am.Model([body], [am.Fix("top", push)], [am.Contact("bottom", plane, mu=0.4)])
    bad = am.solve(model, am.GaussSeidel(batch=1), max_iterations=1, check=False)
    for figure in (bad.plot(), bad.convergence.plot()):
        assert any(t.get_text().startswith("NOT CONVERGED (") for t in figure.texts)
        assert faults(figure) == []
        assert (pixels(figure) == [176, 0, 32]).all(axis=-1).mean() > 0.003  # the band


@pytest.mark.parametrize("suffix", [".png", ".svg", ".pdf"])
def test_every_format(solved, suffix, tmp_path):
    solved.plot(tmp_path / f"a{suffix}")
    begin = {".png": b"\x89PNG", ".svg": b"<?xml", ".pdf": b"%PDF"}[suffix]
    data = (tmp_path / f"a{suffix}").read_bytes()
    assert data.startswith(begin)
    assert len(data) < 300_000


def test_what_is_no_step_has_no_picture():
    for wrong in ([], [1, 2], ("a",)):
        with pytest.raises(am.InvalidInput, match="steps in time"):
            plot(wrong)


def test_a_figure_without_bodies_in_3d_is_legible():
    from amontons.mechanics.ready.gallery import sphere_packing

    found = am.solve(sphere_packing())
    assert faults(status_figure(found)) == []


def test_a_film_shows_all_bodies_in_every_picture(tmp_path):
    model = two_bodies()
    frames = [Frame.of(step) for step in am.evolve(model, am.QuasiStatic(0.5), until=1.0)]
    *pages, film = draw_film(model, frames, tmp_path)
    assert [page.name for page in pages] == ["step-00001.png", "step-00002.png"]
    shown = [np.asarray(Image.open(page).convert("RGB")) for page in pages]
    assert (shown[0] != shown[1]).any()
    for image in shown:
        for colour in STONE[:2]:
            assert share_of(image, colour) > 0.01
    with Image.open(film) as moving:
        assert moving.n_frames == 2
