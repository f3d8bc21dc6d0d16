"""What `Auto` does on meshes: multigrid first, the old way when it fails."""

import numpy as np
import pytest

import amontons as am
from amontons.solvers.auto import hybrid
from amontons.solvers.contract import Breakdown
from amontons.solvers.driver import drive


@pytest.fixture(scope="module")
def problem():
    """A meshed block on a plane, 12 x 12 x 12 elements: W is dear."""
    block = am.Body(am.box((1, 1, 1), cells=12), am.LinearElastic(200, 0.3))
    model = am.Model(
        [block],
        supports=[am.Fix("top", lambda x: (0, 0.2, 0.06 - 0.15 * x[0]))],
        contacts=[am.Contact("bottom", am.Plane(normal=(0, 0, 1)), mu=1.0)],
    )
    return model.assemble()


def test_multigrid_solves_large_meshes(problem):
    solution = drive(problem)
    assert solution.converged
    assert solution.convergence.detail == "contact multigrid"


def test_small_meshes_are_condensed():
    block = am.Body(am.box((1, 1, 1), cells=3), am.LinearElastic(200, 0.3))
    model = am.Model(
        [block],
        supports=[am.Fix("top", (0, 0.02, -0.01))],
        contacts=[am.Contact("bottom", am.Plane(normal=(0, 0, 1)), mu=1.0)],
    )
    assert drive(model.assemble()).convergence.detail != "contact multigrid"


def test_another_method_follows_a_breakdown(problem, monkeypatch):
    class Fails:
        def iterates(self, *_):
            raise Breakdown("no")
            yield

    expected = drive(problem)
    monkeypatch.setattr(hybrid, "ContactMultigrid", Fails)
    solution = drive(problem)
    assert solution.converged
    assert solution.convergence.detail != "contact multigrid"
    assert np.abs(solution.r - expected.r).max() < 1e-5 * np.abs(expected.r).max()


def test_an_iterate_is_judged_once(problem, monkeypatch):
    """`Auto` reads what the driver says of its iterates and evaluates nothing again."""
    judged, error = [], type(problem).error

    def counted(self, r, v=None):
        if self is problem:
            judged.append(r)
        return error(self, r, v)

    monkeypatch.setattr(type(problem), "error", counted)
    found = drive(problem, tolerance=1e-30, max_iterations=20)
    assert len(found.convergence.history) > 2
    more = len(judged) - len(found.convergence.history)
    assert 0 <= more <= 1  # the driver's own at the end, where rounding may hide an error
