"""Steps in time of rigid bodies with contact, friction, impacts and joints.

Moreau's midpoint rule with finite rotations.  From x0, Q0, v0 and W0, the angular velocity in
own axes, to the end of a step h:

    x_m = x0 + h v0 / 2,  Q_m, W_f = Q0, W0 after h / 2            where contacts are looked for
    m (v1 - v0) = h m g + P,    J (W_r - W_f) = R_m^T T            P, T of the impulses r
    x1 = x0 + h (v0 + v1) / 2,  Q1, W1 = Q_m, W_r after h / 2

Turning without contact is exact (`free_rotation`), so that moments of momentum stay: W_f, Q_m
are those after half of it from W0, Q0, and W1, Q1 after the other half from W_r. (With a whole
free step before the impulses a spinning top, whose moment and spin are about different axes,
would lose energy and moment of momentum of first order in h.) Contacts whose gap at the
midpoint is not positive take part, with the law between r and u1 + e u0_N, where u0 is of v0
and W_f and u1 of v1 and W_r ([M]; with min(u0_N, 0) a contact that parts and is pressed by
another impact would gain energy). What an impact leaves of overlap, h |u_N| / 2 at most, and
joints lose by turning, is mended where it is more than `overlap`: by the smallest
displacements, in the metric of the masses, that take it away. What was mended takes part,
though rotations open it by their squares. (A law that lets open contacts close without overlap,
u1_N >= -gap / h, turns a rocking block round a step too early at each impact; at the same step
its times are wrong by six times as much.)

Velocities are made to keep to the joints where a step begins (`joints`), and joints take back
beyond the middle what they turned away from before it: with u_m of these velocities and of W_f,
with arms of the step's chord and c of third order in h that closes them at its end (`joints`),

    u1 = c - u_m    for joints,    u1_N >= min(X^T u1, 0)    for contacts that hang on them

so that joints work r . c / 2 in the step, nothing in a plane. (u1 = 0, the law of sticking
contacts, takes from a pendulum a part of its energy of first order: 7 % in five swings of 2 000
steps each.) What joints take at the beginning of a step is all of a jolt, and else of third
order in the whole.
Contacts may take part in the motion by which joints are mirrored, or one near a joint would
stop or throw the body; then the step is solved again with chords and c from what parts there
(`mirrored.closed_beside`).  Friction that jams a contact has no answer with joints that take
something back: u1 = 0 then, which bodies at rest always have.  What joints decide altogether is
no contact, and where they decide the normal alone it is one for the sake of its friction.
Overlaps of both kinds are left: mending them would contradict the joints.

A solve may open contacts by h `left`, its tolerance of the velocities q at its contacts
(`leaves`), for each of two bodies.  Such gaps count as none.  Those that errors of some more
solves may have opened are closed to that again.  Else corners of a wall would drop out at
random, and each step be another problem, with blocks on three corners, or on two; closed to
nothing they would follow every error, another problem again.

Turning lifts a contact by the square of its angle in a step, where it takes no part until loads
have brought it down again.  One that loses its load at a constant rate stays up for ever when
that takes longer than the load is left, from a time of order sqrt(h) before it.

Gravity that changes in time is that of the middle of a step.

Energies: kinetic + potential gain what contacts do, r . (u0 + u1) / 2, what the mending of
overlaps does, and what joints take at the beginning of a step.  That is an identity of the
scheme, to rounding.

[M] J. J. Moreau, "Unilateral contact and dry friction in finite freedom dynamics", CISM 302
(1988).  [J] M. Jean, "The non smooth contact dynamics method", CMAME 177 (1999).
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...core.arrays import finite, number
from ...core.clock import NEVER, Deadline
from ...core.errors import InvalidInput, shown
from ...core.warned import ResultWarning
from ...problem.solution import FrictionSolution
from ...solvers.asked import Asked
from ...solvers.contract import Solver
from .bodies import RigidBodies
from .ends import ended, middle_of
from .guides import Guides
from .joints import Joints
from .meeting import meetings
from .met import Met
from .mirrored import Halfway, closed_beside, joints_of
from .quick import Found, Posed, matched
from .rolling import couples, rolling_problem
from .rows import (
    Rows,
    delassus,
    global_inverse,
    impulses,
    rotations,
    rows_at,
    to_global,
    to_own,
)
from .solving import Solved, Solving, leaves
from .states import (
    Motion,
    RigidEnergies,
    RigidState,
    RigidStep,
    overlap_at_start,
    too_long,
    undetermined,
)

Array = NDArray[np.float64]
Index = NDArray[np.int64]
WHOLE = 1e-9  # the end may miss a whole number of steps by this part of a step
OVERLAP = 1e-5  # of the smallest body, below which overlaps are left
MENDED = 1e-6  # error of a mending that is let pass: what it leaves is mended in the next step
FAR = 1e-3  # of the smallest body, moved by mending, from which contacts are found again
TOUCHING = 1e-9  # of a body, gaps up to which it touches
LEFT = 5.0  # solves whose errors may have opened a contact, but by `overlap` at most
NOTHING = np.zeros((0, 3))


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
    if not isinstance(system, RigidBodies):
        raise InvalidInput(f"system: expected RigidBodies, got {shown(system)}")
    if not isinstance(start, RigidState | None):
        raise InvalidInput(f"start: expected a RigidState, got {shown(start)}")
    if not number("tolerance", tolerance) > 0:
        raise InvalidInput(f"expected a number > 0, got {tolerance!r}", ("tolerance",))
    state = at_start(system) if start is None else start
    count = len(system.bodies)
    for name, values in state.motion._asdict().items():
        width = 4 if name == "orientation" else 3
        if finite(f"start: {name}", values, 2).shape != (count, width):
            raise InvalidInput(
                f"start: expected {name} of shape ({count}, {width}): it belongs to others"
            )
    if not number("until", until) > state.time - WHOLE * step:
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
    own = to_own(rotations(orientation), spin)
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
        masses = np.array([body.mass for body in system.bodies])
        inertia = np.array([body.inertia for body in system.bodies])
        self.inverse: Array = np.linalg.inv(inertia)
        self.bodies = masses, inertia, self.inverse
        self.no_couples = np.zeros((len(masses), 3))
        self.near: Array = TOUCHING * system.packed.reach
        guides = Guides.of(system.packed.planes[:, :3])
        self.solving = Solving(system.mu, guides, asked, solver, check)
        self.joints = Joints(system, self.bodies) if len(system.joints) else None
        self.told = False  # that friction is undetermined

    # ------------------------------------------------------------------ a step
    def advance(self, state: RigidState, time: float, deadline: Deadline) -> RigidStep:
        """One step from a state to a time."""
        h, before = self.h, state.motion
        gravity = np.array(self.system.gravity_at(time - 0.5 * h))
        opened = min(LEFT * h * state.left, 0.5 * self.overlap)  # of each of two bodies
        self.near = TOUCHING * self.system.packed.reach + opened
        jolt, sides, (lost, taken) = NOTHING, NOTHING, (0.0, 0.0)
        if self.joints is not None:
            before, jolt, sides, (lost, taken) = self.joints.kept(before)
        begin, masses = before.position, self.bodies[0]
        middle = middle_of(*before, self.bodies, h)
        at = self._rows(middle[0], middle[2], sides)
        mended = self._mended(at, middle[2], f"step {state.index + 1}", deadline)
        if mended is not None:
            moved, gaps = mended
            before = before.shifted(*moved)
            middle = middle_of(*before, self.bodies, h)
            reach = self.system.packed.reach
            angle = np.linalg.norm(moved[1], axis=1)
            far = np.linalg.norm(moved[0], axis=1) + angle * reach > FAR * self.system.size
            if far.any():  # rotations lift what was mended by their squares
                at = self._rows(middle[0], middle[2], sides, angle**2 * reach)
            else:
                at = self._closed(at, gaps)
        mobility = masses, global_inverse(middle[2], self.inverse)
        half = Halfway(before, middle, h, gravity, mobility, self.system.restitution, state,
                       (2.0 * opened / LEFT, 2.0 * opened))  # fmt: skip
        solved, r, moments, turn = None, NOTHING, NOTHING, self.no_couples
        worked, nc = 0.0, len(at.keys)
        if len(at.rows.slave):
            what = f"step {state.index + 1}"
            if self.system.has_moments:
                solved = self._rolled(at, half, what, deadline)
                r, moments = solved.r[:, :3].copy(), solved.r[:, 3:].copy()
                turn = couples(at.rows, moments, len(masses))
            else:
                at, solved, closing = self._struck(at, half, what, deadline)
                r = solved.r if isinstance(solved, Found) else solved.r.copy()
                worked = 0.5 * float(np.sum(r[nc:] * closing))
        motion, energies = ended(
            at.rows, r, turn, middle, self.bodies, gravity, h, begin, tuple(before)
        )
        kinetic, potential, gain, contact, mending = energies
        done = RigidEnergies(
            kinetic, potential, gain + lost, contact - worked, mending, taken + worked
        )
        end = Motion(*motion)
        loss = state.lost, state.most, state.fastest
        if self.joints is not None:
            fallen = 0.5 * float(masses.sum() * (h * gravity) @ (h * gravity))
            busy = self.joints.energy(end)
            loss = state.loss_after(done.joints, busy, fallen, self.asked.tolerance)
        left = 0.0 if solved is None else leaves(solved, self.asked.tolerance)
        new = RigidState(state.index + 1, time, end, at.keys, r[:nc], moments, *loss, left, end)
        said = self._said_of(state, new) + self._undetermined(at)
        return RigidStep(self.system, new, at.found, at.rows.axes[:nc], r[:nc], r[nc:] + jolt,
                         done, solved, said)  # fmt: skip

    def _said_of(self, state: RigidState, new: RigidState) -> tuple[ResultWarning, ...]:
        """What a step has to say: the first about the state that it begins with."""
        if state.index:
            return too_long(state, new, self.h)
        x, R = state.motion.position, rotations(state.motion.orientation)
        found = meetings(self.system.packed, x, R, self.near)
        return overlap_at_start(self.system, found, self.overlap)

    def _undetermined(self, at: Met) -> tuple[ResultWarning, ...]:
        """Said once of the first contact whose normal joints decide."""
        if self.told or at.hung is None or at.loose.all():
            return ()
        self.told = True
        which = int(np.argmin(at.loose))
        return undetermined(self.system, *at.keys[which, :2].tolist())

    def _rows(self, x: Array, R: Array, sides: Array, apart: Array | float = 0.0) -> Met:
        """Contacts and joints of bodies at x, turned by R; apart (n,): gaps that count.

        sides (k, 3): how far those of joints are apart where the step begins.
        """
        found = meetings(self.system.packed, x, R, self.near + apart)
        keys, axes, arms, others, deepest = rows_at(*found, x)
        rows = Rows(found.slave, found.master, axes, arms, others)
        if self.joints is None:
            return Met(found, keys, rows, NOTHING, None, deepest)
        joints = self.joints.rows(x, R)[0]
        hung = self.joints.hung(rows, joints, R, self.system.mu)
        rows_of_all: list[Any] = [np.concatenate(p) for p in zip(rows, joints, strict=True)]
        both = Rows(*rows_of_all)
        widest = float(np.abs(sides).max())
        if hung is None:
            return Met(found, keys, both, sides, None, max(deepest, widest))
        at = Met(found, keys, both, sides, hung, 0.0).only(~hung.idle)
        if not len(at.keys):
            return at._replace(hung=None, deepest=widest)
        gaps = at.found.gaps[at.loose]
        return at._replace(deepest=max(-gaps.min(initial=0.0), widest))

    def _closed(self, at: Met, gaps: Array) -> Met:
        """What is left of contacts that were mended, with their gaps (nc,) after that."""
        found = at.found
        apart = np.where(found.master >= 0, self.near[found.master], 0.0)
        kept = (gaps <= self.near[found.slave] + apart) | ~at.loose
        return at._replace(found=found._replace(gaps=gaps), deepest=0.0).only(kept)

    # ------------------------------------------------------------------ problems
    def _struck(
        self, at: Met, half: Halfway, what: str, deadline: Deadline
    ) -> tuple[Met, Solved, Array]:
        """Contacts and joints as they are solved, with the impulses of a step, and c (k, 3)."""
        if self.joints is None:
            posed, closing = half.posed(at), NOTHING
        else:
            at, posed, closing = half.closed(self.joints, at)
        solving, mobility = self.solving, half.mobility
        posed = solving.unsqueezed(at, mobility, posed, deadline)
        search = solving.search(at, mobility, posed)
        if self.joints is None or at.hung is None:
            return at, solving.solve(search, what, deadline), closing
        solved = solving.tried(search, deadline, solvers=True)
        if solved is None:  # friction that jams a contact lets joints take nothing back
            posed, closing = half.still(self.joints, at)
            search = solving.search(at, mobility, posed)
            return at, solving.solve(search, what, deadline), closing

        def again(at: Met, posed: Posed) -> Solved | None:
            return solving.tried(solving.search(at, mobility, posed), deadline, solvers=False)

        return closed_beside(self.joints, half, at, solved, search.goal, again)

    def _rolled(
        self, at: Met, half: Halfway, what: str, deadline: Deadline
    ) -> FrictionSolution:
        """Impulses and moments, (nc, 6), where contacts resist rolling or spinning."""
        state = half.state
        posed = self.solving.unsqueezed(at, half.mobility, half.posed(at), deadline)
        omega = to_global(*half.middle[2:])
        problem = rolling_problem(self.system, at.rows, half.mobility, posed, omega)
        moments = np.zeros((len(at.keys), 3))
        if len(state.moments):
            matched(at.keys, state.keys, state.moments, moments)
        start = np.hstack([posed.start, moments])
        return self.solving.judged(self.solving.driven(problem, start, deadline), what)

    def _mended(
        self, at: Met, R: Array, what: str, deadline: Deadline
    ) -> tuple[tuple[Array, Array], Array] | None:
        """Displacements and rotations (n, 3) that take overlaps away, and the gaps then.

        None where overlaps are small.  `what` for messages.
        """
        if at.deepest <= self.overlap:
            return None
        gaps, loose = at.found.gaps.copy(), at.loose
        at = at.only(loose)
        rows, nc, masses = at.rows, len(at.keys), self.bodies[0]
        q = np.zeros((len(rows.slave), 3))
        q[:nc, 0] = at.found.gaps + 0.5 * self.overlap
        q[nc:] = at.apart
        inverse = global_inverse(R, self.inverse)
        if self.joints is not None:  # what joints that say something twice contradict stays
            q[nc:] -= self.joints.contradicted(joints_of(at), inverse, q[nc:])
        posed = Posed(*delassus(rows, masses, inverse), q, np.zeros_like(q))
        search = self.solving.search(at, (masses, inverse), posed, mu=0.0)
        what = f"{what}, overlaps to be mended"
        found = self.solving.solve(search, what, deadline, MENDED)
        push, turn = impulses(rows, found.r, len(masses))
        moved = push / masses[:, None], np.einsum("bij,bj->bi", inverse, turn)
        gaps[loose] = found.u[:nc, 0] - 0.5 * self.overlap
        return moved, gaps
