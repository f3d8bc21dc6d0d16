"""Cone problems by classes: FCLib files, packings, lattices, rolling piles, blocks, meshes.

Every generator takes a seed; sizes are chosen so that a class has small and large problems.
`classes(folder, seed)` yields (class, name, problem), all in Delassus form; `unseen(seed)` the
same of classes on which hardly a constant of a method was chosen (`race.py` says which).
"""

from functools import cached_property
from pathlib import Path

import numpy as np
from generated import packings, wall_step, walls
from scipy import sparse

import amontons as am
from amontons.mechanics.ready.packings import SpherePacking

DENSITY, GRAVITY, STEP = 2000.0, 9.81, 1e-3


# --------------------------------------------------------------------- spheres
class Lattice(SpherePacking):
    """A close packing of equal spheres, layers of a square lattice in each other's pockets."""

    layers: tuple[int, int, int]

    @classmethod
    def of(cls, nx, ny, nz, mu, seed=0):
        """nx by ny spheres in nz layers; those in between have one row less."""
        radius = 0.01
        count = sum((nx - k % 2) * (ny - k % 2) for k in range(nz))
        made = cls(count, width=2 * radius * max(nx, ny), radius=radius, mu=mu, seed=seed)
        object.__setattr__(made, "layers", (nx, ny, nz))
        return made

    @cached_property
    def _placed(self):
        nx, ny, nz = self.layers
        r = self.radius
        centres = [
            [r + 2 * r * i + r * (k % 2), r + 2 * r * j + r * (k % 2), r + np.sqrt(2) * r * k]
            for k in range(nz) for i in range(nx - k % 2) for j in range(ny - k % 2)
        ]  # fmt: skip
        return np.array(centres), np.full(self.count, r)


def spinning(packing, spin, seed, step=STEP):
    """A time step of a packing whose spheres turn at random, standard deviation `spin`, 1/s."""
    still = packing.problem(step)
    random = np.random.default_rng([seed, 3])
    omega = np.zeros((packing.count, 6))
    omega[:, 3:] = spin * random.standard_normal((packing.count, 3))
    f = still.f + still.M @ omega.ravel()
    return am.FrictionProblem.from_global(
        still.M, packing.H, f, np.zeros((still.contacts, 3)), still.mu, name=still.name
    )


# --------------------------------------------------------------------- rigid blocks
class Blocks:
    """Rigid blocks that meet in points, put together one after another."""

    def __init__(self):
        self.centres, self.masses, self.inertias = [], [], []
        self.contacts = []  # slave, master, place, normal into the slave

    def block(self, centre, sides, turn=0.0):
        """A cuboid, turned about y; returns its number."""
        c, s = np.cos(turn), np.sin(turn)
        R = np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])
        mass = DENSITY * np.prod(sides)
        squares = np.square(sides)
        own = np.diag(mass / 12 * (squares.sum() - squares))
        self.centres.append(np.asarray(centre, float))
        self.masses.append(mass)
        self.inertias.append(R @ own @ R.T)
        return len(self.centres) - 1

    def face(self, slave, master, centre, normal, first, second, points):
        """points (k, l) contacts on a rectangle with half edges first, second about centre."""
        for a in np.linspace(-1, 1, points[0]):
            for b in np.linspace(-1, 1, points[1]):
                place = np.asarray(centre) + a * np.asarray(first) + b * np.asarray(second)
                self.contacts.append((slave, master, place, np.asarray(normal, float)))

    def problem(self, mu, push=(0.0, 0.0, 0.0), spin=0.0, seed=0, step=STEP, name=""):
        """A time step from rest, or from random velocities, under gravity and a push (N)."""
        nb, nc = len(self.centres), len(self.contacts)
        random = np.random.default_rng([seed, 4])
        rows, columns, values = [], [], []
        for k, (slave, master, place, n) in enumerate(self.contacts):
            t = np.cross(n, np.eye(3)[np.abs(n).argmin()])
            t /= np.linalg.norm(t)
            for a, axis in enumerate((n, t, np.cross(n, t))):
                for body, sign in ((slave, 1.0), (master, -1.0)):
                    if body < 0:
                        continue
                    arm = place - self.centres[body]
                    rows += range(6 * body, 6 * body + 6)
                    columns += [3 * k + a] * 6
                    values += [*(sign * axis), *(sign * np.cross(arm, axis))]
        H = sparse.csc_array((values, (rows, columns)), shape=(6 * nb, 3 * nc))
        whole = np.zeros((nb, 6, 6))
        for b in range(nb):
            whole[b, :3, :3] = self.masses[b] * np.eye(3)
            whole[b, 3:, 3:] = self.inertias[b]
        M = sparse.block_diag(list(whole)).tocsc()
        v = np.zeros((nb, 6))
        v[:, 3:] = spin * random.standard_normal((nb, 3))
        f = (M @ v.ravel()).reshape(nb, 6)
        f[:, :3] += step * (np.array(self.masses)[:, None] * [0, 0, -GRAVITY] + np.array(push))
        low, high = mu if isinstance(mu, tuple) else (mu, mu)
        bounds = random.uniform(low, high, nc) if high > low else np.full(nc, float(low))
        return am.FrictionProblem.from_global(
            M, H, f.ravel(), np.zeros((nc, 3)), bounds, name=name
        )


