"""Packings of rigid spheres at rest in a box, as discrete problems of any size.

Spheres are dropped one after another into the lowest free pocket, a place where the sphere
touches three others, floor or walls and is in equilibrium without friction [B].  The first ones
lie on the floor at random, so the packing is random too.  No spheres overlap, every sphere has
three supports and so a packing of N spheres about 3 N contacts: it is hyperstatic, as friction
adds two forces per contact to 6 N balances.

[B] C. Bennett, "Serially deposited amorphous aggregates of hard spheres", Journal of Applied
Physics 43 (1972).
"""

from __future__ import annotations

import heapq
from dataclasses import dataclass
from functools import cached_property
from itertools import count, product

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ...core.errors import InvalidInput
from ...problem.friction import FrictionProblem

Array = NDArray[np.float64]
Index = NDArray[np.int64]
FLOOR = -1  # number of the floor as a body; the walls are -2 (x = 0), -3, -4 (y = 0), -5
TOUCHING = 1e-9  # gap, relative to the radius, up to which two bodies touch
OVERLAP = 1e-10  # what rounding may make of a touch, relative to the radius
COVERED = 0.3  # share of the floor that the first spheres cover
SIZES = 3  # different radii of a packing with a spread


@dataclass(frozen=True)
class SpherePacking:
    """`count` spheres in a box with a square floor of edge `width`, by default as high as wide.

    radius: mean radius, length; spread: radii lie within radius (1 -+ spread).  density: mass
    per volume; gravity: acceleration, downwards along z.  mu: friction between spheres and at
    the floor, a number or the bounds (low, high) of random values; mu_wall: at the four walls.
    """

    count: int
    width: float | None = None
    radius: float = 0.01
    spread: float = 0.0
    density: float = 2500.0
    gravity: float = 9.81
    mu: float | tuple[float, float] = 0.5
    mu_wall: float = 0.0
    seed: int = 0

    def __post_init__(self) -> None:
        if not isinstance(self.count, int) or self.count < 1:
            raise InvalidInput(f"count: expected a whole number >= 1, got {self.count!r}")
        for name in ("radius", "density", "gravity"):
            _expect(name, getattr(self, name), getattr(self, name) > 0, "> 0")
        _expect("spread", self.spread, 0 <= self.spread < 0.5, "from 0 to below 0.5")
        _expect("mu_wall", self.mu_wall, self.mu_wall >= 0, ">= 0")
        low, high = self._friction
        _expect("mu", low, 0 <= low <= high, ">= 0, or bounds (low, high)")
        least = 4 * self.radius * (1 + self.spread)
        _expect("width", self.edge, self.edge >= least, f">= {least:g}, two spheres")

    @property
    def _friction(self) -> tuple[float, float]:
        return self.mu if isinstance(self.mu, tuple) else (self.mu, self.mu)

    @property
    def edge(self) -> float:
        """Edge of the floor, length."""
        if self.width is not None:
            return self.width
        cubic = 2 * self.radius * (self.count / 1.1) ** (1 / 3)
        return max(cubic, 4.2 * self.radius * (1 + self.spread))

    # ------------------------------------------------------------------ geometry
    @cached_property
    def _placed(self) -> tuple[Array, Array]:
        pile = _Pile(self)
        pile.seed_floor()
        pile.fill()
        return np.array(pile.centres), np.array(pile.radii)

    @property
    def centres(self) -> Array:
        """Centres of the spheres, (count, 3), the floor at z = 0."""
        return self._placed[0]

    @property
    def radii(self) -> Array:
        """Radii, (count,)."""
        return self._placed[1]

    @cached_property
    def pairs(self) -> Index:
        """Bodies in contact, (nc, 2): slave and master; a master below 0 is floor or wall."""
        from scipy.spatial import cKDTree

        c, r = self._placed
        near = cKDTree(c).query_pairs(2.01 * r.max(), output_type="ndarray")
        gap = np.linalg.norm(c[near[:, 0]] - c[near[:, 1]], axis=1) - r[near].sum(axis=1)
        near = near[gap <= TOUCHING * self.radius]
        found = [near[np.lexsort(near.T[::-1])][:, ::-1]]  # the later one lies on the other
        for k, (normal, offset) in enumerate(self._planes):
            at = np.flatnonzero(c @ normal - offset - r <= TOUCHING * self.radius)
            found.append(np.column_stack([at, np.full(len(at), FLOOR - k)]))
        return np.concatenate(found).astype(np.int64)

    @property
    def _planes(self) -> list[tuple[Array, float]]:
        """(inward normal, offset) of floor and walls: normal . x = offset on the plane."""
        x, y, z = np.eye(3)
        return [(z, 0.0), (x, 0.0), (-x, -self.edge), (y, 0.0), (-y, -self.edge)]

    @cached_property
    def frames(self) -> Array:
        """Normal into the slave and two tangents, (nc, 3, 3) by rows, right-handed."""
        slave, master = self.pairs.T
        c = self.centres
        normal = np.array([n for n, _ in self._planes])[np.clip(-1 - master, 0, 4)]
        free = master >= 0
        apart = c[slave[free]] - c[master[free]]
        normal[free] = apart / np.linalg.norm(apart, axis=1, keepdims=True)
        helper = np.eye(3)[np.abs(normal).argmin(axis=1)]
        first = np.cross(normal, helper).astype(float, copy=False)
        first /= np.linalg.norm(first, axis=1, keepdims=True)
        second = np.cross(normal, first).astype(float, copy=False)
        return np.stack([normal, first, second], axis=1)

    @property
    def masses(self) -> Array:
        """Masses of the spheres, (count,)."""
        return self.density * 4 / 3 * np.pi * self.radii**3

    # ------------------------------------------------------------------ the problem
    def problem(self, step: float = 1e-3, shake: float = 0.0) -> FrictionProblem:
        """One time step under gravity, in global form: v velocities, r impulses.

        Six unknowns a sphere, velocity and angular velocity; f = M v0 + step * weight with v0
        = 0, or random with standard deviation `shake` (velocity).
        """
        _expect("step", step, step > 0, "> 0")
        _expect("shake", shake, shake >= 0, ">= 0")
        random = np.random.default_rng([self.seed, 1])
        mass, r = self.masses, self.radii
        diagonal = np.repeat(mass[:, None], 6, axis=1)
        diagonal[:, 3:] *= 0.4 * r[:, None] ** 2
        velocity = shake * random.standard_normal((self.count, 6))
        velocity[:, 3:] /= r[:, None]
        f = diagonal * velocity
        f[:, 2] -= step * self.gravity * mass
        nc = len(self.pairs)
        low, high = self._friction
        mu = random.uniform(low, high, nc) if high > low else np.full(nc, float(low))
        mu[self.pairs[:, 1] < FLOOR] = self.mu_wall
        return FrictionProblem.from_global(
            sparse.diags_array(diagonal.ravel()).tocsc(), self.H, f.ravel(), np.zeros((nc, 3)),
            mu, name=f"spheres-{self.count}-{self.seed}",
        )  # fmt: skip

    @property
    def H(self) -> sparse.csc_array:
        """Reactions to generalised forces, (6 count, 3 nc)."""
        slave, master = self.pairs.T
        nc = len(slave)
        columns = np.broadcast_to(np.arange(3 * nc).reshape(nc, 1, 3), (nc, 6, 3))
        parts = []
        for body, side in ((slave, -1.0), (master, 1.0)):
            here = np.flatnonzero(body >= 0)
            axes = self.frames[here]  # (k, axis, component)
            arm = side * self.radii[body[here]][:, None, None] * axes[:, :1]
            wrench = -side * np.concatenate([axes, np.cross(arm, axes)], axis=2)
            rows = 6 * body[here][:, None, None] + np.arange(6)[None, :, None]
            rows = np.broadcast_to(rows, (len(here), 6, 3))
            parts.append((wrench.swapaxes(1, 2), rows, columns[here]))
        data, rows, cols = (np.concatenate([p[k].ravel() for p in parts]) for k in range(3))
        return sparse.csc_array((data, (rows, cols)), shape=(6 * self.count, 3 * nc))


