"""CAD files and shapes: geometry, names, contact on them, broken files."""

import json
import subprocess
import sys

import numpy as np
import pytest
from click.testing import CliRunner

import amontons as am
from amontons.app.cli import main
from amontons.core.errors import FileFormatError, InvalidInput
from amontons.mechanics.meshes import cad
from amontons.mechanics.meshes.surfaces import facet_areas, nodal_normals

occ = pytest.importorskip("netgen.occ")
Box, Compound, Cylinder, Glue, MoveTo, Sphere, X, Y, Z = (
    occ.Box, occ.Compound, occ.Cylinder, occ.Glue, occ.MoveTo, occ.Sphere, occ.X, occ.Y, occ.Z
)

CASE = """
[mesh]
file = "part.step"
size = 0.4
[material.default]
young = 1000
poisson = 0.3
[[fix]]
on = "top"
value = [0.002, 0, -0.01]
[[contact]]
slave = "bottom"
obstacle = { plane = { normal = [0, 0, 1] } }
friction = { coulomb = 0.3 }
"""


def block():
    shape = Box((0, 0, 0), (2, 1, 1))
    shape.faces.Min(Z).name = "bottom"
    shape.faces.Max(Z).name = "top"
    return shape


def cylinder():
    shape = Cylinder((0, 0, 0), Z, r=1, h=2)
    shape.faces.Min(Z).name = "bottom"
    shape.faces.Max(Z).name = "top"
    return shape


def two_blocks():
    one, two = Box((0, 0, 0), (1, 1, 1)), Box((1, 0, 0), (3, 1, 1))
    one.solids.name, two.solids.name = "steel", "copper"
    one.faces.Min(X).name, two.faces.Max(X).name = "left", "right"
    return Compound([one, two])


def plate():
    shape = MoveTo(0, 0).Rectangle(2, 1).Face()
    shape.edges.Min(Y).name = "bottom"
    return shape


@pytest.fixture
def part(tmp_path):
    path = tmp_path / "part.step"
    block().WriteStep(str(path))
    return path


def area(mesh, name):
    return sum(facet_areas(mesh.points, f).sum() for f in mesh.surface(name))


def volume(mesh, region=None):
    """Volume of a region of tetrahedra, or of triangles in 2D."""
    total = 0.0
    for cells in mesh.cells:
        if region in (None, cells.region):
            corner = mesh.points[cells.nodes]
            total += np.linalg.det(corner[:, 1:] - corner[:, :1]).sum()
    return total / (6 if mesh.dim == 3 else 2)


@pytest.fixture(scope="module")
def block_read(tmp_path_factory):
    """The mesh of a file of the block."""
    path = tmp_path_factory.mktemp("part") / "part.step"
    block().WriteStep(str(path))
    return am.read_cad(path, 0.4)


def test_block_from_step(block_read):
    mesh = block_read
    assert mesh.regions == ("default",)
    assert set(mesh.surfaces) == {"face1", "face2", "face3", "face4", "bottom", "top"}
    assert volume(mesh) == pytest.approx(2, rel=1e-12)
    assert area(mesh, "bottom") == pytest.approx(2, rel=1e-12)
    assert sum(area(mesh, name) for name in mesh.surfaces) == pytest.approx(10, rel=1e-12)
    nodes = mesh.surface_nodes("bottom")
    assert np.ptp(mesh.points[nodes, 2]) == 0
    normals = nodal_normals(mesh.points, mesh.surface("bottom"))[nodes]
    np.testing.assert_allclose(normals, np.tile([0.0, 0, -1], (len(nodes), 1)), atol=1e-12)


def test_the_same_mesh_every_time(part, block_read):
    np.testing.assert_array_equal(block_read.points, am.read_cad(str(part), 0.4).points)


def test_smaller_size_gives_shorter_edges():
    for size in (0.5, 0.2):
        mesh = am.mesh_shape(block(), size)
        corner = mesh.points[mesh.cells[0].nodes]
        edges = np.linalg.norm(corner[:, :, None] - corner[:, None], axis=-1)
        assert 0.7 * size < edges.sum() / (12 * len(corner)) < 1.6 * size


