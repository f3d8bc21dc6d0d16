"""Bodies that touch within a step: what they slid before counts as no slip."""

from dataclasses import replace

import numpy as np
import pytest
from tangent_checker import checked_tangents

import amontons as am
from amontons.mechanics.model.large_deformation import large_deformation, large_step

SOFT = am.NeoHookean(1.0, 0.3)
GAP, PRESS = 0.1, 0.02
END = 1.0 + PRESS / GAP  # it touches at 1


def coming_down(along, *, pair, angle=0.0, mu=2.0):
    """A block above a plane, or above a slab of its own kind; along(t): motion of its top."""
    c, s = np.cos(angle), np.sin(angle)
    turn = np.array([[c, s], [-s, c]])
    meshes = [am.box((1, 0.5), (3, 2), origin=(0, GAP)),
              am.box((3, 0.5), (7, 2), origin=(-1, -0.5))]  # fmt: skip
    turned = [am.Mesh(m.points @ turn, m.cells, m.surfaces) for m in meshes]
    names = "up", "low"
    bodies = [am.Body(m, SOFT, name=n) for m, n in zip(turned, names, strict=True)]

    def component(k):
        return lambda x, t: float(np.array(along(t)) @ turn[:, k])

    supports = [am.Fix("up.top", (component(0), component(1)))]
    if not pair:
        contact = am.Contact("up.bottom", am.Plane((-s, c)), mu=mu, kinematics="finite")
        return am.Model(bodies[:1], supports, [contact])
    supports.append(am.Fix("low.bottom", 0))
    return am.Model(bodies, supports, [am.Contact("up.bottom", master="low.top", mu=mu)])


def forces(model, counts, until=END):
    """Sums of the forces (2,) in the frames, after so many steps each."""
    out = []
    for count in counts:
        *_, step = am.evolve(model, am.QuasiStatic(until / count), until=until)
        assert step.solution.converged
        out.append(step.state.force.sum(axis=0))
    return np.array(out)


@pytest.mark.parametrize("pair", [False, True])
def test_forces_do_not_change_with_where_in_a_step_bodies_touch(pair):
    """With six steps they touch at the end of one: the last one has no slip while open."""
    model = coming_down(lambda t: (0.2 * t, -GAP * t), pair=pair)
    exact, *others = forces(model, (6, 5, 7, 11))
    assert abs(exact[1]) > 0.1 * exact[0] > 0
    tolerance = 2e-3 if pair else 1e-8  # of what the slab does on its way
    np.testing.assert_allclose(others, np.broadcast_to(exact, (3, 2)), rtol=tolerance)


@pytest.mark.parametrize("pair", [False, True])
def test_no_friction_of_bodies_that_stop_before_they_touch(pair):
    """Along and down, then down alone: what they would have slid is no force."""
    model = coming_down(lambda t: (GAP * min(t, 0.9), -GAP * t), pair=pair)
    found = forces(model, (4,))[0]
    assert abs(found[1]) < 1e-3 * found[0]


def test_turned_as_a_whole():
    at_rest, turned = (
        forces(coming_down(lambda t: (0.2 * t, -GAP * t), pair=True, angle=angle), (5,))
        for angle in (0.0, 1.0)
    )
    np.testing.assert_allclose(turned, at_rest, rtol=1e-8)


@pytest.mark.parametrize("law", [{"mu": 0.4}, {"tresca": 0.01}])
def test_tangents_are_exact(law):
    rng = np.random.default_rng(5)
    model = coming_down(lambda t: (0.0, -0.11), pair=True)
    contact = am.Contact("up.bottom", master="low.top", **law)
    model = am.Model(model.bodies, model.supports, [contact])
    dofs = large_deformation(model).parts.X.size
    before = 0.01 * rng.standard_normal(dofs)
    problem = large_step(model, np.zeros(dofs), np.zeros(dofs), before)
    problem = replace(problem, play=rng.uniform(0, 0.3, problem.contacts))
    draws = (rng.standard_normal((2, problem.unknowns)) * [[0.05], [1.0]] for _ in range(20))
    assert checked_tangents(problem, draws) > 8
