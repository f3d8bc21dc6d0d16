"""An arch that snaps through under a block: an equilibrium ends within a load step."""

from dataclasses import replace

import numpy as np

import amontons as am
from amontons.solvers.newton import predictors
from amontons.solvers.newton.step_lengths import Failed


def pressed_arch():
    """A flat arch between two supports; a block comes down on it by 0.05 per unit of time."""
    mesh = am.box((2, 0.1), (16, 2))
    x, y = mesh.points.T
    mesh = replace(mesh, points=np.stack([x, y + 0.25 * np.sin(np.pi * x / 2)], axis=1))
    block = am.box((0.3, 0.2), (2, 2), origin=(0.85, 0.351))
    bodies = [am.Body(mesh, am.NeoHookean(1.0, 0.3), name="arch"),
              am.Body(block, am.NeoHookean(10.0, 0.3), name="block")]  # fmt: skip
    held = [am.Fix("arch.left", 0), am.Fix("arch.right", 0),
            am.Fix("block.top", (0.0, lambda x, t: -0.05 * t))]  # fmt: skip
    return am.Model(bodies, held, [am.Contact("block.bottom", master="arch.top", mu=0.0)])


def end_of(step):
    """Displacements at the end of steps of that size, and the records of the steps."""
    steps = list(am.evolve(pressed_arch(), am.QuasiStatic(step), until=6.0))
    return steps[-1].state.displacement, [str(s.solution.convergence) for s in steps]


def test_bodies_that_creep_come_where_short_load_steps_lead(monkeypatch):
    """Without friction the end does not hang on the way.

    Bodies creep from where an attempt has ended, also where the last predictor fails itself.
    """

    def singular(*_):
        raise Failed("singular")

    short, _ = end_of(0.5)
    for fails in (False, True):
        if fails:
            monkeypatch.setattr(predictors, "by_tangent", singular)
        end, told = end_of(1.0)
        np.testing.assert_allclose(end, short, atol=1e-6)
    assert any("over a jump" in record for record in told)


def test_bodies_at_rest_do_not_creep():
    """Where a step begins at its solution, Newton's steps there compare rounding."""
    steel = am.SaintVenantKirchhoff(2.1e5, 0.3)
    bodies = [am.Body(am.box((1, 1), (2, 1), origin=(0, -1)), steel, name="lower"),
              am.Body(am.box((0.4, 0.2), 1, origin=(0.3, 0)), steel, name="upper")]  # fmt: skip
    supports = [am.Fix("lower.bottom", 0),
                am.Fix("upper.top", (0, lambda x, t: -1e-4 * min(t, 1.0)))]  # fmt: skip
    contact = am.Contact("upper.bottom", master="lower.top", mu=0.2, stiffness=1e7)
    model = am.Model(bodies, supports, [contact])
    steps = am.evolve(model, am.QuasiStatic(0.5), until=15.0)
    records = [step.solution.convergence for step in steps]
    assert max(record.iterations for record in records) <= 3
    assert not any("over a jump" in str(record) for record in records)
