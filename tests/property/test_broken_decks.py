"""Lines of decks dropped, swapped, cut and spoiled: a case, or an error with file and line."""

import random
import re

import pytest
from click.testing import CliRunner

import amontons as am
from amontons.app.cli import main
from amontons.io.readers import read
from tests.unit.io.test_decks import DECK
from tests.unit.two_parts_deck import RICH

WORDS = [
    "nan", "NaN", "inf", "-1", "0", "1e400", "99999999999999999999", "1e9", "", "x", "1.5",
    "-1e-300", "S9", "S0", "P7", '"', "*", "1,2", "NALL", "nosuch", "\u00e9", "\t", "1e18",
    "9223372036854775808", "1e30", "GENERATE", ".", "-", "1d5", "0x10", "1_000", "\u0663",
    "\u00b2", "TOP", "BOTTOM", "Inst-1.1", "a.b.c", "DECK.INP",
]  # fmt: skip
CARDS = [
    "*INCLUDE, INPUT=deck.inp", "*INCLUDE, INPUT=.", "*INCLUDE", "*INCLUDE, INPUT=no.inp",
    "*NSET, NSET=NALL\nNALL", "*NSET, NSET=Q\nQ", "*ELSET, ELSET=UPPER\nUPPER", "*STEP",
    "*END STEP", "*PART, NAME=P", "*END PART", "*ASSEMBLY, NAME=A", "*END ASSEMBLY",
    "*INSTANCE, NAME=I, PART=P", "*SURFACE, NAME=SX\nSX", "*NSET, NSET=EMPTY",
    "*NSET, NSET=G, GENERATE\n1, 1000000000000, 1", "*NSET, NSET=G, GENERATE\n1, 10, 0",
    "*AMPLITUDE, NAME=A\n0,0,1", "*EQUATION\n2\n1,1,1.,2,1,0.", "*EQUATION\n1\n1,1,0.",
    "*EQUATION\n2\n1,1,1.", "*MPC\nPLANE,1,2,3,4", "*TIE, NAME=T\nTOP, BOTTOM",
    "*TRANSFORM, NSET=NALL, TYPE=C\n0,0,0,0,0,1", "*TIE, NAME=T\nTOP, TOP",
    "*CONTACT PAIR, INTERACTION=I\nTOP, TOP", "*RIGID BODY, NSET=NALL, REF NODE=1",
    "*CLEARANCE, MASTER=TOP, SLAVE=BOTTOM, VALUE=nan", "*EXPANSION\n1e-5", "*", "*,",
    "*COUPLING, CONSTRAINT NAME=C, REF NODE=1, SURFACE=TOP\n*KINEMATIC\n1,3", "* ,NAME=x",
    "*PRE-TENSION SECTION, SURFACE=TOP, NODE=1\n0,0,1", "*ORIENTATION, NAME=O\n0,0,0,0,0,0",
    "*INITIAL CONDITIONS, TYPE=TEMPERATURE\nNALL, 20", "*TEMPERATURE\nNALL, 300",
    "*DLOAD\nUPPER, GRAV, 9.81, 0,0,-1", "*DLOAD\nUPPER, P9, 1", "*DSLOAD\nTOP, P, nan",
    "*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=TABULAR\n0,0\n1,1", "*STATIC\n0,0", "*FRICTION",
    "*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=EXPONENTIAL\n1e-300,1e300", "*FRICTION\n1e300",
    "*CHANGE FRICTION, INTERACTION=I\n*FRICTION\n0.1", "*DENSITY\n-1", "*ELASTIC\n0, .3",
    "*MODEL CHANGE, TYPE=CONTACT PAIR, REMOVE\nBOTTOM, TOP", "*STATIC\n1e-300,1e300",
    "*ELEMENT, TYPE=SPRINGA, ELSET=SP\n500,1,2", "*SPRING, ELSET=SP\n\n5.",
    "*BOUNDARY\nNALL, 1, 3, 1e300", "*BOUNDARY\nNALL, ENCASTRE", "*NODE\n1e9,0,0,0",
    "*ELASTIC, TYPE=ORTHO\n1,1,1,1,1,1,1,1", "*ELASTIC\n1e300, .3", "*NODE\n1",
    "*SOLID SECTION, ELSET=UPPER, MATERIAL=STEEL\n-1", "*SURFACE, NAME=EMPTY, TYPE=NODE",
]  # fmt: skip
LETTERS = [9, 11, 12, 32, 34, 39, 42, 44, 46, 61, 65, 127, 160, 233, 0x2028, 0x3000, 0xFEFF]


