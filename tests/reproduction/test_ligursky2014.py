"""The examples of ligursky2014 against the sets that the paper derives; the V-shaped body."""

import json
import sys
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

import amontons as am

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT))  # the reproductions are not installed

from reproduce.ligursky2014 import claims, examples, rates, stress, tables, vee  # noqa: E402
from reproduce.ligursky2014.__main__ import REFERENCE, main  # noqa: E402


def test_example_1_shows_what_first_order_can_not_tell():
    G, H = examples.example1()
    assert G["one-sided branches (p', x')"] == "[[-1, -1], [-1, 1]]"
    assert G["zeros around the origin (p, x)"] == "[[-0.7, -0.7], [-0.7, 0.7]]"
    assert (G["event of the curve from p = -1"], abs(G["at"]) < 1e-12) == ("fold", True)
    assert H["one-sided branches (p', x')"] == "[[-1, 0], [-1, 0], [1, 0]]"
    assert H["zeros around the origin (p, x)"].count("[-1.0, ") == 2
    assert "[1.0, 0.0]" in H["zeros around the origin (p, x)"]
    assert H["event of the curve from p = -1"] == "branch"
    assert all(row["ends"] == "interval, interval" for row in (G, H))


def test_example_2_finds_the_crossing():
    first, second = examples.example2()
    assert abs(first["branch point at"]) < 1e-9
    assert first["one-sided branches there"] == 4
    assert second["largest |x^2 - p|"] < 1e-12
    assert abs(second["turns at"]) < 1e-10


def test_example_3_the_memory_term_leaves_one_piece():
    with_memory, without, by_hand = examples.example3()
    assert with_memory["at p = 0"] == "slip (one equation)"
    assert without["at p = 0"] == "impending slip (two)"
    for row in (with_memory, without, by_hand):
        assert row["largest error against the paper's set"] < 1e-13
        assert row["agrees"]


def test_example_4_large_friction():
    rows = examples.example4()
    assert rows[0]["tangents"] == "p' < 0 (s), p' = 0 (+)"
    assert rows[1]["tangents"] == "p' = 0 (+), p' = 0 (+)"
    assert rows[2]["tangents"] == "p' > 0 (f), p' = 0 (+)"
    assert rows[3]["tangents"].endswith("s -> + at 2; + -> f at 2")
    assert rows[4]["tangents"].startswith("all between")
    for row in rows:
        assert row["off the printed set"] < 1e-12
        assert row["agrees"]


def test_example_5_curved_obstacle():
    curved, flat = examples.example5()
    assert curved["tangents"] == "p' < 0 (s), p' < 0 (-)"
    assert curved["folds of the curve"][0] == pytest.approx(0.5, abs=1e-11)
    assert curved["error of slip / p'"] < 1e-12
    assert curved["off the exact folds"] < 1e-10
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


def test_the_full_problem_of_a_user_is_followed_quickly():
    """654 unknowns that only name their pieces: counted in factorised matrices, not seconds."""
    exact = vee.follow(0, None)
    problem, start = vee.full_problem(exact)
    assert len(start) == 654
    branch = am.follow(problem, start=start, at=0.0)
    expected = [e.parameter for e in exact.folds]
    assert [e.parameter for e in branch.folds] == pytest.approx(expected, abs=1e-12)
    assert len(branch.at(0.38)) == 3
    assert len(branch.events) == len(exact.events)
    assert problem.calls < 1200


def test_the_printed_stress_resists_a_rotation():
    still, turned = stress.rows()
    assert still["agrees"]
    assert not turned["agrees"]
    assert turned["stress, printed (N/mm^2)"] == pytest.approx(4.14, abs=0.01)


def test_propositions_on_random_systems():
    rows = rates.rows()
    assert all(row["agrees"] for row in rows)


def test_the_page_opens_with_counts(tmp_path):
    rows = [{"claim": "x", "verdict": word} for word in ("agrees", "agrees", "paper", "ours")]
    line = claims.line(rows)
    assert "4 statements" in line
    assert "2 agree / 1 differ by the paper's fault / 1 differ by ours" in line
    done = CliRunner().invoke(main, ["example1", "--results", str(tmp_path)])
    assert done.exit_code == 0, done.output
    page = (tmp_path / "results.md").read_text().splitlines()
    assert page[2].startswith("Of 2 statements")


def test_the_scripts_import_public_names_only():
    for path in (ROOT / "reproduce/ligursky2014").glob("*.py"):
        for line in path.read_text().splitlines():
            if line.startswith(("import amontons", "from amontons")):
                assert not line.startswith("from amontons.analysis."), f"{path.name}: {line}"
