"""Steps in time of rigid bodies with contact, friction, impacts and joints.

Moreau's midpoint rule with finite rotations.  From x0, Q0, v0 and W0, the angular velocity in
own axes, to the end of a step h:

    x_m = x0 + h v0 / 2,  Q_m = Q0 exp(h W0 / 2)                   where contacts are looked for
    m (v1 - v0) = h m g + P,    J (W1 - W_f) = R_m^T T             P, T of the impulses r
    x1 = x0 + h (v0 + v1) / 2,  Q1 = Q0 exp(h (W0 + W1) / 2)

with W_f after a step without contact (`rows.turned_freely`).  Contacts whose gap at the
midpoint is not positive take part, with the law between r and u1 + e min(u0_N, 0).  What an
impact leaves of overlap, h |u_N| / 2 at most, and joints lose by turning, is mended where it is
more than `overlap`: by the smallest displacements, in the metric of the masses, that take it
away.  (A law that lets open contacts close without overlap, u1_N >= -gap / h, turns a rocking
block round a step too early at each impact; at the same step its times are wrong by six times
as much.)

Energies: kinetic + potential gain what contacts do, r . (u0 + u1) / 2 (of W_f for rotations),
and what the mending of overlaps does.  That is an identity of the scheme, to rounding.

[M] J. J. Moreau, "Unilateral contact and dry friction in finite freedom dynamics", CISM 302
(1988).  [J] M. Jean, "The non smooth contact dynamics method", CMAME 177 (1999).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...core.arrays import finite, number
from ...core.clock import NEVER, Deadline
from ...core.errors import Interrupted, InvalidInput, NotConverged
from ...problem.friction import FrictionProblem
from ...problem.law import Coulomb, Law, Tied, joined
from ...problem.solution import FrictionSolution
from ...solvers.asked import Asked
from ...solvers.contract import Iterate, Solver
from ...solvers.driver import drive_as_asked
from .bodies import GROUND, RigidBodies
from .meeting import Meetings, meetings
from .rows import (
    Rows,
    delassus,
    frames_of,
    impulses,
    rotations,
    turned,
    turned_freely,
    velocities,
)

Array = NDArray[np.float64]
Index = NDArray[np.int64]
WHOLE = 1e-9  # the end may miss a whole number of steps by this part of a step
OVERLAP = 1e-5  # of the smallest body, below which overlaps are left
TOUCHING = 1e-9  # of a body, gaps up to which it touches


class Motion(NamedTuple):
    """Where all bodies are and how they move; all (n, 3) but orientation (n, 4).

    spin: angular velocity in own axes.
    """

    position: Array
    orientation: Array
    velocity: Array
    spin: Array


@dataclass(frozen=True, eq=False)
class RigidState:
    """All that the next step needs: an evolution goes on from it with the same numbers."""

    index: int
    time: float
    motion: Motion
    keys: Index  # (nc, 3) slave, master and feature of the last contacts
    impulses: Array  # (nc, 3) theirs, in their frames


@dataclass(frozen=True)
class RigidEnergies:
    """Kinetic and potential energy at the end of a step, works within it."""

    kinetic: float
    potential: float
    gain: float  # of both together
    contact: float  # work of contacts and joints
    mending: float  # of overlaps

    @property
    def defect(self) -> float:
        """What the balance misses, of rounding."""
        return self.gain - self.contact - self.mending


@dataclass(frozen=True, eq=False)
class RigidStep:
    """One step: the state after it, its contacts and energies.

    meetings: contacts that were looked at, the first of `solution`; r (nc, 3): their impulses
    in their frames, normal first; frames (nc, 3, 3) by rows; solution: None without contacts
    and joints; joints (k, 3): impulses on the first bodies, in global axes.
    """

    system: RigidBodies
    state: RigidState
    meetings: Meetings
    frames: Array
    r: Array
    joints: Array
    energies: RigidEnergies
    solution: FrictionSolution | None

    @property
    def time(self) -> float:
        """Time at the end of the step."""
        return self.state.time

    @property
    def position(self) -> Array:
        """Centres of mass, (n, 3)."""
        return self.state.motion.position

    @property
    def rotation(self) -> Array:
        """Rotations from own to global axes, (n, 3, 3)."""
        return rotations(self.state.motion.orientation)

    @property
    def status(self) -> NDArray[np.int8]:
        """ContactStatus of the contacts, (nc,)."""
        if self.solution is None:
            return np.zeros(0, np.int8)
        return self.solution.status[: len(self.r)]


def evolve_rigid(
    system: RigidBodies,
    *,
    step: float,
    until: float,
    start: RigidState | None = None,
    solver: Solver | None = None,
    tolerance: float = 1e-6,
    overlap: float = OVERLAP,
    deadline: Deadline = NEVER,
    check: bool = True,
) -> Iterator[RigidStep]:
    """The steps of rigid bodies up to the time `until`, each solved from the last impulses.

    step: its size, unit of time; start: any `step.state` goes on from there; tolerance: of each
    solve; overlap: part of the smallest body that bodies may overlap, and joints be apart;
    check: raise NotConverged instead of going on with the best impulses that were found.
    """
    if not number("step", step) > 0:
        raise InvalidInput(f"expected a number > 0, got {step!r}", ("step",))
    if not number("overlap", overlap) > 0:
        raise InvalidInput(f"expected a number > 0, got {overlap!r}", ("overlap",))
    state = at_start(system) if start is None else start
    count = len(system.bodies)
    for name, values in state.motion._asdict().items():
        width = 4 if name == "orientation" else 3
        if finite(f"start: {name}", values, 2).shape != (count, width):
            raise InvalidInput(
                f"start: expected {name} of shape ({count}, {width}): it belongs to others"
            )
    if not (np.isfinite(until) and until > state.time - WHOLE * step):
        raise InvalidInput(f"until: expected a time after {state.time:g}, got {until!r}")
    asked = Asked(tolerance, np.inf)
    return _steps(_Stepping(system, step, overlap * system.size, asked, solver, check),
                  state, until, deadline)  # fmt: skip


def _steps(
    stepping: _Stepping, state: RigidState, until: float, deadline: Deadline
) -> Iterator[RigidStep]:
    first = state.time - state.index * stepping.h
    while state.time < until - WHOLE * stepping.h:
        time = first + (state.index + 1) * stepping.h
        done = stepping.advance(state, time, deadline)
        state = done.state
        yield done


def at_start(system: RigidBodies) -> RigidState:
    """The bodies where and as they are given, at time 0."""
    position, orientation, velocity, spin = (
        np.array([getattr(body, name) for body in system.bodies])
        for name in ("position", "orientation", "velocity", "spin")
    )
    own = np.einsum("bij,bi->bj", rotations(orientation), spin)
    none = np.zeros((0, 3))
    return RigidState(
        0, 0.0, Motion(position, orientation, velocity, own), none.astype(np.int64), none
    )


class _Stepping:
    """A system with what all steps share."""

    def __init__(
        self, system: RigidBodies, step: float, overlap: float, asked: Asked,
        solver: Solver | None, check: bool,
    ) -> None:  # fmt: skip
        self.system, self.h, self.overlap, self.asked = system, step, overlap, asked
        self.solver, self.check = solver, check
        self.masses = np.array([body.mass for body in system.bodies])
        self.inertia = np.array([body.inertia for body in system.bodies])
        self.inverse = np.linalg.inv(self.inertia)
        self.near = TOUCHING * system.packed.reach
        begin = at_start(system).motion
        R = rotations(begin.orientation)
        first = np.array([joint.first for joint in system.joints], dtype=np.int64)
        second = np.array([joint.second for joint in system.joints], dtype=np.int64)
        point = np.array([joint.point for joint in system.joints], dtype=float).reshape(-1, 3)
        self.joined = first, second
        self.anchors = (
            np.einsum("jki,jk->ji", R[first], point - begin.position[first]),
            np.where((second == GROUND)[:, None], point, np.einsum(
                "jki,jk->ji", R[second], point - begin.position[second])),
        )  # fmt: skip

    # ------------------------------------------------------------------ a step
    def advance(self, state: RigidState, time: float, deadline: Deadline) -> RigidStep:
        """One step from a state to a time."""
        h, before = self.h, state.motion
        begin = before.position
        spin = turned_freely(self.inertia, before.spin, h)
        middle = self._middle(before)
        found, rows, apart = self._rows(*middle, before)
        moved = self._mended(rows, found, apart, middle[1])
        if moved is not None:
            before = self._shifted(before, moved, rotations(before.orientation))
            middle = self._middle(before)
            found, rows, apart = self._rows(*middle, before)
        R = middle[1]
        free = before.velocity + h * np.asarray(self.system.gravity)
        r, solution = np.zeros((len(rows.slave), 3)), None
        velocity, after = free, spin
        contact = 0.0
        if len(r):
            solution = self._solve(state, before, found, rows, (free, spin), R, deadline)
            r = solution.r
            push, turn = impulses(rows, r, len(free))
            velocity = free + push / self.masses[:, None]
            own = np.einsum("bij,bi->bj", R, turn)
            after = spin + np.einsum("bij,bj->bi", self.inverse, own)
            mean, turning = 0.5 * (before.velocity + velocity), 0.5 * (spin + after)
            contact = float((push * mean).sum() + (own * turning).sum())
        position = before.position + 0.5 * h * (before.velocity + velocity)
        orientation = turned(before.orientation, 0.5 * h * (before.spin + after))
        motion = Motion(position, orientation, velocity, after)
        nc = len(found.slave)
        keys = np.column_stack([found.slave, found.master, found.feature])
        new = RigidState(state.index + 1, time, motion, keys, r[:nc])
        mending = -self._weighs(before.position - begin)
        energies = self._energies(state.motion, motion, contact, mending)
        return RigidStep(self.system, new, found, rows.axes[:nc], r[:nc], r[nc:], energies,
                         solution)  # fmt: skip

    def _middle(self, motion: Motion) -> tuple[Array, Array]:
        """Positions and rotations at the middle of the step, as the bodies move now."""
        half = 0.5 * self.h
        orientation = turned(motion.orientation, half * motion.spin)
        return motion.position + half * motion.velocity, rotations(orientation)

    def _rows(self, x: Array, R: Array, motion: Motion) -> tuple[Meetings, Rows, Array]:
        """Contacts, all rows, and how far the sides of joints are apart, (k, 3)."""
        found = meetings(self.system.packed, x, R, self.near)
        slave, master = found.slave, found.master
        axes = frames_of(found.normals)
        arms = found.points - x[slave]
        others = found.points - x[master]  # of the ground: not read
        first, second = self.joined
        if not len(first):
            return found, Rows(slave, master, axes, arms, others), np.zeros((0, 3))
        own, other = (
            np.einsum("jik,jk->ji", R[b], a)
            for b, a in zip(self.joined, self.anchors, strict=True)
        )
        fixed = np.where((second == GROUND)[:, None], self.anchors[1], x[second] + other)
        rows = Rows(
            np.concatenate([slave, first]), np.concatenate([master, second]),
            np.concatenate([axes, np.broadcast_to(np.eye(3), (len(first), 3, 3))]),
            np.concatenate([arms, own]), np.concatenate([others, other]),
        )  # fmt: skip
        return found, rows, x[first] + own - fixed

    # ------------------------------------------------------------------ problems
    def _law(self, found: Meetings, mu: float) -> Law:
        """Friction at contacts, bonds at joints."""
        contacts = Coulomb(np.full(len(found.slave), mu))
        joints = len(self.joined[0])
        if not joints:
            return contacts
        return joined([contacts, Tied(joints)]) if len(found.slave) else Tied(joints)

    def _solve(
        self, state: RigidState, before: Motion, found: Meetings, rows: Rows,
        free: tuple[Array, Array], R: Array, deadline: Deadline,
    ) -> FrictionSolution:  # fmt: skip
        """The impulses of a step."""
        nc, e = len(found.slave), self.system.restitution
        q = velocities(rows, free[0], np.einsum("bij,bj->bi", R, free[1]))
        if e > 0:
            spin = np.einsum("bij,bj->bi", R, before.spin)
            u0 = velocities(rows, before.velocity, spin)[:nc, 0]
            q[:nc, 0] += e * np.minimum(u0, 0.0)
        problem = self._problem(rows, q, self._law(found, self.system.mu), R)
        start = np.zeros_like(q)
        _match(found.slave, found.master, found.feature, state.keys, state.impulses, start)
        asked = self.asked if deadline is NEVER else replace(self.asked, time_limit=deadline)
        solution = drive_as_asked(problem, asked, Iterate(start), self.solver)
        if self.check and not solution.converged:
            record = solution.convergence
            kind = Interrupted if record.by_user else NotConverged
            raise kind(f"step {state.index + 1}: {record}. {record.advice}", solution)
        return solution

    def _problem(self, rows: Rows, q: Array, law: Law, R: Array) -> FrictionProblem:
        inverse = R @ self.inverse @ R.swapaxes(1, 2)
        W = delassus(rows, self.masses, inverse)
        return FrictionProblem._from_blocks(W, q, law)

    def _mended(
        self, rows: Rows, found: Meetings, apart: Array, R: Array
    ) -> tuple[Array, Array] | None:
        """Displacements and rotations (n, 3) that take overlaps away; None of small ones."""
        worst = max(-found.gaps.min(initial=0.0), np.abs(apart).max(initial=0.0))
        if worst <= self.overlap:
            return None
        nc = len(found.slave)
        q = np.zeros((len(rows.slave), 3))
        q[:nc, 0] = found.gaps + 0.5 * self.overlap
        q[nc:] = apart
        problem = self._problem(rows, q, self._law(found, 0.0), R)
        solution = drive_as_asked(problem, self.asked, None, self.solver)
        push, turn = impulses(rows, solution.r, len(self.masses))
        inverse = R @ self.inverse @ R.swapaxes(1, 2)
        return push / self.masses[:, None], np.einsum("bij,bj->bi", inverse, turn)

    def _shifted(self, motion: Motion, by: tuple[Array, Array], R: Array) -> Motion:
        """The bodies moved and turned, with the velocities that they have in own axes."""
        moved, angle = by
        own = np.einsum("bij,bi->bj", R, angle)
        return motion._replace(
            position=motion.position + moved, orientation=turned(motion.orientation, own)
        )

    # ------------------------------------------------------------------ energies
    def _energies(
        self, before: Motion, after: Motion, contact: float, mending: float
    ) -> RigidEnergies:
        kinetic = self._kinetic(after)
        change = after.position - before.position
        gain = kinetic - self._kinetic(before) - self._weighs(change)
        potential = -self._weighs(after.position)
        return RigidEnergies(kinetic, potential, gain, contact, mending)

    def _kinetic(self, motion: Motion) -> float:
        moving = 0.5 * self.masses @ (motion.velocity**2).sum(axis=1)
        turning = np.einsum("bi,bij,bj->", motion.spin, self.inertia, motion.spin)
        return float(moving + 0.5 * turning)

    def _weighs(self, moved: Array) -> float:
        """Work of gravity on displacements (n, 3)."""
        return float(self.masses @ (moved @ np.asarray(self.system.gravity)))


def _match(
    slave: Index, master: Index, feature: Index, keys: Index, last: Array, start: Array
) -> None:
    """Give contacts the impulses that the same corners had in the last step."""
    if not len(last):
        return
    old = {tuple(key): k for k, key in enumerate(keys.tolist())}
    for k, key in enumerate(
        zip(slave.tolist(), master.tolist(), feature.tolist(), strict=True)
    ):
        found = old.get(key)
        if found is not None:
            start[k] = last[found]