def spoiled(seed):
    """A deck with one to three things wrong, or not."""
    draw = random.Random(seed)
    lines = draw.choice([DECK, RICH]).split("\n")
    for _ in range(draw.choice([1, 1, 1, 2, 3])):
        draw.choice(WAYS)(draw, lines)
    return "\n".join(lines)


def _drop(draw, lines):
    if len(lines) > 1:
        del lines[draw.randrange(len(lines))]


def _swap(draw, lines):
    a, b = draw.randrange(len(lines)), draw.randrange(len(lines))
    lines[a], lines[b] = lines[b], lines[a]


def _double(draw, lines):
    lines.insert(draw.randrange(len(lines)), draw.choice(lines))


def _cut_file(draw, lines):
    del lines[draw.randrange(len(lines)) + 1 :]
    _cut_line(draw, lines)


def _word(draw, lines):
    k = draw.randrange(len(lines))
    fields = lines[k].split(",")
    j, word = draw.randrange(len(fields)), draw.choice(WORDS)
    before = fields[j].split("=")[0] + "=" if "=" in fields[j] else ""
    fields[j] = before + word
    lines[k] = ",".join(fields)


def _field(draw, lines):
    k = draw.randrange(len(lines))
    fields = lines[k].split(",")
    if draw.random() < 0.5:
        fields.append(draw.choice(WORDS))
    else:
        del fields[draw.randrange(len(fields))]
    lines[k] = ",".join(fields)


def _card(draw, lines):
    lines.insert(draw.randrange(len(lines)), draw.choice(CARDS))


def _cut_line(draw, lines):
    k = draw.randrange(len(lines))
    lines[k] = lines[k][: draw.randrange(len(lines[k]) + 1)]


def _letter(draw, lines):
    k = draw.randrange(len(lines))
    at = draw.randrange(len(lines[k]) + 1)
    lines[k] = lines[k][:at] + chr(draw.choice(LETTERS)) + lines[k][at:]


def _move(draw, lines):
    k = draw.randrange(len(lines))
    block = lines[k : k + draw.randrange(1, 8)]
    del lines[k : k + len(block)]
    at = draw.randrange(len(lines) + 1)
    lines[at:at] = block


WAYS = [_drop, _swap, _double, _cut_file, _word, _word, _word, _field, _card, _card, _cut_line,
        _letter, _move]  # fmt: skip
# what no line is to blame for: bodies that nothing holds
NOWHERE = re.compile(r"is free to move|found none$")


@pytest.mark.parametrize("block", range(5))
def test_spoiled_decks_are_cases_or_errors_with_file_and_line(tmp_path, block):
    solved = 0
    for seed in range(100 * block, 100 * block + 100):
        path = tmp_path / "deck.inp"
        path.write_bytes(spoiled(seed).encode())
        try:
            case = read(path)
            with case.naming_keys():
                case.model.assemble()
            solved += 1
        except am.AmontonsError as error:
            text = str(error)
            assert re.search(r"deck\.inp:(\d+| line \d+)", text) or NOWHERE.search(text), (
                seed, text
            )  # fmt: skip
    assert solved  # some spoil nothing


@pytest.mark.parametrize("seed", range(1000, 1030))
def test_the_command_ends_with_2_and_one_message(tmp_path, seed):
    path = tmp_path / "deck.inp"
    path.write_bytes(spoiled(seed).encode())
    done = CliRunner().invoke(main, ["info", str(path)])
    assert done.exception is None or isinstance(done.exception, SystemExit)
    assert done.exit_code in (0, 2), done.output
    if done.exit_code == 2:
        assert "deck.inp" in done.output


