"""Mesh files: gmsh in all its versions, other formats, broken files."""

import meshio
import numpy as np
import pytest

import amontons as am
from amontons.mechanics.elements import stiffness
from amontons.mechanics.meshes.surfaces import facet_areas, nodal_normals

SQUARE_22 = """$MeshFormat
2.2 0 8
$EndMeshFormat
$PhysicalNames
3
1 1 "lower side"
2 2 "steel"
2 3 "copper"
$EndPhysicalNames
$Nodes
7
10 0 0 0
20 1 0 0
30 2 0 0
40 0 1 0
50 1 1 0
60 2 1 0
70 9 9 0
$EndNodes
$Elements
6
1 15 2 0 1 10
2 1 2 1 1 20 10
3 1 2 1 1 20 30
4 1 2 7 2 40 50
5 3 2 2 1 10 20 50 40
6 3 2 3 2 20 50 60 30
$EndElements
"""


@pytest.fixture
def square(tmp_path):
    path = tmp_path / "square.msh"
    path.write_text(SQUARE_22)
    return path


def test_hand_written_gmsh_22(square):
    mesh = am.read_mesh(square)
    assert mesh.dim == 2
    assert len(mesh.points) == 6  # point 70 belongs to nothing
    assert mesh.regions == ("steel", "copper")
    assert set(mesh.surfaces) == {"lower side", "7"}
    lower = nodal_normals(mesh.points, mesh.surface("lower side"))[
        mesh.surface_nodes("lower side")
    ]
    np.testing.assert_allclose(lower, [[0, -1]] * 3)
    assert sum(len(c.nodes) for c in mesh.cells) == 2
    right = mesh.points[mesh.cells[1].nodes[0]]  # clockwise in the file
    np.testing.assert_array_equal(right, [[1, 0], [2, 0], [2, 1], [1, 1]])


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("2.2 0 8", "9.9 0 8", "gmsh 2.2 or 4.1"),
        ("$MeshFormat", "$Nonsense", "gmsh 2.2 or 4.1"),
        ("30 2 0 0\n", "30 2 zero 0\n", r"msh:14: expected a node"),
        ("30 2 0 0\n", "30 2 0\n", r"msh:14: expected a node"),
        ("30 2 0 0\n", "20 2 0 0\n", "node 20 comes twice"),
        ("30 2 0 0\n", "30 2 nan 0\n", "not finite"),
        ("$Nodes\n7\n", "$Nodes\n700\n", "700 lines of a node"),
        ("$Nodes\n7\n", "$Nodes\nmany\n", "number of nodes"),
        ("20 50 60 30", "20 50 60 99", "node 99, which is not defined"),
        ("20 50 60 30", "20 50 60", "an element with 2 tags and 4 nodes"),
        ("20 50 60 30", "20 50 30 60", "folded"),
        ("6 3 2 3 2 20 50 60 30", "6 99 2 3 2 20 50 60 30", "element type"),
        ("6 3 2 3 2 20 50 60 30", "6 9 2 3 2 10 20 30 40 50 60", "tri6 cell.*folded"),
        ("6 3 2 3 2 20 50 60 30", "6 13 2 3 2 " + "10 " * 18, "SecondOrderIncomplete = 1"),
        ('1 1 "lower side"', "lower side", "dimension tag"),
        ("3 1 2 1 1 20 30", "3 1 2 1 1 20 70", "belong to no cell"),
        ("3 1 2 1 1 20 30", "3 1 2 1 1 10 60", "no side of a cell"),
        ("50 1 1 0", "50 1 1 3", "constant z"),
        ("$EndElements\n", "", "end of file"),
        (SQUARE_22[SQUARE_22.index("$Elements") :], "", "Elements"),
    ],
)
def test_broken_gmsh_files_say_what_is_wrong(tmp_path, capfd, old, new, words):
    path = tmp_path / "broken.msh"
    assert old in SQUARE_22
    path.write_text(SQUARE_22.replace(old, new, 1))
    with pytest.raises(am.FileFormatError, match=words) as caught:
        am.read_mesh(path)
    assert "broken.msh" in str(caught.value)
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("none.msh", None, "no such file"),
        ("empty.msh", b"", "empty"),
        ("noise.msh", bytes(range(256)) * 9, "expected a mesh"),
        ("noise.vtu", b"<VTKFile", "expected a mesh"),
        ("noise.vtk", b"# vtk DataFile Version 3.0\nrubbish\n", "expected a mesh"),
        ("noise.inp", b"*NODE\n1, x, y\n", "inp:2: coordinate: expected a number, got 'x'"),
        ("noise.med", b"not hdf5", "expected a mesh"),
        ("noise", b"text", "expected a mesh"),
    ],
)
def test_other_files_that_are_no_mesh(tmp_path, capfd, name, content, words):
    path = tmp_path / name
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(am.FileFormatError, match=words):
        am.read_mesh(path)
    with pytest.raises(am.FileFormatError, match="folder"):
        am.read_mesh(tmp_path)
    assert capfd.readouterr() == ("", "")


