"""`amontons info`: facts about a problem, and a picture of its bodies."""

import json

from click.testing import CliRunner

import amontons as am
from amontons.app.cli import main
from amontons.app.cli.info_mesh import assembly
from amontons.io.fclib import write_fclib
from amontons.mechanics.ready.gallery import box_tower


def run(*arguments):
    return CliRunner().invoke(main, [str(a) for a in arguments])


def test_a_file_of_fclib(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write_fclib(box_tower(2), "tower.hdf5")
    result = run("info", "tower.hdf5")
    assert result.exit_code == 0
    assert "rank of W" in result.stdout
    assert "gauss-seidel" in result.stdout
    data = json.loads(run("info", "tower.hdf5", "--json", "-").stdout)
    assert data["contacts"] == 8
    assert data["rank of W"] == "12 of 24"


def test_draws_all_bodies_of_a_case(tmp_path):
    model = am.read_case("example:vee").model
    mesh = assembly(model.bodies * 2)
    points = len(model.bodies[0].mesh.points)
    assert len(mesh.points) == 2 * points
    assert {name.split(".")[0] for name in mesh.surfaces} == {model.bodies[0].name}
    assert mesh.cells[-1].nodes.max() == 2 * points - 1
    picture = tmp_path / "vee.png"
    assert run("info", "example:vee", "--picture", picture).exit_code == 0
    assert picture.stat().st_size > 1000
