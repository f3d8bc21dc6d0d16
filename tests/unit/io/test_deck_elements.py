"""Decks with elements of second order, around an axis, warm, orthotropic."""

import gzip
from pathlib import Path

import meshio
import numpy as np
import pytest

import amontons as am
from amontons.core.errors import FileFormatError
from amontons.io.decks.case import read
from amontons.mechanics.meshes import second_order
from amontons.mechanics.meshes.cells import CELLS
from amontons.mechanics.meshes.check import is_straight
from amontons.mechanics.meshes.write import with_all_kinds

TESTS = Path("/usr/share/doc/calculix-ccx-test/examples/test")


def found(name):
    for path in (TESTS / name, TESTS / f"{name}.gz"):
        if path.exists():
            return path
    return pytest.skip("CalculiX' tests are not installed")


def printed(name):
    """The last displacements of a .dat.ref, by node."""
    path, out, on = found(f"{name}.dat.ref"), {}, False
    with gzip.open(path, "rt") if path.suffix == ".gz" else path.open() as file:
        for line in file:
            words = line.split()
            if words[:1] == ["displacements"]:
                out, on = {}, True
            elif words[1:2] == ["(elem,"]:
                on = False
            elif on and len(words) == 4:
                out[int(words[0])] = [float(word) for word in words[1:]]
    return np.array([out[number] for number in sorted(out)])


@pytest.mark.parametrize(("name", "error"), [
    ("ring2", 3e-4),  # two rings of CAX8, press fit
    ("ring1", 3e-3),  # one of them is heated; CalculiX' strain is finite, 0.24 %
    ("contact4", 0.035),  # one C3D20 on another: contact is coarser here, see docs/decks.md
    ("punch1", 0.11),  # three facets below a punch
])  # fmt: skip
def test_displacements_of_calculix(name, error):
    solution = am.solve(read(found(f"{name}.inp")).target)
    expected = printed(name)[:, : solution.model.dimension]
    off = np.concatenate(solution.displacement) - expected
    assert np.abs(off).max() < error * np.abs(expected).max()


def test_stress_of_a_plate_of_two_elements():
    """100 N on 3.825 mm of thickness 1: an even stress, whatever CPS8R's own modes do."""
    solution = am.solve(read(found("plate.inp")).target)
    assert solution.pressure == pytest.approx(26.14187, rel=1e-3)


DECK = """*NODE, NSET=NALL
1, 1., 0.
2, 2., 0.
3, 2., 1.
4, 1., 1.
5, 1., 1.
6, 2., 1.
7, 2., 2.
8, 1., 2.
*ELEMENT, TYPE={kind}, ELSET=ALL
1, 1, 2, 3, 4
2, 5, 6, 7, 8
*MATERIAL, NAME=M
*ELASTIC{elastic}
*EXPANSION{expansion}
*ORIENTATION, NAME=O
0., 1., 0., -1., 0., 0.
*SOLID SECTION, ELSET=ALL, MATERIAL=M{section}
*SURFACE, NAME=UP
1, S3
*SURFACE, NAME=DOWN
2, S1
*SURFACE INTERACTION, NAME=I
*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=HARD
*CONTACT PAIR, INTERACTION=I, TYPE=SURFACE TO SURFACE
DOWN, UP
*INITIAL CONDITIONS, TYPE=TEMPERATURE
NALL, 20.
*BOUNDARY
1, 2
2, 2
7, 2
8, 2
{held}*STEP
*STATIC
1., 1.
*TEMPERATURE
NALL, 120.
*END STEP
"""


AT_SIDES = "1, 1\n8, 1\n"


def solved(tmp_path, kind="CAX4", elastic="\n1000., 0.", expansion="\n1.E-5", section=""):
    path = tmp_path / "deck.inp"
    path.write_text(DECK.format(kind=kind, elastic=elastic, expansion=expansion,
                                section=section, held=AT_SIDES * (kind != "CAX4")))
    return am.solve(read(path).target)


def test_temperature_and_axis(tmp_path):
    """Two rings between plates: pressure E alpha T, the force around is area times that."""
    solution = solved(tmp_path)
    assert solution.pressure == pytest.approx(1.0)
    assert solution.fields.force[:, 1].sum() == pytest.approx(3 * np.pi)
    assert solution.model.axisymmetric


