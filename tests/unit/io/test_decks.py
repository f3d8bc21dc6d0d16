"""Decks: dialects, sets, instances, steps, and what is said of decks that can not be read."""

import gzip
import json

import numpy as np
import pytest
from click.testing import CliRunner

import amontons as am
from amontons.app.cli import main
from amontons.io.decks.cards import read_cards
from amontons.io.decks.flat import flatten
from amontons.io.readers import read

# two blocks 1 x 1 x 1, one on the other, pressed by 4 N, that slide by .1 in x
NODES = """*NODE, NSET=NALL
1, 0., 0., 0.
2, 1., 0., 0.
3, 1., 1., 0.
4, 0., 1., 0.
5, 0., 0., 1.
6, 1., 0., 1.
7, 1., 1., 1.
8, 0., 1., 1.
11, 0., 0., 1.
12, 1., 0., 1.
13, 1., 1., 1.
14, 0., 1., 1.
15, 0., 0., 2.
16, 1., 0., 2.
17, 1., 1., 2.
18, 0., 1., 2.
"""
BLOCKS = """*ELEMENT, TYPE=C3D8, ELSET=LOWER
1, 1, 2, 3, 4, 5, 6, 7, 8
*ELEMENT, TYPE=C3D8, ELSET=UPPER
2, 11, 12, 13, 14, 15, 16, 17, 18
"""
REST = """*SURFACE, NAME=TOP
LOWER, S2
*SURFACE, NAME=BOTTOM
UPPER, S1
*MATERIAL, NAME=STEEL
*ELASTIC
1000., 0.
*SOLID SECTION, ELSET=LOWER, MATERIAL=STEEL
*SOLID SECTION, ELSET=UPPER, MATERIAL=STEEL
*CONTACT PAIR, INTERACTION=I, TYPE=SURFACE TO SURFACE
BOTTOM, TOP
*SURFACE INTERACTION, NAME=I
*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=HARD
*FRICTION
0.3,
*BOUNDARY
1, 1, 3
2, 1, 3
3, 1, 3
4, 1, 3
15, 1, 2
16, 1, 2
17, 1, 2
18, 1, 2
*STEP
*STATIC
1., 1.
*CLOAD
15, 3, -1.
16, 3, -1.
17, 3, -1.
18, 3, -1.
*BOUNDARY
15, 1, 1, 0.1
16, 1, 1, 0.1
17, 1, 1, 0.1
18, 1, 1, 0.1
*END STEP
"""
DECK = NODES + BLOCKS + REST
SLIDE = "*BOUNDARY\n15, 1, 1, 0.1\n16, 1, 1, 0.1\n17, 1, 1, 0.1\n18, 1, 1, 0.1\n"
PRESSED = DECK.replace(SLIDE, "")


def case_of(tmp_path, text, *overrides, name="deck.inp"):
    path = tmp_path / name
    path.write_bytes(text.encode())
    return read(path, overrides)


def solved(tmp_path, text, *overrides):
    return am.solve(case_of(tmp_path, text, *overrides).model, tolerance=1e-10)


def same(one, other):
    return all(np.allclose(a, b, rtol=1e-7, atol=1e-12)
               for a, b in zip(one.displacement, other.displacement, strict=True))  # fmt: skip


# ------------------------------------------------------------------------------ the model
def test_two_blocks_slide_with_the_force_of_friction(tmp_path):
    found = solved(tmp_path, DECK)
    assert found.resultant == pytest.approx([-0.3 * 4, 0, 4], rel=1e-8, abs=1e-8)
    assert found.counts["slip"] == 4
    top = solved(tmp_path, PRESSED).displacement[0][-4:, 2]
    assert top == pytest.approx([-8e-3] * 4, rel=1e-8)  # p/E over two blocks: .004 each


def test_overlap_by_the_stiffness_of_the_deck(tmp_path):
    soft = PRESSED.replace("OVERCLOSURE=HARD", "OVERCLOSURE=LINEAR\n800.")
    assert solved(tmp_path, soft).displacement[0][-4:, 2] == pytest.approx(
        [-8e-3 - 4 / 800] * 4, rel=1e-8
    )
    hard = solved(tmp_path, soft, "deck.hard=true")
    assert hard.displacement[0][-4:, 2] == pytest.approx([-8e-3] * 4, rel=1e-8)


def test_stick_slope_of_friction(tmp_path):
    """Shear stiffness G = 500 over two blocks, and a slope of 200 between them."""
    slow = DECK.replace("0.3,", "0.3, 50.").replace("0.1\n", "0.001\n")
    found = solved(tmp_path, slow)
    assert found.counts["stick"] == 4
    assert abs(found.resultant[0]) < 0.3 * 4
    rigid = solved(tmp_path, slow, "deck.hard=true")
    assert abs(rigid.resultant[0]) > 1.2 * abs(found.resultant[0])


