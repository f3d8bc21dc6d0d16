"""`python -m reproduce.hueeber2008` on coarse levels, against every printed entry."""

import json
import sys
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT))  # the reproductions are not installed

from reproduce.hueeber2008 import figures, shell, tables  # noqa: E402
from reproduce.hueeber2008.__main__ import CUBE, REFERENCE, main  # noqa: E402


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    out = tmp_path_factory.mktemp("hueeber2008")
    figures.DPI = 20
    done = CliRunner().invoke(main, [*CUBE, "--levels", "0,1,2", "--results", str(out)])
    assert done.exit_code == 0, done.output
    return out


@pytest.fixture(scope="module")
def record(results):
    return json.loads((results / "results.json").read_text())


def test_every_entry_of_table_41(record):
    for level, run in record["table4.1"].items():
        assert tables.history(run) == REFERENCE["table4.1"][level]


def test_multigrid_steps_of_tables_42_and_43(record):
    for name in ("exact", "inexact", "nested"):
        for level, run in record["table4.2"][name].items():
            K, steps = REFERENCE["table4.2"][name][level]
            assert run["K"] == K
            assert run["cycles"] <= steps
    for c, runs in record["table4.3"].items():
        for level, run in runs.items():
            K, steps = REFERENCE["table4.3"][c][level]
            assert run["finished"] and abs(run["K"] - K) <= 2
            assert abs(run["steps"] - steps) <= 3 and run["steps"] <= steps


def test_table_51_from_zero(record):
    for level, run in record["table5.1"]["zero"].items():
        K, steps = REFERENCE["table5.1"]["zero"][level]
        assert abs(run["K"] - K) <= 1
        assert abs(run["steps"] - steps) <= 2
    known = json.loads((ROOT / "tests/data/cube.json").read_text())
    for level in ("1", "2"):
        ours = record["table5.1"]["zero"][level]["resultant"]
        np.testing.assert_allclose(ours, known[f"level{level}"]["resultant"], rtol=1e-6)


def test_table_51_nested(record):
    for level, run in record["table5.1"]["nested"].items():
        K, steps = REFERENCE["table5.1"]["nested"][level]
        assert abs(run["K"] - K) <= 1
        assert abs(run["steps"] - steps) <= 1


def test_full_newton_is_superlinear_and_needs_a_third_of_the_steps(record):
    for level, run in record["newton"].items():
        last = np.array(run["changes"][-3:])
        assert last[1] < 0.05 * last[0] and last[2] < 0.01 * last[1]
        assert 3 * run["steps"] <= record["table5.1"]["zero"][level]["steps"]


def test_the_page_and_its_figures(results):
    text = (results / "results.md").read_text()
    assert "| 2 | 15/16 12/16 12/16 12/16 12/16 |" in text and "**no**" not in text
    assert "does not name the norm" in text
    for name in ("4.1", "4.2", "4.3", "5.1a", "5.1b", "5.2", "5.3"):
        assert (results / f"figure{name}.png").stat().st_size > 1000


def test_the_shell():
    runs = shell.table61([0, 1], (0.2,))
    for level, run in runs["zero"]["0.2"].items():
        assert run.finished and run.settled <= REFERENCE["table6.1"]["zero"][level][0]
    nested = runs["nested"]["0.2"]["1"]
    assert nested.finished and nested.settled < runs["zero"]["0.2"]["1"].settled
    newton, fixed = shell.newton(1, 0.4).values()
    assert newton.finished and fixed.finished and newton.steps < fixed.steps
    r = newton.iterates[-1].r
    np.testing.assert_allclose(fixed.iterates[-1].r, r, atol=1e-7 * np.abs(r).max())


@pytest.mark.parametrize("words", [["table9"], ["--levels", "x"], ["--levels", "9"]])
def test_wrong_words_are_named(words):
    assert CliRunner().invoke(main, words).exit_code == 2
