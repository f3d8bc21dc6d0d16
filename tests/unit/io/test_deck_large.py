"""Decks with *HYPERELASTIC and NLGEOM: finite strains, beside CalculiX."""

import shutil
import subprocess

import numpy as np
import pytest

import amontons as am
from amontons.core.errors import FileFormatError
from amontons.io.answers.frd import read_frd
from amontons.io.readers import read_case

CCX = pytest.mark.skipif(shutil.which("ccx") is None, reason="CalculiX is not installed")
DECK = """*HEADING
two cubes, pulled and sheared
*NODE, NSET=ALL
1, 0., 0., 0.
2, 1., 0., 0.
3, 1.1, 1., 0.
4, 0., 1., 0.1
5, 0., 0., 1.
6, 1., 0.1, 1.
7, 1., 1., 1.
8, -0.1, 1., 1.
9, 0., 0., 2.
10, 1., 0., 2.
11, 1., 1., 2.
12, 0., 1., 2.
*ELEMENT, TYPE=C3D8, ELSET=CUBES
1, 1, 2, 3, 4, 5, 6, 7, 8
2, 5, 6, 7, 8, 9, 10, 11, 12
*MATERIAL, NAME=M
{material}
*SOLID SECTION, ELSET=CUBES, MATERIAL=M
*BOUNDARY
1, 1, 3
2, 1, 3
3, 1, 3
4, 1, 3
*STEP, {nlgeom}
*STATIC
0.25, 1.
*CLOAD
9, 1, 0.06
10, 3, 0.1
11, 2, -0.05
*NODE FILE
U
*END STEP
"""
LAWS = {
    "*HYPERELASTIC, NEO HOOKE\n0.5, 0.4": am.MooneyRivlin(0.5, 0.0, 5.0),
    "*HYPERELASTIC, MOONEY-RIVLIN\n0.4, 0.1, 0.4": am.MooneyRivlin(0.4, 0.1, 5.0),
    "*HYPERELASTIC, YEOH\n0.5, -0.05, 0.02, 0.4, 1e20, 1e20":
        am.ReducedPolynomial((0.5, -0.05, 0.02), 5.0),
    "*HYPERELASTIC, REDUCED POLYNOMIAL, N=2\n0.5, 0.1, 0.4, 1e20":
        am.ReducedPolynomial((0.5, 0.1), 5.0),
    "*HYPERELASTIC, POLYNOMIAL\n0.4, 0.1, 0.4": am.MooneyRivlin(0.4, 0.1, 5.0),
    "*HYPERELASTIC, OGDEN\n1., 1.7, 0.": am.Ogden((1.0,), (1.7,), 20.0),
    "*HYPERELASTIC, OGDEN, N=2\n0.8, 1.3, 0.2, -2., 0.4, 1e20":
        am.Ogden((0.8, 0.2), (1.3, -2.0), 5.0),
    "*HYPERELASTIC, OGDEN, N=3\n0.6, 1.3, 0.1, 5., 0.2, -2., 0.4, 1e20\n1e20":
        am.Ogden((0.6, 0.1, 0.2), (1.3, 5.0, -2.0), 5.0),
    "*ELASTIC\n2.5, 0.25": am.SaintVenantKirchhoff(2.5, 0.25),
}  # fmt: skip


def deck(tmp_path, material, nlgeom="NLGEOM, INC=1000"):
    path = tmp_path / "cubes.inp"
    path.write_text(DECK.format(material=material, nlgeom=nlgeom))
    return path


def displacement(model):
    return am.solve(model).displacement[0]


def by_calculix(path):
    text = path.read_text().replace(
        "*STATIC", "*CONTROLS, PARAMETERS=FIELD\n1e-8, 1e-8\n*STATIC"
    )
    path.with_name("ccx.inp").write_text(text)
    run = {"cwd": path.parent, "check": True, "capture_output": True, "timeout": 60}
    subprocess.run(["ccx", "ccx"], **run)
    blocks = read_frd(path.with_name("ccx.frd")).blocks
    return [block for block in blocks if block.name == "DISP"][-1].values


@pytest.mark.parametrize("material", LAWS)
def test_the_law_of_a_deck(tmp_path, material):
    case = read_case(deck(tmp_path, material))
    (law,) = case.model.bodies[0].material.values()
    wanted = LAWS[material]
    assert type(law) is type(wanted)
    F = np.array([[[0.2, 0.1, 0.0], [0.0, -0.1, 0.3], [0.05, 0.0, 0.1]]])
    np.testing.assert_allclose(law.stress(F), wanted.stress(F), rtol=1e-13)


@CCX
@pytest.mark.parametrize("material", LAWS)
def test_large_strains_are_those_of_calculix(tmp_path, material):
    """Displacements of half an edge; CalculiX prints six digits."""
    path = deck(tmp_path, material)
    ours = displacement(read_case(path).model)
    theirs = by_calculix(path)
    assert abs(theirs).max() > 0.25
    np.testing.assert_allclose(ours, theirs, atol=2e-4 * abs(theirs).max())