def test_pressure_and_gravity_push_into_the_body(tmp_path):
    forces = DECK[DECK.index("*CLOAD") : DECK.index("*BOUNDARY\n15, 1, 1")]
    pressed = solved(tmp_path, DECK.replace(forces, "*DLOAD\nUPPER, P2, 4.\n"))
    assert pressed.resultant[2] == pytest.approx(4, rel=1e-8)
    assert same(pressed, solved(tmp_path, DECK))
    named = NODES + BLOCKS + "*SURFACE, NAME=LOADED\nUPPER, S2\n" + REST
    named = named.replace(forces, "*DSLOAD\nloaded, P, 4.\n")
    assert same(solved(tmp_path, named), pressed)
    heavy = DECK.replace("1000., 0.", "1000., 0.\n*DENSITY\n2.").replace(
        forces, "*DLOAD\nUPPER, GRAV, 10., 0., 0., -1.\n"
    )
    assert solved(tmp_path, heavy).resultant[2] == pytest.approx(20, rel=1e-8)


def test_forces_at_a_node_add_up_in_a_step(tmp_path):
    twice = DECK.replace("15, 3, -1.\n", "15, 3, -.5\n15, 3, -.5\n")
    assert same(solved(tmp_path, twice), solved(tmp_path, DECK))


def test_a_plane_deck_of_some_thickness(tmp_path):
    def deck(thickness, kind):
        return f"""*NODE
1, 0, 0
2, 1, 0
3, 1, 1
4, 0, 1
5, 0, 1
6, 1, 1
7, 1, 2
8, 0, 2
*ELEMENT, TYPE={kind}, ELSET=A
1, 1, 2, 3, 4
*ELEMENT, TYPE={kind}, ELSET=B
2, 5, 6, 7, 8
*SURFACE, NAME=TOP
A, S3
*SURFACE, NAME=BOTTOM
B, S1
*MATERIAL, NAME=M
*ELASTIC
100., .3
*SOLID SECTION, ELSET=A, MATERIAL=M
{thickness}
*SOLID SECTION, ELSET=B, MATERIAL=M
{thickness}
*CONTACT PAIR, INTERACTION=I
BOTTOM, TOP
*SURFACE INTERACTION, NAME=I
*BOUNDARY
1, 1, 2
2, 2, 2
8, 1, 1
*STEP
*STATIC
*CLOAD
7, 2, -1.
8, 2, -1.
*END STEP
"""

    strain = solved(tmp_path, deck("2.", "CPE4"))
    assert strain.resultant == pytest.approx([0, 1], abs=1e-8)  # 2 N over a thickness of 2
    assert strain.displacement[0][-1, 1] == pytest.approx(-2 * (1 - 0.3**2) / 100, rel=1e-6)
    stress = solved(tmp_path, deck("2.", "CPS4"))
    assert stress.displacement[0][-1, 1] == pytest.approx(-2 / 100, rel=1e-6)


# ------------------------------------------------------------------------------- dialects
def test_letters_blanks_remarks_tabs_and_line_ends_change_nothing(tmp_path):
    odd = DECK.lower().replace(", ", " ,\t").replace("*node", "** a remark\n*Node  ")
    odd = odd.replace("\n15 ,\t1", "\n\n** another\n15 ,\t1")
    odd = odd.replace("*surface ,\tname=top", "*Surface,\n Name=top").replace("\n", "\r\n")
    assert same(solved(tmp_path, odd), solved(tmp_path, DECK))


def test_elements_over_several_lines_and_unsorted_large_numbers(tmp_path):
    odd = DECK.replace("1, 1, 2, 3, 4, 5, 6, 7, 8", "1, 1, 2, 3,\n 4, 5, 6,\n7, 8,")
    far = odd
    for k in range(18, 10, -1):
        far = far.replace(f"\n{k},", f"\n{999_999_000 - k},")
    far = far.replace("11, 12, 13, 14, 15, 16, 17, 18",
                      ", ".join(str(999_999_000 - k) for k in range(11, 19)))  # fmt: skip
    one, other = solved(tmp_path, far), solved(tmp_path, DECK)
    assert one.resultant == pytest.approx(other.resultant, rel=1e-8)