def wall(rows, blocks, points=2, size=(0.4, 0.2, 0.2)):
    """Running bond: rows of blocks, each second one with halves at its ends; no head joints."""
    made, before = Blocks(), []
    lx, ly, lz = size
    for row in range(rows):
        ends = [lx * k for k in range(blocks + 1)]
        if row % 2:
            ends = [0, *(lx * (k + 0.5) for k in range(blocks)), lx * blocks]
        spans = list(zip(ends[:-1], ends[1:], strict=True))
        now = []
        for low, high in spans:
            centre = ((low + high) / 2, 0, (row + 0.5) * lz)
            number = made.block(centre, (high - low, ly, lz))
            for other, left, right in before or [(-1, low, high)]:
                a, b = max(low, left), min(high, right)
                if b - a > 1e-9:
                    made.face(
                        number, other, ((a + b) / 2, 0, row * lz), (0, 0, 1),
                        ((b - a) / 2, 0, 0), (0, ly / 2, 0), (points, points),
                    )  # fmt: skip
            now.append((number, low, high))
        before = now
    return made


def arch(stones, points=2, radius=1.0, thickness=0.2, width=0.3):
    """A semicircle of voussoirs, as cuboids, between two springings."""
    made = Blocks()
    step = np.pi / stones
    for k in range(stones):
        angle = np.pi - (k + 0.5) * step
        centre = radius * np.array([np.cos(angle), 0, np.sin(angle)])
        made.block(centre, (thickness, width, radius * step), -angle)
    for k in range(stones + 1):
        angle = np.pi - k * step
        out = np.array([np.cos(angle), 0, np.sin(angle)])
        along = np.array([np.sin(angle), 0, -np.cos(angle)])
        slave, master = (k, k - 1) if k < stones else (k - 1, -1)
        normal = along if k < stones else -along
        made.face(slave, master, radius * out, normal, thickness / 2 * out,
                  (0, width / 2, 0), (points, points))  # fmt: skip
    return made


