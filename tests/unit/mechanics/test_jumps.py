"""An arch that snaps through under a block: an equilibrium ends within a load step."""

from dataclasses import replace

import numpy as np

import amontons as am


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


def test_bodies_that_creep_come_where_short_load_steps_lead():
    """Without friction the end does not hang on the way; long load steps creep in one."""
    model = pressed_arch()
    ends, most = [], []
    for step in (1.0, 0.5):
        steps = list(am.evolve(model, am.QuasiStatic(step), until=6.0))
        ends.append(np.asarray(steps[-1].state.displacement))
        most.append(max(step.solution.convergence.iterations for step in steps))
    assert 8 < most[0] <= 20  # it does creep
    np.testing.assert_allclose(ends[0], ends[1], atol=1e-6)
