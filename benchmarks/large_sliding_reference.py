"""Plane and round cases of `large_sliding` by a third method, to show which limit is right.

Nothing of amontons but meshes: bilinear quadrilaterals, 2 x 2 points, of the same energy,

    W = G / 2 (tr C - 3) - G ln J + K' / 2 (ln J)^2,

and a penalty at `POINTS` points of every slave facet against the closest master facet, with
a spring along it that is anchored in the master where the point touched, and whose anchor is
drawn along when Coulomb's limit is reached (the "moving friction cone" of P. Wriggers,
L. Krstulovic-Opara, Int. J. Comput. Methods 1 (2004) 105-119).  For a point x, its projection
y on a facet along the normal n there, its tangent t, and its anchor a,

    g = n . (x - y),  p = e max(-g, 0),   T = e_t t . (a - x), cut to |T| <= mu p,

forces p n + T t act on x and the opposite at y.  Normals are means at nodes and linear between
them: with those of single facets forces jump from one to the next, and where a corner slides
no equilibrium may be left.  All tangents are complex differences.  The
penalties e = e_t are `STIFF` times the softer modulus over a facet's length, so that what
they give way vanishes with the mesh.  Bodies of rotation are given by their meridian:
coordinates r and z, F_33 = r / R.
"""

import time
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise

import numpy as np
from large_sliding_models import corners
from large_sliding_more import taper
from large_sliding_peers import Setting
from scipy import sparse
from scipy.sparse.linalg import splu

import amontons as am

POINTS, STIFF = 3, 50.0
PARTS = (1, 4, 16)  # of a load step, one number after another
RAMP, MOST = (0.03, 0.1, 0.3, 1.0), 12  # parts of the penalty, Newton steps at each
TINY = 1e-30  # step of complex differences
NEAR = 0.4  # lengths beyond which nothing is seen
SLACK = 1e-9  # beyond ends of facets
GAUSS = 1 / np.sqrt(3)


@dataclass(frozen=True)
class Solid:
    """A body: nodes first..first + n of all; dX (c, 4, 4, 2), weights (c, 4), radii (c, 4)."""

    nodes: np.ndarray
    slopes: np.ndarray
    weights: np.ndarray
    shear: float
    lame: float
    radius: np.ndarray | None
    values: np.ndarray

    @classmethod
    def of(cls, points, cells, first, shear, bulk, round_):
        """From a mesh of quadrilaterals (c, 4) around."""
        signs = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
        at = signs * GAUSS
        values = np.prod(1 + at[:, None] * signs, axis=2) / 4  # (points, nodes)
        local = np.stack([signs[:, c] * (1 + at[:, None, 1 - c] * signs[:, 1 - c]) / 4
                          for c in range(2)], axis=2)  # fmt: skip
        x = points[cells]
        jacobian = np.einsum("qac,nad->nqdc", local, x)
        slopes = np.einsum("qac,nqcd->nqad", local, np.linalg.inv(jacobian))
        weights = np.abs(np.linalg.det(jacobian))
        radius = np.einsum("qa,na->nq", values, x[..., 0]) if round_ else None
        if round_:
            weights = weights * radius * np.pi / 2  # of a quarter
        return cls(cells + first, slopes, weights, shear, bulk - 2 * shear / 3, radius, values)

    def forces(self, u):
        """Nodal forces (c, 4, 2) of displacements (c, 4, 2), real or complex."""
        f = np.einsum("nad,nqac->nqdc", u, self.slopes)
        f = f + np.eye(2)
        det = f[..., 0, 0] * f[..., 1, 1] - f[..., 0, 1] * f[..., 1, 0]
        inverse = np.empty_like(f)  # F^-T
        inverse[..., 0, 0], inverse[..., 1, 1] = f[..., 1, 1] / det, f[..., 0, 0] / det
        inverse[..., 0, 1], inverse[..., 1, 0] = -f[..., 1, 0] / det, -f[..., 0, 1] / det
        hoop = 1.0 if self.radius is None else (
            1 + np.einsum("qa,na->nq", self.values, u[..., 0]) / self.radius)  # fmt: skip
        volume = self.lame * np.log(det * hoop)
        stress = self.shear * f + (volume - self.shear)[..., None, None] * inverse
        out = np.einsum("nqdc,nqac,nq->nad", stress, self.slopes, self.weights)
        if self.radius is not None:
            around = self.shear * hoop + (volume - self.shear) / hoop
            out[..., 0] += np.einsum("nq,qa,nq->na", around / self.radius, self.values,
                                     self.weights)  # fmt: skip
        return out