def boxes(levels, count, points, seed):
    """Boxes of random widths on boxes, faces of points by points contacts, no head joints."""
    random, made = np.random.default_rng([seed, 6]), Blocks()
    height, depth, below = 0.2, 0.3, [(-1, -10.0, 10.0)]
    for level in range(levels):
        low, now, z = 0.0, [], level * height
        for _ in range(count):
            width, low = random.uniform(0.25, 0.5), low + random.uniform(0, 0.03)
            high = low + width
            number = made.block(((low + high) / 2, 0, z + height / 2), (width, depth, height))
            for other, left, right in below:
                a, b = max(low, left), min(high, right)
                if b - a > 0.02:
                    half, centre = ((b - a) / 2, 0, 0), ((a + b) / 2, 0, z)
                    made.face(number, other, centre, (0, 0, 1), half, (0, depth / 2, 0),
                              (points, points))  # fmt: skip
            now.append((number, low, high))
            low = high
        below = now
    return made


def logs(layers, count, seed, thickness=0.05):
    """Logs laid crosswise, two contacts where two of them cross."""
    random, made, below = np.random.default_rng([seed, 7]), Blocks(), []
    for layer in range(layers):
        z, across, now = layer * thickness, layer % 2 == 1, []
        places = np.linspace(0.06, 0.94, count) + random.uniform(-0.02, 0.02, count)
        for place in places:
            x, y = (place, 0.5) if across else (0.5, place)
            sides = (thickness, 1, thickness) if across else (1, thickness, thickness)
            number = made.block((x, y, z + thickness / 2), sides)
            ends = [(-1, 0.5, (0.4, 0, 0))] if layer == 0 else [
                (other, at, (0.01, 0, 0) if random.random() < 0.5 else (0, 0.01, 0))
                for other, at in below
            ]  # fmt: skip
            for other, at, half in ends:
                where = (place, at, z) if across else (at, place, z)
                made.face(number, other, where, (0, 0, 1), half, (0, 0, 0), (2, 1))
            now.append((number, place))
        below = now
    return made


