"""Decks with equations, couplings, bolts, springs, turned axes: against CalculiX 2.20.

The numbers are those that CalculiX prints for these very decks; all of them carry a *TIE.
"""

from __future__ import annotations

import numpy as np
import pytest
from bar_deck import bar_deck, node

import amontons as am
from amontons.io.decks.case import read

LEAD = "*NODE\n9001, 1., 1., 4.\n9002, 0., 0., 0.\n"
HELD = "*BOUNDARY\nBOT, 1, 3\n"
TOP = [node(i, j, 4, upper=True) for j in range(3) for i in range(3)]
SECTION = "*SURFACE, NAME=SEC\n5, S2\n6, S2\n7, S2\n8, S2\n"
PRECISION = 2e-8  # of the digits that are printed


def case_of(folder, model, steps, **options):
    path = folder / "bar.inp"
    path.write_text(bar_deck(model, steps))
    return read(path, **options)


def step(*loads):
    lines = "".join(f"{load}\n" for load in loads)
    return f"*STEP\n*STATIC\n1., 1.\n*CLOAD\n{lines}*END STEP\n"


def top_of(solution):
    """Displacements of the nodes of the top, by their number in the deck."""
    points = solution.model.bodies[0].mesh.points
    at = np.flatnonzero(points[:, 2] == 4)
    return dict(zip(TOP, solution.displacement[0][at], strict=True))


def bottom_force(solution):
    """The force of the support of the bottom, whatever its number."""
    mesh = solution.model.bodies[0].mesh
    (name,) = (
        name for name in solution.supports
        if not mesh.points[mesh.node_sets.get(name, [-1]), 2].any()
    )
    return solution.supports[name].force


def wanted(solution, numbers):
    found = top_of(solution)
    for label, values in numbers.items():
        np.testing.assert_allclose(found[label], values, atol=PRECISION)


def test_equations(tmp_path):
    equal = "".join(f"2\n{a}, 3, 1., {TOP[8]}, 3, -1.\n" for a in TOP[1:8])
    chain = f"3\n{TOP[0]}, 3, 2., {TOP[1]}, 3, -1., {TOP[2]}, 3, -1.\n"
    case = case_of(tmp_path, f"*EQUATION\n{equal}{chain}{HELD}",
                   step(f"{TOP[8]}, 3, -20.", f"{TOP[4]}, 1, 3."))  # fmt: skip
    found = am.solve(case.target)
    wanted(found, {1037: (1.463542e-02, -1.346553e-03, -1.943987e-02),
                   1042: (1.797168e-02, 0, -1.943987e-02)})  # fmt: skip
    np.testing.assert_allclose(bottom_force(found), (-3, 0, 20), atol=1e-9)


def test_a_rigid_body_with_its_nodes(tmp_path):
    case = case_of(
        tmp_path, f"{LEAD}*RIGID BODY, NSET=TOP, REF NODE=9001, ROT NODE=9002\n{HELD}",
        step("9001, 1, 2.", "9001, 3, -5.", "9002, 1, 0.4", "9002, 3, 0.7"),
    )  # fmt: skip
    found = am.solve(case.target)
    lead = found.references["node 9001"]
    np.testing.assert_allclose(
        lead.displacement, (3.130583e-02, -2.022556e-03, -4.720050e-03), atol=PRECISION
    )
    np.testing.assert_allclose(
        lead.rotation, (1.011278e-03, 1.011278e-02, 2.73e-03), atol=PRECISION
    )
    np.testing.assert_allclose(lead.moment, (0.4, 0, 0.7), atol=1e-9)
    wanted(found, {1039: (3.403583e-02, 7.074437e-04, -1.584411e-02)})


@pytest.mark.parametrize(("card", "numbers"), [
    ("*KINEMATIC\n1, 3", {1037: (3.130583e-02, -2.022556e-03, 4.381454e-03)}),
    ("*DISTRIBUTING\n1, 6", {1037: (3.092088e-02, -2.020994e-04, 5.260952e-03),
                             1042: (3.179585e-02, 0, -1.505885e-02)}),
])  # fmt: skip
def test_couplings(tmp_path, card, numbers):
    turn = ["9001, 4, 0.4"] if "KIN" in card else []
    case = case_of(
        tmp_path, f"{LEAD}*COUPLING, REF NODE=9001, SURFACE=TOPFACE\n{card}\n{HELD}",
        step("9001, 1, 2.", "9001, 3, -5.", *turn),
    )  # fmt: skip
    found = am.solve(case.target)
    wanted(found, numbers)
    np.testing.assert_allclose(found.references["node 9001"].force, (2, 0, -5), atol=1e-9)


