"""General contact of decks and pairs = "auto" of case files: the same as pairs by hand."""

import json

import numpy as np
import pytest
from click.testing import CliRunner

import amontons as am
from amontons.app.cli import main
from tests.unit.io.test_decks import DECK, PRESSED, case_of, same, solved

PAIR = "*CONTACT PAIR, INTERACTION=I, TYPE=SURFACE TO SURFACE\nBOTTOM, TOP\n"
ALL = "*CONTACT\n*CONTACT INCLUSIONS, ALL EXTERIOR\n*CONTACT PROPERTY ASSIGNMENT\n , , I\n"
GENERAL = DECK.replace(PAIR, ALL)


def test_all_exterior_is_the_pair_by_hand(tmp_path):
    case = case_of(tmp_path, GENERAL)
    assert same(am.solve(case.model, tolerance=1e-10), solved(tmp_path, DECK))
    (note,) = [note for note in case.notes if "found" in note]
    assert note == ("contact found: UPPER (slave, 1 facets) on LOWER (1 facets): area 1, "
                    "gap 0; I")  # fmt: skip


@pytest.mark.parametrize("given", ["BOTTOM, TOP", "TOP, BOTTOM", "BOTTOM", ", TOP", "TOP, "])
def test_inclusions_by_surfaces(tmp_path, given):
    text = GENERAL.replace("INCLUSIONS, ALL EXTERIOR", f"INCLUSIONS\n{given}")
    if given.strip(", ") in ("BOTTOM", "TOP") and not given.startswith(","):
        with pytest.raises(am.FileFormatError, match=r"deck.inp:\d+: \*CONTACT: no contact"):
            case_of(tmp_path, text)  # a surface with itself
    else:
        assert same(solved(tmp_path, text), solved(tmp_path, DECK))


def test_assignments_by_surfaces_the_last_one_counts(tmp_path):
    smooth = GENERAL.replace(" , , I\n", "")
    assert solved(tmp_path, smooth).resultant == pytest.approx([0, 0, 4], abs=1e-8)
    named = GENERAL.replace(" , , I\n", " , , J\nBOTTOM, TOP, I\n").replace(
        "*BOUNDARY\n1,", "*SURFACE INTERACTION, NAME=J\n*FRICTION\n.1,\n*BOUNDARY\n1,"
    )
    assert same(solved(tmp_path, named), solved(tmp_path, DECK))
    turned = named.replace(" , , J\nBOTTOM, TOP, I\n", "BOTTOM, TOP, I\n , , J\n")
    assert solved(tmp_path, turned).resultant == pytest.approx([-0.4, 0, 4], rel=1e-7, abs=1e-8)


def test_exclusions_and_pairs_by_hand(tmp_path):
    none = GENERAL.replace("*CONTACT PROP", "*CONTACT EXCLUSIONS\nTOP, BOTTOM\n*CONTACT PROP")
    with pytest.raises(am.FileFormatError, match="no contact found: the deck has 2 parts"):
        case_of(tmp_path, none)
    both = case_of(tmp_path, DECK.replace(PAIR, PAIR + ALL))
    assert len(both.model.contacts) == 1
    alone = GENERAL.replace("*CONTACT PROP", "*CONTACT EXCLUSIONS\n, TOP\n*CONTACT PROP")
    with pytest.raises(am.FileFormatError, match="no contact found"):
        case_of(tmp_path, alone)