def test_included_and_packed(tmp_path):
    (tmp_path / "sub").mkdir()
    (tmp_path / "sub" / "nodes.inp").write_text(NODES.split("\n", 1)[1])
    (tmp_path / "sub" / "rest.inp").write_text("*INCLUDE, INPUT=last.inp\n")
    (tmp_path / "sub" / "last.inp").write_text(BLOCKS + REST)
    text = "*NODE, NSET=NALL\n*INCLUDE, INPUT=sub/nodes.inp\n*include,input=sub/rest.inp\n"
    assert same(solved(tmp_path, text), solved(tmp_path, DECK))
    path = tmp_path / "deck.inp.gz"
    path.write_bytes(gzip.compress(DECK.encode()))
    assert same(am.solve(read(path).model, tolerance=1e-10), solved(tmp_path, DECK))


def test_sets_of_sets_and_generated_ones(tmp_path):
    held = REST[REST.index("*BOUNDARY\n1,") : REST.index("*STEP")]
    named = (
        "*NSET, NSET=A\n1, 3\n*NSET, NSET=FOOT\na, 2\n*NSET, NSET=FOOT\n4\n"
        "*NSET, NSET=HEAD, GENERATE\n15, 18\n*BOUNDARY\nFOOT, PINNED\nhead, 1, 2\n"
    )
    assert same(solved(tmp_path, DECK.replace(held, named)), solved(tmp_path, DECK))


def test_parts_stand_where_their_instances_do(tmp_path):
    """One block as a part, placed twice: the second one turned about z and lifted."""
    part = "*PART, NAME=Block\n" + "".join(
        line + "\n" for line in NODES.splitlines()[:9]
    ).replace(", NSET=NALL", "")
    part += "*ELEMENT, TYPE=C3D8, ELSET=All\n1, 1, 2, 3, 4, 5, 6, 7, 8\n"
    part += "*NSET, NSET=Foot, GENERATE\n1, 4\n*NSET, NSET=Head, GENERATE\n5, 8\n"
    part += "*SURFACE, NAME=Top\nAll, S2\n*SURFACE, NAME=Bottom\nAll, S1\n"
    part += "*SOLID SECTION, ELSET=All, MATERIAL=STEEL\n,\n*END PART\n"
    assembly = """*ASSEMBLY, NAME=Whole
*INSTANCE, NAME=Low-1, PART=Block
*END INSTANCE
*INSTANCE, NAME="High-1", PART=block
0., 0., 1.
.5, .5, 0., .5, .5, 1., 90.
*END INSTANCE
*NSET, NSET=Held, INSTANCE=Low-1
Foot
*END ASSEMBLY
"""
    model = REST[REST.index("*MATERIAL") : REST.index("*SOLID SECTION")]
    model += REST[REST.index("*CONTACT PAIR") : REST.index("*BOUNDARY\n1")]
    model = model.replace("BOTTOM, TOP", "High-1.Bottom, Low-1.Top")
    steps = """*BOUNDARY
Held, 1, 3
High-1.Head, 1, 2
*STEP
*STATIC
*CLOAD
High-1.Head, 3, -1.
*BOUNDARY
High-1.Head, 1, 1, 0.1
*END STEP
"""
    found = solved(tmp_path, part + assembly + model + steps)
    assert found.resultant == pytest.approx([-1.2, 0, 4], rel=1e-8, abs=1e-8)
    deck = flatten(read_cards(tmp_path / "deck.inp"))
    turned = np.array([[1, 0], [1, 1], [0, 1], [0, 0]])
    assert np.allclose(deck.points[8:12, :2], turned)
    assert np.allclose(deck.points[12:, :2], turned)
    assert np.allclose(deck.points[8:, 2], [1] * 4 + [2] * 4)
    assert deck.node_name(9) == "High-1.2"


# ---------------------------------------------------------------------------------- steps
def test_the_way_through_the_steps(tmp_path):
    """Forces stay, and a second step that slides back remembers the first."""
    back = DECK + (
        "*STEP\n*STATIC\n.5, 1.\n*BOUNDARY\n15, 1, 1, 0.\n16, 1, 1, 0.\n17, 1, 1, 0.\n"
        "18, 1, 1, 0.\n*END STEP\n"
    )
    case = case_of(tmp_path, back)
    assert case.moving is None
    assert case.evolution.until == 2
    steps = list(am.evolve(case.model, case.evolution.method, until=2.0, tolerance=1e-9))
    ends = {round(s.time, 9): s for s in steps}
    assert [s.time for s in steps] == [1, 1.5, 2]
    forward, backward = (ends[t].solution.r[:, 1:].sum(axis=0) for t in (1.0, 2.0))
    assert np.linalg.norm(forward) == pytest.approx(1.2, rel=1e-6)
    assert backward == pytest.approx(-forward, rel=1e-6, abs=1e-8)
    solved = ["solve", str(tmp_path / "deck.inp"), "-o", str(tmp_path / "out")]
    assert CliRunner().invoke(main, solved).exit_code == 0


