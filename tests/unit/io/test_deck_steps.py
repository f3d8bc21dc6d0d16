"""Steps of decks that change friction, supports and contact pairs, by exact values."""

import json

import numpy as np
import pytest
from click.testing import CliRunner

import amontons as am
from amontons.app.cli import main
from tests.unit.io.test_decks import DECK, SLIDE, case_of

CALM = DECK.replace(SLIDE, "")
SIDE = "15, 1, 1, {0}\n16, 1, 1, {0}\n17, 1, 1, {0}\n18, 1, 1, {0}\n"


def steps_of(tmp_path, text, *overrides):
    case = case_of(tmp_path, text, *overrides)
    found = am.evolve(
        case.in_time, case.evolution.method, until=case.evolution.until, tolerance=1e-10
    )
    return {round(step.time, 6): step for step in found}


def step(text, head="*STEP\n*STATIC\n.25, 1.\n"):
    return f"{head}{text}*END STEP\n"


def side(step):
    """Shear over pressure in x."""
    return step.fields.force[:, 0].sum() / step.fields.force[:, 2].sum()


def test_friction_that_changes(tmp_path):
    """0.3 in the first step, 0.1 in the second, whatever stuck before."""
    text = DECK + step("*CHANGE FRICTION, INTERACTION=I\n*FRICTION\n0.1,\n")
    ends = steps_of(tmp_path, text)
    assert side(ends[1.0]) == pytest.approx(-0.3, rel=1e-6)
    assert side(ends[2.0]) == pytest.approx(-0.1, rel=1e-6)


def test_a_stiffness_that_changes(tmp_path):
    soft = CALM.replace("OVERCLOSURE=HARD", "OVERCLOSURE=LINEAR\n800.")
    text = soft + step(
        "*CHANGE SURFACE BEHAVIOR, INTERACTION=I\n"
        "*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR\n200.\n"
    )
    ends = steps_of(tmp_path, text)
    for time, stiffness in ((1.0, 800), (2.0, 200)):
        top = ends[time].state.displacement.reshape(-1, 3)[-4:, 2]
        assert top == pytest.approx([-8e-3 - 4 / stiffness] * 4, rel=1e-7)


def test_a_support_that_comes_begins_where_the_node_is(tmp_path):
    """The pressed top is taken hold of, and lifted from where it is then."""
    lift = "".join(f"{k}, 3, 3, -.004\n" for k in range(15, 19))
    ends = steps_of(tmp_path, CALM + step(f"*BOUNDARY\n{lift}"))
    for time, way in ((1.0, -8e-3), (1.5, -6e-3), (2.0, -4e-3)):
        top = ends[time].state.displacement.reshape(-1, 3)[-4:, 2]
        assert top == pytest.approx([way] * 4, rel=1e-7)


def test_a_support_that_is_fixed_stays(tmp_path):
    keep = "".join(f"{k}, 3, 3\n" for k in range(15, 19))
    text = CALM + step(f"*CLOAD, OP=NEW\n*BOUNDARY, FIXED\n{keep}") + step("")
    ends = steps_of(tmp_path, text)
    for time in (1.0, 1.5, 2.0, 3.0):
        top = ends[time].state.displacement.reshape(-1, 3)[-4:, 2]
        assert top == pytest.approx([-8e-3] * 4, rel=1e-7)
    assert ends[3.0].fields.force[:, 2].sum() == pytest.approx(4, rel=1e-7)


def test_supports_that_go(tmp_path):
    """OP=NEW lets the dragged head go in x: it springs back as far as friction lets it."""
    held = "1, 1, 3\n2, 1, 3\n3, 1, 3\n4, 1, 3\n15, 2\n16, 2\n17, 2\n18, 2\n"
    ends = steps_of(tmp_path, DECK + step(f"*BOUNDARY, OP=NEW\n{held}"))
    assert side(ends[1.0]) == pytest.approx(-0.3, rel=1e-6)
    assert side(ends[2.0]) == pytest.approx(0.0, abs=1e-6)
    head, foot = ends[2.0].state.displacement.reshape(-1, 3)[[-4, 8], 0]
    assert 0.05 < foot < 0.1
    assert head == pytest.approx(foot, abs=2e-3)
    again = held + SIDE.format(0.0)
    ends = steps_of(tmp_path, DECK + step(f"*BOUNDARY, OP=NEW\n{again}"))
    assert side(ends[2.0]) == pytest.approx(0.3, rel=1e-6)  # goes on from where it was
    assert ends[1.5].state.displacement.reshape(-1, 3)[-1, 0] == pytest.approx(0.05)


def test_contact_that_is_removed_and_comes_back(tmp_path):
    """A block that is held at one foot too bears without contact, and as before with it."""
    hold = "".join(f"{k}, 3, 3, -.01\n" for k in range(15, 19))
    text = CALM.replace("*CLOAD\n15, 3, -1.\n16, 3, -1.\n17, 3, -1.\n18, 3, -1.\n",
                        f"*BOUNDARY\n{hold}")  # fmt: skip
    text = text.replace("15, 1, 2\n", "15, 1, 2\n11, 1, 2\n")
    rest = "*MODEL CHANGE, TYPE=CONTACT PAIR, {}\nBottom, Top\n"
    text = text.replace("*FRICTION\n0.3,\n", "")
    spring = text.replace("*BOUNDARY\n1,", "*BOUNDARY\n11, 3, 3, 0.\n1,")
    ends = steps_of(tmp_path, spring + step(rest.format("REMOVE")) + step(rest.format("ADD")))
    assert ends[1.0].fields.force[:, 2].sum() > 1
    assert ends[2.0].fields.force[:, 2].sum() == 0
    assert ends[3.0].fields.force[:, 2].sum() == pytest.approx(
        ends[1.0].fields.force[:, 2].sum(), rel=1e-7
    )