BAD = [  # old, new, line, words
    ("1, 0., 0., 0.", "99999999999999999999, 0., 0., 0.", 2, "below 2\\^53, got '9+'"),
    ("1, 0., 0., 0.", "1_000, 0., 0., 0.", 2, "expected a number, got '1_000'"),
    ("15, 3, -1.", "\u00b2, 3, -1.", 50, "node set \u00b2: not found"),
    ("LOWER, S2", "LOWER, S\u00b2", 32, "face S\u00b2: expected S1 to S6"),
    ("8, 0., 1., 1.", "8, 0., 1., -1.", 19, "element 1: mesh: hex cell .* folded"),
    ("*SURFACE, NAME=TOP\nLOWER, S2", "*SURFACE, NAME=TOP", 32, "surface TOP: is empty"),
    ("*MATERIAL, NAME=STEEL\n*ELASTIC\n1000., 0.\n", "", 26, "material STEEL: not found"),
]


@pytest.mark.parametrize(("old", "new", "line", "words"), BAD)
def test_what_is_wrong_is_named_with_its_line(tmp_path, old, new, line, words):
    assert old in DECK
    path = tmp_path / "deck.inp"
    path.write_text(DECK.replace(old, new, 1), encoding="utf-8")
    with pytest.raises(am.FileFormatError, match=words) as found:
        read(path)
    at = int(str(found.value).split("deck.inp:")[1].split(":")[0])
    assert abs(at - line) <= 1, str(found.value)


def test_a_section_whose_elements_are_given_again_needs_no_cells(tmp_path):
    """The last section of an element counts, as in CalculiX."""
    path = tmp_path / "deck.inp"
    path.write_text(DECK.replace(
        "*CONTACT PAIR", "*SOLID SECTION, ELSET=UPPER, MATERIAL=STEEL\n*CONTACT PAIR", 1
    ).replace("*SOLID SECTION, ELSET=LOWER, MATERIAL=STEEL\n",
              "*ELSET, ELSET=BOTH\nLOWER, UPPER\n*SOLID SECTION, ELSET=BOTH, MATERIAL=STEEL\n"
              "*SOLID SECTION, ELSET=LOWER, MATERIAL=STEEL\n"))  # fmt: skip
    assert read(path).model.assemble().contacts == 4


STEP = "*STEP\n*STATIC\n1., 1.\n"
OTHER = "*STEP\n*FREQUENCY\n10\n*END STEP\n"
REFUSED = [  # old, new, words
    (STEP, OTHER + STEP, "one of vibrations, .*--allow FREQUENCY leaves the whole step"),
    (STEP, "*STEP\n*HEAT TRANSFER\n1., 1.\n", "one of heat, .*there is nothing to solve"),
    ("*NODE, NSET=NALL", "*RESTART, READ\n*NODE, NSET=NALL", "results of another run"),
    ("*STEP", "*INITIAL CONDITIONS, TYPE=STRESS\n1, 1, 0.\n*STEP", "TYPE=STRESS: changes"),
    ("TYPE=C3D8, ELSET=LOWER", "TYPE=DC3D8, ELSET=LOWER", "this type, of heat, are not read"),
    ("TYPE=C3D8, ELSET=LOWER", "TYPE=C3D9, ELSET=LOWER", "not read, .*did you mean C3D"),
]


@pytest.mark.parametrize(("old", "new", "words"), REFUSED)
def test_refusals_say_what_would_have_been_done_and_what_helps(tmp_path, old, new, words):
    assert old in DECK
    path = tmp_path / "deck.inp"
    path.write_text(DECK.replace(old, new, 1))
    with pytest.raises(am.FileFormatError, match=words):
        read(path)


def test_a_step_of_another_kind_is_left_out_where_that_is_allowed(tmp_path):
    path = tmp_path / "deck.inp"
    path.write_text(DECK + OTHER)
    case = read(path, ["deck.allow=[FREQUENCY]"])
    path.write_text(DECK)
    assert any("a step of vibrations, is left out" in note for note in case.notes)
    assert case.evolution.until == read(path).evolution.until
