"""The block of ligursky2014 beside GetFEM, its figures, and claims from mesh to mesh."""

import json
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import amontons as am

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT))  # the reproductions are not installed

from reproduce.ligursky2014 import (  # noqa: E402
    block,
    convergence,
    curves,
    disc,
    figure2,
)
from reproduce.ligursky2014.__main__ import REFERENCE  # noqa: E402

STORED = json.loads((ROOT / "reproduce/ligursky2014/results/results.json").read_text())


def test_stored_block_meets_the_reference():
    """The committed page beside GetFEM: folds, statuses of every contact, the node (10, 0)."""
    known_meshes = [name for name in REFERENCE["block"] if name.isdigit()]
    assert "800" in known_meshes
    for squares in known_meshes:
        known, runs = REFERENCE["block"][squares], dict(STORED["block"][squares]["runs"])
        if squares in STORED["block-paper"]:
            runs[block.THEIRS] = STORED["block-paper"][squares]
        for name, run in runs.items():
            assert block.fold_error(run, known) < 1e-9, name
            assert block.solution_error(run, known) < 1e-8, name


def test_stored_block_on_all_meshes():
    """Every method the same folds; lawful solutions; chords that are not seen."""
    for squares, one in STORED["block"].items():
        runs = [*one["runs"].values()]
        runs += [STORED["block-paper"][squares]] if squares in STORED["block-paper"] else []
        for run in runs:
            assert run["folds"] == pytest.approx(runs[0]["folds"], abs=1e-9)
            assert [row["corner"] for row in run["at 0.495"]] == ["f", "-", "s"]
            for row in run["at 0.495"]:
                assert row["residual"] < 1e-9
                assert max(row[key] for key in ("penetration", "tension", "r_n gap",
                                                "beyond the cone")) < 1e-9  # fmt: skip
    for one in STORED["block-paper"].values():
        assert one["curve"]["chords"] < 1e-3
    for rows in STORED["block-friction"].values():
        assert [len(row["folds"]) for row in rows.values()] == [0, 0, 2, 2, 2]
        assert max(row["chords"] for row in rows.values()) < 1e-3


def test_the_block_notices_a_wrong_status():
    one = {"pattern": "fs", "u_nu": 0.0, "u_tau": 0.0, "T_nu": 0.0, "T_tau": 0.0}
    known = {"folds": [0.5], "at 0.495": [one], "along": [one]}
    assert block.solution_error(known, known) == 0
    wrong = {**known, "at 0.495": [{**one, "pattern": "f-"}]}
    assert np.isinf(block.solution_error(wrong, known))
    assert np.isinf(block.fold_error({"folds": []}, known))


def test_a_small_block_by_both_ways():
    """By the pieces and by the paper's algorithms: the same folds, solutions and curve."""
    theirs = am.Continuation(**block.PAPER, switch=am.Switch.TANGENT)
    runs = []
    for options in (am.Continuation(), theirs):
        branch, cpu = block.timed(4, options)
        runs.append(block.record(branch, cpu) | {"curve": block.curve(branch)})
    assert block.fold_error(*runs) < 1e-9
    assert block.solution_error(*runs) < 1e-8
    for run in runs:
        assert run["curve"]["chords"] < 1e-3
    lines = [{key: run["curve"][key] for key in ("gamma", *block.NODE)} for run in runs]
    assert curves.chord_error(*lines) < 2e-3


def test_what_is_claimed_of_meshes_is_computed():
    rows = convergence.block_rows(STORED["block"])
    told = {(row["at"], row["quantity"]): row["steps"] for row in rows}
    assert told["lower fold", "gamma"] == "grow"
    assert told["upper fold", "gamma"] == "shrink"
    assert told["gamma = 1", "T_nu"] == "shrink"
    assert told["0.495, stick", "T_nu"] == "grow"
    assert told["gamma = 0.45", "T_nu"] == "status differs"
    claims = {row["claim"]: row["verdict"] for row in convergence.block_claims(STORED["block"])}
    assert claims["two folds"] == claims["up to three solutions"] == "holds"
    assert claims["stresses seem to converge"] == "holds in part"
    claims = {row["claim"]: row["verdict"]
              for row in convergence.vee_claims(STORED["vee-curves"])}  # fmt: skip
    assert set(claims.values()) == {"holds"}
    assert convergence.steps([1.0, 1.5, 1.6])["ratio"] == pytest.approx(0.2)


def test_example_5_of_a_model():
    curved, flat = disc.run([], Path())
    assert curved["off"] < 1e-10
    assert curved["solutions at 0.47"] == 3
    assert curved["largest |g|"] < 1e-12
    assert curved["slip off its curve"] < 1e-10
    assert flat["folds"] == flat["by hand"] == "none"


def test_figure_2_and_time_steps(tmp_path):
    rows = figure2.run([], tmp_path)
    assert (tmp_path / "figure2.png").stat().st_size > 10_000
    assert [row["one-sided branches"] for row in rows] == [2, 3, 4]
    assert max(row["largest value on the branches"] for row in rows) < 1e-15
    assert max(row["largest slope along the directions"] for row in rows) < 1e-5
    turned, plain = STORED["time-steps"]["block"]
    assert turned["contact"] == 0
    assert plain["contact"] < -0.1
    assert {row["jumps"] for row in STORED["time-steps"]["vee"]} == {0}


def test_curves_between_points_are_smooth():
    """A circle of eight points: cubics in between, chords as few as allowed."""

    class Circle:
        linear = False
        angles = np.linspace(0, np.pi, 8)

        def __iter__(self):
            for a in self.angles:
                yield SimpleNamespace(
                    parameter=np.cos(a), state=np.array([np.sin(a)]), piece="all",
                    direction=np.array([np.cos(a)]), rate=-np.sin(a), arclength=a,
                )  # fmt: skip

    dense = curves.sampled(Circle(), lambda y, p: {"y": float(y[0])})
    assert np.abs(np.hypot(dense["gamma"], dense["y"]) - 1).max() < 2e-4
    drawn = curves.thinned(dense, 5e-4)
    assert len(drawn["y"]) < len(dense["y"]) / 2
    assert curves.chord_error(drawn, dense) < 2e-3
