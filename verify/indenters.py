"""Indenters: a cone, cylinders, a flat punch with friction, a pin in its hole."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq
from scipy.special import ellipk

import amontons as am
from amontons.core.errors import AmontonsError
from amontons.mechanics.meshes import second_order
from amontons.mechanics.ready.gallery import cylinder_on_half_plane

from .case import Case, Value
from .half_spaces import half_plane, lines_beside, on_lines, stretched

Array = NDArray[np.float64]
YOUNG, POISSON = 1000.0, 0.3
MODULUS = YOUNG / (1 - POISSON**2)  # of plane strain


def cone(size: int) -> list[Value]:
    """A rigid cone of slope 1/100 is pressed until the contact has the radius 1."""
    slope = 0.01
    depth = np.pi / 2 * slope
    cells, inner = 4 * size, int(1.5 * size)
    lines = lines_beside(np.linspace(0, 1.5, inner + 1), cells, 400.0)
    body = am.Body(on_lines(lines, lines), am.LinearElastic(YOUNG, POISSON), axisymmetric=True)
    found = am.solve(am.Model(
        [body], [am.Fix("bottom", 0), am.Fix("left", (0, None))],
        [am.Contact("top", am.Plane((0, -1)), mu=0.0, where=lambda p: p[:, 0] < 1.5,
                    clearance=lambda p: slope * p[:, 0] - depth)],
    ))  # fmt: skip
    at = np.argsort(found.points[:, 0])
    middle = np.interp(0.5, found.points[at, 0], found.pressure[at])
    wide = 2e-3  # what the cylinder of 400 radii changes
    return [Value("force, N", abs(found.resultant[1]), np.pi / 2 * MODULUS * slope),
            Value("pressure at half of the radius, N/mm^2", middle,
                  MODULUS * slope / 2 * np.arccosh(2.0), known=wide)]  # fmt: skip


def orthotropic(size: int) -> list[Value]:
    """The rigid cylinder of hertz-2d on a half plane with other moduli along and across."""
    young, poisson, shear = (2000.0, 500.0, 800.0), (0.3, 0.25, 0.2), (300.0, 250.0, 200.0)
    radius = 100.0
    found = am.solve(am.Model(
        [am.Body(half_plane((8 * size, 4 * size), 0.8 / size, 20.0),
                 am.OrthotropicElastic(young, poisson, shear))],
        [am.Fix("bottom", 0)],
        [am.Contact("top", am.Sphere((0, radius - 0.006), radius), mu=0.0)],
    ))  # fmt: skip
    load = -found.resultant[1]
    along = 1 / young[0] - (poisson[1] / young[0]) ** 2 * young[2]  # of plane strain
    across = 1 / young[1] - (poisson[2] / young[1]) ** 2 * young[2]
    both = -poisson[0] / young[0] - poisson[1] * poisson[2] / young[0] / young[1] * young[2]
    compliance = np.sqrt(across * (2 * both + 1 / shear[0] + 2 * np.sqrt(along * across)))
    half = np.sqrt(2 * load * radius * compliance / np.pi)
    peak = 2 * load / (np.pi * half)
    exact = peak * np.sqrt(np.maximum(1 - (found.points[:, 0] / half) ** 2, 0))
    error = found.weights @ (found.pressure - exact) ** 2 / (found.weights @ exact**2)
    wide = 2 * (half / 20) ** 2  # what the rectangle changes
    return [Value("largest pressure, N/mm^2", found.pressure.max(), peak, known=wide),
            Value("pressure, error in L2", np.sqrt(error), 0.0, 1.0)]  # fmt: skip


def punch_friction(size: int) -> list[Value]:
    """A rigid punch of half width 1 with friction; the outermost stick and how slip grows."""
    mu, poisson = 0.04, 0.48
    coupling = (1 - 2 * poisson) / (2 * (1 - poisson))
    cells = 3 * size
    half = np.sin(np.pi / 2 * np.linspace(0, 1, size + 1))  # dense at the corner
    across = lines_beside(half, cells, 1e4)
    down = stretched(np.linspace(0, 1, cells + 1), cells, 1e4, 1 - half[-2])
    mesh = second_order(on_lines(across, down))
    found = am.solve(am.Model(
        [am.Body(mesh, am.LinearElastic(YOUNG, poisson))],
        [am.Fix("bottom", 0), am.Fix("left", (0, None))],
        [am.Contact("top", am.Plane((0, -1), point=(0, -0.01)), mu=mu,
                    where=lambda p: p[:, 0] <= 1 + 1e-9)],
    ))  # fmt: skip
    at = np.argsort(found.points[:, 0])
    x, slip = found.points[at, 0], np.abs(found.slip).ravel()[at]
    sticks = np.flatnonzero(np.array(found.status)[at] == am.ContactStatus.STICK)
    if not len(sticks) or sticks[-1] > len(x) - 5:
        raise AmontonsError("no zone of slip at the corner")
    beside = slice(sticks[-1] + 1, sticks[-1] + 5)
    rate, start = np.polyfit(x[beside], slip[beside] ** (2 / 3), 1)
    exact = brentq(lambda c: ellipk(1 - c**2) / ellipk(c**2) - coupling / mu, 1e-6, 1 - 1e-9)
    return [Value("half width that sticks", -start / rate, exact, known=coupling**2)]


def capped(size: int) -> list[Value]:
    """A cylinder slides with friction mu p, but no more shear than half of mu p0."""
    mu, share = 0.5, 0.5
    plain = cylinder_on_half_plane(size, shift=1.0, mu=0.0)
    pressed = am.drive(plain, tolerance=1e-10).r[:, 0]
    strip = 0.4 / (size - 1)
    load = pressed.sum()
    half = np.sqrt(4 * load / np.pi)
    cap = share * mu * 2 * load / (np.pi * half)
    law = am.CappedCoulomb(np.full(size, mu), np.full(size, cap * strip))
    found = am.drive(am.FrictionProblem.from_delassus(plain.W, plain.q, law),
                     tolerance=1e-10)  # fmt: skip
    inner = np.sqrt(1 - share**2)
    part = 4 / np.pi * (share * inner / 2 + np.pi / 4 - np.arcsin(inner) / 2)
    x = np.linspace(-0.2, 0.2, size)
    exact = np.minimum(cap, cap / share * np.sqrt(np.maximum(1 - (x / half) ** 2, 0)))
    error = np.abs(np.abs(found.r[:, 1]) / strip - exact).sum() / exact.sum()
    return [Value("friction over mu P", np.abs(found.r[:, 1].sum()) / (mu * load), part),
            Value("shear, error in L1", error, 0.0, 1.0)]  # fmt: skip


def _half_ring(inside: float, outside: float, cells: int, around: int, names: tuple[str, str]):
    """Half of a ring x >= 0, cells alike in shape, from the lowest point around."""
    box = am.box((1, 1), (cells, around))
    r = inside * (outside / inside) ** box.points[:, 0]
    angle = np.pi * box.points[:, 1]
    new = {"left": names[0], "right": names[1], "bottom": "below", "top": "above"}
    return am.Mesh(np.stack([r * np.sin(angle), -r * np.cos(angle)], axis=1), box.cells,
                   {new[old]: facets for old, facets in box.surfaces.items()})  # fmt: skip


def pin(size: int) -> list[Value]:
    """A pin, radius 1 less the clearance, is drawn down in the hole of a plate by its core."""
    clearance, radial = 1e-4, round(1.25 * size)
    law = am.LinearElastic(YOUNG, POISSON)
    bodies = [
        am.Body(_half_ring(0.02, 1 - clearance, radial, size, ("core", "rim")), law, "pin"),
        am.Body(_half_ring(1.0, 60.0, radial, radial, ("hole", "far")), law, "plate"),
    ]
    held = [am.Fix(f"{body.name}.{side}", (0, None)) for body in bodies
            for side in ("below", "above")]  # fmt: skip
    found = am.solve(am.Model(
        bodies, [am.Fix("core", (0, -8 * clearance)), am.Fix("far", 0), *held],
        [am.Contact("pin.rim", master="plate.hole", mu=0.0)],
    ))  # fmt: skip
    load = 2 * abs(found.supports["core"].force[1])

    def clearance_of(b: float) -> float:
        return (2 - np.log(b**2 + 1) - 2 * b**4) / (np.pi * (b**2 + 1) * b**2)

    b = brentq(lambda b: clearance_of(b) - MODULUS * clearance / load, 1e-3, 0.9)
    tangent = np.tan(np.arctan2(found.points[:, 0], -found.points[:, 1]) / 2)
    root, whole = np.sqrt(np.maximum(b**2 - tangent**2, 0)), np.sqrt(b**2 + 1)
    exact = load / np.pi * (2 * root / (whole * (1 + tangent**2))
                            + np.log((whole + root) / (whole - root)) / (2 * b**2 * whole**2))
    lowest = int(np.argmin(tangent))
    error = found.weights @ (found.pressure - exact) ** 2 / (found.weights @ exact**2)
    known = 10 * clearance  # small strains keep both radii; the plate ends at 60 radii
    return [
        Value("largest pressure, N/mm^2", found.pressure[lowest], exact[lowest], known=known),
        Value("pressure, error in L2", np.sqrt(error), 0.0, 1.0, known=5 / size**2),
    ]


CASES = (
    Case("cone", "Cone on a half space",
         "A rigid cone of slope 1/100 is pressed without friction: P = pi a^2 E* tan / 2.",
         "I. N. Sneddon, The relation between load and penetration in the axisymmetric "
         "Boussinesq problem for a punch of arbitrary profile, Int. J. Engng Sci. 3 (1965) "
         "45-57", cone, (8, 16, 32), (64,), 1.0,
         "Axisymmetric; the half space is a cylinder of 400 radii, held below, which alone "
         "adds about 0.1 percent. The pressure is infinite at the tip."),
    Case("orthotropic", "Cylinder on an orthotropic half plane",
         "The cylinder of hertz-2d on a material with E 2000, 500, 800, nu 0.3, 0.25, 0.2 "
         "and G 300, 250, 200 along x, y and z.",
         "Hertz with 2/E* = sqrt(s22 (2 s12 + s66 + 2 sqrt(s11 s22))), s of plane strain: the "
         "slope of the surface beside a line force, from the characteristic equation of "
         "plane anisotropic elasticity", orthotropic, (12, 24, 48), (96,), 1.5,
         "As hertz-2d; a = 0.50."),
    Case("punch-friction", "Flat punch with friction, the part that sticks",
         "A rigid flat punch is pressed into a half plane, nu 0.48, with mu 0.04; beside the "
         "middle |x| < c that sticks, the material slips inwards.",
         "The problem of Spence, J. Elasticity 5 (1975) 297, in the plane; where shear does "
         "not act back on the pressure, K(sqrt(1 - c^2)) / K(c) = beta / mu with complete "
         "elliptic integrals K and beta = (1 - 2 nu) / (2 - 2 nu)",
         punch_friction, (8, 16, 32), (48,), 1.0,
         "Eight nodes a cell. What the formula neglects is of the order beta^2 = 0.0015. The "
         "half plane is 10 000 half widths wide: with 100, the block as a whole becomes "
         "wider by as much as the surface under the punch, and c is 0.85."),
    Case("capped", "Hertz and friction with a cap",
         "A cylinder slides; the shear is mu p, but at most a half of mu p0.",
         "Integral of the smaller one over Hertz's ellipse", capped, (101, 201, 401), (801,),
         1.0, "No mesh: strips of constant traction on a half plane (Flamant)."),
    Case("pin", "Pin in a hole",
         "A pin of nearly the radius of its hole is drawn down by its middle, without "
         "friction, the plate being of the same material: an arc of 142 degrees touches.",
         "Closed form of A. Persson (1964) for similar materials, as in M. Ciavarella and P. "
         "Decuzzi (2001); here checked against 40 000 terms of a Fourier series",
         pin, (32, 64, 128), (256,), 1.0,
         "The clearance is 1e-4 of the radius and the plate is held at 60 radii."),
)  # fmt: skip
