"""Multigrid asks of the matrix of a level nothing but what `LevelMatrix` says."""

import re
from pathlib import Path

import numpy as np
import pytest

import amontons as am
from amontons.linear import GeometricMultigrid
from amontons.linear.geometric import MultigridFactor
from amontons.linear.level_matrix import LevelMatrix
from amontons.mechanics.model import assembly
from amontons.solvers import ContactMultigrid

PAGE = (Path(__file__).parents[3] / "docs" / "extending.md").read_text()
NAMES = [name for name in (*vars(LevelMatrix), "is_stored") if not name.startswith("_")]


class Asked:
    """A level matrix that answers for another one what the protocol has, and notes it."""

    def __init__(self, given, seen):
        self.given, self.seen = given, seen

    def __getattr__(self, name):
        if name not in NAMES:
            raise AttributeError(f"{name} is not in the protocol")
        self.seen.add(name)
        return getattr(self.given, name)


def cube(cells=6, symmetric=False):
    supports = [am.Fix("top", (0.01, 0.02, -0.03))]
    if symmetric:  # idle components
        supports = [am.Fix("left", (0, None, None)), am.Fix("top", (None, 0.02, -0.03))]
    return am.Model(
        [am.Body(am.box((1, 1, 1), cells=cells), am.LinearElastic(50, 0.3))],
        supports, [am.Contact("bottom", am.Plane(normal=(0, 0, 1)), mu=0.4)],
    )  # fmt: skip


def asked(problem):
    """The problem on levels of `Asked`, and what is noted."""
    seen = set()
    return problem.with_hierarchy(problem.hierarchy.made_of(lambda A: Asked(A, seen))), seen


@pytest.mark.parametrize("symmetric", [False, True])
@pytest.mark.parametrize("grid_from", [1, 10**9], ids=["operator", "stored"])
def test_contact_multigrid_asks_for_the_protocol_alone(grid_from, symmetric, monkeypatch):
    monkeypatch.setattr(assembly, "GRID_FROM", grid_from)
    problem = cube(symmetric=symmetric).assemble()
    other, seen = asked(problem)
    found = am.drive(other, ContactMultigrid())
    known = am.drive(problem, ContactMultigrid())
    assert found.converged and {"smooth", "residual", "rows", "stored"} <= seen
    np.testing.assert_array_equal(found.r, known.r)


def test_linear_systems_ask_for_the_protocol_alone():
    problem = cube().assemble()
    other, seen = asked(problem)
    b = np.cos(np.arange(problem.unknowns))
    for p in (problem, other):
        x = MultigridFactor(p.hierarchy, p.hierarchy.nodes, GeometricMultigrid()).solve(b)
        np.testing.assert_allclose(problem.M @ x, b, atol=1e-9)
    assert {"times", "smooth", "first_smooth"} <= seen


def test_another_smoother_and_format_find_the_same_solution():
    """The class of the page on extending, on levels of a Galerkin product of its own."""
    block = re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)[-1]
    names = {}
    exec(block.partition("\nproblem = ")[0], names)  # noqa: S102
    problem = cube(8).assemble()
    levels = problem.hierarchy.made_of(names["Elsewhere"])
    found = am.drive(problem.with_hierarchy(levels), ContactMultigrid(), tolerance=1e-9)
    known = am.drive(problem, am.SemismoothNewton(), tolerance=1e-9)
    assert found.converged
    assert isinstance(levels.levels[0].A, names["Elsewhere"])
    np.testing.assert_allclose(found.r, known.r, atol=1e-6 * np.abs(known.r).max())


def test_other_levels_leave_the_problem_as_it_was():
    problem = cube().assemble()
    before = problem.hierarchy
    other, _ = asked(problem)
    assert problem.hierarchy is before
    assert other.hierarchy is not before and other.M is problem.M