class _Pile:
    """Spheres placed so far, in cells, and the pockets between them by height."""

    def __init__(self, packing: SpherePacking) -> None:
        self.packing = packing
        self.random = np.random.default_rng(packing.seed)
        spread = np.linspace(-1, 1, SIZES) if packing.spread else np.zeros(1)
        self.sizes = packing.radius * (1 + packing.spread * spread)
        self.cell = 2.0 * self.sizes.max()
        self.cells: dict[tuple[int, int, int], list[int]] = {}
        self.centres: list[Array] = []
        self.radii: list[float] = []
        self.pockets: list[list[tuple[float, int, Array]]] = [[] for _ in self.sizes]
        self.numbers = count()  # heaps never compare places
        self.normals = np.array([n for n, _ in packing._planes])
        self.offsets = np.array([o for _, o in packing._planes])

    def seed_floor(self) -> None:
        """Random spheres on the floor, the first pockets between them."""
        p = self.packing
        wanted = min(p.count, max(1, round(COVERED * p.edge**2 / (np.pi * p.radius**2))))
        for _ in range(50 * wanted):
            if len(self.centres) == wanted:
                return
            r = self.random.choice(self.sizes)
            x, y = self.random.uniform(r, p.edge - r, 2)
            self._place_if_free(np.array([x, y, r]), r)

    def fill(self) -> None:
        """Pockets from below until all spheres are there."""
        while len(self.centres) < self.packing.count:
            order = self.random.permutation(len(self.sizes))
            kind = next((k for k in order if self.pockets[k]), None)
            if kind is None:
                raise InvalidInput(
                    f"count: expected at most {len(self.centres)} spheres in a box of edge "
                    f"{self.packing.edge:g}, got {self.packing.count}: no pocket is left"
                )
            _, _, place = heapq.heappop(self.pockets[kind])
            self._place_if_free(place, float(self.sizes[kind]))

    def _place_if_free(self, place: Array, r: float) -> None:
        near = self._near(place, 2 * self.cell)
        if self._free(place[None], r, near)[0]:
            number = len(self.centres)
            self.centres.append(place)
            self.radii.append(r)
            self.cells.setdefault(self._key(place), []).append(number)
            near = self._near(place, 2 * self.cell)
            for kind, size in enumerate(self.sizes):
                for found in self._pockets_at(number, near, size):
                    heapq.heappush(self.pockets[kind], (found[2], next(self.numbers), found))

    def _key(self, place: Array) -> tuple[int, int, int]:
        return tuple(np.floor(place / self.cell).astype(int))  # type: ignore[return-value]

    def _near(self, place: Array, reach: float) -> Index:
        """Spheres in the cells within `reach`, a multiple of the cell."""
        i, j, k = self._key(place)
        span = range(-int(np.ceil(reach / self.cell)), int(np.ceil(reach / self.cell)) + 1)
        found: list[int] = []
        for a, b, c in product(span, span, span):
            found += self.cells.get((i + a, j + b, k + c), ())
        return np.array(found, dtype=np.int64)

    def _free(self, places: Array, r: float, near: Index) -> NDArray[np.bool_]:
        """Whether spheres of radius r at places (k, 3) overlap none of `near` nor a plane."""
        slack = OVERLAP * self.packing.radius
        free = np.all(places @ self.normals.T - self.offsets >= r - slack, axis=1)
        if len(near):
            centres = np.array([self.centres[k] for k in near])
            reach = np.array([self.radii[k] for k in near]) + r - slack
            distance = np.linalg.norm(places[:, None] - centres, axis=2)
            free &= np.all(distance >= reach, axis=1)
        return free

    def _pockets_at(self, number: int, near: Index, r: float) -> Array:
        """Stable places (k, 3) that touch sphere `number` and two other bodies."""
        origin, reach = self.centres[number], self.radii[number] + r
        others = near[near != number]
        apart = np.array([self.centres[k] - origin for k in others]).reshape(-1, 3)
        limit = np.array([self.radii[k] + r for k in others])
        close = np.linalg.norm(apart, axis=1) < reach + limit
        apart, limit = apart[close], limit[close]
        # x from the origin, |x| = reach: a sphere gives a . x = (a^2 + reach^2 - limit^2) / 2
        plane = self.offsets + r - self.normals @ origin
        held = np.abs(plane) < reach
        rows = np.concatenate([apart, self.normals[held]])
        right = np.concatenate(
            [0.5 * ((apart**2).sum(axis=1) + reach**2 - limit**2), plane[held]]
        )
        a, b = np.triu_indices(len(rows), 1)
        axis = np.cross(rows[a], rows[b])
        size = (axis**2).sum(axis=1)
        good = size > 1e-12 * (rows[a] ** 2).sum(axis=1) * (rows[b] ** 2).sum(axis=1)
        a, b, axis, size = a[good], b[good], axis[good], size[good]
        foot = (
            right[a, None] * np.cross(rows[b], axis) - right[b, None] * np.cross(rows[a], axis)
        ) / size[:, None]
        left = reach**2 - (foot**2).sum(axis=1)
        real = left > 0
        a, b, foot = a[real], b[real], foot[real]
        way = axis[real] * np.sqrt(left[real] / size[real])[:, None]
        x = np.concatenate([foot + way, foot - way])
        a, b = np.tile(a, 2), np.tile(b, 2)
        inward = np.concatenate([np.zeros(len(apart)), np.ones(held.sum())])[:, None]
        supports = [x, *(np.where(inward[k] > 0, rows[k], x - rows[k]) for k in (a, b))]
        stable = _carries(np.stack(supports, axis=1))
        x = x[stable] + origin
        return x[self._free(x, r, near)] if len(x) else x


def _carries(supports: Array) -> NDArray[np.bool_]:
    """Whether pushes along supports (k, 3 supports, 3) can balance a weight."""
    unit = supports / np.linalg.norm(supports, axis=2, keepdims=True)
    crosses = np.stack(
        [np.cross(unit[:, (k + 1) % 3], unit[:, (k + 2) % 3]) for k in range(3)], axis=1
    )
    volume = (unit[:, 0] * crosses[:, 0]).sum(axis=1)
    regular = np.abs(volume) > 1e-6
    share = crosses[:, :, 2] / np.where(regular, volume, 1.0)[:, None]  # Cramer, for e_z
    return regular & (share >= -1e-12).all(axis=1)


def _expect(name: str, value: float, good: bool, wanted: str) -> None:
    if not (np.isfinite(value) and good):
        raise InvalidInput(f"{name}: expected a number {wanted}, got {value!r}")
