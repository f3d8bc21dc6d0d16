"""How far the reactions of one motion differ: attained values of each, and bounds of all.

From the centre of the face (`face`) the direction that raises a component most, relative to
the barrier, is followed to the edge both ways; every reaction met on the way counts for all
contacts.  So `low` and `high` are attained.  Few contacts are done exactly, by two linear
programs per normal reaction: over a polygon inside the cone (attained, in 2D exact), and over
one around it, which bounds it.  Other bounds come from the multipliers of the centre.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ...core.clock import Deadline
from ...core.errors import TimeUp
from .face import Face, centred, longest, lp_work, polygon

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
SIDES = 16  # of polygons in the place of discs: 2 % of the radius
MOVES = 1e-7  # of the largest entry of random directions, below which a contact is determined
BATCH = 32  # directions followed at a time
SHORT = 0.999  # of the way to the edge: attained strictly
SAMPLES = 3  # random directions that tell which contacts are determined
SPREAD = 1e-6  # range, of the largest reaction, that counts as a difference
PROGRAMS = 0.5  # part of the time for linear programs


@dataclass(frozen=True, eq=False)
class ReactionRanges:
    """What a motion leaves open of its reactions, all in the unit of the problem.

    dimension: free numbers among the reactions; sure: False where rounding leaves it open, or
    contacts stick at the edge of their cones (then it is at least that).  open (nc,): contacts
    whose reaction is not determined.  low, high (nc, d): values that are attained, by whole
    states of reactions with the same motion; they differ at `open` contacts alone.  exact
    (nc,): normal ranges from linear programs, in 3D within 2 % of mu r_N.  most (nc,): no
    normal reaction with this motion is larger; inf where that is not known.  other (nc, d): the
    attained state farthest from the given one.  Where contacts stick at the edge of their
    cones, or their status is open, nothing is exact and most is inf.
    """

    dimension: int
    sure: bool
    open: Mask
    low: Array
    high: Array
    exact: Mask
    most: Array
    other: Array

    @property
    def spread(self) -> Array:
        """high - low of normal reactions, relative to the largest reaction, (nc,)."""
        largest = float(np.abs(self.high[:, 0]).max(initial=0.0)) or 1.0
        return (self.high - self.low)[:, 0] / largest

    @property
    def largest(self) -> float:
        """Largest range of a component, relative to the largest reaction."""
        size = float(np.linalg.norm(self.high, axis=1).max(initial=0.0)) or 1.0
        return float((self.high - self.low).max(initial=0.0)) / size


def reaction_ranges(face: Face, r: Array, deadline: Deadline) -> ReactionRanges:
    """Ranges of the reactions of the motion of r (nc, d); ends in time with what is attained.

    Raises TimeUp where not even the dimension is there in time.
    """
    rank = face.rank(deadline)
    nc, d = r.shape
    dimension = face.unknowns - rank.value
    sure = rank.least == rank.value and not face.edge
    nothing = np.zeros(nc, dtype=bool)
    found = ReactionRanges(dimension, sure, nothing, r.copy(), r.copy(), nothing.copy(),
                           np.full(nc, np.inf), r)  # fmt: skip
    if dimension == 0:
        return found if face.edge else replace(found, most=r[:, 0].copy())
    walk = _Walk(face, found, d)
    try:
        walk.begin(deadline)
        walk.along_all(deadline)
        walk.by_programs(deadline.share(PROGRAMS))
    except TimeUp:
        pass
    return walk.found()


class _Walk:
    """Reactions attained so far, least and largest of every component."""

    def __init__(self, face: Face, begun: ReactionRanges, d: int) -> None:
        self.face, self.begun, self.d = face, begun, d
        self.c = face.c0
        self.low, self.high = face.c0.copy(), face.c0.copy()
        self.far, self.distance = face.c0, 0.0
        self.s: Array | None = None
        self.bounded = False
        nc = len(begun.open)
        self.open, self.exact = np.zeros(nc, dtype=bool), np.zeros(nc, dtype=bool)
        self.most = np.full(nc, np.inf)
        self.owner = np.concatenate([face.stick.repeat(d), face.slip])

    @property
    def _normal(self) -> Mask:
        """Which c are normal reactions, (k,)."""
        each = np.arange(self.face.unknowns)
        return (each >= len(self.face.stick) * self.d) | (each % self.d == 0)

    def begin(self, deadline: Deadline) -> None:
        """The centre, and which contacts are determined."""
        face = self.face
        self.c, self.s, self.bounded = centred(face, deadline)
        self.inverse = face.inverse_hessian(self.c)
        self.solve = face.solver(self.inverse, deadline)
        if self.solve is None:
            raise TimeUp("stopped: the balance can not be factorised")
        random = np.random.default_rng(0)
        g = random.standard_normal((face.unknowns, SAMPLES))
        root = np.sqrt(self.inverse.diagonal())
        p = face.balanced(self.inverse, self.solve, g / root[:, None])
        moves = np.abs(p).max(axis=1) / root
        free = moves > MOVES * max(float(moves.max(initial=0.0)), 1e-300)
        self.free = free
        self.open[self.owner[free]] = True
        self._follow(p)
        self._bound()

    def _bound(self) -> None:
        """r_N <= s.c0 / (s_N - mu |s_T|) from the multipliers of the centre."""
        if self.s is None:
            return
        face = self.face
        normal, tangent, slip = (part[..., 0] for part in face.parts(self.s[:, None]))
        total = float(self.s @ face.c0) * face.unit
        room = np.concatenate([normal - face.mu * np.linalg.norm(tangent, axis=1), slip])
        terms = np.abs(self.s) @ np.abs(face.c0) * face.unit * face.unknowns * 1e-15
        if total > 0 and (room > 1e-9 * np.abs(self.s).max()).all():
            self.most[np.concatenate([face.stick, face.slip])] = (total + terms) / room

    def along_all(self, deadline: Deadline) -> None:
        """Every free component in turn, normals first, those of the largest steps first."""
        face, k, first = self.face, self.face.unknowns, self._normal
        for group in (np.flatnonzero(self.free & first), np.flatnonzero(self.free & ~first)):
            for begin in range(0, len(group), BATCH):
                chosen = group[begin : begin + BATCH]
                deadline.pay(1e4 * k + 200.0 * BATCH * k)
                g = np.zeros((k, len(chosen)))
                g[chosen, np.arange(len(chosen))] = 1.0
                self._follow(face.balanced(self.inverse, self.solve, g))

    def _follow(self, p: Array) -> None:
        """To the edge along p (k, b), both ways."""
        for sign in (1.0, -1.0):
            reach = longest(self.face, self.c, sign * p)
            ends = self.c[:, None] + (SHORT * np.minimum(reach, 1e6)) * sign * p
            self._take(ends)

    def _take(self, ends: Array) -> None:
        """Count states of reactions c (k, b)."""
        self.low = np.minimum(self.low, ends.min(axis=1, initial=np.inf))
        self.high = np.maximum(self.high, ends.max(axis=1, initial=-np.inf))
        apart = np.linalg.norm(ends - self.face.c0[:, None], axis=0)
        if len(apart) and apart.max() > self.distance:
            self.distance = float(apart.max())
            self.far = ends[:, apart.argmax()].copy()

    def by_programs(self, deadline: Deadline) -> None:
        """Linear programs for the normal reactions, the widest ranges first."""
        from scipy.optimize import linprog

        face, d = self.face, self.d
        s = len(face.stick) * d
        normals = np.flatnonzero(self.free & self._normal)
        normals = normals[np.argsort(-(self.high - self.low)[normals], kind="stable")]
        inner, outer = (polygon(face, SIDES, outside=side) for side in (False, True))
        equal = sparse.csr_array(face.A)
        right = equal @ face.c0
        bounds = [(None, None)] * s + [(0.0, None)] * len(face.slip)
        shapes = (inner,) if d == 2 else (inner, outer)
        for k in normals:
            deadline.pay(2 * len(shapes) * lp_work(inner, equal))
            contact, known = self.owner[k], True
            for G in shapes:
                for sign in (1.0, -1.0):
                    cost = np.zeros(face.unknowns)
                    cost[k] = -sign
                    found = linprog(cost, G, np.zeros(G.shape[0]), equal, right, bounds,
                                    method="highs-ipm")  # fmt: skip
                    known &= found.status in (0, 3)
                    if found.status == 0 and G is inner:
                        self._attain(k, np.asarray(found.x), sign)
                    if found.status == 0 and G is shapes[-1] and sign > 0:
                        top = float(found.x[k]) * face.unit * (1 + 1e-6)
                        self.most[contact] = min(self.most[contact], top)
                    if found.status == 3 and G is inner:
                        (self.high if sign > 0 else self.low)[k] = sign * np.inf
            self.exact[contact] = known

    def _attain(self, k: int, c: Array, sign: float) -> None:
        """An end of the range of c_k by a program; strictly inside beside it, a whole state."""
        self._take((self.c + SHORT * (c - self.c))[:, None])
        if sign > 0:
            self.high[k] = max(self.high[k], c[k])
        else:
            self.low[k] = min(self.low[k], max(c[k], 0.0))

    def found(self) -> ReactionRanges:
        """What is known by now."""
        begun, face, d = self.begun, self.face, self.d
        low, high = begun.low.copy(), begun.high.copy()
        s = len(face.stick) * d
        low[face.stick] = self.low[:s].reshape(-1, d) * face.unit
        high[face.stick] = self.high[:s].reshape(-1, d) * face.unit
        ray = face.reactions(np.concatenate([np.zeros(s), np.ones(len(face.slip))]))[face.slip]
        ends = np.stack([self.low[s:, None] * ray, self.high[s:, None] * ray])
        low[face.slip], high[face.slip] = ends.min(axis=0), ends.max(axis=0)
        same = ~self.open
        low[same], high[same] = begun.low[same], begun.high[same]
        low[:, 0] = np.maximum(low[:, 0], 0.0)
        if face.edge:  # the face is but a part of what the motion leaves open
            return replace(begun, open=self.open, low=low, high=high,
                           other=face.reactions(self.far))  # fmt: skip
        determined = same & np.isin(np.arange(len(same)), self.owner)
        self.most[determined] = np.minimum(self.most, begun.high[:, 0])[determined]
        off = np.setdiff1d(np.arange(len(same)), self.owner)
        self.most[off] = begun.high[off, 0]
        return replace(begun, open=self.open, low=low, high=high, exact=self.exact,
                       most=self.most, other=face.reactions(self.far))  # fmt: skip
