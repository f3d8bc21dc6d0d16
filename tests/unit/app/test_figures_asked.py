"""Which figures are written, in which format, and what the comparison number costs."""

import json

import pytest
from click.testing import CliRunner

import amontons as am
from amontons.app.cli import main
from amontons.io.fclib import write_fclib
from amontons.io.results import Output, save, summary
from amontons.mechanics.ready.gallery import box_tower
from amontons.problem.friction import FrictionProblem

SMALL = ["example:tresca", "--set", "mesh.cells=3"]


def run(*arguments):
    result = CliRunner().invoke(main, [str(a) for a in arguments])
    assert result.exit_code == 0, result.output
    return result


def written(folder):
    return sorted(path.name for path in folder.iterdir() if path.suffix not in (".h5", ".vtu"))


def test_formats_and_none(tmp_path):
    place = tmp_path / "out"
    run("solve", *SMALL, "-o", place, "--figures", "svg")
    assert written(place) == ["convergence.svg", "pairs.csv", "solution.json", "status.svg"]
    run("solve", *SMALL, "-o", place, "--figures", "pdf", "--quiet")
    assert written(place) == ["convergence.pdf", "pairs.csv", "solution.json", "status.pdf"]
    run("solve", *SMALL, "-o", place, "--no-figures")  # older ones would be another's
    assert written(place) == ["pairs.csv", "solution.json"]
    run("solve", *SMALL, "-o", place)
    assert written(place) == ["convergence.png", "pairs.csv", "solution.json", "status.png"]


def test_a_wrong_format_is_refused(tmp_path):
    result = CliRunner().invoke(main, ["solve", *SMALL, "--figures", "jpg"])
    assert result.exit_code == 2
    assert "'png', 'svg', 'pdf'" in result.output


def test_follow_draws_what_was_asked_for(tmp_path):
    vee = ["follow", "example:vee", "--set", "mesh.refine=0"]
    place = tmp_path / "out"
    run(*vee, "-o", place, "--y", "displacement x contact", "--figures", "svg")
    assert written(place) == ["follow.csv", "follow.json", "follow.svg"]
    head = (place / "follow.csv").read_text().splitlines()[0].split(",")
    assert head[0] == "load"
    assert head[-1] == "displacement x contact"
    run(*vee, "-o", tmp_path / "none", "--no-figures")
    assert written(tmp_path / "none") == ["follow.csv", "follow.json"]
    result = CliRunner().invoke(main, [*vee, "-o", str(tmp_path / "bad"), "--y", "r_N 999"])
    assert result.exit_code == 2
    assert "no contact 999" in result.output
    assert not (tmp_path / "bad").exists()


def test_no_factorisation_for_a_comparison_number(tmp_path, monkeypatch):
    """Contact multigrid needs no factor of M; only the published error does."""
    place = tmp_path / "out"
    cube = ["solve", "example:cube", "--no-figures", "-o", place]
    asked = []
    whole = FrictionProblem.solve_M
    monkeypatch.setattr(
        FrictionProblem, "solve_M", lambda *given: asked.append(1) or whole(*given)
    )
    run(*cube)
    assert json.loads((place / "solution.json").read_text())["fclib_error"] is None
    assert not asked
    run(*cube, "--fclib-error")
    error = json.loads((place / "solution.json").read_text())["fclib_error"]
    assert 0 < error < 1e-6
    assert asked


def test_the_number_is_there_where_it_costs_nothing(tmp_path):
    write_fclib(box_tower(2), tmp_path / "tower.hdf5")  # local form
    run("solve", tmp_path / "tower.hdf5", "-o", tmp_path / "out")
    found = json.loads((tmp_path / "out" / "solution.json").read_text())
    assert found["fclib_error"] == pytest.approx(am.solve(box_tower(2)).fclib_error, abs=1e-9)


def test_the_property_is_evaluated_when_it_is_asked_for():
    body = am.Body(am.box((1, 1), cells=3), am.LinearElastic(200, 0.3))
    model = am.Model([body], [am.Fix("top", (0.0, -0.02))],
                     [am.Contact("bottom", am.Plane((0, 1)), mu=0.4)])  # fmt: skip
    found = am.solve(model)
    assert found.fclib_error < 1e-6
    assert summary(found.output)["fclib_error"] == found.fclib_error  # it is known by then


def test_save_without_figures(tmp_path):
    found = am.solve(box_tower(2))
    paths = save(Output(found, figures=""), tmp_path / "out")
    assert {path.name for path in paths} == {"solution.json", "solution.h5"}
