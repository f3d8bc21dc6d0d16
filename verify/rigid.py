"""Rigid bodies that move far: rolling, rocking, falling."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import integrate, optimize

import amontons as am

from .case import Case, Value

Array = NDArray[np.float64]
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


def _upright(b: float, h: float, tilt: float, impacts: int = 1) -> list[float]:
    """Times at which a block 2b x 2h passes its upright position, by Housner."""
    alpha, radius = np.arctan2(b, h), np.hypot(b, h)
    c = 2 * G * radius / (4 / 3 * radius**2)

    def quarter(top: float) -> float:
        def slowness(s: float) -> float:
            return 2 * s / np.sqrt(c * (np.cos(alpha - top) - np.cos(alpha - (top - s * s))))

        return float(integrate.quad(slowness, 0, np.sqrt(top), epsabs=1e-12)[0])

    def height(angle: float) -> float:
        return float(np.cos(alpha - angle) - np.cos(alpha))

    times, left = [quarter(tilt)], height(tilt)
    for _ in range(impacts):
        left = left * (1 - 1.5 * np.sin(alpha) ** 2) ** 2
        top = optimize.brentq(lambda x, left=left: height(x) - left, 0, alpha)
        times.append(times[-1] + 2 * quarter(top))
    return times


def _rocked(b: float, h: float, tilt: float, step: float, until: float) -> Array:
    """The same, of a block that is let go at a tilt."""
    turn = np.array([[np.cos(tilt), 0, np.sin(tilt)], [0, 1, 0],
                     [-np.sin(tilt), 0, np.cos(tilt)]])  # fmt: skip
    block = am.RigidBody(
        am.cuboid((2 * b, 0.2, 2 * h)), 2500, np.array([b, 0, 0]) - turn @ [b, 0, -h],
        (np.cos(tilt / 2), 0, np.sin(tilt / 2), 0),
    )  # fmt: skip
    steps = _last(am.RigidBodies([block], [FLOOR], mu=2.0), step, until)
    angle = np.array([2 * np.arctan2(*s.state.motion.orientation[0, [2, 0]]) for s in steps])
    at = np.flatnonzero(angle[:-1] * angle[1:] < 0)
    return (at + 1 + angle[at] / (angle[at] - angle[at + 1])) * step


def rocking(size: int) -> list[Value]:
    """A block 0.2 x 1 is let go at a tilt of 0.1, and rocks over its two edges."""
    expected = _upright(0.1, 0.5, 0.1)
    found = [*_rocked(0.1, 0.5, 0.1, 4e-3 / size, 1.05)[:2], np.nan, np.nan]
    names = ("first", "second")
    return [Value(f"upright for the {name} time, s", float(found[k]), expected[k])
            for k, name in enumerate(names)]  # fmt: skip


def rocking_blocks(size: int) -> list[Value]:
    """Slender and stout ones, let go at small and large tilts: four passages of each."""
    out = []
    for b in (0.05, 0.1, 0.2):
        worst = 0.0
        for part in (0.2, 0.5, 0.8):
            tilt = part * np.arctan2(b, 0.5)
            expected = np.array(_upright(b, 0.5, tilt, 3))
            found = _rocked(b, 0.5, tilt, 4e-3 / size, 1.02 * expected[-1])
            same = len(found) == len(expected)
            worst = max(worst, np.abs(found / expected - 1).max() if same else np.inf)
        name = f"1 + error of the worst of 12 times, b / h = {2 * b:g}"
        out.append(Value(name, 1 + worst, 1.0))
    return out


def books(size: int) -> list[Value]:
    """Boxes and a ball fall on each other for 10 000 steps."""
    rng = np.random.default_rng(size)
    bodies = [am.RigidBody(am.cuboid((0.3, 0.2, 0.25)), orientation=rng.standard_normal(4),
                           position=(0.1 * k % 0.3, 0, 0.3 + 0.35 * k)) for k in range(4)]
    bodies.append(am.RigidBody(am.Ball(0.12), position=(0.05, 0.02, 1.9)))
    before = sum(b.mass * G * b.position[2] for b in bodies)  # type: ignore[index]
    done, count, end = 0.0, 0, None
    system = am.RigidBodies(bodies, [FLOOR], mu=0.4, restitution=0.2)
    for end in am.evolve_rigid(system, step=1e-4 * size, until=1.0 * size, tolerance=1e-6):
        done += end.energies.contact + end.energies.mending
        count += 1
    assert end is not None
    after = end.energies.kinetic + end.energies.potential
    return [Value("steps", count, 10_000),
            Value("energy that is left, J", after, before + done, scale=before)]  # fmt: skip


def _rod(angle: float) -> tuple[am.RigidBody, Array]:
    """A thin rod with two points, of length 2, on the lower one, and W (2, 2) of that."""
    needle = am.Polyhedron(np.concatenate([np.eye(3), -np.eye(3)]) * [1.0, 0.01, 0.01])
    arm = -np.array([np.cos(angle), np.sin(angle)])
    rod = am.RigidBody(needle, 1000.0, (0, 0, -arm[1]), velocity=(-1.0, 0, 0),
                       orientation=(np.cos(angle / 2), 0, -np.sin(angle / 2), 0))
    lever = np.array([arm[0], -arm[1]])
    return rod, np.eye(2) / rod.mass + np.outer(lever, lever) / rod.inertia[1, 1]


def painleve(size: int) -> list[Value]:
    """The friction from which a rod that slides is stopped at once, and by what impulse."""
    out, step = [], 1e-4 / size
    for tangent in (1.0, 2.0, 3.0):
        rod, W = _rod(np.arctan(tangent))

        def first(mu: float, rod: am.RigidBody = rod) -> am.RigidStep:
            system = am.RigidBodies([rod], [FLOOR], mu=mu)
            return next(am.evolve_rigid(system, step=step, until=step, tolerance=1e-12))

        low, high = 0.5, 3.0
        while high - low > 1e-6:
            mu = 0.5 * (low + high)
            stuck = (first(mu).status == am.ContactStatus.STICK).all()
            low, high = (low, mu) if stuck else (mu, high)
        critical = W[0, 0] / abs(W[0, 1])
        out.append(Value(f"friction that jams, tan = {tangent:g}", high, critical))
        if tangent == 2.0:
            impulse = np.linalg.solve(W, [0.0, 1.0])  # takes u_T = -1 away, u_N = 0
            out.append(Value("normal impulse at mu = 2, N s", first(2.0).r[:, 0].sum(),
                             impulse[0]))  # fmt: skip
    return out


CASES = (
    Case("rolling", "Ball on a slope",
         "A ball rolls down a slope without slipping at mu 0.4, and slips at 0.1.",
         "5/7 g sin a where tan a < 7/2 mu; g (sin a - mu cos a) else", rolling, (1, 2)),
    Case("rocking", "Block that rocks",
         "A slender block is let go at a tilt, rocks over its edges and loses speed at each.",
         "G. W. Housner, BSSA 53 (1963)", rocking, (2, 4, 8), order=1),
    Case("rocking-blocks", "Blocks that rock, slender and stout",
         "Nine blocks are let go at 0.2, 0.5 and 0.8 of the angle at which they fall.",
         "G. W. Housner, BSSA 53 (1963)", rocking_blocks, (4, 16), order=1, close=5e-3),
    Case("books", "Energy over 10 000 steps",
         "Boxes and a ball fall on each other and come to rest; the energy at the end is that "
         "at the beginning and all work of contacts and of mending.",
         "conservation of energy", books, (1,), close=1e-10),
    Case("painleve", "Painlevé's rod",
         "A rod leans on the end that it pushes along a floor. From a coefficient of friction "
         "on, sliding would press the end into the floor whatever the reaction: it sticks at "
         "once, by an impulse that no step makes smaller.",
         "mu = W_NN / |W_NT|, of a uniform rod (1 + 3 cos^2 a) / (3 sin a cos a), 4/3 at "
         "least (this one is thinner to its ends); F. Génot, B. Brogliato, Eur. J. Mech. A 18 "
         "(1999)", painleve, (1, 4, 16), order=1),
)  # fmt: skip