def _gmsh_box(path, version, binary, recombine=False):
    gmsh = pytest.importorskip("gmsh")
    gmsh.initialize(interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.option.setNumber("Mesh.MeshSizeMax", 0.5)
        gmsh.option.setNumber("Mesh.MshFileVersion", version)
        gmsh.option.setNumber("Mesh.Binary", binary)
        below = gmsh.model.occ.addBox(0, 0, 0, 2, 1, 1)
        above = gmsh.model.occ.addBox(0, 0, 1, 2, 1, 0.5)
        gmsh.model.occ.fragment([(3, below)], [(3, above)])
        gmsh.model.occ.synchronize()
        gmsh.model.addPhysicalGroup(3, [1], name="stone")
        gmsh.model.addPhysicalGroup(3, [2], name="wood")
        for name, z in (("floor", 0.0), ("ceiling", 1.5), ("stone", 1.0)):
            found = gmsh.model.getEntitiesInBoundingBox(-1, -1, z - 0.1, 3, 3, z + 0.1, 2)
            gmsh.model.addPhysicalGroup(2, [tag for _, tag in found], name=name)
        gmsh.model.mesh.generate(3)
        gmsh.write(str(path))
    finally:
        gmsh.finalize()


@pytest.mark.parametrize("version", [2.2, 4.1])
@pytest.mark.parametrize("binary", [0, 1])
def test_gmsh_round_trip(tmp_path, version, binary):
    path = tmp_path / "two.msh"
    _gmsh_box(path, version, binary)
    mesh = am.read_mesh(path)
    assert set(mesh.regions) == {"stone", "wood"}
    if not binary:  # through meshio a surface can not share the name of a region
        assert set(mesh.surfaces) == {"floor", "ceiling", "stone"}
    (facets,) = mesh.surface("floor")
    assert facet_areas(mesh.points, facets).sum() == pytest.approx(2.0)
    floor = nodal_normals(mesh.points, mesh.surface("floor"))[mesh.surface_nodes("floor")]
    np.testing.assert_allclose(floor, [[0, 0, -1]] * len(floor), atol=1e-12)
    K = stiffness(
        mesh, {"stone": am.LinearElastic(10, 0.2), "wood": am.LinearElastic(1, 0.3)}
    )
    assert abs(K @ np.tile([1.0, 0, 0], len(mesh.points))).max() < 1e-11


@pytest.mark.parametrize("suffix", [".vtu", ".vtk", ".inp", ".xdmf", ".mesh", ".med", ".bdf"])
def test_other_formats_through_meshio(tmp_path, capfd, suffix):
    box = am.box((1, 2, 3), 2)
    path = tmp_path / f"box{suffix}"
    meshio.Mesh(box.points, [("hexahedron", box.cells[0].nodes)]).write(path)
    capfd.readouterr()
    mesh = am.read_mesh(path)
    np.testing.assert_allclose(mesh.points, box.points)
    np.testing.assert_array_equal(mesh.cells[0].nodes, box.cells[0].nodes)
    assert capfd.readouterr() == ("", "")


def test_abaqus_sets_become_regions_and_surfaces(tmp_path):
    box = am.box((1, 1, 1), 2)
    path = tmp_path / "box.inp"
    meshio.Mesh(
        box.points, [("hexahedron", box.cells[0].nodes)],
        cell_sets={"everything": [np.arange(8)], "low": [np.arange(4)]},
        point_sets={"floor": box.surface_nodes("bottom"), "line": np.array([0, 1])},
    ).write(path)  # fmt: skip
    mesh = am.read_mesh(path)
    assert sorted(mesh.regions) == ["everything", "low"]
    assert [len(c.nodes) for c in mesh.cells] == [4, 4]
    np.testing.assert_array_equal(mesh.surface_nodes("floor"), box.surface_nodes("bottom"))
    assert "line" not in mesh.surfaces
