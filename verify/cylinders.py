"""Rings and tubes pressed into each other: Lamé, press fit, push-out."""

from __future__ import annotations

import numpy as np

import amontons as am
from amontons.mechanics.meshes import second_order
from benchmarks.mortar_models import Rings

from .case import Case, Value

YOUNG, MU, LENGTH = 210e3, 0.1, 19.0
INSIDE, BETWEEN, OUTSIDE, OVERLAP = 10.0, 20.0, 30.0, 0.0025  # radii, mm
PRESSURE, FORCE = 6.1523, 1468.9  # Lamé with these numbers, and mu p 2 pi r L


def lame(size: int) -> list[Value]:
    """Two rings in plane strain, a quarter, meshes that do not match."""
    case = Rings(around=(size, size + size // 3), radial=(size // 2, size // 2 + 1))
    found = am.solve(case.model())
    pressure = found.pressure
    mean = found.weights @ pressure / found.weights.sum()
    exact = _of_both(case)
    return [Value("mean pressure, N/mm^2", mean, exact),
            Value("pressure, largest error",
                  np.abs(pressure / exact - 1).max(), 0.0, 1.0)]  # fmt: skip


def _of_both(case: Rings) -> float:
    """Pressure on the inner ring at small strains: each ring has its own radius there."""
    (a, b, c), half = case.radii, case.overlap / 2
    young, poisson = 1000 / (1 - 0.3**2), 0.3 / (1 - 0.3)  # of plane strain
    r, s = b + half, b - half
    inner = r / young * ((r**2 + a**2) / (r**2 - a**2) - poisson)
    outer = s / young * ((c**2 + s**2) / (c**2 - s**2) + poisson)
    return case.overlap / (inner + r / s * outer)  # the same force around: p r


def _tubes(size: int, order: int, poisson: float, push: float, ratio: float) -> am.Model:
    """Half a section of both tubes; the inner one, pushed along the axis, is the slave."""
    bodies = []
    for name, (a, b), cells in (
        ("inner", (INSIDE, BETWEEN + OVERLAP), (size, 2 * size)),
        ("outer", (BETWEEN, OUTSIDE), (size, round(ratio * 2 * size))),
    ):
        mesh = am.box((b - a, LENGTH), cells, origin=(a, 0))
        mesh = second_order(mesh) if order == 2 else mesh
        law = am.LinearElastic(YOUNG, poisson)
        bodies.append(am.Body(mesh, law, name, axisymmetric=True))
    contact = am.Contact("inner.right", master="outer.left", mu=MU if push else 0.0)
    supports = [am.Fix("outer.bottom", (None, 0)), am.Fix("inner.top", (None, -push))]
    return am.Model(bodies, supports, [contact])


def fit(order: int, ratio: float, poisson: float = 0.0):
    """A function of the size: pressure without friction, and force to push the tube out."""

    def compute(size: int) -> list[Value]:
        pressed = am.solve(_tubes(size, order, poisson, 0.0, ratio))
        pushed = am.solve(_tubes(size, order, poisson, 0.05, ratio))
        mean = pressed.weights @ pressed.pressure / pressed.weights.sum()
        return [Value("mean pressure, N/mm^2", mean, PRESSURE, known=OVERLAP / BETWEEN),
                Value("push-out force, N", abs(pushed.resultant[1]), FORCE,
                      known=OVERLAP / BETWEEN)]  # fmt: skip

    return compute


PROBLEM = ("Tubes of diameters 20/40.005 and 40/60 mm, 19 mm long, E 210 GPa, nu 0, mu 0.1, "
           "are pressed into each other; the inner one is then pushed out.")  # fmt: skip
SOURCE = "Lamé; forum thread CalculiX #98, where other programs gave 1400 or 3200 N"
REMARKS = ("Axisymmetric. Without Poisson's effect the fit has the same pressure along the "
           "whole length; while pushed, shear bends the tubes a little. Small strains keep "
           "both radii, 20.0025 and 20 mm, which theory takes as one (1.25e-4).")  # fmt: skip
CASES = (
    Case("lame", "Lamé: two rings",
         "Two rings with an overlap are pressed into each other without friction.",
         "G. Lamé 1852; any book on elasticity", lame, (8, 16, 32), (64,), 2.0,
         "Plane strain, straight facets for arcs: order 2. Small strains keep the radii of "
         "both rings, which differ by half a percent, and so does the expected pressure."),
    Case("press-fit", "Press fit and push-out", PROBLEM, SOURCE, fit(1, 1.0), (4, 8, 16), (32,),
         1.0, REMARKS),
    Case("press-fit-nonmatching", "The same, meshes that do not match", PROBLEM, SOURCE,
         fit(1, 1.3), (4, 8, 16), (32,), 1.0, REMARKS),
    Case("press-fit-second-order", "The same, second order", PROBLEM, SOURCE, fit(2, 1.3),
         (3, 6, 12), (24,), 1.0, REMARKS),
)  # fmt: skip
