"""The verification manual: its cheapest cases, and that it can fail."""

import json
from dataclasses import replace

import pytest
from click.testing import CliRunner

from verify.__main__ import CASES, main
from verify.case import Case, Value, run

CHEAP = "wedge slope wall keystone tie reference spring tool overlap slot rolling"


@pytest.mark.parametrize("name", CHEAP.split())
def test_cheap_cases_pass(name):
    outcome = run(replace(CASES[name], sizes=CASES[name].sizes[:1]))
    assert outcome.passed, [(v.name, v.error) for v in outcome.last]


def test_fracture_and_press_fit_come_closer_with_the_mesh():
    for name, sizes in (
        ("fracture", (4, 8)),
        ("press-fit", (2, 4)),
        ("press-fit-3d", (2, 3)),
        ("capstan", (8, 16)),
        ("thermal-fit", (2, 4)),
        ("cone", (4, 8)),
        ("orthotropic", (6, 12)),
        ("punch-friction", (8, 16)),
        ("capped", (101, 401)),
        ("pin", (16, 32)),
        ("sector", (1, 2)),
        ("disc", (1, 2)),
        ("layers", (1, 2)),
    ):
        outcome = run(replace(CASES[name], sizes=sizes))
        for value in outcome.last:
            first, last = outcome.errors(value.name)
            assert last <= max(first, value.known)
            assert last < 0.2


def off(by, order=1.0):
    return Case("off", "Off", "", "", lambda n: [Value("x", 1 + by / n, 1.0)], (1, 2), (),
                order)  # fmt: skip


def test_a_case_fails_where_it_is_wrong_or_comes_no_closer():
    assert run(off(0.01)).passed
    assert not run(off(0.03)).passed
    assert not run(off(0.01, order=None)).passed
    assert not run(replace(off(0), compute=lambda n: [Value("x", 1 + 1e-3 * n, 1.0)])).passed
    assert not run(replace(off(0), compute=lambda n: [Value("x", float("nan"), 1.0)])).passed
    assert run(off(0.01)).order("x") == pytest.approx(1.0)


def test_the_command_says_so_in_its_exit_code(tmp_path, monkeypatch):
    monkeypatch.setitem(CASES, "off", off(0.03))
    found = CliRunner().invoke(main, ["off", "--results", str(tmp_path)])
    assert found.exit_code == 1
    assert "FAIL  off" in found.output
    assert json.loads((tmp_path / "results/results.json").read_text())["off"]["passed"] is False
    assert "FAIL" in (tmp_path / "README.md").read_text()
    assert CliRunner().invoke(main, ["wedges"]).exit_code == 2
    assert "did you mean 'wedge'" in CliRunner().invoke(main, ["wedges"]).output


def test_a_failed_case_says_why(monkeypatch):
    monkeypatch.setitem(CASES, "off", replace(off(0.03), source="a book"))
    found = CliRunner().invoke(main, ["off"])
    assert (
        "error 1.5e-02 at size 2, and 1.0e-02 is allowed; expected from a book" in found.output
    )
    grows = replace(off(0), compute=lambda n: [Value("x", 1 + 1e-3 * n, 1.0)])
    assert "larger than those of the smaller sizes, 1.0e-03" in run(grows).failure(
        run(grows).last[0]
    )
    monkeypatch.setitem(CASES, "off", replace(off(0), compute=lambda n: [1 / 0]))
    found = CliRunner().invoke(main, ["off", "wall", "--quick"])
    assert found.exit_code == 1
    assert "FAIL  off: ZeroDivisionError" in found.output
    assert "PASS  wall" in found.output


def test_quick_takes_the_smallest_size_with_the_tolerance_of_the_order():
    case = off(0.03)  # 3 percent at size 1, 1.5 at size 2
    assert not run(case).passed
    quick = run(replace(off(0.019)), quick=True)
    assert list(quick.values) == [1]
    assert quick.tolerance == pytest.approx(0.02)
    assert quick.passed
    assert not run(case, quick=True).passed
    assert not run(replace(off(0.01), order=None), quick=True).passed
    for wrong in (["--quick", "--fine"], ["--quick", "--results", "x"]):
        assert CliRunner().invoke(main, wrong).exit_code == 2


def test_names_are_patterns():
    found = CliRunner().invoke(main, ["--list", "--only", "w*", "slope"])
    assert [line.split()[0] for line in found.output.splitlines()] == ["wedge", "slope", "wall"]
    titles = [case.title for case in CASES.values()]
    assert len(set(titles)) == len(titles)
    assert not any("same" in title for title in titles)  # a figure stands alone