def differences(force, u):
    """force(u) (n, a) and its derivatives (n, a, b) for u (n, b)."""
    slopes = []
    for k in range(u.shape[1]):
        moved = u.astype(complex)
        moved[:, k] += 1j * TINY
        slopes.append(force(moved).imag / TINY)
    return force(u), np.stack(slopes, axis=2)


def turned(normals):
    """Tangents (..., 2) of a facet from its start to its end, for outward normals."""
    return np.stack([-normals[..., 1], normals[..., 0]], axis=-1)


@np.errstate(all="ignore")  # points far off that face nothing: not finite
def across(at, facet, before, after):
    """Part of a facet that points face along its normals, vector from there, unit normal.

    at (..., 2); facet and those beside it (..., 2 nodes, 2), real or complex.  Normals are
    those at its ends, mean ones of the facets that meet there, and linear in between: with
    s the part, y = x_1 + s e, (x - y) . (t_1 + s (t_2 - t_1)) = 0.
    """
    edge = facet[..., 1, :] - facet[..., 0, :]
    own = unit(edge)
    first, second = (own + unit(side[..., 1, :] - side[..., 0, :]) for side in (before, after))
    first, second = unit(first), unit(second)
    bent, start = second - first, at - facet[..., 0, :]
    a, b = -(edge * bent).sum(-1), (start * bent).sum(-1) - (edge * first).sum(-1)
    c = (start * first).sum(-1)
    part = 2 * c / (np.sqrt(b**2 - 4 * a * c) - b)
    way = unit(first + part[..., None] * bent)
    normal = np.stack([way[..., 1], -way[..., 0]], axis=-1)
    return part, start - part[..., None] * edge, normal


def unit(vectors):
    """Vectors (..., 2), real or complex, over their lengths."""
    return vectors / np.sqrt((vectors**2).sum(-1))[..., None]