def test_amplitudes_and_loads_that_go(tmp_path):
    text = DECK.replace("*FRICTION\n0.3,\n", "").replace(
        "*CLOAD\n", "*AMPLITUDE, NAME=RAMP\n0., 0., .5, 2., 1., 1.\n*CLOAD, AMPLITUDE=ramp\n"
    )
    text += "*STEP\n*STATIC\n*CLOAD, OP=NEW\n15, 3, -2.\n*END STEP\n"
    case = case_of(tmp_path, text)
    mesh = case.model.bodies[0].mesh

    def total(t):  # of all nodal forces in z
        sizes = [len(mesh.node_sets[load.on]) for load in case.in_time.loads]
        values = [load.value[2] for load in case.in_time.loads]
        values = [value(None, t) if callable(value) else value for value in values]
        return np.dot(sizes, values)

    assert [total(t) for t in (0, 0.25, 0.5, 1, 2)] == pytest.approx([0, -4, -8, -4, -2])


# --------------------------------------------------------------------------------- errors
@pytest.mark.parametrize(
    ("change", "words"),
    [
        (("TYPE=C3D8, ELSET=LOWER", "TYPE=C3D9, ELSET=LOWER"),
         r"deck.inp:18: \*ELEMENT: TYPE=C3D9: .* did you mean C3D8"),
        (("LOWER, S2", "LOVER, S2"), r"deck.inp:23: element set LOVER: not found.*LOWER"),
        (("LOWER, S2", "LOWER, S7"), r"face S7: expected S1 to S6"),
        (("*SURFACE, NAME=TOP\n", "*NSET, NSET=A\nA, 1\n*SURFACE, NAME=TOP\n"),
         "node set A: names itself"),
        (("5, 6, 7, 8\n", "5, 6, 7\n"), r"element 1: expected 8 nodes, got 7.*cut"),
        (("2, 1., 0., 0.", "2, 1., nan, 0."), r"deck.inp:3: coordinate: .* finite"),
        (("2, 1., 0., 0.", "2, 1.x, 0., 0."), r"deck.inp:3: coordinate: expected a number"),
        (("3, 1., 1., 0.", "2, 1., 1., 0."), r"deck.inp:4: node 2: .* twice"),
        (("2, 11, 12", "1, 11, 12"), r"deck.inp:21: element 1: .* twice"),
        (("11, 12, 13, 14", "11, 12, 13, 99"), r"deck.inp:21: element 2: node 99 is not there"),
        (("MATERIAL=STEEL\n*SOLID", "MATERIAL=STEAL\n*SOLID"), "did you mean STEEL"),
        (("*SOLID SECTION, ELSET=UPPER, MATERIAL=STEEL\n", ""), "have no material"),
        (("1000., 0.", "-1000., 0."), r"deck.inp:\d+: \*ELASTIC: young"),
        (("INTERACTION=I,", "INTERACTION=J,"), "surface interaction J: not found"),
        (("*FRICTION\n0.3,", "*FRICTION\n-0.3,"), "expected a coefficient >= 0"),
        (("15, 3, -1.", "25, 3, -1."), "node 25: there is none"),
        (("15, 3, -1.", "15, 4, -1."), "a moment at a node of solid elements"),
        (("BOTTOM, TOP\n", "BOTTOM\n"), "expected slave, master"),
        (("*STATIC\n1., 1.", "*DYNAMIC"), r"\*DYNAMIC: changes the answer .*inertia"),
        (("*ELASTIC", "*ELASTICC"), r"ELASTICC: changes .*did you mean \*ELASTIC\?"),
        (("*END STEP", "*TEMPERATURE, OP=NEW\nNALL, 20.\n*END STEP"), "OP=NEW: is not read"),
        (("*BOUNDARY\n1,", "*GAP\n1.\n*BOUNDARY\n1,"),
         "GAP: changes the answer and is not read .*contact elements"),
        (("*BOUNDARY\n1,", "*MODEL CHANGE\nLOWER\n*BOUNDARY\n1,"),
         "MODEL CHANGE: stands before the first"),
        (("*END STEP", "*STEP"), "has not ended"),
        (("*NODE,", "1, 2\n*NODE,"), "deck.inp:1: expected a keyword"),
        (("*MATERIAL, NAME=STEEL\n", ""), "stands before the first"),
        (("*SURFACE, NAME=TOP", "*INCLUDE, INPUT=deck.inp\n*SURFACE, NAME=TOP"),
         "includes itself"),
        (("*SURFACE, NAME=TOP", "*INCLUDE, INPUT=no.inp\n*SURFACE, NAME=TOP"),
         "no such file"),
        (("*BOUNDARY\n1, 1, 3", "*BOUNDARY\n1, ENCASTER"), "did you mean ENCASTRE"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_said_with_its_line(tmp_path, change, words):
    assert DECK.count(change[0]) >= 1
    with pytest.raises(am.FileFormatError, match=words):
        case_of(tmp_path, DECK.replace(*change, 1)).model.assemble()


def test_supports_of_nodes_without_elements_are_left_out(tmp_path):
    text = DECK.replace("\n18, 0., 1., 2.\n", "\n18, 0., 1., 2.\n90, 5., 5., 5.\n")
    text = text.replace("*BOUNDARY\n1, 1, 3\n", "*BOUNDARY\n90, 1, 3\n1, 1, 3\n")
    assert same(solved(tmp_path, text), solved(tmp_path, DECK))
    notes = case_of(tmp_path, text).notes
    assert any("nodes without elements are left out" in note for note in notes)


def test_a_cut_file(tmp_path):
    for k in range(0, len(DECK), 97):
        try:
            case_of(tmp_path, DECK[:k]).model.assemble()
        except am.AmontonsError as reason:
            assert "deck.inp" in str(reason)  # noqa: PT017
    (tmp_path / "deck.inp.gz").write_bytes(gzip.compress(DECK.encode())[:200])
    with pytest.raises(am.FileFormatError, match="can not be read"):
        read(tmp_path / "deck.inp.gz")


@pytest.mark.parametrize("risk", [("--set", "deck.allow=gap"), ("--allow", "gap")])
def test_a_risk_that_is_taken_is_said_in_the_result(tmp_path, monkeypatch, risk):
    monkeypatch.chdir(tmp_path)
    text = DECK.replace("*BOUNDARY\n1,", "*GAP\n1.\n*BOUNDARY\n1,")
    (tmp_path / "deck.inp").write_text(text.replace("*END STEP", "*NODE PRINT\nU\n*END STEP"))
    done = CliRunner().invoke(main, ["solve", "deck.inp", *risk])
    assert done.exit_code == 0, done.output
    assert "AT YOUR RISK: *GAP" in done.output
    notes = json.loads((tmp_path / "deck-results" / "solution.json").read_text())["notes"]
    assert any("AT YOUR RISK" in note for note in notes)
    assert any("NODE PRINT" in note and "skipped" in note for note in notes)


def test_hard_contact_is_one_word_on_the_command_line(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    soft = PRESSED.replace("OVERCLOSURE=HARD", "OVERCLOSURE=LINEAR\n800.")
    (tmp_path / "deck.inp").write_text(soft)
    said = {}
    for words in ((), ("--hard",)):
        asked = ["solve", "deck.inp", "--no-figures", *words, "--json", "found.json"]
        done = CliRunner().invoke(main, asked)
        assert done.exit_code == 0, done.output
        notes = json.loads((tmp_path / "found.json").read_text())["notes"]
        said[words] = [note for note in notes if "taken as hard" in note]
    assert said[()] == []
    assert len(said["--hard",]) == 1


# ------------------------------------------------------------------- node sets of meshes
def test_node_sets_are_held_and_loaded():
    mesh = am.box((1, 1), 4)
    top = np.flatnonzero(mesh.points[:, 1] == 1)
    sets = am.Mesh(mesh.points, mesh.cells, mesh.surfaces, node_sets={"edge": top})
    model = am.Model(
        [am.Body(sets, am.LinearElastic(100.0, 0.2))],
        [am.Fix("edge", (0, None))],
        [am.Contact("bottom", am.Plane(normal=(0, 1)), mu=0.0)],
        [am.NodalForce("edge", (0.0, -1.0))],
    )
    assert am.solve(model).resultant == pytest.approx([0, 5], abs=1e-7)  # 5 nodes
    fine = am.refined(sets)
    assert np.array_equal(fine.node_sets["edge"], np.flatnonzero(fine.points[:, 1] == 1))
    with pytest.raises(am.InvalidInput, match="node set 'a': expected numbers from 0 to 24"):
        am.Mesh(mesh.points, mesh.cells, node_sets={"a": [25]})
    with pytest.raises(am.InvalidInput, match="a surface has this name"):
        am.Mesh(mesh.points, mesh.cells, mesh.surfaces, node_sets={"top": [1]})
