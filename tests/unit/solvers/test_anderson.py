"""Anderson acceleration of a linear iteration, beside GMRES and in any unit."""

import numpy as np
import pytest

from amontons.solvers.anderson import Anderson


def accelerated(depth, unit, count, seed=0):
    """Errors, relative, of x -> D x + b whose eigenvalues are 0 to 0.95."""
    rng = np.random.default_rng(seed)
    factors = rng.choice(np.linspace(0, 0.95, 6), 3000)
    b = unit * rng.standard_normal(3000)
    solution = b / (1 - factors)
    x, memory, errors = np.zeros(3000), Anderson(3000, depth), []
    for _ in range(count):
        image = factors * x + b
        memory.mix(x, image)
        x = image
        errors.append(np.abs(x - solution).max() / np.abs(solution).max())
    return errors


@pytest.mark.parametrize("unit", [1e-60, 1.0, 1e60])
def test_six_eigenvalues_take_seven_steps(unit):
    """As GMRES; differences in single precision keep the last of them from being exact."""
    assert accelerated(0, unit, 8)[-1] > 0.5
    errors = accelerated(6, unit, 30)
    assert errors[7] < 1e-4
    assert errors[-1] < 1e-13


def test_units_do_not_matter():
    np.testing.assert_allclose(accelerated(3, 2.0**70, 9), accelerated(3, 1.0, 9), rtol=1e-9)


def test_forgetting_starts_again():
    """From the same point it goes as it did at first."""
    memory, again = Anderson(10, 4), Anderson(10, 4)
    x = np.arange(10.0)
    for _ in range(3):
        memory.mix(x, image := 0.5 * x + 1)
        x = image
    memory.forget()
    for _ in range(3):
        first, second = np.cos(x) + x, np.cos(x) + x
        memory.mix(x, first)
        again.mix(x.copy(), second)
        np.testing.assert_array_equal(first, second)
        x = first