@dataclass
class Sides:
    """Points of the slave's facets and the master's facets; what they remember.

    slave (k, 2), master (s, 2): nodes; parts (k,), weights (k,): of points.  Anchors: facet
    (k,) and part of it (k,).  before (k,): slides of the last Newton step;
    turns: a point slid the other way then, and is held in between.
    """

    slave: np.ndarray
    parts: np.ndarray
    weights: np.ndarray
    master: np.ndarray
    stiffness: float
    mu: float
    anchor: np.ndarray
    anchored: np.ndarray
    before: np.ndarray
    turns: bool = False

    @classmethod
    def of(cls, slave, master, x, stiffness, mu, round_):
        """At the undeformed positions x of all nodes."""
        at, weights = np.polynomial.legendre.leggauss(POINTS)
        at, weights = (at + 1) / 2, weights / 2
        ends = x[slave]
        long = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
        weights = (long[:, None] * weights).ravel()
        slaves, parts = np.repeat(slave, POINTS, axis=0), np.tile(at, len(slave))
        if round_:
            weights = weights * np.pi / 2 * ((1 - parts) * x[slaves[:, 0], 0]
                                             + parts * x[slaves[:, 1], 0])  # fmt: skip
        k = len(parts)
        return cls(slaves, parts, weights, master, stiffness, mu,
                   np.zeros(k, dtype=np.int64), np.zeros(k), np.zeros(k))  # fmt: skip

    @cached_property
    def _around(self):
        """Facets before and after every one, (s, 2), itself at an end."""
        own, found = np.arange(len(self.master)), []
        for one, other in ((0, 1), (1, 0)):
            same = self.master[:, one][:, None] == self.master[:, other]
            found.append(np.where(same.any(axis=1), same.argmax(axis=1), own))
        return np.stack(found, axis=1)

    def nodes(self, some, facet, anchor):
        """Nodes (k, 10) that tell the force: slave, facet, those around it, anchor."""
        around = self.master[self._around[facet]].reshape(-1, 4)
        return np.concatenate([self.slave[some], self.master[facet], around,
                               self.master[anchor]], axis=1)  # fmt: skip

    def closest(self, x):
        """Master facet (k,), part (k,) in 0..1 and gap (k,) of points; inf beyond an end."""
        at = x[self.slave]
        at = (1 - self.parts)[:, None] * at[:, 0] + self.parts[:, None] * at[:, 1]
        there = x[self.master], *x[self.master[self._around]].swapaxes(0, 1)
        part, away, normal = across(at[:, None], *there)
        gap = (away * normal).sum(axis=2)
        seen = (part >= -SLACK) & (part <= 1 + SLACK) & (np.abs(gap) < NEAR)
        best = np.where(seen, np.abs(gap), np.inf).argmin(axis=1)
        row = np.arange(len(at))
        gap = np.where(seen[row, best], gap[row, best], np.inf)
        return best, np.clip(part[row, best], 0, 1), gap

    def forces(self, x, some, facet, anchor, anchored, slides):
        """Forces (k, 8) on slave, and master nodes of `some` points, `nodes` at x (k, 20).

        slides (k,): sign of the friction on x where it slides, 0 where it sticks.
        """
        x = x.reshape(len(x), 10, 2)
        part = self.parts[some][:, None]
        at = (1 - part) * x[:, 0] + part * x[:, 1]
        there, away, n = across(at, x[:, 2:4], x[:, 4:6], x[:, 6:8])
        t, there = turned(n), there[:, None]
        pressure = -self.stiffness * (away * n).sum(axis=1)
        held = (1 - anchored[:, None]) * x[:, 8] + anchored[:, None] * x[:, 9]
        spring = self.stiffness * ((held - at) * t).sum(axis=1)
        along = np.where(slides == 0, spring, slides * self.mu * pressure)
        force = (pressure[:, None] * n + along[:, None] * t) * self.weights[some][:, None]
        return np.concatenate([(1 - part) * force, part * force, -(1 - there) * force,
                               -there * force], axis=1)  # fmt: skip

    def pushing(self, x):
        """What acts at x: points, facets, anchors (facet, part), slides, pressures, springs."""
        facet, part, gap = self.closest(x)
        some = np.flatnonzero(gap < 0)
        facet, part, gap = facet[some], part[some], gap[some]
        anchor, anchored = self.anchor[some], self.anchored[some]
        ends = x[self.master[anchor]]
        held = (1 - anchored)[:, None] * ends[:, 0] + anchored[:, None] * ends[:, 1]
        now = x[self.slave[some]]
        parts = self.parts[some][:, None]
        now = (1 - parts) * now[:, 0] + parts * now[:, 1]
        there = x[self.master[facet]], *x[self.master[self._around[facet]]].swapaxes(0, 1)
        t = turned(across(now, *there)[2])
        spring = self.stiffness * ((held - now) * t).sum(axis=1)
        limit = -self.mu * self.stiffness * gap
        slides = np.where(np.abs(spring) > limit, np.sign(spring), 0.0)
        turning = slides * self.before[some] < 0
        slides[turning] = 0.0  # by way of sticking
        self.turns = bool(turning.any())
        return some, facet, anchor, anchored, slides, spring, limit

    def remember(self, x):
        """Draw anchors along at the end of a load step."""
        facet, part, _ = self.closest(x)
        some, _, anchor, anchored, slides, _, limit = self.pushing(x)
        self.anchor, self.anchored = facet, part  # new arrays: a step may be taken back
        sticks = slides == 0
        self.anchor[some[sticks]] = anchor[sticks]
        self.anchored[some[sticks]] = anchored[sticks]
        for k, way, far in zip(some[~sticks], slides[~sticks], limit[~sticks], strict=True):
            self._place(x, k, way * far / self.stiffness)

    def _place(self, x, k, far):
        """The anchor of a point at a way along the master from where it is."""
        facet, part = self.anchor[k], self.anchored[k]
        while True:
            long = np.linalg.norm(x[self.master[facet, 1]] - x[self.master[facet, 0]])
            part = part + far / long
            past = part - 1 if part > 1 else min(part, 0)
            beyond = self.master[facet, 1 if past > 0 else 0]
            following = np.flatnonzero(self.master[:, 0 if past > 0 else 1] == beyond)
            if past == 0 or not len(following):
                break
            far, facet = past * long, following[0]
            part = 0.0 if past > 0 else 1.0
        self.anchor[k], self.anchored[k] = facet, part


