"""Rigid tools of decks and case files: analytic surfaces that a node moves or presses."""

import numpy as np
import pytest

import amontons as am
from tests.unit.io.test_decks import case_of, solved

N = 6  # cells along a side


def plate(kind="CPE4", surface="TYPE=SEGMENTS", profile="START, 3., 4.\nCIRCL, 0., 1., 0., 4.\n"
          "CIRCL, -3., 4., 0., 4.", step="", model=""):  # fmt: skip
    """A plate 2 x 1 about x = 0 (of CAX4 from x = 0 on) under a tool of radius 3."""
    begin = 0.0 if kind.startswith("CAX") else -1.0
    nodes = [f"{1 + i + j * (N + 1)}, {begin + (1 - begin) * i / N}, {j / N}"
             for j in range(N + 1) for i in range(N + 1)]  # fmt: skip
    cells = [
        f"{1 + i + j * N}, " + ", ".join(
            str(1 + i + a + (j + b) * (N + 1)) for a, b in ((0, 0), (1, 0), (1, 1), (0, 1)))
        for j in range(N) for i in range(N)
    ]  # fmt: skip
    upper = "\n".join(f"{1 + i + (N - 1) * N}, S3" for i in range(N))
    low = ", ".join(str(1 + i) for i in range(N + 1))
    return "\n".join([
        "*NODE, NSET=ALL", *nodes, "999, 0., 4., 0.", f"*ELEMENT, TYPE={kind}, ELSET=E", *cells,
        f"*NSET, NSET=LOW\n{low}", f"*SURFACE, NAME=TOP\n{upper}",
        "*MATERIAL, NAME=M\n*ELASTIC\n1000., 0.3\n*SOLID SECTION, ELSET=E, MATERIAL=M\n1.",
        f"*SURFACE, {surface}, NAME=ROUND\n{profile}",
        "*RIGID BODY, ANALYTICAL SURFACE=ROUND, REF NODE=999",
        "*SURFACE INTERACTION, NAME=I\n*FRICTION\n0.2,",
        "*CONTACT PAIR, INTERACTION=I\nTOP, ROUND", model or "*BOUNDARY\nLOW, 1, 2",
        f"*STEP\n*STATIC\n{step}\n*END STEP\n",
    ])  # fmt: skip


DOWN = "*BOUNDARY\n999, 1, 1, 0.\n999, 2, 2, -.01\n999, 6, 6, 0."
PRESS = "*BOUNDARY\n999, 1, 1, 0.\n999, 6, 6, 0.\n*CLOAD\n999, 2, "


@pytest.mark.parametrize("kind", ["CPE4", "CPS4", "CAX4"])
def test_a_tool_moved_and_a_tool_pressed(tmp_path, kind):
    """The reaction of the node presses it as far; it is that of the same disc by hand."""
    moved = solved(tmp_path, plate(kind, step=DOWN))
    reaction = float(moved.references["node 999"].force[1])
    assert reaction < 0
    assert moved.resultant[1] == pytest.approx(reaction, rel=1e-9)
    pressed = solved(tmp_path, plate(kind, step=f"{PRESS}{reaction!r}"))
    assert pressed.references["node 999"].displacement[1] == pytest.approx(-0.01, rel=1e-7)
    assert np.allclose(pressed.displacement[0], moved.displacement[0], atol=1e-9)
    body = moved.model.bodies[0]
    disc = am.Sphere((0, 3.99), 3.0)
    contact = am.Contact("TOP", disc, mu=0.2, method="mortar")
    supports = [s for s in moved.model.supports if "node" not in s.on]
    still = am.solve(am.Model([body], supports, [contact]), tolerance=1e-10)
    assert still.resultant[1] == pytest.approx(reaction, rel=0.01)  # normals of another place


