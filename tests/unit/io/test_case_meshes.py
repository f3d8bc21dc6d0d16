"""Several meshes in a case file: names, places, materials, contact between them."""

import json

import numpy as np
import pytest
from click.testing import CliRunner

import amontons as am
from amontons.app.cli import main
from amontons.core.errors import FileFormatError

CASE = """
[[mesh]]
name = "punch"
box = [1, 1]
cells = 4
move = [0.5, 1]
[[mesh]]
name = "base"
box = [2, 1]
cells = [6, 3]
[material.default]
young = 100
poisson = 0
[[fix]]
on = "base.bottom"
value = [0, 0]
[[fix]]
on = "punch.top"
value = [0, -0.01]
[[contact]]
slave = "punch.bottom"
master = "base.top"
friction = { coulomb = 0.3 }
"""


@pytest.fixture
def case(tmp_path):
    def write(text=CASE):
        path = tmp_path / "case.toml"
        path.write_text(text)
        return path

    return write


def test_two_boxes_meet(case):
    model = am.read_case(case()).model
    assert [body.name for body in model.bodies] == ["punch", "base"]
    np.testing.assert_array_equal(model.bodies[0].mesh.bounding_box(), [(0.5, 1), (1.5, 2)])
    solution = am.solve(model)
    assert solution.converged
    # softer than both as columns of their whole width, stiffer than as two of the punch's
    assert 100 * 0.01 / 2 < abs(solution.fields.resultant[1]) < 100 * 0.01 / 1.5


def test_materials_by_mesh(case):
    text = CASE + "[material.base]\nyoung = 200\npoisson = 0.1\n"
    punch, base = am.read_case(case(text)).model.bodies
    assert (punch.material.young, base.material.young) == (100, 200)


def test_set_reaches_each(case):
    run = CliRunner().invoke(
        main, ["info", str(case()), "--set", "mesh[1].cells=2", "--json", "-"]
    )
    assert run.exit_code == 0, run.stderr
    few = json.loads(run.stdout)["unknowns"]
    assert few == 2 * (25 - 5 + 9 - 3)


def test_an_unnamed_single_one(case):
    text = '[[mesh]]\nbox = [1, 1]\ncells = 2\n' + CASE[CASE.index("[material"):].replace(
        "base.", "").replace("punch.", "").replace('master = "top"', "obstacle = { plane = { "
        "normal = [0, 1] } }").replace('on = "bottom"\nvalue = [0, 0]',
                                       'on = "left"\nvalue = [0, "free"]')  # fmt: skip
    assert len(am.read_case(case(text)).model.bodies) == 1


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('name = "punch"', "", r"mesh\[0\]\.name: missing, expected a name for each"),
        ('name = "punch"', 'name = "base"', r"mesh\[1\]\.name: 'base' is that of mesh\[0\]"),
        ('name = "punch"', 'name = "a.b"', r"mesh\[0\]\.name: expected a name without a point"),
        ("move = [0.5, 1]", "move = 1", r"mesh\[0\]\.move: expected a list of 2 numbers"),
        ("cells = 4", "cells = 4\norder = 3", r"mesh\[0\]\.order: expected 1 or 2"),
        ("box = [1, 1]", "box = [1, 1, 1]", r"mesh\[0\]\.move: expected a list of 3"),
        ("[0.5, 1]\n", "[0.5, 1]\nglue = false\n", r"mesh\[0\]\.glue: unknown key"),
        ("[material.default]", "[material.bas]", r"material\.bas: no mesh.*mean 'base'"),
        ("[material.default]", "[material.base]", r"material\.punch: missing"),
        ('"base.bottom"', '"bottom"', r"fix\[0\]\.on: .*one of punch.bottom, base.bottom"),
        ('"base.bottom"', '"bas.bottom"', r"fix\[0\]\.on: .*did you mean 'base.bottom'"),
        ('master = "base.top"', 'master = "base.tip"', r"contact\[0\]\.master: .*'base.top'"),
        ("box = [2, 1]\ncells = [6, 3]", "box = [2, 1, 1]\ncells = 2",
         r"mesh\[1\]: expected a mesh in 2D as the first"),
    ],
)  # fmt: skip
def test_mistakes(case, old, new, words):
    assert old in CASE
    with pytest.raises(FileFormatError, match=words):
        am.read_case(case(CASE.replace(old, new)))