def test_cylindrical_axes(tmp_path):
    """Radial force, held around the axis; printed there with GLOBAL=YES."""
    case = case_of(
        tmp_path, "*TRANSFORM, NSET=TOP, TYPE=C\n0.5, -3., 0., 0.5, -3., 1.\n"
        f"{HELD}TOP, 2, 2, 0.01\n", step(f"{TOP[4]}, 1, 3.", f"{TOP[0]}, 3, 2."),
    )  # fmt: skip
    found = am.solve(case.target)
    wanted(found, {1037: (-1.446285e-02, 2.594945e-02, 1.648709e-02),
                   1041: (-6.940033e-03, 2.510231e-02, 2.055353e-03)})  # fmt: skip
    bottom = bottom_force(found)
    np.testing.assert_allclose(bottom, (1.129830, -0.7724540, -2.0), atol=1e-6)


def test_springs(tmp_path):
    model = (
        f"*ELEMENT, TYPE=SPRINGA, ELSET=SA\n501, {TOP[0]}, {node(2, 0, 0)}\n"
        f"*ELEMENT, TYPE=SPRING1, ELSET=S1\n502, {TOP[8]}\n"
        f"*ELEMENT, TYPE=SPRING2, ELSET=S2\n503, {TOP[2]}, {TOP[6]}\n"
        "*SPRING, ELSET=SA\n\n40.\n*SPRING, ELSET=S1\n3\n70.\n*SPRING, ELSET=S2\n1, 2\n90.\n"
    )
    case = case_of(tmp_path, model + HELD, step(f"{TOP[4]}, 1, 3.", f"{TOP[0]}, 3, -2."))
    wanted(am.solve(case.target), {1037: (1.516110e-02, 3.960441e-03, -4.265688e-03),
                                   1045: (2.786030e-02, -3.987374e-03, -5.495675e-03),
                                   })  # fmt: skip


def test_multiple_point_constraints(tmp_path):
    """Small loads: CalculiX' ones are nonlinear."""
    model = (
        f"*MPC\nPLANE, {TOP[0]}, {TOP[2]}, {TOP[6]}, {TOP[8]}, {TOP[4]}\n"
        f"*MPC\nSTRAIGHT, {node(0, 0, 1)}, {node(2, 0, 1)}, {node(1, 0, 1)}\n"
        f"*MPC\nBEAM, {node(0, 0, 2)}, {node(2, 1, 2)}\n"
    )
    case = case_of(tmp_path, model + HELD, step(f"{TOP[1]}, 1, 3e-4", f"{TOP[5]}, 3, -8e-4"))
    found = top_of(am.solve(case.target))
    numbers = {1037: (9.739239e-06, -9.980953e-07, 2.584001e-06),
               1042: (9.286308e-06, 1.110338e-06, -5.976124e-06)}  # fmt: skip
    for label, values in numbers.items():
        np.testing.assert_allclose(found[label], values, atol=1e-9)


def test_a_bolt_is_pulled_and_then_locked(tmp_path):
    model = (f"{LEAD}{SECTION}*PRE-TENSION SECTION, SURFACE=SEC, NODE=9001\n0., 0., 1.\n{HELD}"
             "TOP, 1, 1\nTOP, 3, 3\n")  # fmt: skip
    later = ("*STEP\n*STATIC\n1., 1.\n*BOUNDARY, FIXED\n9001, 1, 1\n*BOUNDARY\n"
             "TOP, 3, 3, 0.01\n*END STEP\n")  # fmt: skip
    case = case_of(tmp_path, model, step("9001, 1, 10.") + later)
    steps = list(am.evolve(case.in_time, case.evolution.method, until=case.evolution.until))
    assert [s.time for s in steps] == [1.0, 2.0]
    bolts = [s.references["node 9001"] for s in steps]
    for bolt in bolts:
        assert bolt.displacement == pytest.approx(9.616650e-3, rel=1e-6)
    assert bolts[0].force == pytest.approx(10.0)
    assert bolts[1].force == pytest.approx(20.39863, rel=1e-6)
    assert bottom_force(steps[1])[2] == pytest.approx(-20.39863, rel=1e-6)
    wanted(steps[1], {1038: (0, 1.884848e-03, 0.01)})