def test_cylinder_becomes_facets_of_second_order():
    errors = []
    for size in (0.4, 0.2):
        mesh = am.mesh_shape(cylinder(), size)
        errors.append([
            2 * np.pi - volume(mesh), np.pi - area(mesh, "bottom"),
            4 * np.pi - area(mesh, "face1"),
        ])  # fmt: skip
        assert min(errors[-1]) > 0  # inside the shape
        on_curve = mesh.points[mesh.surface_nodes("face1"), :2]
        np.testing.assert_allclose(np.linalg.norm(on_curve, axis=1), 1, rtol=1e-9)
    coarse, fine = errors
    assert np.all(np.array(fine) < 0.35 * np.array(coarse))
    assert fine[0] < 0.01 * 2 * np.pi


def test_touching_solids_are_bonded(tmp_path):
    two_blocks().WriteStep(str(tmp_path / "two.stp"))
    mesh = am.read_cad(tmp_path / "two.stp", 0.5)
    assert mesh.regions == ("steel", "copper")
    assert volume(mesh, "steel") == pytest.approx(1)
    assert volume(mesh, "copper") == pytest.approx(2)
    assert {"left", "right"} <= set(mesh.surfaces)
    assert len(np.unique(mesh.points, axis=0)) == len(mesh.points)


# --------------------------------------------------------------------------- touching solids
def block_on_plate():
    """A block of 1 x 1 x 1 in the middle of a plate of 2 x 2 x 1, both with a face "top"."""
    plate, cube = Box((0, 0, 0), (2, 2, 1)), Box((0.5, 0.5, 1), (1.5, 1.5, 2))
    plate.solids.name, cube.solids.name = "plate", "cube"
    plate.faces.Max(Z).name, cube.faces.Max(Z).name = "top", "top"
    plate.faces.Min(Z).name, cube.faces.Min(Z).name = "ground", "foot"
    return Compound([plate, cube])


def test_touching_solids_can_stay_apart(tmp_path):
    """Whole faces, of each solid its own: the glued plate's top has a hole under the block."""
    block_on_plate().WriteStep(str(tmp_path / "two.step"))
    mesh = am.read_cad(tmp_path / "two.step", 0.5, glue=False)
    assert mesh.regions == ("plate", "cube")
    assert (volume(mesh, "plate"), volume(mesh, "cube")) == pytest.approx((4, 1))
    assert area(mesh, "top-plate") == pytest.approx(4)
    assert area(mesh, "top-cube") == area(mesh, "foot") == pytest.approx(1)
    assert area(mesh, "top") == pytest.approx(5)
    plate, cube = (
        {n for b in mesh.cells if b.region == name for n in b.nodes.ravel()}
        for name in mesh.regions
    )
    assert not plate & cube
    numbers = [int(name[4:]) for name in mesh.surfaces if name.startswith("face")]
    assert len(numbers) == 8 and len(set(numbers)) == 8


def test_two_solids_of_one_name_stay_two_regions():
    one, two = Box((0, 0, 0), (1, 1, 1)), Box((1, 0, 0), (2, 1, 1))
    one.solids.name = two.solids.name = "body"
    assert am.mesh_shape(Compound([one, two]), 1, glue=False).regions == ("body", "body-2")
    shape = Compound([Box((0, 0, 0), (1, 1, 1)), Box((1, 0, 0), (2, 1, 1))])
    assert am.mesh_shape(shape, 1, glue=False).regions == ("solid1", "solid2")


def test_one_surface_of_glued_solids_is_taken_apart():
    """Three in a row, the first joint opened: as many nodes more as it has."""
    parts = [Box((k, 0, 0), (k + 1, 1, 1)) for k in range(3)]
    for part, name in zip(parts, "abc", strict=True):
        part.solids.name = name
    parts[0].faces.Max(X).name = "joint"
    glued = am.mesh_shape(Compound(parts), 0.5)
    mesh = am.mesh_shape(Compound(parts), 0.5, glue={"joint": False})
    extra = len(mesh.points) - len(glued.points)
    assert extra == len(glued.surface_nodes("joint")) > 4
    assert area(mesh, "joint-a") == area(mesh, "joint-b") == pytest.approx(1)
    assert "joint" not in mesh.surfaces
    assert sum(f.nodes.shape[0] for f in mesh.boundary) == sum(
        f.nodes.shape[0] for f in glued.boundary
    ) + 2 * sum(f.nodes.shape[0] for f in glued.surfaces["joint"])
    with pytest.raises(InvalidInput, match="glue: surface 'joynt': not found.*mean 'joint'"):
        am.mesh_shape(Compound(parts), 0.5, glue={"joynt": False})


