"""Laws, adjusted nodes and clearances of contact pairs in decks, by exact values."""

import numpy as np
import pytest

import amontons as am
from amontons.io.readers import read
from tests.unit.io.test_decks import DECK, PRESSED, case_of, same, solved

SMOOTH = PRESSED.replace("*FRICTION\n0.3,\n", "")
HARD = "OVERCLOSURE=HARD"


def top(found):
    return found.displacement[0][-4:, 2]


def test_exponential_law_of_calculix(tmp_path):
    """p = 4 over a unit area: d = c0 ln(p / p0) / ln 100, beside p/E over two blocks."""
    soft = SMOOTH.replace(HARD, "OVERCLOSURE=EXPONENTIAL\n.001, 2.")
    overlap = 1e-3 * np.log(2) / np.log(100)
    assert top(solved(tmp_path, soft)) == pytest.approx([-8e-3 - overlap] * 4, rel=1e-7)
    apart = SMOOTH.replace(HARD, "OVERCLOSURE=EXPONENTIAL\n.001, 400.")
    assert top(solved(tmp_path, apart)) == pytest.approx([-8e-3 + 1e-3] * 4, rel=1e-7)


def test_a_table_of_pressure_over_overclosure(tmp_path):
    soft = SMOOTH.replace(HARD, "OVERCLOSURE=TABULAR\n0., 0.\n2., .01\n6., .02")
    assert top(solved(tmp_path, soft)) == pytest.approx([-8e-3 - 0.015] * 4, rel=1e-7)
    hard = solved(tmp_path, soft, "deck.hard=true")
    assert top(hard) == pytest.approx([-8e-3] * 4, rel=1e-7)


@pytest.mark.parametrize("law", ["LINEAR\n800., .5", "TABULAR\n0., 0.\n2., .01\n6., .02"])
def test_strains_stay_finite_where_contact_is_asked_to_be_hard(tmp_path, law):
    """As with HARD in the deck, which is not as at small strains."""
    large = SMOOTH.replace("*STEP", "*STEP, NLGEOM")
    assert large != SMOOTH
    asked = solved(tmp_path, large.replace(HARD, f"OVERCLOSURE={law}"), "deck.hard=true")
    plain = solved(tmp_path, large)
    assert same(asked, plain)
    assert not same(plain, solved(tmp_path, SMOOTH))
    small = solved(tmp_path, large.replace(HARD, f"OVERCLOSURE={law}"), "deck.hard=true",
                   "deck.small=true")  # fmt: skip
    assert same(small, solved(tmp_path, SMOOTH))


def test_the_tension_far_away_bends_the_line_of_nodes_only(tmp_path):
    """K d (1/2 + atan(d/e)/pi) with e = pi sigma / K."""
    line = SMOOTH.replace(HARD, "OVERCLOSURE=LINEAR\n800., .5")
    assert top(solved(tmp_path, line)) == pytest.approx([-8e-3 - 4 / 800] * 4, rel=1e-7)
    nodal = line.replace("SURFACE TO SURFACE", "NODE TO SURFACE")
    overlap = -top(solved(tmp_path, nodal)) - 8e-3
    width = np.pi * 0.5 / 800
    pressure = 800 * overlap * (0.5 + np.arctan(overlap / width) / np.pi)
    assert pressure == pytest.approx([4.0] * 4, rel=2e-3)


def test_tied_by_a_stiffness(tmp_path):
    tied = SMOOTH.replace(HARD, "OVERCLOSURE=TIED\n800.\n*FRICTION\n0., 1e5")
    assert top(solved(tmp_path, tied)) == pytest.approx([-8e-3 - 4 / 800] * 4, rel=1e-7)
    pulled = tied.replace("3, -1.\n", "3, 1.\n")
    assert top(solved(tmp_path, pulled)) == pytest.approx([8e-3 + 4 / 800] * 4, rel=1e-7)


def apart(text, gap):
    """The upper block lifted."""
    for k in range(11, 19):
        z = 1 if k < 15 else 2
        x, y = ((0, 0), (1, 0), (1, 1), (0, 1))[(k - 11) % 4]
        text = text.replace(f"\n{k}, {x}., {y}., {z}.\n", f"\n{k}, {x}., {y}., {z + gap}\n")
    return text


