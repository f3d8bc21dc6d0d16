"""Bounds on the load at which rigid blocks in frictional contact give way.

Loads dead + x live, x growing from 0; G r + dead + x live = 0 is the balance of all rigid
motions w of the blocks, u = G^T w.  Coulomb's slip is not normal to its cone (no dilatancy), so
that the load at which a motion first can begin lies below the one of limit analysis:

- upper: the largest x with balance inside of the cones ([D], static theorem).  Beyond it no r
  exists at all, which the motion w of the dual program proves.
- lower: let r^ be in balance inside of the cones at x, and (r, w) any state of motion there:
  u_N >= 0, r_N u_N = 0, r_T = -mu r_N u_T / |u_T|.  Then (r^ - r).u = 0 says

      sum r^_N u_N + sum over faces (r^_T . u_T + mu r_N |u_T|) = 0,                      (1)

  a face being the contacts whose tangential motions are the same for all w, with sums of r_T
  and r_N.  Where |r^_T| <= mu least(r_N) on every face, least over all r in balance inside of
  the cones, all terms are zero: a face does not slip if that is strict, u_N = 0 if r^_N > 0.
  If no w but 0 does that (a rank), no motion begins at x.

The least r_N of a face is one linear program each.  They are taken over intervals of x, with r^
in between linear, from 0 up to the first that can not be excluded: `lower`.  Where blocks rock
rather than slide both meet.  In the plane `begins` bounds the load in between at which a motion
that the live load drives can begin.  Linear programs keep to their constraints within 1e-7 of
the loads; inequalities have to hold by STRICT.

[D] D. C. Drucker, "Coulomb friction, plasticity, and limit loads", J. Appl. Mech. 21 (1954);
masonry: R. K. Livesley, Int. J. Numer. Methods Engrg. 12 (1978) 1853-1871.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ...core.arrays import expect_shape, finite
from ...core.clock import Deadline, deadline_of, now
from ...core.errors import InvalidInput, UnsupportedLaw
from ...core.faces import Told
from ...problem.friction import Form, FrictionProblem
from ...problem.law import Coulomb
from ..hyperstatic.face import lp_work
from .begins import Assembly, Begins, begins

Array = NDArray[np.float64]
SIDES = 48  # of the polygons that stand for discs in 3D
GAP = 2e-3  # relative distance of both bounds at which the search ends
WORK = 60.0  # seconds by default
STRICT = 1e-6  # of loads, by which inequalities hold strictly: above what programs tolerate
BEGINS = 0.6  # part of the time for the load at which motions begin
FEWEST = 1e-4  # part of the upper bound below which intervals are not divided


@dataclass(frozen=True, eq=False, repr=False)
class Collapse(Told):
    """Bounds on the factor of the live load at which blocks begin to move.

    lower: below it nothing moves; upper: there is no balance beyond it; both are proved.  r
    (nc, d): balance at `upper`; motion (n,): the proof that there is none beyond it, rates of
    the unknowns; balanced: whether there is any balance without live load.  begins: bounds on
    the load at which a motion that the live load drives can begin; None in 3D.
    """

    lower: float
    upper: float
    r: Array | None
    motion: Array | None
    balanced: bool
    programs: int
    seconds: float
    reason: str
    begins: Begins | None = None

    @property
    def width(self) -> float:
        """(upper - lower) / upper, 1 where nothing limits the load."""
        if not np.isfinite(self.upper):
            return 1.0
        return (self.upper - self.lower) / self.upper if self.upper > 0 else 0.0

    @property
    def record(self) -> dict[str, Any]:
        """For JSON."""
        return {
            "lower": self.lower, "upper": self.upper if np.isfinite(self.upper) else None,
            "width": self.width, "balanced": self.balanced,
            "programs": self.programs, "seconds": self.seconds, "reason": self.reason,
            "r": None if self.r is None else self.r.tolist(),
            "motion": None if self.motion is None else self.motion.tolist(),
            "begins": None if self.begins is None else self.begins.record,
        }  # fmt: skip

    def __str__(self) -> str:
        if not self.balanced:
            return f"no balance without live load: {self.reason}"
        told = "" if self.begins is None else f" {self.begins}"
        return (
            f"nothing moves below {self.lower:.6g} times the live load, and there is no "
            f"balance beyond {self.upper:.6g}.{told} {self.reason}"
        )


def collapse_load(
    problem: FrictionProblem, live: Any, *, gap: float = GAP, time_limit: Any = None
) -> Collapse:
    """Bounds on the factor of a live load, see the module.

    problem: in global form; its f is the dead load and its rigid motions, those that M does not
    resist, those of the blocks (all unknowns where M resists all, as a mass does).  live (n,).
    gap: relative distance of the bounds that is good enough; time_limit: seconds.  Raises
    UnsupportedLaw unless the law is Coulomb's, InvalidInput in the Delassus form.
    """
    if problem.form is not Form.GLOBAL:
        raise InvalidInput("collapse: expected the global form, M, H, f and w; this is W and q")
    if not isinstance(problem.law, Coulomb):
        raise UnsupportedLaw(f"collapse: expected Coulomb friction, got {problem.law.name}")
    live = finite("live", live, 1)
    expect_shape("live", live.shape, (problem.unknowns,))
    began, deadline = now(), deadline_of(time_limit, WORK)
    blocks = _Blocks(problem, live, deadline)
    found = blocks.largest()
    if found is None:
        return Collapse(0.0, 0.0, None, None, False, 1, now() - began,
                        "even the dead load has none inside of the friction cones")  # fmt: skip
    upper, r, motion = found
    if upper == np.inf:
        return Collapse(0.0, np.inf, None, None, True, 1, now() - began,
                        "Any live load is balanced.")  # fmt: skip
    first = blocks.begins(upper, r, gap)
    lower, reason = blocks.lower(upper, gap, deadline)
    lower, upper = min(lower, upper) * blocks.factor, upper * blocks.factor
    if first is not None:  # what nothing begins below, the live load does not begin either
        first = replace(first, lower=min(max(first.lower, lower), first.upper))
    return Collapse(lower, upper, r, motion, True, blocks.programs, now() - began, reason,
                    first)  # fmt: skip


class _Blocks:
    """The linear programs in r (nc, d) and x, of the balance of rigid motions.

    Both loads have size one in them: else a live load much smaller than the dead one is less
    than what programs keep to, and would seem to be balanced whatever its factor.
    """

    def __init__(self, problem: FrictionProblem, live: Array, deadline: Deadline) -> None:
        self.deadline = deadline
        self.nc, self.d, self.mu = problem.contacts, problem.dimension, problem.mu
        H = sparse.csr_array(problem.H)
        modes = problem.loose_modes
        self.modes = modes if modes.shape[1] else None
        G: Any = sparse.csr_array(modes.T @ H) if modes.shape[1] else H
        given: Any = problem.f, live
        dead, live = (modes.T @ x if modes.shape[1] else x for x in given)
        self.size, unit = (float(np.abs(x).max(initial=0)) or 1.0 for x in (dead, live))
        self.factor = self.size / unit  # of the live load, by one of which the programs count
        self.G, self.dead, self.live = G, dead / self.size, live / unit
        self.programs = 0
        normal = np.arange(self.nc) * self.d
        self.normal = normal
        self.face = _faces(sparse.csc_array(G), self.d, self.nc)
        self.count = int(self.face.max(initial=-1)) + 1
        self.inner, self.outer = (self._cone(s) for s in ("inner", "outer"))

    def _cone(self, kind: str) -> sparse.csr_array:
        """Rows A with A r <= 0 for r in a polygon inside or outside of the cone."""
        turn = np.array([[1.0], [-1.0]])
        shrink = 1.0
        if self.d == 3:
            angle = 2 * np.pi * (np.arange(SIDES) + 0.5) / SIDES
            turn = np.column_stack([np.cos(angle), np.sin(angle)])
            shrink = np.cos(np.pi / SIDES) if kind == "inner" else 1.0
        each = np.column_stack([np.zeros(len(turn)), turn])
        rows = sparse.kron(sparse.eye_array(self.nc), each, format="lil")
        for i in range(self.nc):
            rows[i * len(turn) : (i + 1) * len(turn), self.normal[i]] = -shrink * self.mu[i]
        return sparse.csr_array(rows)

    def _program(
        self, c: Array, cone: sparse.csr_array, interval: tuple[float, float],
        more: tuple[Any, Array] | None = None, extra: int = 0,
    ) -> Any:  # fmt: skip
        """linprog in (r, x, extra) under balance, cone and x in an interval."""
        from scipy.optimize import linprog

        self.programs += 1
        self.deadline.spend(lp_work(cone, self.G))
        m = self.nc * self.d
        none = sparse.csr_array((self.G.shape[0], extra))
        balance = sparse.hstack([self.G, self.live[:, None], none], format="csr")
        A = sparse.hstack([cone, sparse.csr_array((cone.shape[0], 1 + extra))], format="csr")
        b = np.zeros(A.shape[0])
        if more is not None:
            A, b = sparse.vstack([A, more[0]], format="csr"), np.concatenate([b, more[1]])
        bounds = np.tile([-np.inf, np.inf], (m + 1 + extra, 1))
        bounds[self.normal, 0] = 0.0
        bounds[m] = interval
        return linprog(c, A, b, balance, -self.dead, bounds, method="highs")

    def largest(self) -> tuple[float, Array, Array] | None:
        """(x, r, motion) of limit analysis; x is infinite where nothing limits it."""
        m = self.nc * self.d
        c = np.zeros(m + 1)
        c[m] = -1.0
        found = self._program(c, self.outer, (0.0, np.inf))
        if found.status == 3:
            return np.inf, np.zeros(0), np.zeros(0)
        if found.status != 0:
            return None
        w = np.asarray(found.eqlin.marginals)
        motion = w if self.modes is None else self.modes @ w
        r = self.size * found.x[:m].reshape(self.nc, self.d)
        return float(found.x[m]), r, motion

    def begins(self, most: float, r: Array, gap: float) -> Begins | None:
        """Bounds on the load at which a motion begins that the live load drives, in 2D."""
        if self.d != 2:
            return None
        plane = Assembly(self.G, self.dead, self.live, self.mu, self.face)
        found = begins(plane, most, r / self.size, self.deadline.share(BEGINS), gap)
        found = replace(found, lower=found.lower * self.factor, upper=found.upper * self.factor)
        if found.r is None or found.w is None:
            return found
        w = found.w if self.modes is None else self.modes @ found.w
        return replace(found, r=found.r * self.size, w=w * (self.factor / self.size))

    def lower(self, upper: float, gap: float, deadline: Deadline) -> tuple[float, str]:
        """(the largest x up to which no motion can begin, what is to be said)."""
        begin, width = 0.0, 0.25 * upper
        goal = upper * (1 - gap)
        ends: dict[float, Array | None] = {}
        why = ""
        while begin < goal:
            if deadline.passed:
                return begin, "The search was not over in time."
            end = min(begin + width, goal)
            why = self._excluded(begin, end, ends)
            if not why:
                begin, width = end, 2 * width
                continue
            width = 0.5 * (end - begin)
            if width < min(FEWEST, 0.25 * gap) * upper:
                return begin, f"Beyond the lower bound {why}."
        return begin, "Faces that slide leave no doubt: blocks rock, or slide as they must."

    def _excluded(self, a: float, b: float, ends: dict[float, Array | None]) -> str:
        """"" where no motion can begin at x from a to b, else what may."""
        least = np.array([self._least(face, a, b) for face in range(self.count)])
        if np.isnan(least).any():
            return "a linear program failed"
        for x in (a, b):
            state = self._inside(x, least)
            if state is None:
                return "a face may slide"
            ends[x] = state
        both = np.minimum(ends[a][:, 0], ends[b][:, 0])  # type: ignore[index]
        if self._moves(both > STRICT, (self._room(least) > 0)[self.face]):
            return "blocks may slide, or turn about contacts without pressure"
        return ""

    def _least(self, face: int, a: float, b: float) -> float:
        """The least sum of r_N of a face over all balances at x from a to b."""
        c = np.zeros(self.nc * self.d + 1)
        c[self.normal[self.face == face]] = 1.0
        found = self._program(c, self.outer, (a, b))
        return max(float(found.fun), 0.0) if found.status == 0 else np.nan

    def _room(self, least: Array) -> Array:
        """What |r^_T| of every face may be, (faces,): 0 where it may lose all pressure."""
        mu = np.array([self.mu[self.face == f].min() for f in range(self.count)])
        return np.maximum(mu * least * (1 - 1e-6) - STRICT, 0.0)

    def _inside(self, x: float, least: Array) -> Array | None:
        """r^ (nc, d) at x, |r^_T| of faces within mu least, pressures as even as can be."""
        m, d = self.nc * self.d, self.d
        room = self._room(least)
        turn = np.array([[1.0], [-1.0]])
        shrink = 1.0
        if d == 3:
            angle = 2 * np.pi * (np.arange(SIDES) + 0.5) / SIDES
            turn, shrink = np.column_stack([np.cos(angle), np.sin(angle)]), np.cos(
                np.pi / SIDES
            )
        rows, limit = [], []
        for f in range(self.count):
            for s in turn:
                row = np.zeros(m + 2)
                for i in np.flatnonzero(self.face == f):
                    row[i * d + 1 : (i + 1) * d] = s
                rows.append(row)
                limit.append(shrink * room[f])
        lift = np.zeros((self.nc, m + 2))
        lift[np.arange(self.nc), self.normal] = -1.0
        lift[:, m + 1] = 1.0
        A = sparse.csr_array(np.vstack([*rows, lift]))
        b = np.concatenate([np.array(limit), np.zeros(self.nc)])
        c = np.zeros(m + 2)
        c[m + 1] = -1.0
        found = self._program(c, self.inner, (x, x), (A, b), extra=1)
        if found.status == 3 or found.status != 0:
            return None
        return found.x[:m].reshape(self.nc, d)

    def _moves(self, held: NDArray[np.bool_], stuck: NDArray[np.bool_]) -> bool:
        """Whether some motion has u_T = 0 where contacts stick, u_N = 0 where they hold."""
        kept = np.tile(stuck[:, None], (1, self.d))
        kept[:, 0] = held
        rows = self.G.T.toarray()[kept.ravel()]
        values = np.linalg.svd(rows, compute_uv=False) if rows.size else np.zeros(0)
        n = self.G.shape[0]
        return len(values) < n or bool(values[-1] <= 1e-10 * values[0])


def _faces(G: sparse.csc_array, d: int, nc: int) -> NDArray[np.int64]:
    """Number of the face of every contact, (nc,): the same tangential columns."""
    dense = G.toarray()
    size = max(float(np.abs(dense).max(initial=0.0)), 1e-300)
    known: dict[bytes, int] = {}
    out = np.zeros(nc, dtype=np.int64)
    for i in range(nc):
        part = np.round(dense[:, i * d + 1 : (i + 1) * d] / size, 9) + 0.0
        out[i] = known.setdefault(part.tobytes(), len(known))
    return out
