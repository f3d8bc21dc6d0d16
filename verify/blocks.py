"""Blocks: wedge, patches, a slope, a wall, a fall with bounces."""

from __future__ import annotations

import numpy as np

import amontons as am
from benchmarks.mortar_models import stacked

from .case import Case, Value

G = 9.81


def wedge(size: int) -> list[Value]:
    """F / G of a block pushed up a slope of tan a = 0.1 by its side."""
    out = []
    for mu, expected in ((0.0, 0.1), (0.1, 0.202020), (0.2, 0.306122), (0.3, 0.412371)):
        turn = np.array([[1, -0.1], [0.1, 1]]) / np.hypot(1, 0.1)
        flat = am.box((6, 4), (3 * size, 2 * size))
        mesh = am.Mesh(flat.points @ turn.T, flat.cells, flat.surfaces)
        model = am.Model(
            [am.Body(mesh, am.LinearElastic(206e3, 0.3))], [am.Fix("left", (0.05, None))],
            [am.Contact("bottom", am.Plane(turn @ (0, 1)), mu=mu)],
            [am.BodyForce((0, -1000.0 / 24))],
        )  # fmt: skip
        push, carried = am.solve(model, tolerance=1e-10).resultant
        exact = (0.1 + mu) / (1 - 0.1 * mu)
        assert abs(exact - expected) < 1e-6  # the printed number is this one
        out.append(Value(f"F/G at mu = {mu:g}", -push / carried, exact))
    return out


def patch(size: int) -> list[Value]:
    """Pressure 1 between blocks in 2D and 3D on meshes that do not match."""
    out = []
    for name, dim, kinds in (
        ("quad on quad", 2, ("quad", "quad")), ("tri on quad", 2, ("quad", "tri")),
        ("hex on hex", 3, ("hex", "hex")), ("tet on hex", 3, ("hex", "tet")),
    ):  # fmt: skip
        below = (size,) * (dim - 1) + (1,)
        above = (size + 2,) * (dim - 1) + (1,)
        found = am.solve(stacked(dim, below, above, kinds, moved=0.2), tolerance=1e-13)
        out.append(Value(f"{name}, largest error of pressure",
                         np.abs(found.pressure - 1).max(), 0.0, 1.0))  # fmt: skip
    return out


def slope(size: int) -> list[Value]:
    """Accelerations on 30 degrees, mu 0.3, of blocks of 1.4 and 0.14 m; steps of 1 / size."""
    angle, mu = np.radians(30), 0.3
    weight = 1000.0 * G * np.array([np.sin(angle), -np.cos(angle)])
    out = []
    for name, scale in (("1.4 m", 1.0), ("0.14 m", 0.1)):
        block = am.Body(am.box((1.4 * scale, 0.52 * scale), 1), am.Rigid(density=1000.0))
        model = am.Model(
            [block], loads=[am.BodyForce(tuple(weight))],
            contacts=[am.Contact("bottom", am.Plane((0, 1)), mu=mu)],
        )  # fmt: skip
        *_, last = am.evolve(model, am.MoreauJean(1.0 / size), until=1.0)
        speed = float(last.state.velocity.reshape(-1, 2)[:, 0].mean())
        out.append(Value(f"acceleration, {name}, m/s^2", speed,
                         G * (np.sin(angle) - mu * np.cos(angle))))  # fmt: skip
    return out


def wall(size: int) -> list[Value]:
    """How far 1 kg pressed on a wall by 20 N with mu 1 creeps down in 1 s."""
    side = 0.1
    force = (-20.0 / side**2, -G / side**2)  # per area of the square of 1 kg
    block = am.Body(am.box((side, side), 1), am.Rigid(density=1.0 / side**2))
    model = am.Model(
        [block], loads=[am.BodyForce(force)],
        contacts=[am.Contact("left", am.Plane((1, 0)), mu=1.0)],
    )  # fmt: skip
    *_, last = am.evolve(model, am.MoreauJean(1.0 / size), until=1.0)
    moved = float(np.abs(last.displacement[0]).max())
    return [Value("creep in 1 s, m", moved, 0.0, 0.5 * G)]


def bounce(size: int) -> list[Value]:
    """First two summits of a stone that falls from 1 m with a restitution of 0.7."""
    e = 0.7
    stone = am.Body(am.box((0.1, 0.1), cells=1), am.Rigid(density=1000))
    model = am.Model(
        [stone], loads=[am.BodyForce((0, -1000 * G))],
        contacts=[am.Contact("bottom", am.Plane((0, 1), point=(0, -1.0)), mu=0.5)],
    )  # fmt: skip
    steps = list(am.evolve(model, am.MoreauJean(1.0 / size, restitution=e), until=1.8))
    time = np.array([step.time for step in steps])
    height = 1 + np.array([step.displacement[0][:, 1].min() for step in steps])
    fall = np.sqrt(2 / G)
    first = (time > fall) & (time < fall * (1 + 2 * e))
    second = (time > fall * (1 + 2 * e)) & (time < fall * (1 + 2 * e + 2 * e**2))
    return [Value("first summit, m", height[first].max(), e**2),
            Value("second summit, m", height[second].max(), e**4)]  # fmt: skip


CASES = (
    Case("wedge", "NAFEMS CGS-4: sliding wedge",
         "A block on a slope of tan a = 0.1 is pushed up by its side; F/G when it slides.",
         "NAFEMS benchmark CGS-4; F/G = (tan a + mu) / (1 - mu tan a)", wedge, (2, 4, 8),
         (16,)),
    Case("patch", "Patch tests",
         "A uniform pressure passes between meshes that do not match and are bent.",
         "The pressure is 1 everywhere, whatever the mesh", patch, (2, 3, 5), (8,)),
    Case("slope", "Block sliding down a slope",
         "Rigid blocks on 30 degrees with mu = 0.3, one a tenth of the other.",
         "a = g (sin - mu cos); forum thread Chrono #462, where the small one was a third "
         "slower",
         slope, (50, 100), (400,)),
    Case("wall", "Block pressed on a wall",
         "1 kg is pressed on a wall by 20 N, mu = 1: it stays where it is.",
         "Statics; pull request Genesis #2872, where regularised friction crept by 4.5 mm/s",
         wall, (50, 100), (400,)),
    Case("bounce", "Stone that bounces",
         "A stone falls from 1 m with a restitution of 0.7.",
         "Each summit is e^2 of the last one", bounce, (400, 800, 1600), (3200,), 1.0,
         "Moreau and Jean's scheme: order 1 in the step; where in a step the impact falls is "
         "chance, and so is a part of the error."),
)  # fmt: skip
