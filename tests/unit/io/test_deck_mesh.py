"""Meshes out of decks: groups, surfaces, second order, parts, what exporters write."""

import numpy as np
import pytest

import amontons as am
from amontons.core.errors import FileFormatError

BRICK = """*NODE
1, 0, 0, 0
2, 1, 0, 0
3, 1, 1, 0
4, 0, 1, 0
5, 0, 0, 1
6, 1, 0, 1
7, 1, 1, 1
8, 0, 1, 1
11, 2, 0, 0
12, 2, 1, 0
13, 2, 0, 1
14, 2, 1, 1
*ELEMENT, TYPE=C3D8, ELSET=Volume1
1, 1, 2, 3, 4, 5, 6, 7, 8
*ELEMENT, TYPE=C3D8, ELSET=Volume2
2, 2, 11, 12, 3, 6, 13, 14, 7
"""


@pytest.fixture
def read(tmp_path):
    def inner(text, **options):
        path = tmp_path / "part.inp"
        path.write_text(text)
        return am.read_mesh(path, **options)

    return inner


def test_names_are_written_as_in_the_file(read):
    mesh = read(BRICK + "*ELSET, ELSET=Left\n1\n*NSET, NSET=Floor\n1,2,3,4\n")
    assert sorted(mesh.regions) == ["Left", "Volume2"]  # of equal ones that with its own card
    assert mesh.surface_nodes("Floor").size == 4
    assert mesh.points.shape == (12, 3)


def test_surfaces_of_faces(read):
    ends, nodes = "1, S6\n2, S4\n", "5\n6\n7\n8\n"
    text = f"{BRICK}*SURFACE, NAME=ends\n{ends}*SURFACE, NAME=nodes, TYPE=NODE\n{nodes}"
    mesh = read(text)
    x = mesh.points[mesh.surface_nodes("ends"), 0]
    assert sorted(set(x)) == [0, 2]
    np.testing.assert_allclose(mesh.points[mesh.surface_nodes("nodes"), 2], 1)
    with pytest.raises(FileFormatError, match=r"part\.inp: surface ends: face S7: expected S1"):
        read(BRICK + "*SURFACE, NAME=ends\n1, S7\n")


@pytest.mark.parametrize("kind", ["S4", "M3D4", "CPS4", "SFM3D4R"])
def test_flat_elements_on_solids_are_surfaces(read, kind):
    mesh = read(BRICK + f"*ELEMENT, TYPE={kind}, ELSET=skin\n9, 1, 4, 3, 2\n")
    assert mesh.surface_nodes("skin").size == 4
    assert sorted(mesh.regions) == ["Volume1", "Volume2"]


def test_solids_of_other_physics(read):
    assert read(BRICK.replace("C3D8", "DC3D8")).cell_count == 2
    assert read(BRICK.replace("C3D8", "C3D8RH")).cell_count == 2
    with pytest.raises(FileFormatError, match=r"inp:14: \*ELEMENT: TYPE=C3D9.*mean C3D8"):
        read(BRICK.replace("C3D8", "C3D9"))


def test_lines_on_plane_cells(read):
    text = (
        "*NODE\n1,0,0,0\n2,1,0,0\n3,1,1,0\n4,0,1,0\n*ELEMENT,TYPE=CPS4,ELSET=plate\n1,1,2,3,4\n"
        "*ELEMENT,TYPE=T3D2,ELSET=low\n2,1,2\n"
    )
    mesh = read(text)
    assert mesh.dim == 2
    np.testing.assert_array_equal(np.sort(mesh.surface_nodes("low")), [0, 1])


def test_of_second_order_with_faces(read):
    nodes = "1,0,0,0\n2,1,0,0\n3,0,1,0\n4,0,0,1\n"
    middle = "5,.5,0,0\n6,.5,.5,0\n7,0,.5,0\n8,0,0,.5\n9,.5,0,.5\n10,0,.5,.5\n"
    text = (
        f"*NODE\n{nodes}{middle}*ELEMENT, TYPE=CPS6, ELSET=floor\n1, 1,2,3,5,6,7\n"
        "*ELEMENT, TYPE=C3D10, ELSET=body\n2, 1,2,3,4,5,6,7,8,9,10\n"
    )
    mesh = read(text)
    assert mesh.cells[0].kind == "tet10"
    assert mesh.surface_nodes("floor").size == 6


def test_parts_and_instances_and_what_follows_the_first_step(read):
    part = f"*PART, NAME=Block\n{BRICK}*NSET, NSET=Low\n1,2,3,4\n*END PART\n"
    text = part + (
        "*ASSEMBLY, NAME=all\n*INSTANCE, NAME=Down, PART=Block\n*END INSTANCE\n"
        "*INSTANCE, NAME=Up, PART=Block\n0, 0, 5\n*END INSTANCE\n*END ASSEMBLY\n"
        "*STEP\n*NONSENSE\n*END STEP\n"
    )
    mesh = read(text)
    assert sorted(mesh.regions) == ["Down.Volume1", "Down.Volume2", "Up.Volume1", "Up.Volume2"]
    np.testing.assert_allclose(mesh.points[mesh.surface_nodes("Up.Low"), 2], 5)


def test_glue(read):
    mesh = read(BRICK, glue=False)
    assert len(mesh.points) == 16


def test_no_elements(read):
    with pytest.raises(FileFormatError, match=r"part\.inp: expected a mesh, got no elements"):
        read("*NODE\n1, 0, 0, 0\n")
