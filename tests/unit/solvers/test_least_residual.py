"""Acceleration of a linear iteration, beside GMRES and in any unit."""

import numpy as np
import pytest

from amontons.solvers.least_residual import LeastResidual


def accelerated(depth, unit, count, seed=0):
    """Errors, relative, of x -> x + r, r = b - A x, A diagonal with entries 1 to 0.05."""
    rng = np.random.default_rng(seed)
    factors = rng.choice(1 - np.linspace(0, 0.95, 6), 3000)
    b = unit * rng.standard_normal(3000)
    solution = b / factors
    x, memory, errors = np.zeros(3000), LeastResidual(3000, depth), []
    for _ in range(count):
        r = b - factors * x
        memory.mix(x, r)
        np.testing.assert_allclose(r, b - factors * x, atol=1e-6 * np.abs(b).max())
        memory.keep(x, r)
        errors.append(np.abs(x - solution).max() / np.abs(solution).max())
        x += r
    return errors


@pytest.mark.parametrize("unit", [1e-60, 1.0, 1e60])
def test_six_eigenvalues_take_seven_steps(unit):
    """As GMRES; changes in single precision keep the last of them from being exact."""
    assert accelerated(0, unit, 8)[-1] > 0.5
    errors = accelerated(6, unit, 30)
    assert errors[7] < 1e-4
    assert errors[-1] < 1e-13


def test_units_do_not_matter():
    np.testing.assert_allclose(accelerated(3, 2.0**70, 9), accelerated(3, 1.0, 9), rtol=1e-9)


def test_what_is_undone_was_never_mixed():
    rng = np.random.default_rng(1)
    memory = LeastResidual(10, 2)
    for _ in range(4):
        x, r = rng.standard_normal((2, 10))
        before, wanted = x.copy(), r.copy()
        if memory.mix(x, r):
            assert np.linalg.norm(r) <= np.linalg.norm(wanted)
            memory.undo(x, r)
        np.testing.assert_allclose([x, r], [before, wanted], atol=1e-13)
        memory.keep(x, r)


def test_forgetting_starts_again():
    """From the same point it goes as it did at first."""
    memory, again = LeastResidual(10, 4), LeastResidual(10, 4)
    x = np.arange(10.0)
    for _ in range(3):
        memory.mix(x, r := np.cos(x))
        memory.keep(x, r)
        x = 0.5 * x + 1
    memory.forget()
    for _ in range(3):
        first, second = x.copy(), x.copy()
        r, other = np.cos(x), np.cos(x)
        memory.mix(first, r)
        again.mix(second, other)
        np.testing.assert_array_equal([first, r], [second, other])
        memory.keep(first, r)
        again.keep(second, other)
        x = np.cos(first) + first
