"""The least load at which a motion can begin that the live load drives: bounds, in 2D.

A motion begins at x where some r and w obey, with the power of the live load normalised,

    G r + dead + x live = 0,   |r_T| <= mu r_N,   u = G^T w,   live.w = 1,
    u_N >= 0,   r_N u_N = 0,   r_T u_T = -mu r_N |u_T|                                      (1)

([FT]; slip does not dilate).  The least x of (1) is a linear program with complementarity: a
minimum that no descent can be sure of.  It is bounded here from both sides.

- `upper`: a state (r, w) that obeys (1) at x.  Candidates w are the mechanisms of a sequence of
  linear programs whose friction bounds mu r_N are those of the program before ([GCA]), and that
  of the relaxation below; for each w the least x of an r that fits it is one more program.
- `lower`: linear programs in products of forces with motions (`relaxation`), first a small one,
  then, where a gap is left, a tighter one whose contacts are decided one by one (`branching`).
  Their motions are candidates for `upper`, too: sequences of programs tend to miss the least.

[FT] M. C. Ferris, F. Tin-Loi, "Limit analysis of frictional block assemblies as a mathematical
program with complementarity constraints", Int. J. Mech. Sci. 43 (2001) 209-224.
[GCA] M. Gilbert, C. Casapulla, H. M. Ahmed, "Limit analysis of masonry block structures with
non-associative frictional joints using linear programming", Comput. Struct. 84 (2006) 873-887.
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
from .branching import Branching
from .relaxation import Relaxation

Array = NDArray[np.float64]
Places = NDArray[np.int64]
PROGRAMS = 40  # of the sequence
KEPT = (0.4, 0.7)  # of the friction bounds of the program before, one sequence each
STILL = 1e-7  # velocity, of the largest of a mechanism, that counts as none
ACCEPTED = 1e-6  # by which a state may miss (1), relative
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


def begins(
    blocks: Assembly, most: float, first: Array, deadline: Deadline, gap: float = 0.0
) -> Begins:
    """Bounds between 0 and most, the load beyond which there is no balance, with r `first`.

    gap: relative distance of both that is good enough.
    """
    found = _Found(blocks)
    try:
        relaxed = Relaxation(blocks, signed=False)
        found.unknowns = relaxed.unknowns
        answer = relaxed.bound(most, deadline)
        found.rise(answer.value, answer.residual)
        found.take(answer.motion)
    except TimeUp:
        pass
    for w in _mechanisms(blocks, first, deadline):
        if found.meet(ACCEPTED):
            break
        found.take(w)
    if not found.meet(max(gap, ACCEPTED)):
        _branch(found, most, deadline, gap)
    best = found.best
    return Begins(min(found.lower, best.upper), best.upper, best.r, best.w, best.violation,
                  found.residual, found.unknowns)  # fmt: skip


def _branch(found: _Found, most: float, deadline: Deadline, gap: float) -> None:
    """The tighter relaxation, its contacts decided one by one as long as there is time."""
    try:
        relaxed = Relaxation(found.blocks, signed=True)
        tree = Branching(relaxed, min(most, found.best.upper), deadline)
        for w in tree.motions():
            found.unknowns = relaxed.unknowns
            found.take(w)
            tree.lower_cut(found.best.upper)
            found.rise(tree.lower, tree.residual)
            if found.meet(max(gap, ACCEPTED)):
                return
        found.rise(tree.lower, tree.residual)
    except TimeUp:
        pass


class _Found:
    """The best bounds so far."""

    def __init__(self, blocks: Assembly) -> None:
        self.blocks, self.unknowns = blocks, 0
        self.lower = self.residual = 0.0
        self.best = Begins(0.0, np.inf, None, None, 0.0, 0.0, 0)

    def take(self, w: Array | None) -> None:
        """A motion, if it has a state at a load below that of all others."""
        found = None if w is None else state_of(self.blocks, w)
        if found is None:
            return
        missed = self.blocks.violation(*found)
        if missed <= ACCEPTED and found[0] < self.best.upper:
            self.best = Begins(0.0, *found, missed, 0.0, 0)

    def rise(self, lower: float, residual: float) -> None:
        """A lower bound, and what its multipliers leave."""
        if lower > self.lower:
            self.lower, self.residual = lower, residual

    def meet(self, gap: float) -> bool:
        """Whether both bounds are as near as that."""
        return self.best.upper * (1 - gap) <= self.lower


# -------------------------------------------------------------------------- from above
def _mechanisms(blocks: Assembly, first: Array, deadline: Deadline) -> Iterator[Array]:
    """The motions of the sequences of programs."""
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
