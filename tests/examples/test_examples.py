"""Every example runs: those of the package, the case files and the scripts."""

import importlib.util
import json
from pathlib import Path

import pytest
from click.testing import CliRunner

import amontons as am
from amontons.app.cli import main
from amontons.app.cli.sources import DATA, examples
from amontons.io.case import read_case

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
SMALLER = {
    "block": "[4,8]",
    "cube": 4,
    "tresca": 4,
    "slab": "[12,6]",
    "hertz": "[32,16]",
    "dome": "[6,6,3]",
}
IN_TIME = {"release", "wall"}  # `amontons run`


def load(path):
    spec = importlib.util.spec_from_file_location(path.stem, path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize("name", sorted(set(examples()) - IN_TIME))
def test_built_in_example(name, tmp_path):
    smaller = ["--set", f"mesh.cells={SMALLER[name]}"] if name in SMALLER else []
    arguments = ["solve", f"example:{name}", "-o", str(tmp_path / "out"), *smaller]
    result = CliRunner().invoke(main, arguments)
    assert result.exit_code == 0, result.output
    record = json.loads((tmp_path / "out" / "solution.json").read_text())
    assert record["outcome"] == "converged"
    assert record["error"] <= record["tolerance"]


def test_built_in_wall_runs_in_time(tmp_path):
    smaller = ["--set", "wall.cells=[2,1,1]", "--set", "evolution.until=0.2"]
    arguments = ["run", "example:wall", "-o", str(tmp_path / "out"), "--pictures", *smaller]
    result = CliRunner().invoke(main, arguments)
    assert result.exit_code == 0, result.output
    names = {path.name for path in (tmp_path / "out" / "pictures").iterdir()}
    assert names == {"step-00001.png", "step-00002.png", "film.gif"}
    assert (tmp_path / "out" / "energy.png").read_bytes().startswith(b"\x89PNG")
    refused = CliRunner().invoke(main, ["solve", "example:wall"])
    assert refused.exit_code == 2
    assert "amontons run example:wall" in refused.output


def test_wall_in_the_repository_is_the_built_in_one():
    assert (EXAMPLES / "wall" / "wall.toml").read_text() == (DATA / "wall.toml").read_text()


def test_cube_in_the_repository_is_the_built_in_one():
    assert (EXAMPLES / "cube" / "case.toml").read_text() == (DATA / "cube.toml").read_text()


def test_cube_script_and_case_agree():
    from_script = load(EXAMPLES / "cube" / "cube.py").main(cells=4)
    case = read_case(EXAMPLES / "cube" / "case.toml", ["mesh.cells=4"])
    from_case = am.solve(case.model)
    assert from_script.pattern == from_case.pattern
    assert from_script.resultant == pytest.approx(from_case.resultant, rel=1e-6)


def test_cube_by_gmsh(tmp_path):
    pytest.importorskip("gmsh")
    load(EXAMPLES / "cube" / "make_mesh.py").make_cube(str(tmp_path / "cube.msh"), 0.25)
    text = (EXAMPLES / "cube" / "gmsh.toml").read_text()
    (tmp_path / "gmsh.toml").write_text(text)
    solution = am.solve(read_case(tmp_path / "gmsh.toml").model)
    assert solution.converged
    # linear tetrahedra of size 1/4 are stiffer than the fine cube, by some per cent
    assert solution.resultant == pytest.approx([1.55, -5.11, 6.0], rel=0.25)


def test_tower(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    safe, *_, slippery = load(EXAMPLES / "tower.py").main()
    assert set(safe) == {"s"}
    assert "l" in slippery
    assert am.read_fclib("tower.hdf5").contacts == 16
    assert "mu = 0.6" in capsys.readouterr().out
