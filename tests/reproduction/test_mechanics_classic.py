"""Closed-form solutions: sliding wedge, Hertz line contact, Cattaneo-Mindlin, sticking block.

K. L. Johnson, "Contact Mechanics", Cambridge University Press (1985), chapters 4 and 7;
NAFEMS benchmark CGS-4, sliding wedge.
"""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import brentq

import amontons as am

RADIUS, YOUNG = 10.0, 1000.0


@pytest.mark.parametrize(
    ("mu", "expected"), [(0.0, 0.1), (0.1, 0.202020), (0.2, 0.306122), (0.3, 0.412371)]
)
def test_a_wedge_pushed_up_an_incline(mu, expected):
    """Horizontal over vertical force (tan a + mu) / (1 - mu tan a) when all nodes slide."""
    angle = np.arctan(0.1)
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    flat = am.box((6, 4), (12, 8))
    mesh = am.Mesh(flat.points @ turn.T, flat.cells, flat.surfaces)
    model = am.Model(
        [am.Body(mesh, am.LinearElastic(206e3, 0.3, plane="stress"))],
        supports=[am.Fix("top", tuple(turn @ (0.05, -0.001)))],  # up the slope and into it
        contacts=[am.Contact("bottom", am.Plane(turn @ (0, 1)), mu=mu)],
    )
    solution = am.drive(model.assemble(), tolerance=1e-10)
    assert set(solution.pattern) <= set("+-")
    horizontal, vertical = model.recover(solution).resultant
    assert -horizontal / vertical == pytest.approx(expected, abs=1e-6)


@pytest.mark.parametrize("mu", [0.0, 0.1, 0.2, 0.3])
def test_a_heavy_wedge_pushed_by_its_side(mu):
    """Contact alone carries the weight G; the push on the left side is F = G (…) / (…)."""
    turn = np.array([[1, -0.1], [0.1, 1]]) / np.hypot(1, 0.1)
    flat = am.box((6, 4), (12, 8))
    weight = 1000.0
    model = am.Model(
        [
            am.Body(
                am.Mesh(flat.points @ turn.T, flat.cells, flat.surfaces),
                am.LinearElastic(206e3, 0.3),
            )
        ],
        supports=[am.Fix("left", (0.05, None))],
        contacts=[am.Contact("bottom", am.Plane(turn @ (0, 1)), mu=mu)],
        loads=[am.BodyForce((0, -weight / 24))],
    )
    solution = am.drive(model.assemble(), tolerance=1e-9)
    assert solution.converged
    push, carried = model.recover(solution).resultant
    assert carried == pytest.approx(weight, rel=1e-7)
    assert -push / weight == pytest.approx((0.1 + mu) / (1 - 0.1 * mu), rel=1e-6)


def graded_half_plane(cells, fine, reach=20.0):
    """A rectangle under y = 0, `reach` deep, twice as wide, `fine` cells at the origin."""
    base = am.box((2, 1), cells)
    across, down = base.points[:, 0] - 1, 1 - base.points[:, 1]

    def stretch(s, count):
        k = brentq(lambda k: reach * k / np.sinh(k) / count - fine, 1e-6, 50)
        return reach * np.sinh(k * s) / np.sinh(k)

    points = np.stack([stretch(across, cells[0] / 2), -stretch(down, cells[1])], axis=1)
    return am.Mesh(points, base.cells, base.surfaces)


def indented(cells, fine, poisson, mu):
    """A rigid disc pressed by 0.03 into the half plane."""
    return am.Model(
        [am.Body(graded_half_plane(cells, fine), am.LinearElastic(YOUNG, poisson))],
        [am.Fix("bottom", 0)],
        [am.Contact("top", am.Sphere((0, RADIUS - 0.03), RADIUS), mu=mu)],
    )


