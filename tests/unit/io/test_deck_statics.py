"""Decks without contact: statics, by exact values; options and delays of what loads them."""

from dataclasses import replace

import numpy as np
import pytest

import amontons as am
from amontons.mechanics.elements.elasticity import body_load
from amontons.mechanics.meshes import second_order
from tests.unit.io.test_decks import case_of

BRICK = """*NODE, NSET=NALL
1, 0, 0, 0
2, 1, 0, 0
3, 1, 1, 0
4, 0, 1, 0
5, 0, 0, 1
6, 1, 0, 1
7, 1, 1, 1
8, 0, 1, 1
*ELEMENT, TYPE=C3D8, ELSET=EALL
1, 1, 2, 3, 4, 5, 6, 7, 8
*MATERIAL, NAME=M
*ELASTIC
100., 0.25
*SOLID SECTION, ELSET=EALL, MATERIAL=M
*BOUNDARY
1, 1, 3
2, 2, 3
3, 3, 3
4, 1, 1
4, 3, 3
5, 1, 2
8, 1, 1
6, 2, 2
*AMPLITUDE, NAME=A
0., 0., 1., 1., 3., 3.
*STEP
*STATIC
.5, 2.
*CLOAD
5, 3, 1.
6, 3, 1.
7, 3, 1.
8, 3, 1.
*END STEP
"""


def ends_of(case):
    found = am.evolve(case.in_time, case.evolution.method, until=case.evolution.until)
    return {round(step.time, 6): step.displacement[0] for step in found}


@pytest.mark.parametrize(("card", "line", "words"), [
    ("BOUNDARY", "NONE, 1, 3", "node set NONE: is empty"),
    ("CLOAD", "NONE, 1, 3.", "node set NONE: is empty"),
    ("TEMPERATURE", "NONE, 10.", "node set NONE: is empty"),
    ("DLOAD", "NOBODY, P1, 1.", "NOBODY P1': holds no"),
    ("DLOAD", "NOBODY, GRAV, 9.81, 0, 0, -1", "element set NOBODY: is empty"),
    ("DSLOAD", "NOFACE, P, 1.", "NOFACE': holds no"),
])  # fmt: skip
def test_supports_and_loads_of_empty_sets_are_refused(tmp_path, card, line, words):
    """They did nothing, without a word: a body could be held less than its deck says."""
    deck = BRICK.replace(
        "*BOUNDARY\n1", "*NSET, NSET=NONE\n*ELSET, ELSET=NOBODY\n*SURFACE, NAME=NOFACE\n"
        "*BOUNDARY\n1",
    )  # fmt: skip
    with pytest.raises(am.FileFormatError, match=words):
        case_of(tmp_path, deck.replace("*CLOAD", f"*{card}\n{line}\n*CLOAD"))


def test_a_pulled_brick(tmp_path):
    case = case_of(tmp_path, BRICK)
    assert any("no contact in this deck" in note for note in case.notes)
    u = am.solve(case.model).displacement[0]
    np.testing.assert_allclose(u[4:, 2], 0.04, rtol=1e-9)  # 4 / (E A)
    np.testing.assert_allclose(u[[1, 2], 0], -0.01, rtol=1e-9)


@pytest.mark.parametrize(("delay", "factors"), [("", (0.5, 2.0)), (", TIME DELAY=1.", (0, 1))])
def test_a_load_that_comes_later(tmp_path, delay, factors):
    text = BRICK.replace("*CLOAD\n", f"*CLOAD, AMPLITUDE=A{delay}\n")
    ends = ends_of(case_of(tmp_path, text))
    for time, factor in zip((0.5, 2.0), factors, strict=True):
        np.testing.assert_allclose(ends[time][4:, 2], 0.04 * factor, rtol=1e-9, atol=1e-14)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("*CLOAD\n", "*CLOAD, LOAD CASE=2\n", r":30: \*CLOAD: LOAD CASE.*imaginary"),
        ("*STEP\n", "*STEP, PERTURBATION\n", r"\*STEP.*PERTURBATION.*step before"),
        ("*STATIC\n", "*STATIC, RIKS\n", "RIKS.*with the state"),
        ("*ELASTIC\n", "*ELASTIC, DEPENDENCIES=1\n", r":13: \*ELASTIC.*DEPENDENCIES"),
        ("ELSET=EALL, MATERIAL=M", "ELSET=EALL, MATERIAL=M, COMPOSITE", "COMPOSITE"),
        ("*AMPLITUDE, NAME=A\n", "*AMPLITUDE, NAME=A, SMOOTH=.25\n", "SMOOTH"),
        ("TYPE=C3D8, ELSET", "TYPE=C3D8, OFFSET=100, ELSET", r":10: \*ELEMENT.*OFFSET"),
    ],
)
def test_options_that_change_the_answer_are_errors(tmp_path, old, new, words):
    text = BRICK.replace(old, new)
    assert text != BRICK
    with pytest.raises(am.FileFormatError, match=words):
        case_of(tmp_path, text)


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("*CLOAD\n", "*CLOAD, LOAD CASE=1\n"),
        ("*STEP\n", "*STEP, NAME=PULL, UNSYMM=YES, PERTURBATION=NO\n"),
        ("*NODE, NSET=NALL\n", "*NODE, NSE=NALL\n"),  # the first letters will do
        ("MATERIAL=M\n*B", "MATER=M\n*B"),
        ("*AMPLITUDE, NAME=A\n", "*AMPLITUDE, NAME=A, VALUE=RELATIVE\n"),
    ],
)
def test_options_that_say_what_is_so_anyway(tmp_path, old, new):
    text = BRICK.replace(old, new)
    assert text != BRICK
    u = am.solve(case_of(tmp_path, text).model).displacement[0]
    np.testing.assert_allclose(u[4:, 2], 0.04, rtol=1e-9)


