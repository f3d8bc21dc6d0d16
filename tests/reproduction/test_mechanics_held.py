"""Bodies held by contact alone, and contact nodes whose tangents a support holds already."""

import numpy as np
import pytest

import amontons as am
from amontons.solvers.driver import drive

MATERIAL = am.LinearElastic(young=200, poisson=0.3)
FLOOR = am.Plane(normal=(0, 0, 1))


def pressed(quarter, mu):
    """A cube pressed on the floor, whole or one quarter with symmetry supports."""
    supports = [am.Fix("top", (0, 0, -0.05))]
    mesh = am.box((1, 1, 1), cells=(4, 4, 4))
    if quarter:
        mesh = am.box((0.5, 0.5, 1), cells=(2, 2, 4), origin=(0.5, 0.5, 0))
        supports += [am.Fix("left", (0, None, None)), am.Fix("front", (None, 0, None))]
    contact = am.Contact("bottom", FLOOR, mu=mu)
    return am.Model([am.Body(mesh, MATERIAL)], supports, [contact])


SOLVERS = [None, am.SemismoothNewton(), am.SemismoothNewton(linear=am.Direct())]


@pytest.mark.parametrize("mu", [0.0, 0.1, 1.0])
@pytest.mark.parametrize("solver", SOLVERS, ids=["auto", "schur", "augmented"])
def test_quarter_model_agrees_with_the_whole(mu, solver):
    whole, part = pressed(False, mu), pressed(True, mu)
    full, quarter = drive(whole.assemble()), drive(part.assemble(), solver)
    assert full.converged
    assert quarter.converged
    fields, its = whole.recover(full), part.recover(quarter)
    force = fields.resultant[2]
    assert 4 * its.resultant[2] == pytest.approx(force, rel=1e-6)
    for point, status in zip(its.points, quarter.status, strict=True):
        same = np.flatnonzero(np.abs(fields.points - point).max(axis=1) < 1e-9)[0]
        assert status == full.status[same]


def free_cube(load):
    """A cube lying on the floor under its own weight and a sideways force."""
    body = am.Body(am.box((1, 1, 1), cells=(3, 3, 3)), MATERIAL)
    contact = am.Contact("bottom", FLOOR, mu=0.5)
    return am.Model([body], [], [contact], loads=(am.BodyForce(load),))


@pytest.mark.parametrize("load", [(0, 0, -1), (0.3, 0, -1)])
def test_body_held_by_contact_alone_is_in_balance(load):
    model = free_cube(load)
    solution = drive(model.assemble())
    assert solution.converged
    np.testing.assert_allclose(model.recover(solution).resultant, -np.array(load), atol=1e-9)


def test_body_that_friction_can_not_hold_is_not_converged():
    solution = drive(free_cube((0.9, 0, -1)).assemble(), time_limit=20)
    assert not solution.converged
    assert np.isfinite(solution.r).all()


def test_support_that_pushes_a_node_into_the_obstacle_is_refused():
    contact = am.Contact("bottom", FLOOR, mu=0.5)
    body = am.Body(am.box((1, 1, 1), cells=2), MATERIAL)
    model = am.Model([body], [am.Fix("left", (0, 0, -0.1))], [contact])
    with pytest.raises(am.InvalidInput, match=r"supports hold the node .* push it 0\.1"):
        model.assemble()
