"""Solvers and readers from outside of the package, as docs/extending.md has them."""

import re
import subprocess
import sys
from importlib.metadata import EntryPoint
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

import amontons as am
from amontons.app.cli import main
from amontons.app.cli.contestants import contestants
from amontons.app.cli.sources import open_source
from amontons.core import plugins
from amontons.io import readers
from amontons.io.case import settings

PAGE = (Path(__file__).parents[2] / "docs" / "extending.md").read_text()
SOLVER, _, _, READER, MATRIX = re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)
CASE = (Path(am.__file__).parent / "examples_data" / "cube.toml").read_text()
METHOD = "fixed_point:FixedPoint"


@pytest.fixture
def module(tmp_path, monkeypatch):
    """The modules of the page where Python finds them."""
    (tmp_path / "fixed_point.py").write_text(SOLVER.partition("\n\nmodel = ")[0] + "\n")
    (tmp_path / "delassus_npz.py").write_text(READER)
    (tmp_path / "broken_module.py").write_text("import no_such_module\n")
    monkeypatch.syspath_prepend(tmp_path)
    (tmp_path / "here").mkdir()
    monkeypatch.chdir(tmp_path / "here")


def offer(monkeypatch, group, name, value):
    """An entry point, as if a package with it was installed."""
    point = EntryPoint(name, value, group)
    found = {group: {name: point}}
    for user in (settings, readers):
        monkeypatch.setattr(user, "installed", lambda asked: found.get(asked, {}))


def run(*arguments):
    return CliRunner().invoke(main, [str(a) for a in arguments])


def test_on_the_command_line(module):
    result = run("solve", "example:cube", "--set", "mesh.cells=2", "--method", METHOD,
                 "--set", "solver.damping=1.5", "--tolerance", "1e-6")  # fmt: skip
    assert result.exit_code == 0, result.output
    assert "converged with FixedPoint" in result.output


def test_in_a_case_file(module):
    table = re.findall(r"```toml\n(\[solver\].*?)```", PAGE, re.DOTALL)[0]
    Path("case.toml").write_text(re.sub(r"\[solver\].*", "", CASE, flags=re.DOTALL) + table)
    solver = am.read_case("case.toml").settings.solver()
    assert (type(solver).__name__, solver.damping) == ("FixedPoint", 1.5)


def test_in_a_race(module):
    one, two = contestants([f"{METHOD}:damping=1.5", f"FP={METHOD}"])
    assert one.settings.solver().damping == 1.5
    assert (two.name, two.settings.solver().damping) == ("FP", 1.0)


def test_by_entry_point(module, monkeypatch):
    offer(monkeypatch, "amontons.solvers", "fixed-point", METHOD)
    assert type(settings.make_solver("fixed-point", {})).__name__ == "FixedPoint"
    with pytest.raises(am.InvalidInput, match="did you mean 'fixed-point'"):
        settings.method_class("fixed-pont")
    offer(monkeypatch, "amontons.solvers", "fixed-point", "fixed_point:Gone")
    with pytest.raises(am.InvalidInput, match="fixed_point:Gone can not be loaded"):
        settings.method_class("fixed-point")


@pytest.mark.parametrize(
    ("method", "words"),
    [
        ("no_such_module:Solver", "no_such_module can not be imported.*has to be installed"),
        ("broken_module:Solver", "broken_module can not be imported"),
        ("fixed_point:Fixed", "module fixed_point has no Fixed"),
        ("fixed_point:np", "expected the class of a solver"),
        ("amontons.io.readers:Format", "no solver, it has no form and no iterates"),
        ("fixed_point.py:FixedPoint", "can not be imported"),
        ("folder/fixed_point:FixedPoint", "expected package.module:Name"),
        ("fixed_point:", "expected package.module:Name"),
    ],
)
def test_what_is_no_solver_is_said_in_words(method, words, module):
    result = run("solve", "example:cube", "--method", method)
    assert result.exit_code == 2
    assert "Traceback" not in result.stderr
    assert re.search(words, result.stderr), result.stderr


def test_fields_that_it_has_not_are_said_in_words(module):
    result = run("solve", "example:cube", "--method", METHOD, "--set", "solver.dampig=1")
    assert result.exit_code == 2
    assert "solver.dampig" in result.stderr
    assert "did you mean 'damping'" in result.stderr


def test_the_current_folder_is_not_searched(tmp_path, monkeypatch):
    (tmp_path / "only_here.py").write_text("raise SystemExit('imported')\n")
    monkeypatch.chdir(tmp_path)
    with pytest.raises(am.InvalidInput, match="only_here can not be imported"):
        plugins.load("only_here:Solver")
    command = [sys.executable, "-m", "amontons", "info", "example:cube"]
    found = subprocess.run(
        [*command, "--set", "solver.method=only_here:Solver"], capture_output=True, text=True
    )
    assert found.returncode == 2
    assert "only_here can not be imported" in found.stderr


def test_a_reader_by_entry_point(module, monkeypatch):
    np.savez("small.npz", W=np.eye(2), q=np.array([[-1.0, 0.5]]), mu=[0.3])
    known = r"\(.toml\), .*\(.hdf5, .h5\) or .*\(.inp, .inp.gz\).*none of them"
    with pytest.raises(am.FileFormatError, match=known):
        open_source("small.npz")
    offer(monkeypatch, "amontons.readers", "npz", "delassus_npz:FORMAT")
    result = run("solve", "small.npz", "--set", "solver.tolerance=1e-9")
    assert result.exit_code == 0, result.output
    Path("words.txt").write_text("words")
    with pytest.raises(am.FileFormatError, match=r"a NumPy archive \(.npz\), this is none of"):
        open_source("words.txt")
    np.savez("bad.npz", W=np.eye(2))
    assert "bad.npz" in run("info", "bad.npz").stderr


def test_an_entry_point_that_is_no_format_is_refused(module, monkeypatch):
    Path("small.npz").write_bytes(b"x")
    offer(monkeypatch, "amontons.readers", "npz", METHOD)
    with pytest.raises(am.InvalidInput, match="'npz' of amontons.readers: expected a Format"):
        open_source("small.npz")