def test_glued_surface_in_contact_is_refused_with_what_to_do():
    shape = block_on_plate()
    mesh = am.mesh_shape(shape, 0.5)
    joint = "foot"  # of the block, and there a part of the plate's top
    body = am.Body(mesh, am.LinearElastic(1, 0.3))
    with pytest.raises(InvalidInput, match="bonded there.*glue=False"):
        am.Model([body], contacts=[am.Contact(joint, am.Plane((0, 0, 1)), mu=0.1)]).assemble()


def test_force_through_solids_kept_apart():
    """The block pressed on the plate by 0.01 with Poisson 0, between two simple bounds."""
    mesh = am.mesh_shape(block_on_plate(), 0.5, glue=False)
    model = am.Model(
        [am.Body(mesh, am.LinearElastic(1000, 0.0))],
        supports=[am.Fix("ground", (0, 0, 0)), am.Fix("top-cube", (0, 0, -0.01))],
        contacts=[am.Contact("foot", master="top-plate", mu=0.2)],
    )
    solution = am.solve(model)
    assert solution.converged
    force = abs(solution.fields.resultant[2])
    assert 1000 * 0.01 / 2 < force < 1000 * 0.01 / 1.25


def test_solids_without_names_are_numbered():
    mesh = am.mesh_shape(Glue([Box((0, 0, 0), (1, 1, 1)), Box((1, 0, 0), (2, 1, 1))]), 1)
    assert mesh.regions == ("solid1", "solid2")


def test_automatic_names_never_join_another_face():
    shape = block()
    shape.faces.Min(X).name = "face2"
    mesh = am.mesh_shape(shape, 1)
    assert "face2_" in mesh.surfaces
    assert area(mesh, "face2") == pytest.approx(1)


def test_faces_of_one_name_are_one_surface():
    shape = block()
    shape.faces.name = "skin"
    assert area(am.mesh_shape(shape, 1), "skin") == pytest.approx(10)


def test_names_given(part, monkeypatch):
    whole = am.mesh_shape(block(), 1)
    monkeypatch.setattr(cad, "_read_apart", lambda *_: whole)  # files are read in other tests
    mesh = am.read_cad(part, 1, names={"face1": "side", "default": "steel", "top": "side"})
    assert mesh.regions == ("steel",)
    assert set(mesh.surfaces) == {"side", "face2", "face3", "face4", "bottom"}
    assert area(mesh, "side") == pytest.approx(3)
    with pytest.raises(InvalidInput, match="botom.*did you mean 'bottom'"):
        am.read_cad(part, 1, names={"botom": "side"})


def test_plane_faces_give_triangles(tmp_path):
    plate().WriteStep(str(tmp_path / "plate.step"))
    mesh = am.read_cad(tmp_path / "plate.step", 0.3)
    assert mesh.dim == 2
    assert volume(mesh) == pytest.approx(2)
    assert set(mesh.surfaces) == {"bottom", "edge2", "edge3", "edge4"}
    assert area(mesh, "bottom") == pytest.approx(2)


def test_suffixes(part):
    """Capitals too; .stp is what `test_touching_solids_are_bonded` reads."""
    other = part.rename(part.with_suffix(".STEP"))
    assert volume(am.read_cad(other, 1)) == pytest.approx(2)


def test_brep_has_no_names(tmp_path):
    block().WriteBrep(str(tmp_path / "part.brep"))
    mesh = am.read_cad(tmp_path / "part.brep", 1)
    assert set(mesh.surfaces) == {f"face{k}" for k in range(1, 7)}


def test_other_units_become_millimetres(part):
    text = part.read_text()
    assert ".MILLI.,.METRE." in text
    part.write_text(text.replace(".MILLI.,.METRE.", "$,.METRE."))
    assert volume(am.read_cad(part, 500)) == pytest.approx(2e9)


def test_contact_on_a_part():
    """Pressed and dragged on the plane until it slides: the resultant is on the cone."""
    body = am.Body(am.mesh_shape(cylinder(), 0.5), am.LinearElastic(1000, 0.0))
    model = am.Model(
        [body],
        supports=[am.Fix("top", (0.05, 0, -0.01))],
        contacts=[am.Contact("bottom", am.Plane(normal=(0, 0, 1)), mu=0.2)],
    )
    solution = am.solve(model)
    force = solution.fields.resultant
    assert solution.converged
    assert force[2] == pytest.approx(1000 * 0.01 / 2 * np.pi, rel=0.05)  # E A strain
    assert force[0] == pytest.approx(-0.2 * force[2], rel=1e-6)


