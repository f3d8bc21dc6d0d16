"""Bodies that springs hold where they are: other forces and tangents, all else is shared."""

import copy
import pickle

import numpy as np
import pytest
from tangent_checker import checked_tangents

import amontons as am
from amontons.mechanics.model.held_parts import HeldParts
from amontons.mechanics.model.large_deformation import large_deformation

FIRMNESS = 0.5


def pressed():
    """(problem, v): a block on another one, pressed into it a little and noisy."""
    upper = am.Body(am.box((1, 1), (3, 2), origin=(0.1, 0.995)), am.NeoHookean(1.0, 0.3),
                    name="upper")  # fmt: skip
    lower = am.Body(am.box((1.2, 1), (4, 2)), am.NeoHookean(2.0, 0.3), name="lower")
    problem = large_deformation(am.Model(
        [upper, lower], [am.Fix("upper.top", (0.01, -0.02)), am.Fix("lower.bottom", 0)],
        [am.Contact("upper.bottom", master="lower.top", mu=0.3)],
    ))  # fmt: skip
    return problem, 0.003 * np.random.default_rng(3).standard_normal(problem.unknowns)


def test_springs_add_their_part_of_the_stiffness_at_rest():
    problem, v = pressed()
    parts, rng = problem.parts, np.random.default_rng(4)
    u = problem.displacement(v)
    held = problem.held(v, FIRMNESS).parts
    du = 0.01 * rng.standard_normal(u.shape)
    K_0 = parts.matrix(parts.tangent(np.zeros(u.shape))[1])
    expected = FIRMNESS * (K_0 @ du.ravel())
    size = 1e-12 * np.abs(expected).max()
    np.testing.assert_allclose(held.forces(u + du) - parts.forces(u + du), expected, atol=size)
    found, blocks = held.tangent(u + du)
    np.testing.assert_allclose(found, held.forces(u + du), rtol=0, atol=size)
    more = held.matrix(blocks - parts.tangent(u + du)[1]) - FIRMNESS * K_0
    assert abs(more).max() < 1e-12 * abs(K_0).max()
    assert held.contact is parts.contact


def test_relaxed_springs_change_no_residual():
    problem, v = pressed()
    held = problem.held(v, FIRMNESS)
    expected = problem.residual(v)
    np.testing.assert_array_equal(held.residual(v), expected)
    away = v + 1e-3
    assert np.abs(held.residual(away) - problem.residual(away)).max() > 1e-5


def test_the_tangent_of_what_is_held_is_exact():
    """Between differences, away from where the springs are relaxed."""
    problem, v = pressed()
    held, rng = problem.held(v, FIRMNESS), np.random.default_rng(5)
    draws = [(v + 0.004 * one, other) for one, other in rng.standard_normal((6, 2, len(v)))]
    assert checked_tangents(held, draws) >= 2


def pickled(parts):
    return pickle.loads(pickle.dumps(parts))


@pytest.mark.parametrize("copied", [copy.copy, copy.deepcopy, pickled])
def test_held_parts_are_copied(copied):
    """What is asked of a copy before it has its own parts must not ask for them for ever."""
    problem, v = pressed()
    held, u = problem.held(v, FIRMNESS).parts, problem.displacement(v)
    assert isinstance(held, HeldParts)
    np.testing.assert_array_equal(copied(held).forces(u + 0.01), held.forces(u + 0.01))