def test_an_option_left_out_at_the_users_risk(tmp_path):
    text = BRICK.replace("*ELASTIC\n", "*ELASTIC, DEPENDENCIES=1\n")
    case = case_of(tmp_path, text, "deck.allow=[ELASTIC.DEPENDENCIES]")
    assert any("AT YOUR RISK: DEPENDENCIES" in note for note in case.notes)


def test_bricks_that_feel_no_bending_are_no_answer(tmp_path):
    """One brick of second order, reduced integration and few supports: it hourglasses."""
    corners = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], dtype=float)
    corners = np.vstack([corners, corners + [0, 0, 1]])
    pairs = [(0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4),
             (0, 4), (1, 5), (2, 6), (3, 7)]  # fmt: skip
    points = np.vstack([corners, [(corners[a] + corners[b]) / 2 for a, b in pairs]])
    nodes = [f"{k + 1}, {x}, {y}, {z}" for k, (x, y, z) in enumerate(points)]
    head = "\n".join(["*NODE", *nodes, "*ELEMENT, TYPE=C3D20R, ELSET=EALL",
                      "1, " + ", ".join(map(str, range(1, 16))) + ",",
                      ", ".join(map(str, range(16, 21)))])  # fmt: skip
    text = head + "\n" + BRICK[BRICK.index("*MATERIAL") :]
    with pytest.raises(am.NotConverged, match="without a strain"):
        am.solve(case_of(tmp_path, text).model)


def pulls(case):
    """What the supports hold, (3,), and its moment about the origin."""
    found = am.solve(case.model)
    return found.fields.reaction[0].sum(axis=0)


SPUN = BRICK.replace("*SOLID", "*DENSITY\n2.\n*SOLID")


def loaded(*lines):
    begin, end = SPUN.index("*CLOAD"), SPUN.index("*END STEP")
    return SPUN[:begin] + "\n".join(["*DLOAD", *lines, SPUN[end:]])


def test_a_brick_that_turns_about_an_axis(tmp_path):
    """The load: rho omega^2 V times the way of the middle from the axis, 2 * 9 * (1, -1/2)."""
    case = case_of(tmp_path, loaded("EALL, CENTRIF, 9., -.5, 1., 7., 0., 0., 2."))
    np.testing.assert_allclose(pulls(case), [-18.0, 9.0, 0.0], atol=1e-10)
    tilted = case_of(tmp_path, loaded("EALL, CENTRIF, 9., 0., 0., 0., 1., 1., 0."))
    np.testing.assert_allclose(pulls(tilted), [0.0, 0.0, -9.0], atol=1e-10)


def test_loads_along_two_directions_add_up_and_along_one_replace_each_other(tmp_path):
    lines = ("EALL, GRAV, 3., 1., 0., 0.", "EALL, GRAV, 4., 0., 0., -2.",
             "EALL, GRAV, 5., 2., 0., 0.")  # fmt: skip
    np.testing.assert_allclose(pulls(case_of(tmp_path, loaded(*lines))), [-10, 0, 8], atol=1e-9)


def test_a_turn_that_grows_over_time(tmp_path):
    case = case_of(tmp_path, loaded("EALL, CENTRIF, 9., 0., 0., 0., 0., 0., 1."))
    ends = ends_of(case)
    np.testing.assert_allclose(ends[2.0], 4 * ends[0.5], atol=1e-12)
    assert ends[2.0][6, 0] > 0


@pytest.mark.parametrize(
    "line", ["CENTRIF, 9., 0., 0., 1.", "CENTRIF, 9., 0., 0., 0., 0., 0., 0."]
)
def test_an_axis_needs_a_point_and_a_direction(tmp_path, line):
    with pytest.raises(am.FileFormatError, match="CENTRIF: expected.*a point and a direction"):
        case_of(tmp_path, loaded(f"EALL, {line}"))


def test_reduced_integration_holds_for_loads_in_bodies_too():
    """On a curved cell they are other numbers; the sum is that of the points' volume."""
    mesh = replace(am.box((1, 1), 1, origin=(1, 0)), axisymmetric=True)
    cells = second_order(mesh, serendipity=True)
    less = tuple(replace(c, integration="reduced") for c in cells.cells)
    reduced = replace(cells, cells=less)
    force = np.stack([cells.points[:, 0] ** 2, 0 * cells.points[:, 0]], axis=1)
    full, less = body_load(cells, force), body_load(reduced, force)
    assert np.abs(full - less).max() > 1e-3 * np.abs(full).max()
    np.testing.assert_allclose(less.sum(axis=0), full.sum(axis=0), rtol=2e-3)
