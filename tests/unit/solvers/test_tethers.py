"""Bodies that contact alone holds, pressed by forces and pushed far: balance knows them."""

from dataclasses import replace

import numpy as np
import pytest

import amontons as am
from amontons.solvers.auto.hybrid import WHOLE
from amontons.solvers.auto.tethers import Tethers


def pushed(dim, cells, slide, mu, kind):
    """A block on a plane, pressed by a force of 4 at its top, whose top is pushed sideways."""
    mesh = am.box((1,) * dim, cells, kind)
    down = (0.0,) * (dim - 1) + (-4.0,)
    held = (slide,) + (0.0,) * (dim - 2) + (None,)
    return am.Model(
        [am.Body(mesh, am.LinearElastic(1000.0, 0.2))],
        [am.Fix("top", held)],
        [am.Contact("bottom", am.Plane(normal=(0,) * (dim - 1) + (1,)), mu=mu)],
        [am.Traction("top", down)],
    )


@pytest.mark.parametrize(
    ("dim", "cells", "kind"), [(2, 2, "quad"), (2, 3, "tri"), (3, 1, "hex"), (3, 2, "tet")]
)
@pytest.mark.parametrize("slide", [0.05, 0.3, 1.0])
def test_friction_of_a_block_that_slides_is_mu_times_the_force(dim, cells, kind, slide):
    """mu h < N l / 2: it does not overturn."""
    model = pushed(dim, cells, slide, 0.3, kind)
    for solver in (am.Auto(), Tethers()):
        found = am.solve(model, solver, tolerance=1e-8)
        force = np.append(found.resultant[0], found.resultant[-1])
        # in 3D the block grows across where it is pressed, so that not all slips along x
        assert force == pytest.approx([-1.2, 4], rel=1e-5 if dim == 2 else 1e-3)


@pytest.mark.parametrize("tolerance", [1e-4, 1e-10])
def test_the_springs_leave_nothing_behind(tolerance):
    model = pushed(3, 1, 0.3, 0.3, "hex")
    found = am.solve(model, Tethers(), tolerance=tolerance)
    problem = model.assemble()
    balance = problem.M @ found.v - problem.f - problem.H @ found.r.ravel()
    assert np.abs(balance).max() < 50 * tolerance * 4


def test_what_has_no_solution_comes_to_an_end():
    """Friction can not hold a force of 4 with 4 mu = 1.2."""
    model = pushed(2, 2, 0.0, 0.3, "quad")
    free = am.Model(model.bodies, [], model.contacts, [am.Traction("top", (4.0, -4.0))])
    found = am.solve(free, am.Auto(), check=False)
    assert not found.converged
    assert np.isfinite(found.r).all()
    assert found.convergence.advice


def wedge(mu, load):
    """A block whose sides lean by 45 degrees, pressed between two planes."""
    mesh = am.box((2.0, 1.0), cells=(6, 6))
    points = mesh.points.copy()
    points[:, 0] = 1 + (points[:, 0] - 1) * (1 + points[:, 1])
    body = am.Body(replace(mesh, points=points), am.LinearElastic(young=100.0, poisson=0.3))
    left, right = am.Plane((1, 1), point=(0, 0)), am.Plane((-1, 1), point=(2, 0))
    contacts = [am.Contact("left", left, mu=mu), am.Contact("right", right, mu=mu)]
    return am.Model([body], [], contacts, [am.Traction("top", load)])


@pytest.mark.parametrize("mu", [0.1, 0.3])
@pytest.mark.parametrize("push", [0.3, -0.2])
def test_a_cycle_of_one_method_is_not_the_end_of_all(mu, push):
    model = wedge(mu, (push, -1.0))
    alone = am.drive(model.assemble(), WHOLE, contact_tolerance=np.inf)
    assert alone.convergence.outcome is am.Outcome.CYCLED
    found = am.solve(model)
    assert found.convergence.outcome is am.Outcome.CONVERGED
    force = sum(pair.force for pair in found.pairs.values())
    np.testing.assert_allclose(force, [-4 * push, 4.0], atol=1e-6)