def test_a_gap_that_supports_close_is_found(tmp_path):
    """The upper block is 2 above the lower one, and moved down by 2.1."""
    text = PRESSED.replace(PAIR, ALL)
    for k in range(11, 19):
        z = 1 if k < 15 else 2
        x, y = ((0, 0), (1, 0), (1, 1), (0, 1))[(k - 11) % 4]
        text = text.replace(f"\n{k}, {x}., {y}., {z}.\n", f"\n{k}, {x}., {y}., {z + 2}.\n")
    with pytest.raises(am.FileFormatError, match="no contact found"):
        case_of(tmp_path, text)
    moved = text[: text.index("*CLOAD")] + "*BOUNDARY\n" + "".join(
        f"{k}, 3, 3, -2.1\n" for k in (15, 16, 17, 18)
    )
    found = solved(tmp_path, moved + "*END STEP\n")
    assert found.resultant == pytest.approx([0, 0, 50], abs=1e-7)  # .1 over two of E = 1000


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (("*CONTACT\n", ""), "stands before \\*CONTACT"),
        (("*CONTACT INCLUSIONS, ALL EXTERIOR\n", ""), "expected \\*CONTACT INCLUSIONS, ALL"),
        ((" , , I", " , , K"), "surface interaction K: not found, known: .*I"),
        (("ALL EXTERIOR\n", "ALL EXTERIOR\n*CONTACT\n"), "expected one, line \\d+ has it"),
        (("*CONTACT PROP", "*CONTACT EXCLUSIONS\n,\n*CONTACT PROP"), "expected a surface, or"),
        (("*END STEP", "*CONTACT\n*END STEP"), "stands in a step"),
        (("INCLUSIONS, ALL EXTERIOR", "INCLUSIONS\nTOPP, BOTTOM"), "surface TOPP: not found"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_said_with_its_line(tmp_path, change, words):
    with pytest.raises(am.FileFormatError, match=rf"deck.inp:\d+: .*{words}"):
        case_of(tmp_path, GENERAL.replace(*change))


def test_parts_are_named_by_their_instances(tmp_path):
    part = "*PART, NAME=BRICK\n*NODE\n" + "".join(
        f"{4 * k + j + 1}, {x}, {y}, {k}\n"
        for k in (0, 1) for j, (x, y) in enumerate(((0, 0), (1, 0), (1, 1), (0, 1)))
    )  # fmt: skip
    part += ("*ELEMENT, TYPE=C3D8, ELSET=E\n1, 1, 2, 3, 4, 5, 6, 7, 8\n*NSET, NSET=LOW\n"
             "1, 2, 3, 4\n*NSET, NSET=HIGH\n5, 6, 7, 8\n"
             "*SOLID SECTION, ELSET=E, MATERIAL=M\n*END PART\n")  # fmt: skip
    text = part + (
        "*ASSEMBLY, NAME=A\n*INSTANCE, NAME=FOOT, PART=BRICK\n*END INSTANCE\n"
        "*INSTANCE, NAME=HEAD, PART=BRICK\n0, 0, 1\n*END INSTANCE\n*END ASSEMBLY\n"
        "*MATERIAL, NAME=M\n*ELASTIC\n1000., 0.\n"
        "*CONTACT\n*CONTACT INCLUSIONS, ALL EXTERIOR\n"
        "*STEP\n*STATIC\n*BOUNDARY\nFOOT.LOW, ENCASTRE\nHEAD.HIGH, 1, 2\n"
        "HEAD.HIGH, 3, 3, -.01\n*END STEP\n"
    )
    case = case_of(tmp_path, text)
    assert any("HEAD (slave, 1 facets) on FOOT" in note for note in case.notes)
    found = am.solve(case.model, tolerance=1e-10)
    assert found.resultant[2] == pytest.approx(5.0, rel=1e-8)


# --------------------------------------------------------------------------- case files
TOWER = """
[[mesh]]
name = "low"
box = [2, 2, 1]
cells = [4, 4, 2]
[[mesh]]
name = "middle"
box = [1, 1, 1]
cells = 3
move = [0.5, 0.5, 1]
[[mesh]]
name = "high"
box = [1, 1, 0.5]
cells = [4, 4, 2]
move = [0.6, 0.5, 2]
[material.default]
young = 1000
poisson = 0.3
[[fix]]
on = "low.bottom"
value = [0, 0, 0]
[[traction]]
on = "high.top"
value = [0.05, 0, -1]
"""
AUTO = TOWER + '[[contact]]\npairs = "auto"\nfriction = { coulomb = 0.4 }\n'
ONE = """[[contact]]
slave = "middle.bottom"
master = "low.top"
friction = { coulomb = 0.4 }
"""
OTHER = ONE.replace("middle.bottom", "high.bottom").replace("low.top", "middle.top")


def read_text(tmp_path, text):
    path = tmp_path / "case.toml"
    path.write_text(text)
    return am.read_case(path)


def test_pairs_of_a_case_file_are_found(tmp_path):
    hand = am.solve(read_text(tmp_path, TOWER + ONE + OTHER).model, tolerance=1e-11)
    for text in (AUTO, AUTO + OTHER, AUTO.replace("[[contact]]", OTHER + "[[contact]]")):
        case = read_text(tmp_path, text)
        assert len(case.model.contacts) == 2
        assert same(am.solve(case.model, tolerance=1e-11), hand)
        assert len(case.notes) == (2 if text == AUTO else 1)
    less = 'gap = 0.1\nexclude = ["low", ["middle", "high"]]\n'
    part = read_text(tmp_path, AUTO + less + ONE)
    assert len(part.model.contacts) == 1


def test_what_was_found_is_printed(tmp_path):
    path = tmp_path / "case.toml"
    path.write_text(AUTO)
    line = "note: contact found: middle (slave, 9 facets) on low (16 facets): area 1, gap 0"
    told = CliRunner().invoke(main, ["info", str(path), "--json", str(tmp_path / "info.json")])
    assert line in told.output
    assert len(json.loads((tmp_path / "info.json").read_text())["notes"]) == 2
    told = CliRunner().invoke(main, ["solve", str(path), "-o", str(tmp_path / "out")])
    assert line in told.output
    record = json.loads((tmp_path / "out" / "solution.json").read_text())
    assert len(record["notes"]) == 2
    assert np.allclose(sum(p["force"][2] for p in record["pairs"]), 2.0)


@pytest.mark.parametrize(
    ("more", "words"),
    [
        ("gap = -1\n", "contact[0].gap: expected a distance >= 0, got -1.0"),
        ('exclude = "low"\n', "contact[0].exclude: expected a list of names and pairs of"),
        ('exclude = ["lov"]\n', "contact[0].exclude[0]: part 'lov': not found, known: hi"),
        ('exclude = ["low", "middle"]\n', "contact[0]: no contact found: none of the 3 p"),
        ('slave = "low.top"\n', "contact[0].slave: unknown key"),
        ('[[contact]]\npairs = "auto"\n', "contact[1].pairs: expected one table"),
        ('[[contact]]\npairs = "all"\n', "contact[1].pairs: expected one table"),
    ],
)
def test_what_is_wrong_of_a_case_is_said_with_its_key(tmp_path, more, words):
    with pytest.raises(am.FileFormatError) as caught:
        read_text(tmp_path, AUTO + more)
    assert words in str(caught.value)


def test_errors_of_found_contacts_name_their_table(tmp_path):
    """Contacts that are found come after all others, whatever the order of the tables."""
    text = AUTO.replace("coulomb = 0.4", 'coulomb = "1/(x-x)"') + OTHER
    with pytest.raises(am.InvalidInput, match=r"contact\[0\].friction.coulomb"):
        with (case := read_text(tmp_path, text)).naming_keys():
            am.solve(case.model)