@pytest.mark.parametrize("gap", [0.003, -0.003])
def test_adjusted_nodes_begin_in_contact(tmp_path, gap):
    """The body is then longer or shorter by the gap, strain-free."""
    text = apart(SMOOTH, gap)
    before = top(solved(tmp_path, text))
    assert before == pytest.approx([-8e-3 - gap] * 4, rel=1e-6)
    near = text.replace("TYPE=SURFACE", "ADJUST=0.005, TYPE=SURFACE")
    assert top(solved(tmp_path, near)) == pytest.approx([-4e-3 * (2 + gap)] * 4, rel=1e-6)
    named = text.replace("TYPE=SURFACE", "ADJUST=feet, TYPE=SURFACE").replace(
        "*SURFACE, NAME=TOP", "*NSET, NSET=FEET, GENERATE\n11, 14\n*SURFACE, NAME=TOP"
    )
    assert same(solved(tmp_path, named), solved(tmp_path, near))
    notes = case_of(tmp_path, near).notes
    assert any("4 slave nodes are put onto the master, at most 0.003" in n for n in notes)
    if gap > 0:
        far = text.replace("TYPE=SURFACE", "ADJUST=0.001, TYPE=SURFACE")
        assert same(solved(tmp_path, far), solved(tmp_path, text))


@pytest.mark.parametrize("gap", [0.002, -0.002])
def test_clearance(tmp_path, gap):
    card = f"*CLEARANCE, MASTER=TOP, SLAVE=Bottom, VALUE={gap}\n*BOUNDARY\n1,"
    found = solved(tmp_path, SMOOTH.replace("*BOUNDARY\n1,", card, 1))
    assert top(found) == pytest.approx([-8e-3 - gap] * 4, rel=1e-7)


def test_a_slave_of_single_nodes(tmp_path):
    """Three nodes of the foot make no facet; each has a quarter of the face above."""
    nodes = "*SURFACE, NAME=BOTTOM, TYPE=NODE\n11, \n12\n13,\n"
    text = SMOOTH.replace("*SURFACE, NAME=BOTTOM\nUPPER, S1\n", nodes).replace(
        HARD, "OVERCLOSURE=LINEAR\n800."
    )
    found = solved(tmp_path, text)
    assert found.resultant[2] == pytest.approx(4, rel=1e-8)
    assert found.fields.weights == pytest.approx([0.25] * 3)
    assert sorted(found.fields.force[:, 2]) == pytest.approx([0, 2, 2], abs=1e-8)
    with pytest.raises(am.FileFormatError, match=r"node 15 is on no outer facet that faces"):
        solved(tmp_path, text.replace("11, \n12\n13,\n", "11\n12\n15\n"))


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ((HARD, "OVERCLOSURE=EXPONENTIAL\n.001"), "expected 2 numbers, got 1"),
        ((HARD, "OVERCLOSURE=EXPONENTIAL\n-.001, 2."), "expected c0 > 0 and p0 > 0"),
        ((HARD, "OVERCLOSURE=TABULAR\n0., 0.\n2., -1."), "overclosure: expected growing"),
        ((HARD, "OVERCLOSURE=TABULAR\n1., 0.\n2., 1."), "expected 0, where it begins"),
        ((HARD, "OVERCLOSURE=USER"), "USER: this law .* is not read, expected one of HARD"),
        (("TYPE=SURFACE", "ADJUST=-1, TYPE=SURFACE"), "ADJUST: expected a distance >= 0"),
        (("TYPE=SURFACE", "ADJUST=nowhere, TYPE=SURFACE"), "node set nowhere: not found"),
        (("BOTTOM, TOP\n", "BOTTOM,\n"), "surface BOTTOM: no contact with itself found"),
        (("*BOUNDARY\n1,", "*CLEARANCE, MASTER=TOP, SLAVE=BOTTOM\n*BOUNDARY\n1,"),
         "VALUE: missing"),
        (("*BOUNDARY\n1,", "*CLEARANCE, MASTER=TOP, SLAVE=UP, VALUE=1\n*BOUNDARY\n1,"),
         "contact pair UP, TOP: not found, known: BOTTOM, TOP"),
        (("*STATIC", "*CONTACT PAIR, INTERACTION=I\nBOTTOM, TOP\n*STATIC"),
         "stands in a step; expected before the first one"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_said_with_its_line(tmp_path, change, words):
    assert DECK.count(change[0]) >= 1
    with pytest.raises(am.FileFormatError, match=rf"deck.inp:\d+: .*{words}"):
        case_of(tmp_path, DECK.replace(*change, 1)).model.assemble()


def test_which_law_was_taken_is_said(tmp_path):
    soft = DECK.replace(HARD, "OVERCLOSURE=LINEAR\n800.").replace("0.3,", "0.3, 50.")
    notes = case_of(tmp_path, soft).notes
    assert any("LINEAR, 800 of pressure over overclosure, 50 of shear" in n for n in notes)
    path = tmp_path / "deck.inp"
    notes = read(path, ["deck.hard=true"]).notes
    assert any("taken as hard and rigid, as asked" in n for n in notes)
    with pytest.raises(am.InvalidInput, match=r"deck.stiff=1: expected deck.allow"):
        read(path, ["deck.stiff=1"])
