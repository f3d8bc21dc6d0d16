"""The examples of ligursky2014 against the sets that the paper derives; the V-shaped body."""

import json
import sys
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT))  # the reproductions are not installed

from reproduce.ligursky2014 import examples, tables, vee  # noqa: E402
from reproduce.ligursky2014.__main__ import REFERENCE, main  # noqa: E402


def test_example_1_shows_what_first_order_can_not_tell():
    rows = examples.example1()
    assert rows[0]["zeros around the origin (p, x)"] == "[[-0.7, -0.7], [-0.7, 0.7]]"
    assert "(+1, +0) not strict" in rows[0]["null directions (p', x')"]
    assert rows[1]["zeros around the origin (p, x)"].count("[-1.0, ") == 2
    assert "[1.0, 0.0]" in rows[1]["zeros around the origin (p, x)"]


def test_example_2_finds_the_crossing():
    first, second = examples.example2()
    assert abs(first["branch point at"]) < 1e-9
    assert first["one-sided branches there"] == 4
    assert second["largest |x^2 - p|"] < 1e-12
    assert abs(second["turns at"]) < 1e-10


def test_example_3_the_memory_term_leaves_one_piece():
    with_memory, without = examples.example3()
    assert with_memory["pieces at p = 0"] == "-"
    assert without["pieces at p = 0"] == "s-"
    for row in (with_memory, without):
        assert row["largest error against the paper's set"] < 1e-13


def test_example_4_large_friction():
    rows = examples.example4()
    assert rows[0]["tangents"] == "p' < 0 (s), p' = 0 (+)"
    assert rows[1]["tangents"] == "p' = 0 (+), p' = 0 (+)"
    assert rows[2]["tangents"] == "p' > 0 (f), p' = 0 (+)"
    assert rows[3]["tangents"].endswith("s -> + at 2; + -> f at 2")
    assert rows[4]["tangents"] == "sets on +"


def test_example_5_curved_obstacle():
    curved, flat = examples.example5()
    assert curved["tangents"] == "p' < 0 (s), p' < 0 (-)"
    assert curved["folds of the curve"][0] == pytest.approx(0.5, abs=1e-11)
    assert curved["error of slip / p'"] < 1e-12
    assert flat["tangents"] == "p' < 0 (s), p' > 0 (-)"
    assert flat["folds of the curve"] == []


def test_vee_on_2220_triangles():
    branch = vee.follow(1, None)
    run, known = vee.record(branch, 0.0), REFERENCE["vee"]["2220"]
    assert tables.fold_error(run, known) < 1e-11
    assert tables.solution_error(run, known) < 1e-11
    assert max(row["error"] for row in run["corner at 0.38"]) < 1e-11


def test_stored_results_meet_the_reference():
    """The committed page: all methods on all three meshes."""
    stored = json.loads((ROOT / "reproduce/ligursky2014/results/results.json").read_text())
    for triangles, known in REFERENCE["vee"].items():
        for run in stored["vee"][triangles].values():
            assert tables.fold_error(run, known) < 1e-9
            assert tables.solution_error(run, known) < 1e-8
    assert [len(folds) for folds in stored["friction"].values()] == [0, 0, 0, 2, 2, 2]


def test_the_command_writes_a_page(tmp_path):
    done = CliRunner().invoke(main, ["example2", "--results", str(tmp_path)])
    assert done.exit_code == 0, done.output
    assert "Example 2" in (tmp_path / "results.md").read_text()
    assert CliRunner().invoke(main, ["example9"]).exit_code == 2


def test_tables_notice_a_wrong_status():
    one = {"status": "f", "u_n": 0.0, "u_t": 0.0, "lam_n": 0.0, "lam_t": 0.0}
    run = {"corner at 0.38": [one]}
    assert np.isinf(tables.solution_error(run, {"corner at 0.38": [{**one, "status": "s"}]}))
    assert tables.solution_error(run, {"corner at 0.38": [one]}) == 0
