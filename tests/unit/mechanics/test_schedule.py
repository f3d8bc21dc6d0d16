"""Steps of several sizes, and stages with other friction and supports."""

from dataclasses import replace

import numpy as np
import pytest

import amontons as am
from amontons.mechanics.steps import QuasiStatic, Schedule, Stage


def block(mu=0.3, top=(lambda x, t: 0.02 * t, -0.01), more=()):
    body = am.Body(am.box((1, 1), 4), am.LinearElastic(young=100.0, poisson=0.0))
    supports = [am.Fix("top", list(top)), *more]
    return am.Model([body], supports, [am.Contact("bottom", am.Plane((0, 1)), mu=mu)])


def test_the_same_as_equal_steps():
    model = block()
    one = list(am.evolve(model, QuasiStatic(0.25), until=1.0, tolerance=1e-10))
    plan = Schedule(0.25, times=(0.25, 0.5, 0.75, 1.0))
    other = list(am.evolve(model, plan, until=1.0, tolerance=1e-10))
    assert [s.time for s in other] == [s.time for s in one]
    np.testing.assert_allclose(other[-1].state.displacement, one[-1].state.displacement)
    uneven = Schedule(0.1, times=(0.5, 0.6, 1.0))
    assert [s.time for s in am.evolve(model, uneven, until=1.0)] == [0.5, 0.6, 1.0]


def shear(step):
    return step.solution.r[:, 1].sum() / step.solution.r[:, 0].sum()


def test_friction_that_changes_and_a_restart_in_a_stage():
    """A block that is dragged: its friction is that of the stage."""
    model = block(0.1, (lambda x, t: 0.2 * t, -0.01))
    rough = Stage(1.0, lambda state: block(0.4, (lambda x, t: 0.2 * t, -0.01)))
    plan = Schedule(0.25, stages=(rough,))
    steps = list(am.evolve(model, plan, until=3.0, tolerance=1e-10))
    assert shear(steps[3]) == pytest.approx(-0.1, rel=1e-6)
    assert shear(steps[-1]) == pytest.approx(-0.4, rel=1e-6)
    again = list(am.evolve(model, plan, until=3.0, start=steps[6].state, tolerance=1e-10))
    np.testing.assert_allclose(again[-1].state.displacement, steps[-1].state.displacement)


def test_supports_that_come_and_go():
    """What is let go springs back; what is held stays where it is, with another contact set."""
    free = block(0.0, (None, lambda x, t: -0.01 * t), [am.Fix("left", (0, None))])

    def held(state):
        sunk = state.displacement.reshape(-1, 2)
        points = free.bodies[0].mesh.points
        place = {tuple(x): u for x, u in zip(points, sunk, strict=True)}
        still = am.Fix("left", (0, lambda x, t: -0.01 * t if x[1] == 1 else place[tuple(x)][1]))
        return replace(free, supports=(free.supports[0], still))

    plan = Schedule(0.5, stages=(Stage(1.0, held), Stage(2.0, lambda state: free)))
    steps = list(am.evolve(free, plan, until=3.0, tolerance=1e-10))
    assert [len(s.solution.r) for s in steps] == [5, 5, 4, 4, 5, 5]
    before, after = (steps[k].state.displacement.reshape(-1, 2) for k in (1, 3))
    points = free.bodies[0].mesh.points
    left = (points[:, 0] == 0) & (points[:, 1] < 1)
    np.testing.assert_allclose(after[left], before[left], atol=1e-12)
    assert after[~left, 1].min() < before[~left, 1].min() - 1e-3
    assert steps[5].fields.pressure == pytest.approx([3.0] * 5, rel=1e-8)


def test_bad_plans():
    with pytest.raises(am.InvalidInput, match="growing numbers > 0"):
        Schedule(0.5, times=(1.0, 0.5))
    with pytest.raises(am.InvalidInput, match="order in which they begin"):
        Schedule(0.5, stages=(Stage(2.0, block), Stage(1.0, block)))
    other = Schedule(0.5, stages=(Stage(0.5, lambda state: am.Model(
        block().bodies * 2, [am.Fix("top", 0)], block().contacts)),))  # fmt: skip
    with pytest.raises(am.InvalidInput):
        list(am.evolve(block(), other, until=1.0))
