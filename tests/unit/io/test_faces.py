"""Results show themselves, although pictures stand in a room above them."""

import pytest

import amontons as am


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