# ------------------------------------------------------------------------------ bad input
@pytest.mark.parametrize("size", [0, -1, np.nan, np.inf, "1", None])
def test_size_is_checked(part, size):
    for mesh in (lambda: am.read_cad(part, size), lambda: am.mesh_shape(block(), size)):
        with pytest.raises(InvalidInput, match="size: expected"):
            mesh()


def test_a_size_too_small_is_refused(part):
    with pytest.raises(InvalidInput, match="about 1.7e.13 cells"):
        am.mesh_shape(block(), 1e-4)
    with pytest.raises(FileFormatError, match="part.step: size"):
        am.read_cad(part, 1e-4)


@pytest.mark.parametrize(
    "shape", [list(Sphere((0, 0, 0), 1).faces)[0], list(block().edges)[0], "box", 3]
)
def test_shapes_that_are_no_bodies(shape):
    with pytest.raises(InvalidInput, match="shape: expected"):
        am.mesh_shape(shape, 1)


@pytest.mark.parametrize(
    ("name", "text", "words"),
    [
        ("a.step", "", "empty"),
        ("a.step", "hello", "Line 2: Incorrect syntax"),
        ("a.igs", "hello", "can not read"),
        ("a.brep", "hello", "can not read"),
        ("a.step", None, "no such file"),
        ("a.stl", "solid", r"expected a CAD file.*read_mesh"),
    ],
)
def test_broken_files(tmp_path, capfd, name, text, words):
    path = tmp_path / name
    if text is not None:
        path.write_text(text)
    with pytest.raises(FileFormatError, match=words) as caught:
        am.read_cad(path, 1)
    assert name in str(caught.value) and "\x1b" not in str(caught.value)
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize("part_kept", [0.2, 0.9])
def test_truncated_files(part, capfd, part_kept):
    text = part.read_text()
    part.write_text(text[: int(len(text) * part_kept)])
    with pytest.raises(FileFormatError, match=r"part\.step: OpenCascade can not read"):
        am.read_cad(part, 1)
    assert capfd.readouterr() == ("", "")


def test_a_file_that_makes_opencascade_crash(part):
    part.write_text(part.read_text().replace("VECTOR(", "DEFINITION("))
    code = f"from netgen.occ import OCCGeometry; OCCGeometry({str(part)!r})"
    crashed = subprocess.run([sys.executable, "-c", code], capture_output=True).returncode
    if crashed >= 0:
        pytest.skip("this OpenCascade reads the file")
    with pytest.raises(FileFormatError, match="it crashed"):
        am.read_cad(part, 1)


def test_read_mesh_knows_cad_files(part):
    with pytest.raises(FileFormatError, match="read_cad"):
        am.read_mesh(part)


# ------------------------------------------------------------------------------ case files
def run(*arguments):
    return CliRunner().invoke(main, [str(a) for a in arguments])


@pytest.fixture
def case(part, monkeypatch):
    monkeypatch.chdir(part.parent)
    path = part.parent / "case.toml"
    path.write_text(CASE)
    return path


def test_solve_a_part_from_the_command_line(case):
    result = run("solve", case, "-o", "out")
    assert result.exit_code == 0, result.stderr
    data = json.loads((case.parent / "out" / "solution.json").read_text())
    assert data["outcome"] == "converged"
    assert data["contacts"]["open"] == 0
    assert (case.parent / "out" / "solution.vtu").is_file()
    result = run("info", case)
    assert result.exit_code == 0
    assert "contacts" in result.stdout


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("size = 0.4", "", ["mesh.size", "missing", "CAD"]),
        ("size = 0.4", "size = 0", ["mesh.size", "> 0"]),
        ("size = 0.4", 'size = "fine"', ["mesh.size", "number"]),
        ("size = 0.4", "cells = 3", ["mesh.cells", "unknown key"]),
        ("part.step", "part.stp", ["mesh.file", "no such file"]),
        ("part.step", "broken.step", ["broken.step", "can not read"]),
        ("part.step", "part.msh", ["mesh.size", "CAD"]),
        ('"bottom"', '"face9"', ["face9", "face3"]),
    ],
)
def test_bad_cases(case, old, new, words):
    (case.parent / "broken.step").write_text("ISO-10303-21;\nHEADER")
    (case.parent / "part.msh").write_text("$MeshFormat")
    case.write_text(CASE.replace(old, new))
    result = run("solve", case)
    assert result.exit_code == 2
    for word in words:
        assert word in result.stderr.replace("\n", " ")
    assert "Traceback" not in result.stderr
    assert not (case.parent / "case-results").exists()


