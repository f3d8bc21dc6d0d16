"""Without the extra cad: CAD is refused with the words that install it, the rest goes on."""

import sys

import pytest
from click.testing import CliRunner

import amontons as am
from amontons.app.cli import main
from amontons.core.errors import MissingDependency

CASE = """
[mesh]
file = "part.step"
size = 0.4
[material.default]
young = 1000
poisson = 0.3
[[contact]]
slave = "bottom"
obstacle = { plane = { normal = [0, 0, 1] } }
friction = { coulomb = 0.3 }
"""
WORDS = r"pip install 'amontons\[cad\]'"


@pytest.fixture
def _no_netgen(monkeypatch):
    """As if the extra were not installed."""
    for name in ("netgen", "netgen.occ", "ngsolve"):
        monkeypatch.setitem(sys.modules, name, None)


@pytest.mark.usefixtures("_no_netgen")
@pytest.mark.parametrize("suffix", [".step", ".stp", ".STP", ".iges", ".igs", ".brep"])
def test_cad_files_are_refused_with_the_words_that_install_it(tmp_path, suffix):
    path = tmp_path / f"part{suffix}"
    path.write_text("ISO-10303-21;")
    with pytest.raises(MissingDependency, match=WORDS):
        am.read_cad(path, 1.0)
    with pytest.raises(am.AmontonsError, match="read_cad"):
        am.read_mesh(path)


@pytest.mark.usefixtures("_no_netgen")
def test_shapes_are_refused_with_the_words_that_install_it():
    with pytest.raises(MissingDependency, match=WORDS):
        am.mesh_shape(object(), 1.0)


@pytest.mark.usefixtures("_no_netgen")
def test_the_command_line_says_it_too(tmp_path):
    (tmp_path / "part.step").write_text("ISO-10303-21;")
    (tmp_path / "case.toml").write_text(CASE)
    done = CliRunner().invoke(main, ["solve", str(tmp_path / "case.toml")])
    assert done.exit_code != 0
    assert "pip install 'amontons[cad]'" in " ".join(done.output.split())


@pytest.mark.usefixtures("_no_netgen")
def test_models_are_solved_without_it():
    body = am.Body(am.box((1, 1), 2), am.LinearElastic(1000, 0.3), order=2)
    contact = am.Contact("bottom", am.Plane(normal=(0, 1)), mu=0.3)
    solution = am.solve(am.Model([body], [am.Fix("top", (0, -0.01))], [contact]))
    assert solution.fields.resultant[1] > 0
