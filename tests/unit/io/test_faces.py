"""Results show themselves, although pictures stand in a room above them."""

from dataclasses import replace

import pytest
from legible import faults

import amontons as am
from amontons.app.cli.sources import open_source


def brake():
    return open_source("example:brake", []).model


@pytest.fixture(scope="module")
def solution():
    problem = am.FrictionProblem.from_delassus([[2.0, 0.5], [0.5, 1.0]], [[-1.0, 0.3]], 0.4)
    return am.solve(problem)


def test_a_solution_and_its_record_are_drawn_and_written(solution, tmp_path):
    for shown, name in ((solution, "s.png"), (solution.convergence, "c.svg")):
        figure = shown.plot(tmp_path / name)
        assert figure.axes
        assert (tmp_path / name).stat().st_size > 1000


def test_no_file_is_written_unless_asked(solution, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert solution.plot(title="one contact").get_suptitle() == "one contact"
    assert not list(tmp_path.iterdir())


def test_what_is_no_picture_is_refused(solution, tmp_path):
    with pytest.raises(am.InvalidInput, match=r"\.png, \.svg, \.pdf"):
        solution.plot(tmp_path / "s.txt")
    assert not list(tmp_path.iterdir())


def test_branches_and_diagrams_are_drawn(solution):
    diagram = am.diagram(solution.problem, "load", (0.5, 1.0))
    assert diagram.plot().axes[0].get_xlabel() == diagram.branches[0].name
    assert diagram.branches[0].plot(title="one").axes


def test_all_solutions_are_drawn_with_and_without_bodies(tmp_path):
    model = brake()
    found = am.all_solutions(model)
    assert len(found) == 3
    pieces = found.solutions
    for figure in (found.plot(tmp_path / "r.pdf"), found.plot(model=model, title="arm")):
        titles = [axes.get_title() for axes in figure.axes]
        told = [f"{k}: orientation {s.orientation:+d}" for k, s in enumerate(pieces, 1)]
        assert [title.splitlines()[0] for title in titles] == told
        assert "3 solutions, complete" in figure.get_suptitle()
        assert faults(figure) == []
    nothing = replace(found, solutions=(), complete=False)
    figure = nothing.plot()
    assert "0 solutions, there may be others" in figure.get_suptitle()
    assert faults(figure) == []


def test_more_solutions_than_panels(tmp_path):
    found = am.all_solutions(brake())
    many = replace(found, solutions=found.solutions * 3)
    figure = many.plot()
    assert len(figure.axes) == 6
    assert "3 more not shown" in figure.get_suptitle()
    assert faults(figure) == []


def test_a_solved_model_is_drawn_without_a_file_too(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    found = am.solve(brake())
    assert found.plot(title="arm").get_suptitle() == "arm"
    assert not list(tmp_path.iterdir())
    found.plot("a.svg")
    assert "<svg" in (tmp_path / "a.svg").read_text()[:1000]