@pytest.mark.parametrize(("normal", "sign"), [("0., 0., 1.", -1), ("0., 0., -1.", 1)])
def test_the_normal_of_a_section_says_what_is_tension(tmp_path, normal, sign):
    """Outward of the elements of the surface: tension.  Against that: CalculiX compresses."""
    model = (f"{LEAD}{SECTION}*PRE-TENSION SECTION, SURFACE=SEC, NODE=9001\n{normal}\n{HELD}"
             "TOP, 1, 1\nTOP, 3, 3\n")  # fmt: skip
    found = am.solve(case_of(tmp_path, model, step("9001, 1, 10.")).target)
    assert bottom_force(found)[2] == pytest.approx(10 * sign)


@pytest.mark.parametrize(("model", "loads", "words"), [
    (f"*EQUATION\n2\n{TOP[0]}, 3, 1., {TOP[1]}, 3, -1.\n2\n{TOP[0]}, 3, 1., 1039, 3, 1.\n", (),
     r"bar.inp: line \d+: \*EQUATION: .*component 2 of node .*is eliminated by equation"),
    (f"*EQUATION\n2\n{TOP[0]}, 3, 1.\n", (), "expected 2 terms of node, component"),
    (f"*EQUATION\n2\n{TOP[0]}, 9, 1., {TOP[1]}, 3, 1.\n", (), "component from 1 to 6, got 9"),
    (f"*EQUATION\n2\n1, 3, 1., {TOP[1]}, 3, 1.\n", (), "a support prescribes it too"),
    ("*MPC\nMEANROT, 1, 2\n", (), r"\*MPC MEANROT: is not read, expected one of PLANE"),
    ("*MPC\nPLANE, 1, 2, 3, 5\n", (), "first three nodes lie on a line"),
    ("*RIGID BODY, NSET=TOP, REF NODE=NOWHERE\n", (), "NOWHERE"),
    ("*COUPLING, REF NODE=9001, SURFACE=TOPFACE\n", (), "KINEMATIC or .*DISTRIBUTING"),
    ("", (f"{TOP[0]}, 4, 1.",), "a moment at a node of solid elements"),
    ("", ("9001, 1, 1.",), "belongs to no element"),
    (f"{SECTION}*PRE-TENSION SECTION, ELEMENT=1, NODE=9001\n", (), "beams are not read"),
    ("*TRANSFORM, NSET=TOP, TYPE=S\n0., 0., 0., 0., 0., 1.\n", (), "TYPE=S: expected R"),
    ("*SPRING, ELSET=NONE\n\n1.\n", (), "set of spring elements NONE"),
    ("*TIE, NAME=FAR\nTOPFACE, BELOW\n", (), "(POSITION TOLERANCE|no part of the slave)"),
])  # fmt: skip
def test_wrong_cards_are_told(tmp_path, model, loads, words):
    def solve():
        case = case_of(tmp_path, LEAD + model + HELD, step(*(loads or (f"{TOP[4]}, 1, 3.",))))
        with case.naming_keys():
            am.solve(case.target)

    with pytest.raises(am.AmontonsError, match=words):
        solve()


@pytest.mark.parametrize(("card", "words"), [
    ("*STEP, INC=abc", r"bar.inp:\d+: \*STEP: INC: expected a number, got 'abc'"),
    ("*STEP, INC=1.5", r"\*STEP: INC: expected a whole number, got '1.5'"),
    ("*STEP\n*STATIC, FACTOR=x", r"\*STATIC: FACTOR: expected a number, got 'x'"),
    ("*STEP\n*CONTACTPAIRS", r"did you mean \*CONTACT PAIR\?"),
])  # fmt: skip
def test_slips_in_what_says_nothing_are_told(tmp_path, card, words):
    with pytest.raises(am.AmontonsError, match=words):
        case_of(tmp_path, HELD, step(f"{TOP[4]}, 1, 3.").replace("*STEP", card))