def test_small_strains_where_they_are_asked_for(tmp_path):
    path = deck(tmp_path, "*ELASTIC\n2.5, 0.25")
    large, small = read_case(path), read_case(path, ["deck.small=true"])
    assert any("strains and rotations are finite" in note for note in large.notes)
    assert any("strains are taken as small (asked for)" in note for note in small.notes)
    linear = displacement(read_case(deck(tmp_path, "*ELASTIC\n2.5, 0.25", "INC=9")).model)
    np.testing.assert_allclose(displacement(small.model), linear, atol=1e-12)
    assert abs(displacement(large.model) - linear).max() > 0.01


@pytest.mark.parametrize("more", ["*EXPANSION\n1e-3", "*PLASTIC\n1e9, 0."])
def test_what_finite_strains_do_not_have_keeps_them_small(tmp_path, more):
    path = deck(tmp_path, f"*ELASTIC\n2.5, 0.25\n{more}")
    case = read_case(path)
    assert any(f"taken as small ({path}" in note and more[:5] in note for note in case.notes)


@pytest.mark.parametrize(("material", "message"), [
    ("*HYPERELASTIC, NEO HOOKE\n0.5", None),
    ("*HYPERELASTIC\n0.5, 0.4", "no law: is not read, expected one of NEO HOOKE"),
    ("*HYPERELASTIC, ARRUDA-BOYCE\n0.5, 0.4, 1.", "ARRUDA-BOYCE: is not read"),
    ("*HYPERELASTIC, OGDEN, N=9\n0.5, 0.4, 1.", "N=9: expected a number from 1 to 6"),
    ("*HYPERELASTIC, POLYNOMIAL, N=2\n0.5, 0.4, 1.", "N=2: expected a number from 1 to 1"),
    ("*HYPERELASTIC, OGDEN, N=2\n0.8, 1.3, 0.2", "expected 6 numbers, got 3"),
    ("*HYPERELASTIC, NEO HOOKE\n0.5, -1.", "D1: expected a number >= 0"),
    ("*HYPERELASTIC, NEO HOOKE\n0.5, 0.4, 20.\n0.5, 0.4, 90.", "several temperatures"),
    ("*HYPERELASTIC, YEOH\n0.5, 0.1, 0.1, 0.4, 0.1, 0.", "D2 and further ones"),
    ("*HYPERELASTIC, NEO HOOKE\n-0.5, 0.4", "shear modulus > 0"),
    ("*HYPERELASTIC, NEO HOOKE", "expected a line of data"),
])  # fmt: skip
def test_rubber_that_is_not_read(tmp_path, material, message):
    path = deck(tmp_path, material)
    if message is None:  # D1 left out is 0, which is said
        assert any("D1 is 0, a bulk modulus of 20" in note for note in read_case(path).notes)
        return
    with pytest.raises(FileFormatError, match=message) as found:
        read_case(path)
    assert "cubes.inp:" in str(found.value)


def pressed(law):
    """A block on a larger one, pressed and pushed aside."""
    lower = am.Body(am.box((2, 2, 1), (4, 4, 2), origin=(-0.5, -0.5, -1)), law, "lower")
    upper = am.Body(am.box((1, 1, 1), (2, 2, 2)), law, "upper", integration="full")
    lower = am.Body(lower.mesh, law, "lower", integration="full")
    supports = [am.Fix("lower.bottom", 0), am.Fix("upper.top", (0.1, 0.0, -0.15))]
    contact = am.Contact("upper.bottom", master="lower.top", mu=0.4)
    return am.Model([lower, upper], supports, [contact])


@pytest.mark.parametrize("dialect", ["calculix", "abaqus"])
@pytest.mark.parametrize("law", [*LAWS.values()][1:4] + [*LAWS.values()][6:], ids=repr)
def test_models_of_finite_strains_are_written_and_read_again(tmp_path, law, dialect):
    model = pressed(law)
    am.write_deck(model, tmp_path / "model.inp", dialect)
    there = read_case(tmp_path / "model.inp", ["deck.hard=true"]).model
    one, two = am.solve(model), am.solve(there)
    both = np.concatenate(one.displacement)
    np.testing.assert_allclose(np.concatenate(two.displacement), both, atol=1e-7)


@CCX
def test_contact_at_finite_strains_beside_calculix(tmp_path):
    """Smooth: rubber pressed by a seventh of its height, as far as CalculiX' facets
    of points and averages agree."""
    model = pressed(am.MooneyRivlin(0.4, 0.1, 5.0))
    supports = [am.Fix("lower.bottom", 0), am.Fix("upper.top", (0, 0, -0.15))]
    model = am.Model(model.bodies, supports,
                     [am.Contact("upper.bottom", master="lower.top", mu=0.0)])  # fmt: skip
    am.write_deck(model, tmp_path / "cubes.inp", penalty=1e4)
    theirs = by_calculix(tmp_path / "cubes.inp")
    ours = np.concatenate(am.solve(model).displacement)
    np.testing.assert_allclose(ours, theirs, atol=0.015 * abs(ours).max())
