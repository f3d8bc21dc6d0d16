"""Half spaces: Hertz, Cattaneo and Mindlin, the flat punch, a crack under compression."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

import amontons as am
from amontons.mechanics.ready.gallery import cylinder_on_half_plane
from benchmarks.mortar_models import BallOnBlock, measured

from .case import Case, Value

Array = NDArray[np.float64]
JOHNSON = 'K. L. Johnson, "Contact Mechanics", Cambridge University Press (1985)'
YOUNG, POISSON = 1000.0, 0.3


def stretched(share: Array, cells: float, reach: float, fine: float) -> Array:
    """[0, 1] -> [0, reach], the first of `cells` cells being `fine` wide."""
    k = brentq(lambda k: reach * k / np.sinh(k) / cells - fine, 1e-6, 50)
    return reach * np.sinh(k * share) / np.sinh(k)


def half_plane(cells: tuple[int, int], fine: float, reach: float) -> am.Mesh:
    """A rectangle under y = 0, `reach` deep and twice as wide."""
    base = am.box((2, 1), cells)
    across, down = base.points[:, 0] - 1, 1 - base.points[:, 1]
    x = np.sign(across) * stretched(np.abs(across), cells[0] / 2, reach, fine)
    points = np.stack([x, -stretched(down, cells[1], reach, fine)], axis=1)
    return am.Mesh(points, base.cells, base.surfaces)


def lines_beside(first: Array, cells: int, reach: float) -> Array:
    """`cells` cells up to `reach`: those between `first`, then wider ones."""
    rest, fine = cells + 1 - len(first), first[-1] - first[-2]
    grown = stretched(np.linspace(0, 1, rest + 1), rest, reach - first[-1], fine)
    return np.concatenate([first, first[-1] + grown[1:]])


def on_lines(across: Array, down: Array) -> am.Mesh:
    """The quarter x > 0 > y with nodes at all (across, -down), both ascending from 0."""
    mesh = am.box((1, 1), (len(across) - 1, len(down) - 1))
    x = np.interp(mesh.points[:, 0], np.linspace(0, 1, len(across)), across)
    y = -np.interp(1 - mesh.points[:, 1], np.linspace(0, 1, len(down)), down)
    return am.Mesh(np.stack([x, y], axis=1), mesh.cells, mesh.surfaces)


def hertz_2d(size: int) -> list[Value]:
    """A rigid disc of radius 100 pressed into a half plane; contact half width 0.54."""
    radius = 100.0
    mesh = half_plane((8 * size, 4 * size), 0.8 / size, 20.0)
    model = am.Model(
        [am.Body(mesh, am.LinearElastic(YOUNG, POISSON))], [am.Fix("bottom", 0)],
        [am.Contact("top", am.Sphere((0, radius - 0.003), radius), mu=0.0)],
    )  # fmt: skip
    found = am.solve(model)
    load = -found.resultant[1]
    half = np.sqrt(4 * load * radius * (1 - POISSON**2) / (np.pi * YOUNG))
    peak = 2 * load / (np.pi * half)
    exact = peak * np.sqrt(np.maximum(1 - (found.points[:, 0] / half) ** 2, 0))
    error = found.weights @ (found.pressure - exact) ** 2 / (found.weights @ exact**2)
    wide = (half / 20) ** 2  # what the rectangle changes
    return [Value("largest pressure, N/mm^2", found.pressure.max(), peak, known=wide),
            Value("pressure, error in L2", np.sqrt(error), 0.0, 1.0)]  # fmt: skip


def hertz_3d(size: int) -> list[Value]:
    """A ball on a block, quarter model, mortar contact."""
    case = BallOnBlock(inner=size, rest=size)
    found = measured(case, am.solve(case.model()))
    return [Value("largest pressure, N/mm^2", found.peak, found.peak_hertz),
            Value("radius of contact, mm", found.radius, found.radius_hertz)]  # fmt: skip


def cattaneo(size: int) -> list[Value]:
    """Pressed, pushed to 0.7 of the friction limit, and back to about 0: shear and zones."""
    mu = 0.5
    pressed = _drive(cylinder_on_half_plane(size, mu=mu))
    load = pressed.r[:, 0].sum()

    def pushed(shift: float) -> am.FrictionSolution:
        return _drive(cylinder_on_half_plane(size, shift=shift, mu=mu))

    def force(found: am.FrictionSolution) -> float:
        return -found.r[:, 1].sum() / (mu * load)

    far = brentq(lambda s: force(pushed(s)) - 0.7, 1e-5, 2e-2, xtol=1e-8)
    first = pushed(far)

    def back(shift: float) -> am.FrictionSolution:
        """Slip counts from the state before."""
        problem = cylinder_on_half_plane(size, shift=shift, mu=mu)
        q = np.array(problem.q)
        q[:, 1] -= first.u[:, 1]
        return _drive(am.FrictionProblem.from_delassus(problem.W, q, problem.mu))

    last = back(brentq(lambda s: force(back(s)), -2e-2, far, xtol=1e-8))
    x = np.linspace(-0.2, 0.2, size)
    a, Q1, Q2 = np.sqrt(4 * load / np.pi), force(first), force(last)
    c, b = a * np.sqrt(1 - Q1), a * np.sqrt(1 - (Q1 - Q2) / 2)

    def ellipse(half: float) -> Array:
        root = np.sqrt(np.maximum(1 - (x / half) ** 2, 0))
        return 2 * mu * load * half / (np.pi * a**2) * root

    h, scale = x[1] - x[0], np.abs(ellipse(a)).sum()
    forward = ellipse(a) - ellipse(c)
    backward = -(ellipse(a) - 2 * ellipse(b) + ellipse(c))
    errors = [np.abs(-s.r[:, 1] / h - exact).sum() / scale
              for s, exact in ((first, forward), (last, backward))]  # fmt: skip
    return [Value("shear after pushing, error in L1", errors[0], 0.0, 1.0),
            Value("shear after the reversal, error in L1", errors[1], 0.0, 1.0)]  # fmt: skip


def _drive(problem: am.FrictionProblem) -> am.FrictionSolution:
    return am.drive(problem, tolerance=1e-10)


def flat_punch(size: int) -> list[Value]:
    """A rigid frictionless disc of radius 1 on a half space, axisymmetric."""
    reach, depth = 400.0, 0.01
    lines = lines_beside(np.linspace(0, 1, size + 1), 4 * size, reach)
    body = am.Body(on_lines(lines, lines), am.LinearElastic(YOUNG, POISSON), axisymmetric=True)
    model = am.Model(
        [body], [am.Fix("bottom", 0), am.Fix("left", (0, None))],
        [am.Contact("top", am.Plane((0, -1), point=(0, -depth)), mu=0.0,
                    where=lambda p: p[:, 0] <= 1 + 1e-9)],
    )  # fmt: skip
    force = abs(am.solve(model).resultant[1])
    return [Value("force, N", force, 2 * depth * YOUNG / (1 - POISSON**2))]


def fracture(size: int) -> list[Value]:
    """A crack of half length 1 m at 20 degrees in a plate 160 m wide, 100 MPa, in MPa and m."""
    psi, theta, sigma, young, poisson = np.radians(20), np.radians(30), 100.0, 25e3, 0.25
    reach, along = 80.0, 4 * size
    stress = -sigma * np.outer([np.cos(psi), np.sin(psi)], [np.cos(psi), np.sin(psi)])
    bodies = []
    for name, side in (("upper", 1), ("lower", -1)):
        box = am.box((2, 1), (2 * along, along), origin=(-1, 0) if side > 0 else (-1, -1))
        x = np.abs(box.points[:, 0])
        inner, outer = x * along <= size, x * along > size
        out = np.where(inner, np.sin(np.pi / 2 * np.minimum(x * along / size, 1)), 0.0)
        rest = (x[outer] * along - size) / (along - size)
        tip = 1 - np.sin(np.pi / 2 * (1 - 1 / size))  # cells there
        out[outer] = 1 + stretched(rest, along - size, reach - 1, tip)
        y = stretched(np.abs(box.points[:, 1]), along, reach, tip)
        points = np.stack([np.sign(box.points[:, 0]) * out, side * y], axis=1)
        corner = np.abs(points[:, 1]) < 1e-9
        sets = {
            "left end": np.flatnonzero(corner & (points[:, 0] < -reach + 1e-9)),
            "right end": np.flatnonzero(corner & (points[:, 0] > reach - 1e-9)),
        }
        mesh = am.Mesh(points, box.cells, box.surfaces, node_sets=sets)
        bodies.append(am.Body(mesh, am.LinearElastic(young, poisson), name))
    sides = [("left", (-1, 0)), ("right", (1, 0))]
    loads = [am.Traction(f"{body}.{on}", tuple(stress @ n))
             for body in ("upper", "lower") for on, n in sides]  # fmt: skip
    loads += [am.Traction("upper.top", tuple(stress @ (0, 1))),
              am.Traction("lower.bottom", tuple(stress @ (0, -1)))]  # fmt: skip
    tip = 1 - 1e-6
    contacts = [
        am.Contact("upper.bottom", master="lower.top", method="nodal", tied=True,
                   where=lambda p: np.abs(p[:, 0]) > tip),
        am.Contact("upper.bottom", master="lower.top", method="nodal", mu=np.tan(theta),
                   where=lambda p: np.abs(p[:, 0]) <= tip),
    ]  # fmt: skip
    held = [am.Fix("lower.left end", 0), am.Fix("lower.right end", (None, 0))]
    found = am.solve(am.Model(bodies, held, contacts, loads))
    inside = np.abs(found.points[:, 0]) < tip
    middle = int(np.argmin(np.abs(found.points[:, 0]) + 1e9 * ~inside))
    normal = sigma * np.sin(psi) ** 2
    excess = sigma * np.sin(psi) * (np.cos(psi) - np.sin(psi) * np.tan(theta))
    return [
        Value("normal traction in the middle, MPa", found.pressure[middle], normal),
        Value("largest slip, mm", 1e3 * np.abs(found.slip[inside]).max(),
              1e3 * 4 * (1 - poisson**2) / young * excess),
    ]  # fmt: skip


CASES = (
    Case("hertz-2d", "Hertz: cylinder on a half plane",
         "A rigid cylinder is pressed into an elastic half plane without friction.",
         f"{JOHNSON}, eqs. (4.43), (4.45)", hertz_2d, (12, 24, 48), (96,), 1.5,
         "The half plane is a rectangle 20 deep and 40 wide (a = 0.54, radius 100); the load "
         "is that computed. The pressure ends in a root, so that its L2 error is of order 1.5 "
         "at best only where mesh lines meet the edge, and 1 else."),
    Case("hertz-3d", "Hertz: ball on a block",
         "A ball of radius 1 is pressed on a block of the same material, meshes do not match.",
         f"{JOHNSON}, eq. (4.22)", hertz_3d, (4, 5, 6), (8,), 1.0,
         "The block is 1.5 wide and deep (a = 0.11); the load is that computed."),
    Case("cattaneo-mindlin", "Cattaneo and Mindlin, with a reversal",
         "A cylinder is pressed, pushed to 0.7 of the friction limit and back to no force.",
         f"{JOHNSON}, sections 7.2 and 7.4", cattaneo, (51, 101, 201), (401,), 1.0,
         "No mesh: strips of constant traction on a half plane (Flamant)."),
    Case("flat-punch", "Flat punch on a half space",
         "A rigid disc is pressed into an elastic half space without friction: P = 2 a E* d.",
         f"{JOHNSON}, eq. (3.36)", flat_punch, (16, 32, 64), (96,), 1.0,
         "Axisymmetric; the half space is a cylinder of 400 radii, held below, which alone "
         "adds about 0.1 percent. The edge is singular: order 1."),
    Case("fracture", "Single fracture under shear compression",
         "A closed crack of half length 1 m at 20 degrees slips under 100 MPa, mu = tan 30.",
         "A.-V. Phan, J. A. L. Napier, L. J. Gray, T. Kaplan, Symmetric-Galerkin BEM "
         "simulation of fracture with frictional contact, Int. J. Numer. Methods Engrg. 57 "
         "(2003) 835, doi 10.1002/nme.707, as cited by the documentation of GEOS, Single "
         "Fracture Under Shear Compression, whose formulas give 11.698 MPa and 3.808 mm",
         fracture, (8, 16, 32), (48,), 2.0,
         "The plate is 160 m wide, and tied beside the crack. Nodes are denser at the tips, "
         "where the solution is singular."),
)  # fmt: skip
