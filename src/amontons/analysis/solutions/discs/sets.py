"""Friction discs in uniqueness proofs: where quadratic forms have to be negative, and are.

A proof compares any solution with a reference, d = z - z0 per contact with z = (r, u), or takes
(z, 1) where there is none.  With a >= 0 and the apex g = -z0 (or the last unit vector) all
d = c + a g, c in the friction law, which consists of

    free   r = 0,  u_N >= 0, any u_T
    stick  u = 0,  |r_T| <= mu r_N
    slip   u_N = 0,  r_N >= 0,  r_T = -mu r_N e,  u_T = s e,  s >= 0,  e on a circle or arc.

A form d^T V d <= 0 on all of these is what the proof asks for.  With G the generators of a
status it is a matrix inequality: -G^T V G minus products of numbers that are >= 0 is positive
semidefinite; for stick these products come from the cone |x| <= x_0 (S-lemma), for slip the
matrix of one e is copositive, and e takes samples of the arc; `negative_on_arc` then proves it
between the samples.

Where z0 itself slips along e0, generators at e near e0 are nearly parallel.  With psi half the
angle from e0 to e and t normal to the direction half-way,

    -z0 = -r_N0 c1(e) - s0 c2(e) + sin(psi) k(psi),   k = (0, -2 mu r_N0 t, 0, 2 s0 t),

c1, c2 the generators of r_N and s: the span of c1, c2, k holds them all, also at psi = 0.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from ....core.clock import NEVER, Deadline
from ...statuses import States, states_of
from ...tolerances import ON, SUMMED
from ..groups import Form

Array = NDArray[np.float64]
SAMPLES = 16  # directions of a full circle
FEWEST = 6  # of an arc: a form of e has five coefficients
INTERVALS, PARTS, DIVISIONS = 96, 12, 5  # of directions: at first, of one, how often divided
MOST = 20_000  # intervals at a time
LOOK = (3e6, 5e4)  # operations of a look at intervals, and of each
NEAR = 0.3  # rad from e0 within which the span replaces the cone


@dataclass(frozen=True)
class Region:
    """What one contact may do: statuses of `letter`, slip within half of `middle`.

    letter: . any, c closed, f free, s stick, l slip; in 2D l both ways, + or - one.
    """

    letter: str = "."
    middle: float = 0.0
    half: float = np.pi

    @property
    def statuses(self) -> str:
        """The statuses that it holds."""
        return {".": "fsl", "c": "sl"}.get(self.letter, self.letter)

    def angles(self, extra: tuple[float, ...] = ()) -> Array:
        """Directions of slip at which the form is asked for."""
        if self.half >= np.pi:
            own = self.middle + 2 * np.pi * np.arange(SAMPLES) / SAMPLES
        else:
            count = max(FEWEST, int(np.ceil(self.half / np.pi * SAMPLES)) + 1)
            own = np.linspace(self.middle - self.half, self.middle + self.half, count)
        return np.concatenate([own, extra])


Regions = tuple[Region, ...]


def states_of_regions(regions: Sequence[Region]) -> States:
    """The states (nc,) of regions, arcs disregarded."""
    return states_of("".join(region.letter for region in regions))


@dataclass(frozen=True, eq=False)
class Law:
    """The law of one contact seen from a reference z0 (6,), or from nothing (None)."""

    mu: float
    z0: Array | None

    @property
    def size(self) -> int:
        """6, or 7 without a reference."""
        return 7 if self.z0 is None else 6

    @property
    def apex(self) -> Array | None:
        """g at length 1, None where z0 is zero."""
        if self.z0 is None:
            return np.eye(7)[6]
        return None if np.abs(self.z0).max() <= ON else -self.z0 / np.linalg.norm(self.z0)

    def relative(self, error: float) -> float:
        """Error of g where that of z0 is `error`."""
        return 0.0 if self.z0 is None else 2 * error / max(float(np.linalg.norm(self.z0)), ON)

    @property
    def direction(self) -> float | None:
        """Angle of e0 where z0 slips, or is at the border of slipping, else None."""
        if self.z0 is None or self.mu == 0:
            return None
        r, u = self.z0[:3], self.z0[3:]
        slips = abs(u[0]) <= ON and np.hypot(*r[1:]) >= self.mu * r[0] - ON
        moves = u[1:] if np.hypot(*u[1:]) > self.mu * r[0] else -r[1:]
        return float(np.arctan2(moves[1], moves[0])) if slips and moves.any() else None

    def holds(self, status: str) -> bool:
        """True where z0 has that status: then d has no sign."""
        if self.z0 is None:
            return False
        r, u = self.z0[:3], self.z0[3:]
        if status == "f":
            return bool(np.abs(r).max() <= ON)
        if status == "s":
            return bool(np.abs(u).max() <= ON)
        return bool(abs(u[0]) <= ON and self.mu == 0)  # else by direction

    def lies_in(self, region: Region) -> bool:
        """True where the reference lies in a closed region; also where there is none."""
        if self.z0 is None or region.letter == ".":
            return True
        if region.letter in "fs":
            return self.holds(region.letter)
        r, u = self.z0[:3], self.z0[3:]
        if self.mu == 0 or region.letter == "c":
            return bool(abs(u[0]) <= ON)
        if self.direction is None:
            return False
        if np.abs(r).max() <= ON and np.abs(u).max() <= ON:
            return True
        apart = abs((self.direction - region.middle + np.pi) % (2 * np.pi) - np.pi)
        return bool(apart <= region.half + ON)

    # ---------------------------------------------------------------- generators
    def slip(self, angle: Array, order: int = 0) -> tuple[Array, Array]:
        """(c1, c2, g) and (c1, c2, k) at e, (j, size, 2 or 3), or their derivatives."""
        turned = angle + order * np.pi / 2
        c, s = np.cos(turned), np.sin(turned)
        G = np.zeros((len(angle), self.size, 3))
        G[:, 0, 0], G[:, 1, 0], G[:, 2, 0] = order == 0, -self.mu * c, -self.mu * s
        G[:, 4, 1], G[:, 5, 1] = c, s
        span, apex = G.copy(), self.apex
        if apex is None:
            return G[:, :, :2], span[:, :, :2]
        if order == 0:
            G[:, :, 2] = span[:, :, 2] = apex
        if self.direction is not None and self.z0 is not None:
            psi = (angle - self.direction) / 2 + order * np.pi / 2
            t = np.array([-np.sin(self.direction + psi), np.cos(self.direction + psi)]).T
            across = np.array([-self.mu * self.z0[0], np.hypot(*self.z0[4:])])
            t = 0.5**order / np.linalg.norm(across) * t
            span[:, :, 2] = 0
            span[:, 1:3, 2], span[:, 4:6, 2] = across[0] * t, across[1] * t
        return G, span


def _wrapped(angle: Array) -> Array:
    """Angles in (-pi, pi]."""
    return np.pi - (np.pi - angle) % (2 * np.pi)


# ------------------------------------------------------------- matrix inequalities
def forms_of(
    law: Law, region: Region, rows: list[int], extra: tuple[float, ...] = ()
) -> list[Form]:
    """Where a form V on the given rows of d has to be negative; extra: more directions."""
    axes, out = np.eye(law.size), []
    apex = [] if law.apex is None else [law.apex]

    def add(columns: list[Array], *, inside: bool = False, disc: bool = False) -> None:
        """Generators, and an apex unless the reference is inside."""
        more = [] if inside else apex
        pairs = ((0, len(columns)),) if more and not disc else ()
        G = np.column_stack([*columns, *more])
        out.append(Form(G[rows], pairs, disc and not inside))

    if "f" in region.statuses:
        add([axes[3], axes[4], axes[5]] if 4 in rows else [axes[3]], inside=law.holds("f"))
    if law.mu == 0 and region.letter != "f":
        add([axes[0], axes[4], axes[5]], inside=law.holds("l"))
        return out
    if "s" in region.statuses:
        disc = [axes[0], law.mu * axes[1], law.mu * axes[2]]
        add(disc, inside=law.holds("s"), disc=True)
    if "l" in region.statuses:
        angles = region.angles(extra)
        for angle, cone, span in zip(angles, *law.slip(angles), strict=True):
            near = law.direction is not None and abs(_wrapped(angle - law.direction)) <= NEAR
            pairs = () if near else tuple(combinations(range(cone.shape[1]), 2))
            out.append(Form((span if near else cone)[rows], pairs))
    return out


# ------------------------------------------------------------------ proof on an arc
def negative_on_arc(
    law: Law, region: Region, V: Array, uncertainty: float, deadline: Deadline = NEVER
) -> float | None:
    """None when d^T V d < 0 is proved for all slip of a region, else an angle where it is not.

    Between two directions a form is at least the mean of its values there less what its second
    derivative bends it; means of copositive matrices are copositive.  uncertainty: of z0.
    deadline: where operations are counted.
    """
    first, last = region.middle - region.half, region.middle + region.half
    count = max(2, int(np.ceil(region.half / np.pi * INTERVALS)) + 1)
    ends = np.linspace(first, last, count)
    intervals = np.column_stack([ends[:-1], ends[1:]])
    for _ in range(DIVISIONS):
        deadline.spend(LOOK[0] + LOOK[1] * len(intervals))
        good, wrong = _negative_between(law, intervals, V, uncertainty)
        if wrong is not None or good.all():
            return wrong
        low, high = intervals[~good].T
        share = np.linspace(0, 1, PARTS + 1)
        ends = low[:, None] + (high - low)[:, None] * share
        intervals = np.column_stack([ends[:, :-1].ravel(), ends[:, 1:].ravel()])
        if len(intervals) > MOST:
            break
    return float(intervals[0, 0])


def _negative_between(
    law: Law, intervals: Array, V: Array, uncertainty: float
) -> tuple[NDArray[np.bool_], float | None]:
    """(which intervals of directions, (j, 2), are proved; a direction at which V fails)."""
    size = float(np.linalg.norm(V))
    uncertainty = 0.0 if law.z0 is None else uncertainty
    width = float(np.diff(intervals, axis=1).max())
    good = np.zeros(len(intervals), dtype=bool)
    hopeful = np.zeros(2 * len(intervals), dtype=bool)
    for kind, test in enumerate((copositive, definite)):
        left = intervals[~good]
        G = law.slip(left.ravel())[kind]
        middle = [law.slip(left.mean(axis=1), order)[kind] for order in range(4)]
        bend = _most_bent(V, middle, width, size)
        norm = float(np.linalg.norm(G, axis=(1, 2)).max())
        margin = np.repeat(bend * width**2 / 8, 2)
        margin += size * (2 * norm * uncertainty + SUMMED * norm**2)
        Q = -np.swapaxes(G, 1, 2) @ V @ G
        hopeful[np.repeat(~good, 2)] |= test(Q)
        holds = test(Q - margin[:, None, None] * np.eye(G.shape[2]))
        good[~good] = holds.reshape(-1, 2).all(axis=1)
        if good.all():
            return good, None
    bad = np.repeat(~good, 2) & ~hopeful
    return good, float(intervals.ravel()[np.argmax(bad)]) if bad.any() else None


def _most_bent(V: Array, G: list[Array], width: float, size: float) -> Array:
    """Bound above of the second derivative of -G^T V G on intervals of a width, (j,).

    G: derivatives of order 0 to 3 in the middles, whose norms bound those anywhere.
    """
    turned = np.swapaxes(G[2], 1, 2) @ V @ G[0]
    second = -(turned + np.swapaxes(turned, 1, 2) + 2 * np.swapaxes(G[1], 1, 2) @ V @ G[1])
    n = [float(np.linalg.norm(part, axis=(1, 2)).max()) for part in G]
    third = 2 * size * (n[0] * n[3] + 3 * n[1] * n[2])
    return np.maximum(np.linalg.eigvalsh(second)[:, -1], 0) + third * width / 2


def definite(Q: Array) -> NDArray[np.bool_]:
    """Which symmetric Q (j, s, s) are positive definite."""
    minors = [np.linalg.det(Q[:, :k, :k]) for k in range(1, Q.shape[1] + 1)]
    return np.all(np.array(minors) > 0, axis=0)


def copositive(Q: Array) -> NDArray[np.bool_]:
    """Which symmetric Q (j, s, s), s <= 3, have x Q x >= 0 for all x >= 0 (Hadeler)."""
    if Q.shape[1] < 3:
        full = np.tile(np.eye(3), (len(Q), 1, 1))
        full[:, : Q.shape[1], : Q.shape[1]] = Q
        Q = full
    diagonal = np.einsum("jii->ji", Q)
    a, b, c = np.sqrt(np.maximum(diagonal, 0)).T
    ab, ac, bc = Q[:, 0, 1] + a * b, Q[:, 0, 2] + a * c, Q[:, 1, 2] + b * c
    last = a * b * c + Q[:, 0, 1] * c + Q[:, 0, 2] * b + Q[:, 1, 2] * a
    pairs = (ab >= 0) & (ac >= 0) & (bc >= 0) & (diagonal >= 0).all(axis=1)
    return pairs & (last + np.sqrt(np.maximum(2 * ab * ac * bc, 0)) >= 0)