def test_the_way_of_the_profile_does_not_matter(tmp_path):
    """The slave tells on which side the material is."""
    back = "START, -3., 4.\nCIRCL, 0., 1., 0., 4.\nCIRCL, 3., 4., 0., 4."
    one = solved(tmp_path, plate(step=DOWN))
    other = solved(tmp_path, plate(step=DOWN, profile=back))
    assert np.allclose(one.displacement[0], other.displacement[0], atol=1e-10)


def test_equations_and_turned_axes_beside_a_tool(tmp_path):
    """Numbers of nodes are those of the elements' body."""
    top = 1 + N * (N + 1)
    more = (f"*BOUNDARY\nLOW, 1, 2\n*EQUATION\n2\n{top}, 1, 1., {top + N}, 1, 1.\n"
            f"*TRANSFORM, NSET=LOW, TYPE=R\n0., 1., 0., -1., 0., 0.")  # fmt: skip
    with_them = solved(tmp_path, plate(step=DOWN, model=more))
    without = solved(tmp_path, plate(step=DOWN))
    # the answer is symmetric by itself, up to the stick of friction
    assert np.allclose(with_them.displacement[0], without.displacement[0], atol=1e-9)


@pytest.mark.parametrize(("kind", "head", "profile"), [
    ("CYLINDER", "0., 0., 4., 1., 0., 4.\n0., -1., 4.", None),
    ("REVOLUTION", "0., 0., 4., 0., 0., 5.", "START, 0., -3.\nCIRCL, 3., 0., 0., 0."),
])  # fmt: skip
def test_tools_in_space(tmp_path, kind, head, profile):
    """A block under a rod along y, or a ball: as obstacles by hand that stand lower."""
    mesh = am.box((2, 2, 1), (4, 4, 3))
    x = mesh.points - (1, 1, 0)
    profile = profile or "START, -3., 0.\nCIRCL, 0., -3., 0., 0.\nCIRCL, 3., 0., 0., 0."
    upper = [k + 1 for k, c in enumerate(mesh.cells[0].nodes) if x[c, 2].max() > 0.99]
    low = np.flatnonzero(x[:, 2] == 0) + 1
    text = "\n".join([
        "*NODE", *(f"{k + 1}, {p[0]}, {p[1]}, {p[2]}" for k, p in enumerate(x)),
        "999, 0., 0., 4.", "*ELEMENT, TYPE=C3D8, ELSET=E",
        *(f"{k + 1}, " + ", ".join(str(n + 1) for n in c)
          for k, c in enumerate(mesh.cells[0].nodes)),
        "*NSET, NSET=LOW", *map(str, low), "*SURFACE, NAME=TOP", *(f"{k}, S2" for k in upper),
        "*MATERIAL, NAME=M\n*ELASTIC\n1000., 0.3\n*SOLID SECTION, ELSET=E, MATERIAL=M",
        f"*SURFACE, TYPE={kind}, NAME=ROUND\n{head}\n{profile}",
        "*RIGID BODY, ANALYTICAL SURFACE=ROUND, REF NODE=999",
        "*SURFACE INTERACTION, NAME=I\n*FRICTION\n0.2,\n*CONTACT PAIR, INTERACTION=I",
        "TOP, ROUND\n*BOUNDARY\nLOW, 1, 3\n*STEP\n*STATIC\n*BOUNDARY\n999, 1, 2\n999, 4, 6",
        "999, 3, 3, -.01\n*END STEP\n",
    ])  # fmt: skip
    found = solved(tmp_path, text)
    force = found.references["node 999"].force
    assert np.allclose(force[:2], 0, atol=1e-6)
    round_ = (am.Cylinder((0, 0, 3.99), (0, 1, 0), 3) if kind == "CYLINDER"
              else am.Sphere((0, 0, 3.99), 3))  # fmt: skip
    body = found.model.bodies[0]
    contact = am.Contact("TOP", round_, mu=0.2, method="mortar")
    still = am.solve(
        am.Model([body], [s for s in found.model.supports if "node" not in s.on], [contact]),
        tolerance=1e-10,
    )
    assert still.resultant[2] == pytest.approx(force[2], rel=0.01)