# ----------------------------------------------------------------------- names by picture
def test_info_of_a_part_numbers_its_faces(part, tmp_path):
    picture = tmp_path / "faces.svg"
    result = run("info", part, "--size", 0.5, "--picture", picture, "--json", "-")
    assert result.exit_code == 0, result.stderr
    data = json.loads(result.stdout)
    assert list(data["surfaces"]).index("bottom") >= 0
    assert data["surfaces"]["bottom"]["area"] == pytest.approx(2)
    assert data["surfaces"]["bottom"]["middle"] == pytest.approx([1, 0.5, 0])
    assert picture.stat().st_size > 10_000


def test_every_outer_face_is_numbered_once_and_inner_ones_are_not():
    from amontons.io.plots.surface_names import draw_surface_names

    mesh = am.mesh_shape(two_blocks(), 0.5)
    figure = draw_surface_names(mesh)
    said = [text.get_text() for ax in figure.axes for text in ax.texts]
    inner = [
        k for k, name in enumerate(mesh.surfaces, 1)
        if np.ptp(mesh.points[mesh.surface_nodes(name), 0]) == 0
        and mesh.points[mesh.surface_nodes(name)[0], 0] == 1
    ]
    assert len(inner) == 1
    assert sorted(said, key=int) == [
        str(k) for k in range(1, len(mesh.surfaces) + 1) if k not in inner
    ]  # opposite views: each face of a box is seen in one of them


def test_info_tells_which_faces_bond_and_how_to_open_them(tmp_path):
    path = tmp_path / "two.step"
    two_blocks().WriteStep(str(path))
    told = tmp_path / "told.json"
    said = run("info", path, "--size", 0.5, "--json", told).stdout
    data = json.loads(told.read_text())
    bonds = [n for n, each in data["surfaces"].items() if each["between"]]
    assert len(bonds) == 1 and data["surfaces"][bonds[0]]["area"] == pytest.approx(1)
    assert data["surfaces"][bonds[0]]["between"] == ["steel", "copper"]
    assert f"glue = {{ {bonds[0]} = false }}" in said and "--no-glue" in said
    opened = am.mesh_shape(two_blocks(), 0.5, glue={bonds[0]: False})
    assert {f"{bonds[0]}-steel", f"{bonds[0]}-copper"} <= set(opened.surfaces)


def test_info_without_glue_has_the_names_that_glue_false_gives(tmp_path):
    block_on_plate().WriteStep(str(tmp_path / "two.step"))
    said = run("info", tmp_path / "two.step", "--size", 0.7, "--no-glue", "--json", "-")
    apart = am.read_cad(tmp_path / "two.step", 0.7, glue=False)
    assert list(json.loads(said.stdout)["surfaces"]) == list(apart.surfaces)
    assert "top-cube" in apart.surfaces


def test_a_number_stands_where_its_face_is_seen():
    """The middle of a plate's top is under the block that stands on it."""
    from amontons.io.plots.surface_names import draw_surface_names

    plate, cube = Box((0, 0, 0), (2, 2, 1)), Box((0.5, 0.5, 1), (1.5, 1.5, 2))
    plate.faces.Max(Z).name, cube.faces.Max(Z).name = "shelf", "top"
    mesh = am.mesh_shape(Compound([plate, cube]), 0.3)
    number = str(list(mesh.surfaces).index("shelf") + 1)
    (spot,) = [text for text in draw_surface_names(mesh).axes[0].texts
               if text.get_text() == number]  # fmt: skip
    x, y, z = spot.get_position_3d()
    assert z == pytest.approx(1) and not (0.5 < x < 1.5 and 0.5 < y < 1.5)
    assert not (x < 1.5 and y > 0.5)  # behind the block, seen from x > 0 and y < 0


def test_info_refuses_what_does_not_fit(part, tmp_path):
    (tmp_path / "a.msh").write_text("$MeshFormat")
    for arguments, words in (
        (("example:tower", "--picture", "a.png"), "has no bodies"),
        (("example:hild", "--size", 1), "only for CAD files"),
        (("example:hild", "--picture", "a.gif"), "ends in .png"),
        ((tmp_path / "a.msh", "--size", 1), "only for CAD files"),
        ((part, "--picture", "a.gif"), "ends in .png"),
        ((tmp_path / "a.msh", "--no-glue"), "only for CAD files"),
    ):
        result = run("info", *arguments)
        assert result.exit_code == 2 and words in result.stderr