def test_times_of_steps(tmp_path):
    """Increments of the deck, 20 at most unless DIRECT, corners of amplitudes, overrides."""
    bend = "*AMPLITUDE, NAME=A, TIME=TOTAL TIME\n0., 0., 1.3, 1., 2., 0.\n"
    more = DECK.replace("*STEP\n", f"{bend}*STEP\n", 1)
    more += step("*CLOAD, AMPLITUDE=A\n15, 3, -2.\n")
    assert sorted(steps_of(tmp_path, more)) == [1.0, 1.25, 1.3, 1.5, 1.75, 2.0]
    fine = DECK.replace("1., 1.", ".001, 1.")
    assert len(steps_of(tmp_path, fine)) == 20
    assert any("20 increments, not 1000" in n for n in case_of(tmp_path, fine).notes)
    assert len(steps_of(tmp_path, fine, "deck.increments=3")) == 3
    direct = DECK.replace("*STATIC\n1., 1.", "*STATIC, DIRECT\n.04, 1.")
    assert len(steps_of(tmp_path, direct)) == 25


def test_results_of_all_steps_and_a_restart(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    text = DECK + step("*CHANGE FRICTION, INTERACTION=I\n*FRICTION\n0.1,\n")
    text = text.replace("*END STEP", "*NODE PRINT\nU\n*END STEP")
    (tmp_path / "deck.inp").write_text(text)
    done = CliRunner().invoke(main, ["run", "deck.inp", "-o", "whole"])
    assert done.exit_code == 0, done.output
    table = np.genfromtxt("whole/steps.csv", delimiter=",", names=True)
    assert table["time"].tolist() == [1, 1.25, 1.5, 1.75, 2]
    data = json.loads((tmp_path / "whole" / "solution.json").read_text())
    assert data["pairs"][0]["force"][0] == pytest.approx(-0.4, rel=1e-5)
    assert any("NODE PRINT" in n and "skipped" in n for n in data["notes"])
    assert np.isfinite([list(row) for row in table]).all(axis=0).sum() > 20
    changed = text.replace("\n0.1,\n", "\n0.2,\n")
    (tmp_path / "deck.inp").write_text(changed)
    again = CliRunner().invoke(main, ["run", "deck.inp", "-o", "whole", "--restart"])
    assert "deck.cards" in again.output


@pytest.mark.parametrize(
    ("more", "words"),
    [
        ("*FRICTION\n0.1,\n", "stands in a step; expected .CHANGE FRICTION"),
        ("*CHANGE FRICTION, INTERACTION=J\n*FRICTION\n0.1,\n", "surface interaction J"),
        ("*MODEL CHANGE, TYPE=ELEMENT, REMOVE\nUPPER,\n", "elements that come and go"),
        ("*MODEL CHANGE, TYPE=CONTACT PAIR\nBOTTOM, TOP\n", "either ADD or REMOVE"),
        ("*MODEL CHANGE, TYPE=CONTACT PAIR, REMOVE\nBOTTOM, TIP\n", "contact pair BOTTOM, TIP"),
    ],
)
def test_what_is_wrong_is_said_with_its_line(tmp_path, more, words):
    with pytest.raises(am.FileFormatError, match=rf"deck.inp:\d+: .*{words}"):
        case_of(tmp_path, DECK + step(more))


def test_solve_makes_the_steps_of_a_deck_whose_state_depends_on_the_way(tmp_path, monkeypatch):
    text = DECK + step("*CHANGE FRICTION, INTERACTION=I\n*FRICTION\n0.1,\n")
    monkeypatch.chdir(tmp_path)
    (tmp_path / "deck.inp").write_text(text)
    solved = CliRunner().invoke(main, ["solve", "deck.inp", "-o", "a", "--json", "copy.json"])
    assert solved.exit_code == 0, solved.output
    assert "depends on the way" in solved.output
    run = CliRunner().invoke(main, ["run", "deck.inp", "-o", "b"])
    assert run.exit_code == 0, run.output
    found, known = (json.loads((tmp_path / k / "solution.json").read_text()) for k in "ab")
    for pair, other in zip(found["pairs"], known["pairs"], strict=True):
        np.testing.assert_allclose(pair["force"], other["force"], rtol=1e-9, atol=1e-12)
    assert json.loads((tmp_path / "copy.json").read_text()) == found
    assert (tmp_path / "a" / "steps.csv").is_file()
    alone = CliRunner().invoke(main, ["solve", "deck.inp", "-o", "c", "--uniqueness"])
    assert alone.exit_code == 2
    assert "--uniqueness: for one state alone" in alone.output
    assert not (tmp_path / "c").exists()
