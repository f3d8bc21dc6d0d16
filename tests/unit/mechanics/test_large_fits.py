"""A ring pressed into a wider one at large strains: the pressure of the exact problem.

Both are neo-Hookean in plane strain.  Radii r(R), with stretches a = r' and b = r / R, fulfil

    P_a' + (P_a - P_b) / R = 0,    P_a = dW/da,    P_b = dW/db,

P_a = 0 at the free faces, r and P_a R equal on both sides of the fit.
"""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_bvp

import amontons as am

HUB, SHAFT = am.NeoHookean(1.0, 0.3), am.NeoHookean(10.0, 0.3)
INSIDE, FIT, OUTSIDE, OVERLAP = 0.5, 1.0, 1.5, 0.03


def stresses(law, a, b):
    """P_a, P_b, and the derivatives of P_a with a and b."""
    shear, bulk, volume = law.shear, law.lame_lambda(), np.log(a * b)
    return (shear * (a - 1 / a) + bulk * volume / a, shear * (b - 1 / b) + bulk * volume / b,
            shear * (1 + 1 / a**2) + bulk * (1 - volume) / a**2, bulk / a / b)  # fmt: skip


def exact_force():
    """Force across a cut of the hub, per length: P_a R at the fit."""
    wide = FIT + OVERLAP

    def slopes(law, R, r, a):
        Pa, Pb, by_a, by_b = stresses(law, a, r / R)
        return [a, (-(Pa - Pb) / R - by_b * (a - r / R) / R) / by_a]

    def equations(s, y):
        hub, shaft = FIT + (OUTSIDE - FIT) * s, INSIDE + (wide - INSIDE) * s
        outer, inner = slopes(HUB, hub, *y[:2]), slopes(SHAFT, shaft, *y[2:])
        return np.vstack([np.multiply(outer, OUTSIDE - FIT), np.multiply(inner, wide - INSIDE)])

    def ends(y, z):
        return np.array([
            stresses(HUB, z[1], z[0] / OUTSIDE)[0], stresses(SHAFT, y[3], y[2] / INSIDE)[0],
            y[0] - z[2],
            stresses(HUB, y[1], y[0] / FIT)[0] * FIT
            - stresses(SHAFT, z[3], z[2] / wide)[0] * wide,
        ])  # fmt: skip

    s = np.linspace(0, 1, 41)
    ones = np.ones_like(s)
    first = np.vstack([FIT + (OUTSIDE - FIT) * s, ones, INSIDE + (FIT - INSIDE) * s, ones])
    r, a = solve_bvp(equations, ends, s, first, tol=1e-10, max_nodes=10_000).y[:2, 0]
    return -stresses(HUB, a, r / FIT)[0] * FIT


def quarter(radii, cells):
    """A quarter of a ring; cells around and through."""
    box = am.box((1, 1), cells)
    angle = np.pi / 2 * (1 - box.points[:, 0])
    radius = radii[0] + (radii[1] - radii[0]) * box.points[:, 1]
    points = np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=1)
    return replace(box, points=points)


def measured(fine, slave):
    """The same force with 8 fine facets on 7 fine ones."""
    hub = quarter((FIT, OUTSIDE), (8 * fine, 2 * fine))
    shaft = quarter((INSIDE, FIT + OVERLAP), (7 * fine, 2 * fine))
    bodies = [am.Body(hub, HUB, name="hub"), am.Body(shaft, SHAFT, name="shaft")]
    held = [am.Fix(f"{name}.{side}", by) for name in ("hub", "shaft")
            for side, by in (("left", (0, None)), ("right", (None, 0)))]  # fmt: skip
    sides = ["shaft.top", "hub.bottom"][:: 1 if slave == "shaft" else -1]
    model = am.Model(bodies, held, [am.Contact(sides[0], master=sides[1], mu=0.0)])
    (step,) = am.evolve(model, am.QuasiStatic(1.0), until=1.0)
    cut = step.reaction.reshape(-1, 2)[: len(hub.points)][hub.surface_nodes("left"), 0]
    return abs(cut.sum())


@pytest.mark.parametrize("slave", ["shaft", "hub"])
def test_the_pressure_of_a_fit_is_exact_to_second_order(slave):
    """Facets cut off a fifth of the overlap on the first mesh."""
    exact = exact_force()
    first, second = (measured(fine, slave) for fine in (1, 2))
    assert (exact - first) / (exact - second) == pytest.approx(4, abs=0.4)
    assert second + (second - first) / 3 == pytest.approx(exact, rel=1e-3)