# --------------------------------------------------------------------- meshes
def two_bodies(cells, mu, seed):
    """A block pressed on a wider one, and moved and turned at random: W is full."""
    random = np.random.default_rng([seed, 5])
    below = am.box((1.6, 1.6, 0.6), (cells, cells, max(cells // 3, 1)))
    above = am.box((1, 1, 0.6), (cells, cells, max(cells // 2, 1)), origin=(0.3, 0.3, 0.6))
    lower = am.Body(below, am.LinearElastic(1.0, 0.3), "lower")
    upper = am.Body(above, am.LinearElastic(2.0, 0.3), "upper")
    a, b, c, d = random.uniform(-1, 1, 4)

    def moved(x, t):
        return (0.03 * a + 0.02 * c * (x[1] - 0.8), 0.03 * b + 0.02 * d * (x[0] - 0.8), -0.02)

    model = am.Model([lower, upper], [am.Fix("lower.bottom", 0), am.Fix("upper.top", moved)],
                     [am.Contact("upper.bottom", master="lower.top", mu=mu)])  # fmt: skip
    return model.discrete_problem()


# --------------------------------------------------------------------- all
def fclib(folder, least=5):
    """FCLib files with so many contacts at least, in Delassus form."""
    for path in sorted(Path(folder).glob("*.hdf5")):
        problem = am.read_fclib(path)
        if problem.contacts >= least:
            yield path.stem, problem.condensed()


def close(seed):
    """Close packings."""
    for nx, ny, nz, mu in ((4, 4, 4, 0.3), (6, 6, 6, 0.5), (3, 3, 20, 0.4), (8, 8, 4, 0.2),
                           (9, 9, 8, 0.7)):  # fmt: skip
        made = Lattice.of(nx, ny, nz, mu, seed)
        yield f"fcc {nx}x{ny}x{nz} mu {mu}", made.problem(STEP, 1e-3)


def rolling(seed):
    """Packings of spheres that spin."""
    for count, spin, mu in ((60, 5.0, 0.3), (200, 5.0, 0.3), (200, 20.0, 0.3), (600, 5.0, 0.3),
                            (600, 20.0, 0.3), (400, 10.0, 0.6)):  # fmt: skip
        packing = SpherePacking(count, mu=mu, seed=seed + count)
        yield f"roll {count} spin {spin:g} mu {mu}", spinning(packing, spin, seed)


def rigid(seed):
    """Walls, towers and arches of rigid blocks."""
    push = (0.0, 0.0, 0.0)
    cases = (
        ("wall 6x4", wall(6, 4), (0.3, 0.9), 0.0), ("wall 10x8", wall(10, 8, 3), 0.5, 0.0),
        ("wall 12x10", wall(12, 10), 0.05, 0.0), ("wall 8x6 turning", wall(8, 6), 0.6, 0.05),
        ("tower 12", wall(12, 1), 0.05, 0.02), ("tower 40", wall(40, 1, 3), 0.4, 0.0),
        ("tower 30 turning", wall(30, 1, 4), 0.3, 0.01),
        ("arch 15", arch(15), 0.6, 0.0), ("arch 25 slipping", arch(25, 4), 0.2, 0.0),
        ("arch 31", arch(31, 3), 0.5, 0.0),
    )  # fmt: skip
    for name, made, mu, spin in cases:
        yield name, made.problem(mu, push, spin, seed)


def elastic(seed):
    """Walls of meshed blocks."""
    yield from walls(4, seed)
    for rows, blocks, cells, mu in ((5, 4, (4, 2, 2), 1.5), (3, 6, (4, 3, 2), 0.6)):
        yield f"wall {rows}x{blocks} mu {mu}", wall_step(rows, blocks, cells, mu, shear=2e4)


def meshes(seed):
    """Two meshed bodies, W full."""
    for cells, mu in ((5, 0.3), (8, 0.6), (12, 1.2), (14, 0.3)):
        yield f"two bodies {cells} mu {mu}", two_bodies(cells, mu, seed)


def classes(folder, seed):
    """(class, name, problem) of all."""
    made = {
        "FCLib": fclib(folder), "packings": packings(6, seed), "lattices": close(seed),
        "rolling": rolling(seed), "rigid blocks": rigid(seed), "elastic walls": elastic(seed),
        "two bodies": meshes(seed),
    }  # fmt: skip
    for kind, problems in made.items():
        for name, problem in problems:
            yield kind, name, problem.condensed()


def unseen(seed):
    """(class, name, problem) of spheres of several sizes, boxes, logs and rolling spheres."""
    random = np.random.default_rng([seed, 8])

    def spheres(kind, low, high, spin, **more):
        count, mu = int(10 ** random.uniform(low, high)), float(random.uniform(0.1, 0.8))
        made = SpherePacking(count, mu=mu, seed=int(random.integers(10**6)), **more)
        problem = spinning(made, spin, seed) if spin else made.problem(STEP)
        return kind, f"{kind} {count} mu {mu:.2f} spin {spin:.3g}", problem

    for k in range(6):
        spin = float(random.uniform(1, 10)) if k % 2 else 0.0
        spread = float(random.choice([0.2, 0.35, 0.45]))
        yield spheres("sizes", 1.2, 2.6, spin, spread=spread)
    for kind in ("boxes", "logs"):
        for k in range(5):
            mu, spin = float(random.uniform(0.1, 0.8)), float(random.choice([0.0, 0.02, 0.5]))
            if kind == "boxes":
                a, b, c = (int(n) for n in random.integers((2, 1, 2), (8, 6, 4)))
                made, push = boxes(a, b, c, seed + k), float(random.choice([0.0, 20.0, 60.0]))
            else:
                a, b, c = (int(n) for n in random.integers((3, 2, 2), (10, 6, 3)))
                made, push = logs(a, b, seed + k), 0.0
            name = f"{kind} {a}x{b}x{c} mu {mu:.2f} spin {spin:g} push {push:g}"
            yield kind, name, made.problem(mu, (push, 0.0, 0.0), spin, seed + k)
    for _ in range(3):
        yield spheres("rolling", 1.6, 2.5, float(random.uniform(2, 30)))
