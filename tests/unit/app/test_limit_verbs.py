"""The verbs `jam`, `collapse` and `modes`: words, JSON, pictures, exit codes."""

import json

import pytest
from click.testing import CliRunner

from amontons.app.cli import main

CASE = """
[mesh]
box = [1.0, 0.5]
cells = [6, 3]

[material.default]
young = 200.0
poisson = 0.3
density = 1.0

[[fix]]
on = "top"
value = [0.0, -0.01]

[[contact]]
slave = "bottom"
obstacle = { plane = { normal = [0, 1] } }
friction = { coulomb = 0.5 }
"""


def run(*words):
    return CliRunner().invoke(main, [str(word) for word in words])


def test_jam_of_the_brake():
    told = run("jam", "example:brake")
    assert told.exit_code == 0 and "0.38637" in told.output
    record = json.loads(run("jam", "example:brake", "--json", "-").output)
    assert record["schema"] == "amontons/jam/1" and record["every_pattern"]
    assert record["lower"] <= record["upper"] == pytest.approx(0.38638, abs=1e-5)
    assert len(record["r"]) == len(record["v"]) == 5
    assert run("jam", "example:brake", "--time-limit", 0).exit_code == 2


def test_collapse_of_a_column():
    """Five blocks of 1 by 0.5: 1 / 2.5 of their weight overturns them; on top they slide."""
    asked = ["collapse", "example:column"]
    told = run(*asked, "--live", "1,0")
    assert told.exit_code == 0 and "0.4." in told.output, told.output
    record = json.loads(run(*asked, "--live", "1,0", "--json", "-").output)
    assert record["schema"] == "amontons/collapse/1" and record["balanced"]
    assert record["lower"] < 0.4 <= record["upper"] * (1 + 1e-6) and record["width"] <= 0.01
    top = ["--traction", "row 5 block 1.top=1,0", "--json", "-"]
    found = json.loads(run(*asked, *top).output)  # friction below the block on top
    assert found["upper"] == pytest.approx(0.7 * 0.5)


@pytest.mark.parametrize(("words", "told"), [
    ([], "expected a live load"), (["--live", "1"], "--live 1: expected 2 numbers"),
    (["--live", "east,0"], "--live east,0"), (["--traction", "1,0"], "expected SURFACE=X,Y"),
    (["--live", "1,0", "--gap", "2"], "--gap"), (["--live", "no such=1,0"], "no such"),
    (["--live", "1,0", "--time-limit", "-1"], "--time-limit"),
])  # fmt: skip
def test_wrong_live_loads_are_named(words, told):
    found = run("collapse", "example:column", *words)
    assert found.exit_code == 2 and told in found.output
    assert "has no bodies" in run("collapse", "example:tower", "--live", "1,0").output


def test_modes_of_a_case(tmp_path):
    case, picture = tmp_path / "case.toml", tmp_path / "modes.png"
    case.write_text(CASE)
    told = run("modes", case, "--count", 6, "--velocity", "1,0", "--picture", picture)
    assert told.exit_code == 1 and "grows: flutter" in told.output, told.output
    assert picture.read_bytes().startswith(b"\x89PNG")
    options = ["--velocity", "1,0", "--flutter", "--json", "-", "--mu", 0.01]
    record = json.loads(run("modes", case, *options).output)
    assert record["schema"] == "amontons/modes/1" and record["flutter"]
    assert {"real", "imaginary", "frequency", "damping"} == set(record["modes"][0])
    wrong = run("modes", case, "--velocity", "east")
    assert wrong.exit_code == 2 and "--velocity east" in wrong.output
    assert "has no mass" in run("modes", "example:tower").output