def solved(given, limit=600.0, factor=1.0, round_=False):
    """Load steps of a `Setting`; a row as of `large_sliding_ccx.solved`."""
    points, solids, starts = [], [], [0]
    for k, (mesh, _) in enumerate(given.bodies):
        (block,) = mesh.cells
        shear, bulk = given.moduli(k)
        solids.append(Solid.of(mesh.points, block.nodes, starts[-1], shear, bulk, round_))
        points.append(mesh.points)
        starts.append(starts[-1] + len(mesh.points))
    at = np.concatenate(points)
    (k, slave), (other, master) = given.sides
    stiffness = factor * STIFF * min(young for _, young in given.bodies) / given.facet
    sides = Sides.of(slave + starts[k], master + starts[other], at, stiffness, given.mu, round_)
    held = [((starts[body] + nodes)[:, None] * 2 + parts).ravel()
            for body, nodes, parts in given.supports]  # fmt: skip
    body, nodes, ways = given.driven
    driven = ((starts[body] + nodes)[:, None] * 2 + np.arange(2)).ravel()
    free = np.ones(at.size, dtype=bool)
    free[np.concatenate([*held, driven])] = False
    u, forces, newton, worst, why, most = np.zeros(at.size), [], 0, 0.0, "", 0
    sides.remember(at)
    began, paused = time.process_time(), 0.0
    for number, (last, way) in enumerate(pairwise(ways), 1):
        moved = np.zeros(at.size)
        moved[driven] = (way - last).ravel()
        found = load_step(solids, sides, at, u, moved, free)
        if found is None:
            why = f"load step {number} is not solved"
            break
        u, rest, count = found
        newton, most = newton + count, max(most, count)
        x = at + u.reshape(-1, 2)
        began_pause = time.process_time()
        moved = [x[a:b] for a, b in pairwise(starts)]
        worst = max(worst, given.penetration(moved))
        paused += time.process_time() - began_pause
        forces.append(given.row(number, rest[driven].reshape(-1, 2)))
        if time.process_time() - began - paused > limit:
            why = "out of time"
            break
    return {"steps": len(forces), "newton": newton, "most": most,
            "seconds": time.process_time() - began - paused, "penetration": worst,
            "forces": forces, "reached": len(forces) / given.steps, "why": why}  # fmt: skip


def load_step(solids, sides, at, u, moved, free):
    """(u, residual, Newton steps) of a load step, in parts where that helps; None for none."""
    kept = sides.anchor, sides.anchored
    for parts in PARTS:
        now, steps, found = u, 0, None
        for _ in range(parts):
            found = equilibrium(solids, sides, at, now, moved / parts, free)
            if found is None:
                break
            now, rest, count = found
            sides.remember(at + now.reshape(-1, 2))
            steps += count
        if found is not None:
            return now, rest, steps
        sides.anchor, sides.anchored = kept
    return None


def equilibrium(solids, sides, at, u, moved, free):
    """(u, residual, Newton steps) after the driven nodes have moved; None where none is found.

    Where the whole penalty at once does not do, it grows, which finds out where it touches.
    """
    full, steps = sides.stiffness, 0
    for parts in ((1.0,), RAMP):
        now, change, solved = u, moved, False
        for part in parts:
            sides.stiffness = part * full
            now, rest, count, solved = newton(solids, sides, at, now, change, free, part == 1)
            steps, change = steps + count, None
        sides.stiffness = full
        if solved:
            return now, rest, steps
    return None


