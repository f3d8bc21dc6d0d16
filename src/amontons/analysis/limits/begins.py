"""The least load at which a motion can begin that the live load drives: bounds, in 2D.

A motion begins at x where some r and w obey, with the power of the live load normalised,

    G r + dead + x live = 0,   |r_T| <= mu r_N,   u = G^T w,   live.w = 1,
    u_N >= 0,   r_N u_N = 0,   r_T u_T = -mu r_N |u_T|                                      (1)

([FT]; slip does not dilate).  The least x of (1) is a linear program with complementarity: a
minimum that no descent can be sure of.  It is bounded here from both sides.

- `upper`: a state (r, w) that obeys (1) at x.  Candidates w are the mechanisms of a sequence of
  linear programs whose friction bounds mu r_N are those of the program before ([GCA]), and that
  of the relaxation below; for each w the least x of an r that fits it is one more program.
- `lower`: every product of an equation of (1) in y = (r, x, 1) with w, and of an inequality in
  y with u_N >= 0, is linear in V = y w^T, as are r_N u_N = 0 and |mu r_N u_T| <= -r_T u_T.
  So is x = sum live_j V_xj where live.w = 1.  The least of it over all V, products or not, is a
  linear program ([SA], first level), and no more than the least x.  Its multipliers are the
  proof: c - A^T y, their combination of the rows, leaves nothing but the bound.

The forces of a straight face, whose contacts all have the same tangential motion, are its
normal forces and one tangential force, of at most mu times their sum.

[FT] M. C. Ferris, F. Tin-Loi, "Limit analysis of frictional block assemblies as a mathematical
program with complementarity constraints", Int. J. Mech. Sci. 43 (2001) 209-224.
[GCA] M. Gilbert, C. Casapulla, H. M. Ahmed, "Limit analysis of masonry block structures with
non-associative frictional joints using linear programming", Comput. Struct. 84 (2006) 873-887.
[SA] H. D. Sherali, W. P. Adams, SIAM J. Discrete Math. 3 (1990) 411-430.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ...core.clock import Deadline
from ...core.errors import TimeUp
from ...core.faces import Told

Array = NDArray[np.float64]
Places = NDArray[np.int64]
PROGRAMS = 40  # of the sequence
KEPT = (0.4, 0.7)  # of the friction bounds of the program before, one sequence each
STILL = 1e-7  # velocity, of the largest of a mechanism, that counts as none
ACCEPTED = 1e-6  # by which a state may miss (1), relative
RESIDUAL = 1e-6  # that multipliers may leave of the rows that they combine
WORK = 2200.0  # operations of the relaxation per square of its unknowns, measured
PROGRAM = 2e8  # of one program of the sequence, roughly


@dataclass(frozen=True, eq=False, repr=False)
class Begins(Told):
    """Bounds on the least factor at which a motion can begin that the live load drives.

    upper: at it r (nc, 2) and motion w, with live.w = 1, obey every law but for `violation`,
    relative; inf, and None, where none was found.  lower: no motion below it, by multipliers
    whose rows leave `residual`; 0 where the relaxation was not solved.  unknowns: its size.
    """

    lower: float
    upper: float
    r: Array | None
    w: Array | None
    violation: float
    residual: float
    unknowns: int

    @property
    def width(self) -> float:
        """(upper - lower) / upper, 1 without an upper bound."""
        return 1.0 if not 0 < self.upper < np.inf else 1 - self.lower / self.upper

    def __str__(self) -> str:
        if self.upper == np.inf:
            return f"No motion that the live load drives begins below {self.lower:.6g}."
        return (f"A motion that the live load drives can begin at {self.upper:.6g}, and none "
                f"below {self.lower:.6g}.")  # fmt: skip

    @property
    def record(self) -> dict[str, Any]:
        """For JSON."""
        return {
            "lower": self.lower, "upper": None if self.upper == np.inf else self.upper,
            "width": self.width, "violation": self.violation, "residual": self.residual,
            "r": None if self.r is None else self.r.tolist(),
            "motion": None if self.w is None else self.w.tolist(),
        }  # fmt: skip


@dataclass(frozen=True, eq=False)
class Assembly:
    """Blocks in the plane: G (n, 2 nc), dead, live (n,), mu (nc,), face (nc,) of contacts."""

    G: sparse.csr_array
    dead: Array
    live: Array
    mu: Array
    face: Places

    @cached_property
    def dense(self) -> Array:
        """G (n, 2 nc)."""
        return self.G.toarray()

    @cached_property
    def faces(self) -> tuple[Places, int]:
        """(face of every contact, one friction each; their number)."""
        known: dict[tuple[int, float], int] = {}
        keys = zip(self.face.tolist(), self.mu.tolist(), strict=True)
        owner = np.array([known.setdefault(key, len(known)) for key in keys], dtype=np.int64)
        return owner, len(known)

    def velocity(self, w: Array) -> Array:
        """u (nc, 2) of a motion."""
        return (self.G.T @ w).reshape(-1, 2)

    def violation(self, x: float, r: Array, w: Array) -> float:
        """By how much (1) is missed at most: forces over the largest, velocities likewise."""
        u = self.velocity(w)
        force, speed = np.abs(r).max(initial=0.0) or 1.0, np.abs(u).max(initial=0.0) or 1.0
        power = self.mu * r[:, 0] * np.abs(u[:, 1]) + r[:, 1] * u[:, 1]
        balance = self.G @ r.ravel() + self.dead + x * self.live
        return float(max(
            np.abs(balance).max(initial=0.0) / force,
            (np.abs(r[:, 1]) - self.mu * r[:, 0]).max(initial=0.0) / force,
            -r[:, 0].min(initial=0.0) / force, -u[:, 0].min(initial=0.0) / speed,
            np.abs(r[:, 0] * u[:, 0]).max(initial=0.0) / (force * speed),
            np.abs(power).max(initial=0.0) / (force * speed),
            abs(self.live @ w - 1.0),
        ))  # fmt: skip


def begins(blocks: Assembly, most: float, first: Array, deadline: Deadline) -> Begins:
    """Bounds between 0 and most, the load beyond which there is no balance, with r `first`."""
    best, mechanism = Begins(0.0, np.inf, None, None, 0.0, 0.0, 0), None
    lower, residual, unknowns = 0.0, 0.0, 0
    try:
        relaxed = _Relaxation(blocks)
        unknowns = relaxed.unknowns
        deadline.pay(WORK * float(unknowns) ** 2)
        lower, residual, mechanism = relaxed.solved(most, deadline)
    except TimeUp:
        pass
    for w in _mechanisms(blocks, first, mechanism, deadline):
        found = state_of(blocks, w)
        if found is None:
            continue
        x, r, w = found
        missed = blocks.violation(x, r, w)
        if missed <= ACCEPTED and x < best.upper:
            best = Begins(0.0, x, r, w, missed, 0.0, 0)
        if best.upper * (1 - ACCEPTED) <= lower:
            break
    return Begins(min(lower, best.upper), best.upper, best.r, best.w, best.violation, residual,
                  unknowns)  # fmt: skip


# -------------------------------------------------------------------------- from above
def _mechanisms(
    blocks: Assembly, first: Array, more: Array | None, deadline: Deadline
) -> Iterator[Array]:
    """Motions to look at: that of the relaxation, and those of the sequence of programs."""
    if more is not None:
        yield more
    for kept in KEPT:
        yield from _sequence(blocks, first[:, 0], kept, deadline)


def _sequence(
    blocks: Assembly, normal: Array, kept: float, deadline: Deadline
) -> Iterator[Array]:
    """The mechanisms of one sequence of programs, from normal forces (nc,) on."""
    held = normal
    for _ in range(PROGRAMS):
        if not deadline.affords(PROGRAM):
            return
        deadline.spend(PROGRAM)
        found = _with_bounds(blocks, blocks.mu * held)
        if found is None:
            held = 0.5 * (held + normal)
            continue
        normal, w = found
        yield w
        new = kept * held + (1 - kept) * normal
        if np.abs(new - held).max() <= STILL * max(float(np.abs(new).max()), 1e-300):
            return
        held = new


def _with_bounds(blocks: Assembly, bound: Array) -> tuple[Array, Array] | None:
    """(r_N, w) of the largest x with |r_T| <= bound: its mechanism does not dilate."""
    from scipy.optimize import linprog

    nc = len(blocks.mu)
    limits = np.empty((2 * nc + 1, 2))
    limits[:-1:2] = 0.0, np.inf
    limits[1::2] = np.column_stack([-bound, bound])
    limits[-1] = 0.0, np.inf
    cost = np.zeros(2 * nc + 1)
    cost[-1] = -1.0
    balance = sparse.hstack([blocks.G, blocks.live[:, None]], format="csr")
    found = linprog(cost, None, None, balance, -blocks.dead, limits, method="highs")
    if found.status != 0:
        return None
    return found.x[:-1:2], -np.asarray(found.eqlin.marginals)


def state_of(blocks: Assembly, w: Array) -> tuple[float, Array, Array] | None:
    """(the least x of a state with this motion, its r (nc, 2), w with live.w = 1), or None."""
    from scipy.optimize import linprog

    power = float(blocks.live @ w)
    u = blocks.velocity(w)
    size = float(np.abs(u).max(initial=0.0))
    if not power > STILL * size * np.abs(blocks.live).max() or u[:, 0].min() < -STILL * size:
        return None
    nc, mu = len(blocks.mu), blocks.mu
    opens = u[:, 0] > STILL * size
    slips = np.flatnonzero(~opens & (np.abs(u[:, 1]) > STILL * size))
    limits = np.tile([-np.inf, np.inf], (2 * nc + 1, 1))
    limits[:-1:2, 0] = 0.0
    limits[-1, 0] = 0.0
    limits[:-1].reshape(nc, 2, 2)[opens] = 0.0
    each = np.arange(nc)
    cone = sparse.csr_array(
        (np.concatenate([np.ones(nc), -np.ones(nc), -mu, -mu]),
         (np.tile(np.concatenate([each, each + nc]), 2),
          np.concatenate([2 * each + 1, 2 * each + 1, 2 * each, 2 * each]))),
        shape=(2 * nc, 2 * nc + 1),
    )  # fmt: skip
    k = np.arange(len(slips))
    sense = np.sign(u[slips, 1])
    sliding = sparse.csr_array(
        (np.concatenate([np.ones(len(k)), mu[slips] * sense]),
         (np.tile(k, 2), np.concatenate([2 * slips + 1, 2 * slips]))),
        shape=(len(k), 2 * nc + 1),
    )  # fmt: skip
    balance = sparse.hstack([blocks.G, blocks.live[:, None]])
    cost = np.zeros(2 * nc + 1)
    cost[-1] = 1.0
    found = linprog(
        cost, cone, np.zeros(2 * nc), sparse.vstack([balance, sliding], format="csr"),
        np.concatenate([-blocks.dead, np.zeros(len(k))]), limits, method="highs",
    )  # fmt: skip
    if found.status != 0:
        return None
    return float(found.x[-1]), found.x[:-1].reshape(nc, 2), w / power


# -------------------------------------------------------------------------- from below
class _Relaxation:
    """The linear program in V = y w^T, y = (N of contacts, T of faces, x, 1), row by row."""

    def __init__(self, blocks: Assembly) -> None:
        G, mu = blocks.dense, blocks.mu
        self.owner, nf = blocks.faces
        nc, n = len(mu), len(G)
        first = np.array([np.flatnonzero(self.owner == f)[0] for f in range(nf)], dtype=int)
        self.opening = sparse.csr_array(G[:, ::2].T)  # u_N of w
        self.sliding = sparse.csr_array(G[:, 1::2].T[first])  # u_T of faces
        self.rows, self.n, self.live = nc + nf + 2, n, blocks.live
        self.balance = sparse.csr_array(
            np.column_stack([G[:, ::2], G[:, 1::2][:, first], blocks.live, blocks.dead])
        )
        self.force = sparse.csr_array(
            (mu, (self.owner, np.arange(nc))), shape=(nf, self.rows)
        )  # mu sum N of faces
        self.shear = sparse.csr_array(
            (np.ones(nf), (np.arange(nf), nc + np.arange(nf))), shape=(nf, self.rows)
        )

    @property
    def unknowns(self) -> int:
        """Entries of V."""
        return self.rows * self.n

    def _picked(self, k: int) -> sparse.csr_array:
        """The row that takes entry k of y."""
        return sparse.csr_array(([1.0], ([0], [k])), shape=(1, self.rows))

    def program(self, most: float) -> tuple[Array, Any, Any, Array]:
        """(c, A of A V <= 0, E of E V = e, e); V flat."""
        nc, last = self.opening.shape[0], self.rows - 1
        normal = sparse.csr_array(sparse.eye_array(nc, self.rows))
        x, one = self._picked(last - 1), self._picked(last)
        inside = sparse.vstack(
            [normal, self.force + self.shear, self.force - self.shear, x, most * one - x]
        )
        slip = [
            sparse.vstack([sparse.kron(t + sign * f, u) for t, f, u in self._by_face()])
            for sign in (1.0, -1.0)
        ]  # T u_T + mu N |u_T| <= 0
        A = sparse.vstack([-sparse.kron(inside, self.opening), *slip], format="csr")
        apart = sparse.vstack(
            [sparse.kron(normal[[i]], self.opening[[i]]) for i in range(nc)]
        )  # r_N u_N = 0
        live = sparse.csr_array(self.live[None])
        E = sparse.vstack([
            sparse.kron(self.balance, sparse.eye_array(self.n)), apart, sparse.kron(one, live),
        ], format="csr")  # fmt: skip
        e = np.zeros(E.shape[0])
        e[-1] = 1.0
        return sparse.kron(x, live).toarray().ravel(), A, E, e

    def _by_face(self) -> list[tuple[Any, Any, Any]]:
        """(T, mu sum N, u_T) of every face."""
        count = self.sliding.shape[0]
        return [(self.shear[[f]], self.force[[f]], self.sliding[[f]]) for f in range(count)]

    def solved(self, most: float, deadline: Deadline) -> tuple[float, float, Array | None]:
        """(bound, what its multipliers leave of the rows, the motion of the relaxation)."""
        from scipy.optimize import linprog

        c, A, E, e = self.program(most)
        limit = {} if deadline.work is not None else {"time_limit": max(deadline.left, 0.1)}
        found = linprog(c, A, np.zeros(A.shape[0]), E, e, (None, None), method="highs-ipm",
                        options=limit)  # fmt: skip
        if found.status != 0:
            return 0.0, 0.0, None
        # multipliers of equations and, at most zero, of inequalities: the proof
        y, z = np.asarray(found.eqlin.marginals), np.asarray(found.ineqlin.marginals)
        z = np.minimum(z, 0.0)
        residual = float(np.abs(c - E.T @ y - A.T @ z).max()) / float(np.abs(c).max())
        motion = np.asarray(found.x).reshape(self.rows, self.n)[-1]
        bound = float(e @ y) * (1 - ACCEPTED)
        return (bound if residual <= RESIDUAL else 0.0), residual, motion