@pytest.mark.parametrize("kind", ["CPE4", "CPS4"])
def test_orthotropic_and_turned(tmp_path, kind):
    """Axis 1 stands upright: stress E1 alpha1 T without Poisson's effect."""
    constants = "ENGINEERING CONSTANTS\n4000., 500., 300., 0., 0., 0., 100., 100.,\n100."
    solution = solved(tmp_path, kind, f", TYPE={constants}",
                      ", TYPE=ORTHO\n2.E-5, 1.E-5, 1.E-5", ", ORIENTATION=O")  # fmt: skip
    assert solution.pressure == pytest.approx(4000 * 2e-5 * 100)
    stiff = solved(tmp_path, kind, ", TYPE=ORTHO\n4000., 0., 500., 0., 0., 300., 100., 100.,\n"
                   "100.", "\n2.E-5", ", ORIENTATION=O")  # fmt: skip
    assert stiff.pressure == pytest.approx(8.0)


@pytest.mark.parametrize(("change", "words"), [
    ({"elastic": ", TYPE=ENGINEERING CONSTANTS\n1., 1., 1."}, "9 constants.*got 3"),
    ({"elastic": ", TYPE=ANISO\n1., 1."}, "TYPE=ANISO: is not read"),
    ({"expansion": "\n1.E-5, 20.\n2.E-5, 100."}, "several temperatures"),
    ({"expansion": ", TYPE=ORTHO\n1.E-5"}, "expected 3 numbers"),
    ({"section": ", ORIENTATION=P"}, "orientation P: not found"),
])  # fmt: skip
def test_what_is_refused(tmp_path, change, words):
    with pytest.raises(FileFormatError, match=f"deck.inp.*{words}"):
        solved(tmp_path, **change)


def test_a_temperature_without_expansion_is_said(tmp_path):
    path = tmp_path / "deck.inp"
    text = DECK.format(kind="CPE4", elastic="\n1000., 0.", expansion="\n0.", section="",
                       held=AT_SIDES)  # fmt: skip
    path.write_text(text)
    assert any("no material has an *EXPANSION" in note for note in read(path).notes)


# -------------------------------------------------------------------------------- meshes
@pytest.mark.parametrize("kind", [k for k in CELLS if CELLS[k].order == 2 and k != "line3"])
@pytest.mark.parametrize("suffix", ["msh", "vtu"])
def test_meshes_of_second_order_in_files(tmp_path, kind, suffix):
    """meshio orders nodes of gmsh's elements by a table of its own."""
    first = {"tri6": "tri", "quad8": "quad", "quad9": "quad", "tet10": "tet"}.get(kind, "hex")
    mesh = am.box((1,) * (2 if first in ("tri", "quad") else 3), 2, first)
    if kind == "wedge15":
        n = mesh.cells[0].nodes
        halves = np.concatenate([n[:, [0, 1, 2, 4, 5, 6]], n[:, [0, 2, 3, 4, 6, 7]]])
        mesh = am.Mesh(mesh.points, (am.Cells("wedge", halves),))
    mesh = second_order(mesh, serendipity=kind in ("quad8", "hex20", "wedge15"))
    names = {"tri6": "triangle6", "tet10": "tetra10", "hex20": "hexahedron20",
             "hex27": "hexahedron27"}  # fmt: skip
    points = np.pad(mesh.points, [(0, 0), (0, 3 - mesh.dim)])
    whole = with_all_kinds().Mesh(points, [(names.get(kind, kind), mesh.cells[0].nodes)])
    path = tmp_path / f"mesh.{suffix}"
    if suffix == "msh":
        meshio.gmsh.write(path, whole, fmt_version="2.2", binary=False)
    else:
        whole.write(path)
    found = am.read_mesh(path)
    assert found.cells[0].kind == kind and found.dim == mesh.dim
    assert is_straight(CELLS[kind], found.points[found.cells[0].nodes])
    np.testing.assert_array_equal(found.cells[0].nodes, mesh.cells[0].nodes)
