"""Bodies that moved far beside their cells: what rounding leaves, and what it does not."""

import numpy as np
import pytest

import amontons as am
from amontons.mechanics.meshes.order import second_order
from amontons.mechanics.model.large_deformation import large_deformation


def lifted(far, order, law):
    """A square carried to the right above the ground, touching nothing."""
    mesh = am.box((1, 1), 3)
    mesh = second_order(mesh) if order == 2 else mesh
    contact = am.Contact("bottom", am.Plane((0, 1)), mu=0.3, kinematics="finite")
    return am.Model([am.Body(mesh, law)], [am.Fix("top", (0.7 * far, 0.2))], [contact])


@pytest.mark.parametrize("law", [am.NeoHookean(1.0, 0.3), am.LinearElastic(1.0, 0.3)])
@pytest.mark.parametrize("order", [1, 2])
def test_a_body_carried_far_is_solved_and_errors_above_rounding_are_seen(order, law):
    """It ended with errors of 1e-7 (order 1) and 2e-6: rounding, beside no force at all."""
    model = lifted(1e3, order, law)
    assert am.solve(model).converged
    problem = large_deformation(model)
    v = np.zeros_like(problem.prescribed.reshape(-1, 2)) + (700.0, 0.2)
    v = v.ravel()[problem.parts.free]
    rng = np.random.default_rng(order)
    noise = np.spacing(700.0) * rng.integers(-1, 2, v.shape)  # by which neighbours round
    errors = [problem.error(problem.reactions(x), x) for x in (v + noise, v + 100 * noise)]
    assert errors[0] < 1e-8 < errors[1]


def test_forces_that_are_resolved_grow_with_the_way_only_where_it_is_long():
    """By terms |u| |grad N| of grad u: none at strains of a percent, as the way far off."""
    parts = large_deformation(lifted(0.0, 1, am.NeoHookean(1.0, 0.3))).parts
    sizes = [parts.unit_forces(np.full_like(parts.X, far)) for far in (0.0, 1e-2, 1.0, 1e3)]
    assert sizes[1] < 1.01 * sizes[0]
    assert 3 < sizes[2] / sizes[0] < 10  # a way of three cells
    assert sizes[3] == pytest.approx(1e3 * np.sqrt(sizes[2] ** 2 - sizes[0] ** 2), rel=1e-4)
