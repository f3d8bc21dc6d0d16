"""Hertz and Cattaneo-Mindlin on the half plane itself: compliance by Flamant, no mesh.

K. L. Johnson, "Contact Mechanics", Cambridge University Press (1985), sections 4.2 and 7.2.
"""

import numpy as np
import pytest
from scipy.optimize import brentq

from amontons.mechanics.ready.gallery import cylinder_on_half_plane
from amontons.solvers.driver import drive

HALF_WIDTH, MU = 0.2, 0.5


def solve(strips, shift=0.0):
    solution = drive(cylinder_on_half_plane(strips, shift=shift, mu=MU), tolerance=1e-10)
    assert solution.converged
    x, h = np.linspace(-HALF_WIDTH, HALF_WIDTH, strips, retstep=True)
    return solution, x, h


def half_width_of(load):
    """Hertz: a^2 = 4 P R / (pi E*)."""
    return np.sqrt(4 * load / np.pi)


@pytest.mark.parametrize(("strips", "bound"), [(51, 0.04), (101, 0.02), (201, 0.01)])
def test_hertz_pressure_converges(strips, bound):
    solution, x, h = solve(strips)
    load = solution.r[:, 0].sum()
    a = half_width_of(load)
    exact = 2 * load / (np.pi * a) * np.sqrt(np.maximum(1 - (x / a) ** 2, 0))
    pressure = solution.r[:, 0] / h
    assert np.sqrt(h * ((pressure - exact) ** 2).sum()) < bound * np.sqrt(h * (exact**2).sum())
    assert (pressure > 0).sum() * h == pytest.approx(2 * a, abs=2 * h)


@pytest.mark.parametrize("ratio", [0.3, 0.5, 0.8])
def test_stick_zone_of_cattaneo_and_mindlin(ratio):
    """c / a = sqrt(1 - Q / (mu P)), 0.7071 at half the friction limit."""
    strips = 301
    pressed = solve(strips)[0].r[:, 0].sum()

    def force(shift):
        return -solve(strips, shift)[0].r[:, 1].sum() - ratio * MU * pressed

    shift = brentq(force, 1e-5, 2e-2, xtol=1e-7)
    solution, x, h = solve(strips, shift)
    a = half_width_of(pressed)
    c = a * np.sqrt(1 - ratio)
    assert solution.pattern.strip("f").count("s") * h == pytest.approx(2 * c, abs=2.1 * h)
    hertz = 2 * pressed / (np.pi * a) * np.sqrt(np.maximum(1 - (x / a) ** 2, 0))
    inner = np.sqrt(np.maximum(1 - (x / c) ** 2, 0)) * c / a * 2 * pressed / (np.pi * a)
    shear = -solution.r[:, 1] / h
    difference = np.abs(shear - MU * (hertz - inner)).sum() / np.abs(MU * hertz).sum()
    assert difference < 0.02