@np.errstate(all="ignore")  # cells turn inside out on the way: not finite, given up
def newton(solids, sides, at, u, moved, free, exact):
    """(u, residual, steps, whether it is solved) at one penalty; moved: None or what is."""
    for count in range(MOST):
        rest, matrix = assembled(solids, sides, at, u)
        size, scale = np.linalg.norm(rest[free]), max(np.linalg.norm(rest), 1e-3)
        small = size < (1e-9 if exact else 1e-3) * scale and not sides.turns
        if moved is None and small:
            return u, rest, count, True
        if not np.isfinite(size) or (count and size > 1e3):
            break
        change = np.zeros(at.size) if moved is None else moved
        right = -rest - matrix @ change
        try:
            change[free] = splu(matrix[free][:, free].tocsc()).solve(right[free])
        except RuntimeError:  # singular: far from where it should be
            break
        u, moved = u + change, None
    return u, rest, count, False


def assembled(solids, sides, at, u):
    """Residual (2 n,) and its matrix: forces of cells without those of the contact."""
    rest, entries = np.zeros(at.size), []
    moved = u.reshape(-1, 2)
    for solid in solids:
        count = len(solid.nodes)

        def force(v, solid=solid, count=count):
            return solid.forces(v.reshape(count, 4, 2)).reshape(count, 8)

        found, slopes = differences(force, moved[solid.nodes].reshape(count, 8))
        dofs = (solid.nodes[:, :, None] * 2 + np.arange(2)).reshape(count, 8)
        np.add.at(rest, dofs, found)
        entries.append((slopes, dofs, dofs))
    x = at + moved
    some, facet, anchor, anchored, slides, *_ = sides.pushing(x)
    sides.before[:] = 0
    sides.before[some] = slides
    if len(some):
        nodes = sides.nodes(some, facet, anchor)
        dofs = (nodes[:, :, None] * 2 + np.arange(2)).reshape(len(some), -1)

        def push(v):
            return -sides.forces(v, some, facet, anchor, anchored, slides)

        found, slopes = differences(push, x.ravel()[dofs])
        np.add.at(rest, dofs[:, :8], found)
        entries.append((slopes, dofs[:, :8], dofs))
    data = np.concatenate([s.ravel() for s, _, _ in entries])
    rows = [np.broadcast_to(r[:, :, None], s.shape).ravel() for s, r, _ in entries]
    columns = [np.broadcast_to(c[:, None], s.shape).ravel() for s, _, c in entries]
    row, column = np.concatenate(rows), np.concatenate(columns)
    return rest, sparse.csr_array((data, (row, column)), shape=(at.size, at.size))


def meridian(fine=1, parts=1):
    """The tube and the pin of `large_sliding_more.pressed_in` as bodies of rotation.

    The limit of ever more facets around.  Slave is the tube, all of which faces the pin.
    """
    tube = am.box((0.5, 1.5), (2 * fine, 10 * fine), origin=(1.0, 0.0))
    pin = am.box((0.5, 1.5), (2 * fine, 9 * fine), origin=(0.0, -1.6))
    points = pin.points.copy()
    points[:, 0] = 0.5 + 2 * points[:, 0] * (taper(points[:, 1]) - 0.5)
    pin = replace(pin, points=points)
    steps, nodes = 40 * parts, pin.surface_nodes("bottom")
    ways = np.zeros((steps + 1, len(nodes), 2))
    ways[:, :, 1] = 1.2 * np.arange(steps + 1)[:, None] / steps
    sides = (0, corners(tube, "left")), (1, corners(pin, "right"))
    return Setting(((tube, 1.0), (pin, 10.0)), ((0, tube.surface_nodes("top"), [1]),),
                   (1, nodes, ways), sides, 0.1, 0.3)  # fmt: skip
