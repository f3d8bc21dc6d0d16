"""Large meshes leave the direct solver for conjugate gradients with multigrid."""

import numpy as np
import pytest

import amontons as am
from amontons.linear.geometric import MultigridFactor
from amontons.problem import matrices as global_matrices
from amontons.solvers.driver import drive


@pytest.fixture
def model():
    block = am.Body(am.box((1, 1, 1), cells=6), am.LinearElastic(young=200, poisson=0.3))
    return am.Model(
        [block],
        supports=[am.Fix("top", lambda x: (0, 0.2, 0.06 - 0.15 * x[0]))],
        contacts=[am.Contact("bottom", am.Plane(normal=(0, 0, 1)), mu=1.0)],
    )


def test_iterative_factor_gives_the_same_solution(model, monkeypatch):
    direct = drive(model.assemble())
    monkeypatch.setattr(global_matrices, "DIRECT_LIMIT", 10)
    monkeypatch.setattr(global_matrices, "EXACT_WORK", 0)
    model = am.Model(model.bodies, model.supports, model.contacts)
    iterative = drive(model.assemble(), tolerance=1e-7)
    assert isinstance(iterative.problem.factor(), MultigridFactor)
    assert iterative.converged
    assert iterative.pattern == direct.pattern
    np.testing.assert_allclose(iterative.r, direct.r, atol=1e-5 * np.abs(direct.r).max())
