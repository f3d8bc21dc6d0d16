"""audit.json: every key is documented, and every documented key is there."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

import amontons as am
from amontons.analysis.audit import Answer, audit_answer
from amontons.app.cli.audit import SCHEMA, record

PAGE = (Path(__file__).parents[3] / "docs" / "audit.md").read_text(encoding="utf-8")
SECTION = PAGE[PAGE.index("## audit.json") : PAGE.index("## Our results for other")]
WORDS = {"right", "wrong", "undecided", SCHEMA, "amontons audit … --json audit.json", "--solve"}
OURS = {"converged", "error"}  # of our own solution beside


def said(pattern: str) -> set[str]:
    """The words in backticks of a part of the section."""
    found = re.search(pattern, SECTION, re.MULTILINE | re.DOTALL)
    assert found is not None
    return set(re.findall("`([^`]+)`", found[1])) - WORDS


@pytest.fixture(scope="module")
def records() -> list[dict]:
    steel = am.LinearElastic(1000.0, 0.3)
    low = am.Body(am.box((2, 2, 1), (4, 4, 2)), steel, "low")
    high = am.Body(am.box((1, 1, 1), (3, 3, 2), origin=(0.5, 0.5, 1)), steel, "high")
    motion = [am.Fix("low.bottom", 0.0), am.Fix("high.top", (0.004, 0.0, -0.01))]
    pair = am.Model([low, high], motion, [am.Contact("high.bottom", master="low.top", mu=0.3)])
    flat = am.Model([low], [am.Fix("top", (0.0, 0.0, -0.01))],
                    [am.Contact("bottom", am.Plane((0, 0, 1)), mu=0.3)])  # fmt: skip
    found = [am.audit(model, am.solve(model)) for model in (pair, flat)]
    solution = am.solve(pair)
    stopped = Answer(solution.displacement, reactions=-solution.r, time=0.5, until=1.0)
    found.append(audit_answer(pair, stopped))
    found.append(am.audit(pair, tuple(0 * part for part in solution.displacement)))
    return [record(each) for each in found]


def test_every_key_is_documented_and_every_documented_key_is_there(records):
    whole = {key for each in records for key in each}
    assert whole == said(r"^\| key \| what \|(.*?)\n\n") - OURS
    questions = {
        name: value for each in records for name, value in each.items()
        if isinstance(value, dict) and "verdict" in value
    }  # fmt: skip
    assert set(questions) == {"balance", "penetration", "cone", "status", "geometry", "time",
                              "forces"}  # fmt: skip
    common = said(r"^(Every question has .*?)\n\n")
    for name, value in questions.items():
        assert set(value) == common | said(rf"^\| `{name}` \| (.*?) \|$"), name
    pairs = [pair for each in records for pair in each["pairs"]]
    keys = said(r"^(A pair has .*?)\n\n") | {"penetration", "cone", "status", "geometry"}
    for pair in pairs:
        assert set(pair) == keys
        for name in ("penetration", "cone", "status", "geometry"):
            assert set(pair[name]) == set(questions[name])


def test_all_answers_have_the_same_keys(records):
    """Right, wrong and without any force: a reader finds what it looks for."""
    for name in ("balance", "penetration", "cone", "status", "geometry"):
        for each in records:
            assert set(each[name]) == set(records[0][name]), name


def test_the_page_says_which_questions_fail_and_shows_whole_sentences(tmp_path):
    steel = am.LinearElastic(1000.0, 0.3)
    model = am.Model(
        [am.Body(am.box((1, 1, 1), 3), steel)], [am.Fix("top", (0.0, 0.0, -0.01))],
        [am.Contact("bottom", am.Plane((0, 0, 1)), mu=0.3)],
    )  # fmt: skip
    found = am.audit(model, (0 * model.bodies[0].mesh.points,))
    assert found.verdict == "wrong"
    page = found.report(tmp_path / "a.html").read_text(encoding="utf-8")
    failed = [name for name, one in found.findings.items() if one.verdict.value == "wrong"]
    assert f"This answer is wrong: {', '.join(failed)}." in page
    assert '<td class="words">supports do not have the displacements' in page