def hertz(load, poisson):
    """Half width and largest pressure of a line load, Johnson eqs. (4.43), (4.45)."""
    half_width = np.sqrt(4 * load * RADIUS * (1 - poisson**2) / (np.pi * YOUNG))
    return half_width, 2 * load / (np.pi * half_width)


def test_hertz_pressure_converges_to_the_ellipse():
    errors = []
    for n in (6, 12, 24):
        model = indented((8 * n, 4 * n), 0.8 / n, 0.3, mu=0.0)
        fields = model.recover(am.drive(model.assemble()))
        load = -fields.resultant[1]  # the disc pushes the block down
        half_width, peak = hertz(load, 0.3)
        x = fields.points[:, 0] / half_width
        exact = peak * np.sqrt(np.maximum(1 - x**2, 0))
        difference = fields.weights @ (fields.pressure - exact) ** 2
        errors.append(np.sqrt(difference / (fields.weights @ exact**2)))
    assert errors[0] > errors[1] > errors[2]
    assert errors[-1] < 0.01
    assert fields.pressure.max() == pytest.approx(peak, rel=0.01)


def test_cattaneo_mindlin_stick_zone():
    """Pressed, then sheared by Q = mu P / 2: sticks in c/a = sqrt(1 - Q/(mu P)) = 0.7071.

    The closed form neglects the coupling of shear and pressure; at Poisson's ratio 0.45 a rigid
    disc leaves little of it.  Both zones are known to a cell of the mesh.
    """
    mu, poisson, fine = 0.5, 0.45, 0.3 / 12
    pressed_model = indented((96, 48), fine, poisson, mu=0.0)
    pressed = am.drive(pressed_model.assemble(), tolerance=1e-9)
    model = pressed_model.with_mu(mu)
    problem = model.assemble()
    along = model.recover(pressed).frames[:, 1, 0]

    def sheared(shift):
        w = np.array(problem.w)
        w[:, 1] -= pressed.u[:, 1] + shift * along  # slip counts from the pressed state
        return am.drive(replace(problem, w=w), tolerance=1e-9)

    def ratio(solution):
        shear, load = np.abs(model.recover(solution).resultant)
        return shear / (mu * load)

    shift = brentq(lambda s: ratio(sheared(s)) - 0.5, 1e-4, 0.02, xtol=1e-5)
    solution = sheared(shift)
    assert ratio(solution) == pytest.approx(0.5, abs=0.01)
    order = np.argsort(model.recover(solution).points[:, 0])
    pattern = solution.pattern
    letters = "".join(pattern[i] for i in order).strip("f")
    stick = letters.count("s")
    assert letters.strip("+-") == "s" * stick  # one zone, slip on both sides, one direction
    assert len(set(letters) - {"s"}) == 1
    half_width = hertz(-model.recover(solution).resultant[1], poisson)[0]
    assert stick / len(letters) == pytest.approx(np.sqrt(1 - ratio(solution)), abs=0.08)
    assert stick * fine / (2 * half_width) == pytest.approx(np.sqrt(0.5), abs=0.12)


def test_a_sticking_block_carries_pure_shear():
    """Pressed and sheared below the friction limit: all nodes stick and nothing slides."""
    model = am.Model(
        [am.Body(am.box((4, 1), (16, 4)), am.LinearElastic(100, 0.0))],
        [am.Fix("top", (0.001, -0.02))],
        [am.Contact("bottom", am.Plane((0, 1)), mu=0.8)],
    )
    solution = am.drive(model.assemble(), tolerance=1e-10)
    fields = model.recover(solution)
    assert solution.counts["stick"] == 17
    np.testing.assert_allclose(fields.slip, 0, atol=1e-10)
    assert fields.pressure.mean() == pytest.approx(2.0, rel=0.01)  # 100 * 0.02
    middle = np.abs(fields.points[:, 0] - 2) < 0.5
    np.testing.assert_allclose(fields.shear[middle, 0], -0.05, rtol=0.01)  # 50 * 0.001