@pytest.mark.parametrize(("change", "words"), [
    ({"surface": "TYPE=CYLINDER"}, "TYPE=CYLINDER: expected SEGMENTS in 2D"),
    ({"profile": "LINE, 3., 4."}, "START: missing"),
    ({"profile": "START, 3., 4."}, "expected at least one end of a line or arc"),
    ({"profile": "START, 3., 4.\nPARAB, 1, 2, 3, 4"}, "PARAB: expected LINE or CIRCL"),
    ({"profile": "START, 3., 4.\nLINE, 1."}, "LINE: expected 2 numbers, got 1"),
    ({"profile": "START, 3., 4.\nCIRCL, -3., 4., 0., 4."}, "arc of less than 180 degrees"),
    ({"model": "*TIE, NAME=T\nTOP, ROUND\n*BOUNDARY\nLOW, 1, 2"}, "surface ROUND: not found"),
])  # fmt: skip
def test_what_is_wrong_is_said_with_its_line(tmp_path, change, words):
    with pytest.raises(am.FileFormatError, match=rf"deck.inp:\d+: .*{words}"):
        case_of(tmp_path, plate(step=DOWN, **change))
    card = "*RIGID BODY, ANALYTICAL SURFACE=ROUND, REF NODE=999\n"
    bare = plate(step=DOWN).replace(card, "")
    with pytest.raises(am.FileFormatError, match="expected a \\*RIGID BODY, ANALYTICAL SURF"):
        case_of(tmp_path, bare)


# --------------------------------------------------------------------------- case files
TOOL = """
[[mesh]]
name = "plate"
box = [2, 1]
cells = [6, 6]
move = [-1, 0]
[[mesh]]
name = "punch"
box = [1, 1]
cells = 1
move = [0, 5]
[material.plate]
young = 1000
poisson = 0.3
[material.punch]
law = "rigid"
[[fix]]
on = "plate.bottom"
value = [0, 0]
[[fix]]
on = "punch.top"
value = [0, -0.01]
[[contact]]
slave = "plate.top"
follows = "punch"
method = "mortar"
friction = { coulomb = 0.2 }
"""
DISC = "obstacle = { sphere = { center = [0, 4], radius = 3 } }\n"
PROFILE = """[contact.obstacle.profile]
start = [-3, 4]
steps = [{ end = [0, 1], center = [0, 4] }, { end = [3, 4], center = [0, 4] }]
"""


def test_a_case_file_has_tools(tmp_path):
    deck = solved(tmp_path, plate(step=DOWN))
    wanted = deck.references["node 999"].force
    path = tmp_path / "case.toml"
    turned = PROFILE.replace("-3, 4", "3, 4", 1).replace("[3, 4], ", "[-3, 4], ")
    for obstacle in (DISC, turned):
        path.write_text(TOOL + obstacle)
        found = am.solve(am.read_case(path).model, tolerance=1e-10)
        assert found.supports["punch.top"].force == pytest.approx(wanted, rel=1e-7, abs=1e-9)


@pytest.mark.parametrize(("old", "new", "words"), [
    ('follows = "punch"', 'follows = "lunch"', "contact[0].follows: body 'lunch': not found"),
    ("end = [0, 1]", "end = [0, 1, 2]", "steps[0].end: expected a list of 2 numbers"),
    ("center = [0, 4] }, {", "center = [0, 3] }, {", "steps[0]: expected an arc, its ends are"),
    ("start = [-3, 4]\n", "", "profile.start: missing"),
    ("profile]", "profil]", "unknown key"),
])  # fmt: skip
def test_what_is_wrong_of_a_case_is_said_with_its_key(tmp_path, old, new, words):
    path = tmp_path / "case.toml"
    path.write_text((TOOL + PROFILE).replace(old, new))
    with pytest.raises(am.FileFormatError) as caught:
        am.read_case(path)
    assert words in str(caught.value)
