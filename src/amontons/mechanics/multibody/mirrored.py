"""What joints do in the middle of a step: close at its end, and take back what parts."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .bonds import CLOSED, CLOSINGS, NEARER
from .joints import Joints
from .met import Met
from .quick import Posed, pose
from .rows import Mobility, Rows, to_global, velocities
from .solving import Solved
from .states import Motion, RigidState

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Halfway:
    """Bodies in the middle of a step h: the motion before it, and `ends.middle_of` that.

    state: with the last impulses, from which solves start; opened: gaps that count as none, and
    up to which contacts are closed to them, u1_N >= -(gap - opened[0]) / h.
    """

    before: Motion
    middle: tuple[Array, Array, Array, Array]
    h: float
    gravity: Array
    mobility: Mobility
    restitution: float
    state: RigidState
    opened: tuple[float, float]

    def posed(self, at: Met) -> Posed:
        """The problem of contacts, and of joints with u1 = 0."""
        _, _, R, spun = self.middle
        v, last = self.before.velocity, (self.state.keys, self.state.impulses)
        free = v + self.h * self.gravity, spun
        posed = Posed(*pose(
            at.rows, len(at.keys), (*self.mobility, R), (v, spun), free, self.restitution,
            at.keys, last,
        ))  # fmt: skip
        none, most = self.opened
        if most > none and at.hung is None:  # joints do not let the others be closed
            posed.q[: len(at.keys), 0] += (at.found.gaps.clip(none, most) - none) / self.h
        return posed

    def still(self, joints: Joints, at: Met) -> tuple[Posed, Array]:
        """The problem of joints that keep still, u1 = 0, and what c (k, 3) that is."""
        posed, omega = self.posed(at), to_global(self.middle[2], self.middle[3])
        left = self._left_out(joints, at, posed)
        return posed, velocities(joints_of(at), self.before.velocity, omega) + left

    def _left_out(self, joints: Joints, at: Met, posed: Posed) -> Array:
        """What joints contradict, (k, 3), which is taken off q."""
        nc = len(at.keys)
        left = joints.contradicted(joints_of(at), self.mobility[1], posed.q[nc:])
        posed.q[nc:] -= left
        return left

    def mirrored(
        self, joints: Joints, at: Met, c: Array, meet: bool = False
    ) -> tuple[Posed, Array]:
        """The same of joints that take back what has parted, u1 = c - u_m, and that c.

        What joints that say something twice contradict, as their sides are never closed to
        the last digit, is left out of q: reactions would grow without end for it.
        Contacts that hang on joints take part in that, u1_N >= min(X^T u1, 0); where sides are
        to meet at the end by no more than what has lifted them, X^T c - min(X^T u_m, u_m).
        """
        nc, posed = len(at.keys), self.posed(at)
        v = self.before.velocity
        u_m = velocities(at.rows, v, to_global(self.middle[2], self.middle[3]))
        posed.q[nc:] += u_m[nc:] - c
        if at.hung is not None:
            back = at.hung.pulled(u_m[nc:], len(v))
            if meet:
                back = np.minimum(back, np.maximum(u_m[:nc, 0], 0.0))
            posed.q[:nc, 0] -= np.minimum(at.hung.pulled(c, len(v)) - back, 0.0)
        return posed, c + self._left_out(joints, at, posed)

    def closed(self, joints: Joints, at: Met) -> tuple[Met, Posed, Array]:
        """The problem where joints close at the end, and c (k, 3).

        Joints that contacts hang on keep the rows of the middle and c = 0 at first: what joints
        do alone says little of those, see `closed_beside`.
        """
        if at.hung is not None:
            c = np.zeros_like(at.apart)
            return at, *self.mirrored(joints, at, c)
        rows, pull, c = joints.closed(
            self.before.orientation, self.middle, self.before.velocity, self.h, self.gravity
        )
        at = _with_joints(at, rows)
        posed, c = self.mirrored(joints, at, c)
        if not len(at.keys):  # beside contacts it would leave none of the load to them
            posed.start[:] = pull
        return at, posed, c


def closed_beside(  # noqa: PLR0913
    joints: Joints, half: Halfway, at: Met, solved: Solved, size: float,
    solve: Callable[[Met, Posed], Solved | None],
) -> tuple[Met, Solved, Array]:  # fmt: skip
    """A step solved anew until joints that contacts hang on close at its end; its c (k, 3).

    at, solved: with the joints of the middle; size: velocities, 2 / h times the distances at
    the end, that are let pass; solve: None where it does not.  Each solve tells where sides of
    joints come to beside these contacts, and with that the chords and c of the next.  Parts
    that come no nearer to it, as those wedged between contacts, keep the rows of the middle.
    """
    linked = joints.pattern[3]
    c = np.zeros_like(at.apart)
    first = at, solved, c
    now, last, least = at, np.full(len(c), np.inf), np.zeros(len(c))
    failed = np.zeros(len(c), dtype=bool)
    for step in range(CLOSINGS):
        rows, aim, apart = joints.aimed(
            now.rows, solved.r, half.before.orientation, half.middle, half.before.velocity,
            half.h, half.gravity,
        )  # fmt: skip
        left = np.bincount(linked, (apart**2).sum(axis=1))[linked]
        if step == 0:
            least = np.maximum(CLOSED**2 * left, (0.5 * half.h * size) ** 2)
        open_ = (left > least) & ~failed
        worse = open_ & ~(left <= NEARER * last)
        if not open_.any():
            break
        failed |= worse
        if failed.all():
            return first
        last = left
        chosen: list[Any] = [
            np.where(failed.reshape(-1, *[1] * (old.ndim - 1)), old, new)
            for old, new in zip(joints_of(at), rows, strict=True)
        ]
        now, c = _with_joints(at, Rows(*chosen)), np.where(failed[:, None], 0.0, aim)
        posed, c = half.mirrored(joints, now, c, meet=True)
        posed.start[:] = solved.r
        again = solve(now, posed)
        if again is None:
            return first
        solved = again
    return now, solved, c


def joints_of(at: Met) -> Rows:
    """Rows of the joints alone."""
    rows: list[Any] = [np.ascontiguousarray(part[len(at.keys) :]) for part in at.rows]
    return Rows(*rows)


def _with_joints(at: Met, joints: Rows) -> Met:
    """With other rows of joints."""
    nc = len(at.keys)
    rows: list[Any] = [
        np.concatenate([a[:nc], b]) for a, b in zip(at.rows, joints, strict=True)
    ]
    return at._replace(rows=Rows(*rows))
