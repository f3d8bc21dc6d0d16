"""Rigid bodies that move far: rolling, rocking, falling."""

from __future__ import annotations

import numpy as np
from scipy import integrate, optimize

import amontons as am

from .case import Case, Value

G = 9.81
FLOOR = am.Plane((0, 0, 1))


def _last(system: am.RigidBodies, step: float, until: float) -> list[am.RigidStep]:
    return list(am.evolve_rigid(system, step=step, until=until))


def rolling(size: int) -> list[Value]:
    """A ball on a slope of 0.6, friction 0.4 and 0.1."""
    out = []
    sine, cosine = np.sin(0.6), np.cos(0.6)
    for mu, expected in ((0.4, 5 / 7 * G * sine), (0.1, G * (sine - 0.1 * cosine))):
        ball = am.RigidBody(am.Ball(0.1), position=(0, 0, 0.1))
        system = am.RigidBodies([ball], [FLOOR], mu=mu, gravity=(G * sine, 0, -G * cosine))
        end = _last(system, 0.01 / size, 0.5)[-1]
        speed = float(end.state.motion.velocity[0, 0])
        out.append(Value(f"acceleration, mu = {mu}, m/s^2", speed / end.time, expected))
    return out


def _upright(b: float, h: float, tilt: float) -> list[float]:
    """Times at which a block 2b x 2h passes its upright position, by Housner."""
    alpha, radius = np.arctan2(b, h), np.hypot(b, h)
    c = 2 * G * radius / (4 / 3 * radius**2)

    def quarter(top: float) -> float:
        def slowness(s: float) -> float:
            return 2 * s / np.sqrt(c * (np.cos(alpha - top) - np.cos(alpha - (top - s * s))))

        return float(integrate.quad(slowness, 0, np.sqrt(top), epsabs=1e-12)[0])

    def height(angle: float) -> float:
        return float(np.cos(alpha - angle) - np.cos(alpha))

    left = height(tilt) * (1 - 1.5 * np.sin(alpha) ** 2) ** 2
    top = optimize.brentq(lambda x: height(x) - left, 0, alpha)
    return [quarter(tilt), quarter(tilt) + 2 * quarter(top)]


def rocking(size: int) -> list[Value]:
    """A block 0.2 x 1 is let go at a tilt of 0.1, and rocks over its two edges."""
    b, h, tilt = 0.1, 0.5, 0.1
    turn = np.array([[np.cos(tilt), 0, np.sin(tilt)], [0, 1, 0],
                     [-np.sin(tilt), 0, np.cos(tilt)]])  # fmt: skip
    block = am.RigidBody(
        am.cuboid((2 * b, 0.2, 2 * h)), 2500, np.array([b, 0, 0]) - turn @ [b, 0, -h],
        (np.cos(tilt / 2), 0, np.sin(tilt / 2), 0),
    )  # fmt: skip
    step = 4e-3 / size
    steps = _last(am.RigidBodies([block], [FLOOR], mu=2.0), step, 1.05)
    angle = np.array([2 * np.arctan2(*s.state.motion.orientation[0, [2, 0]]) for s in steps])
    at = np.flatnonzero(angle[:-1] * angle[1:] < 0)
    times = (at + 1 + angle[at] / (angle[at] - angle[at + 1])) * step
    expected = _upright(b, h, tilt)
    found = [*times[:2], np.nan, np.nan]
    names = ("first", "second")
    return [Value(f"upright for the {name} time, s", float(found[k]), expected[k])
            for k, name in enumerate(names)]  # fmt: skip


CASES = (
    Case("rolling", "Ball on a slope",
         "A ball rolls down a slope without slipping at mu 0.4, and slips at 0.1.",
         "5/7 g sin a where tan a < 7/2 mu; g (sin a - mu cos a) else", rolling, (1, 2)),
    Case("rocking", "Block that rocks",
         "A slender block is let go at a tilt, rocks over its edges and loses speed at each.",
         "G. W. Housner, BSSA 53 (1963)", rocking, (2, 4, 8), order=1),
)  # fmt: skip
