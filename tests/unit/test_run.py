"""`amontons run`: what it writes, restart, export, refusals; the [wall] table."""

import csv
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

import amontons as am
from amontons.case import read_case
from amontons.cli import main

WALL = Path(__file__).resolve().parents[2] / "examples" / "wall" / "wall.toml"
SMALL = ["--set", "wall.cells=[2,1,1]", "--set", "wall.rows=3"]
BLOCK = """
[mesh]
box = [2, 1]
cells = [4, 2]
[material.default]
young = 100
poisson = 0.2
[[fix]]
on = "top"
value = ["0.01*t", "-0.02*min(1, 2*t)"]
[[contact]]
slave = "bottom"
obstacle = { plane = { normal = [0, 1] } }
friction = { coulomb = 0.4 }
[evolution]
kind = "quasi-static"
step = 0.25
until = 1
"""


def run(*arguments):
    return CliRunner().invoke(main, ["run", *map(str, arguments)])


def table(folder):
    with (folder / "steps.csv").open(newline="") as file:
        return list(csv.DictReader(file))


def test_the_wall_of_a_case_is_that_of_the_script():
    model = read_case(WALL).model
    assert len(model.bodies) == 13
    stone = model.bodies[0].material
    wall = am.Wall(5, 2, (0.4, 0.2, 0.2), (8, 4, 4), stone, plate=0.05)
    assert [c.slave for c in model.contacts] == [c.slave for c in wall.contacts]
    assert model.bodies[-1].material.young == 2.1e11
    assert model.bodies[0].material.density == 2000


def test_a_run_restarts_where_it_stopped(tmp_path):
    whole, half = tmp_path / "whole", tmp_path / "half"
    done = run(WALL, *SMALL, "--set", "evolution.until=0.03", "-o", whole, "--export-fclib",
               tmp_path / "problems", "--quiet")  # fmt: skip
    assert done.exit_code == 0, done.output
    assert done.output == ""
    rows = table(whole)
    assert [int(row["index"]) for row in rows] == list(range(1, 31))
    assert sorted(p.name for p in whole.iterdir()) == [
        "state.h5", "step-00010.vtu", "step-00020.vtu", "step-00030.vtu", "steps.csv",
        "steps.pvd",
    ]  # fmt: skip
    problems = sorted((tmp_path / "problems").iterdir())
    assert [p.name for p in problems] == [f"wall-{k:05d}.hdf5" for k in range(1, 31)]
    assert am.read_fclib(problems[-1]).contacts > 20
    for end in ("0.015", "0.03"):
        again = ["--restart"] if end == "0.03" else []
        done = run(WALL, *SMALL, "--set", f"evolution.until={end}", "-o", half, *again)
        assert done.exit_code == 0, done.output
        assert "results in" in done.output
    ours, theirs = am.load_state(half / "state.h5"), am.load_state(whole / "state.h5")
    np.testing.assert_array_equal(ours.displacement, theirs.displacement)
    assert [row["elastic"] for row in table(half)] == [row["elastic"] for row in rows]


def test_quasi_static_cases_run(tmp_path):
    case = tmp_path / "case.toml"
    case.write_text(BLOCK)
    done = run(case, "-o", tmp_path / "out", "--every", 2)
    assert done.exit_code == 0, done.output
    rows = table(tmp_path / "out")
    assert len(rows) == 4
    for row in rows:
        assert float(row["contact"]) <= 1e-9 * float(row["elastic"])  # of the tolerance
        assert abs(float(row["defect"])) < 1e-9
    pvd = (tmp_path / "out" / "steps.pvd").read_text()
    assert "step-00002.vtu" in pvd
    assert "step-00004.vtu" in pvd


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("[evolution]", "[evolutions]", ["evolutions", "evolution"]),
        ("step = 0.25", "", ["evolution.step", "missing"]),
        ("step = 0.25", "step = -1", ["evolution", "step", "-1"]),
        ("until = 1", "until = 0", ["evolution.until", "0"]),
        ("until = 1", "until = 1\ntheta = 1", ["evolution.theta", "unknown key"]),
        ('"quasi-static"', '"static"', ["evolution.kind", "quasi-static"]),
        ('kind = "quasi-static"', "", ["density"]),
        ("young = 100", "young = 100\ndensity = -1", ["density", "-1"]),
    ],
)
def test_broken_cases_are_refused(old, new, words, tmp_path):
    case = tmp_path / "case.toml"
    case.write_text(BLOCK.replace(old, new))
    done = run(case, "-o", tmp_path / "out")
    assert done.exit_code == 2, done.output
    for word in words:
        assert word in done.output
    assert not (tmp_path / "out" / "steps.csv").exists()


@pytest.mark.parametrize(
    ("setting", "words"),
    [
        ("wall.rows=0", ["wall.rows", "0"]),
        ("wall.cells=[3,1,1]", ["even number"]),
        ("wall.bond=english", ["wall.bond", "running"]),
        ("wall.size=[1]", ["wall.size"]),
        ("wall.brick=1", ["wall.brick", "unknown key"]),
        ("mesh.cells=2", ["mesh", "not with"]),
        ("fix.on=lid", ["lid"]),
        ("evolution.lumped=1", ["lumped", "true or false"]),
        ("material.glass.young=1", ["glass", "unknown key"]),
    ],
)
def test_broken_walls_are_refused(setting, words, tmp_path):
    done = run(WALL, "--set", setting, "-o", tmp_path / "out")
    assert done.exit_code == 2, done.output
    for word in words:
        assert word in done.output
    assert not (tmp_path / "out").exists()


def test_run_needs_an_evolution_and_a_state(tmp_path):
    case = tmp_path / "case.toml"
    case.write_text(BLOCK.split("[evolution]")[0])
    done = run(case, "-o", tmp_path / "out")
    assert done.exit_code == 2
    assert "evolution: missing" in done.output
    case.write_text(BLOCK)
    done = run(case, "-o", tmp_path / "out", "--restart")
    assert done.exit_code == 2
    assert "state.h5: no such file" in done.output
    done = run(tmp_path / "problem.hdf5")
    assert done.exit_code == 2


def test_a_run_that_fails_keeps_its_state(tmp_path):
    case = tmp_path / "case.toml"
    case.write_text(BLOCK)
    done = run(case, "-o", tmp_path / "out", "--tolerance", "1e-30")
    assert done.exit_code == 1
    assert "step 1" in done.output
