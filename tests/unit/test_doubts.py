"""Warnings about models: each where it is due, and nowhere else."""

import numpy as np
import pytest

import amontons as am

STEEL = am.LinearElastic(young=200.0, poisson=0.3)


def names(solution):
    return [warning.name for warning in solution.warnings]


def block(value=0.0, loads=(), *, gap=0.0, **options):
    """A block above a floor, held at its top."""
    return am.Model(
        [am.Body(am.box((2, 1), cells=(4, 2)), STEEL)],
        [am.Fix("top", value)],
        [am.Contact("bottom", am.Plane((0, 1), point=(0, -gap)), mu=0.3)],
        loads,
        **options,
    )


@pytest.mark.parametrize(
    "model",
    [
        block(),
        block(gap=0.1),
        block((0, None), [am.Traction("left", (0, 0)), am.BodyForce(np.zeros(2))]),
        block((0, -0.1), load_factor=0.0),
    ],
)
def test_a_model_without_load_says_so(model):
    solution = am.solve(model)
    assert names(solution) == ["no-load"]
    assert "no-load" in str(solution)


@pytest.mark.parametrize(
    "model",
    [
        block((0, -0.1)),
        block((0, 0.1)),  # lifted: open by its load
        block(gap=-0.01),  # an overlap is a load
        block(0, [am.Traction("left", (0, -1))]),
        block(0, [am.BodyForce((0, -1))]),
    ],
)
def test_a_load_is_no_doubt(model):
    assert names(am.solve(model)) == []


def test_steps_before_the_load_begins_are_no_doubt():
    model = block((0, lambda x, t: -max(t - 0.6, 0.0)))
    assert [names(step) for step in am.evolve(model, am.QuasiStatic(0.5), until=1)] == [[], []]
    quiet = list(am.evolve(block(), am.QuasiStatic(0.5), until=1))
    assert [names(step) for step in quiet] == [["no-load"], ["no-load"]]
