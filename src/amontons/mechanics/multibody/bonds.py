"""Joints of a step in compiled passes: velocities that keep to them, and closing."""

from __future__ import annotations

import numpy as np

from ...core.compiled import njit
from ...solvers.sweeps.on_bodies import driven_inplace, felt_inplace
from .apart import dot
from .free_rotation import turned_freely, twice_energy
from .joint_factor import factorised, solved_bonds
from .rows import (
    global_inverse,
    rotations,
    row_impulses,
    row_velocities,
    to_global,
    to_own,
)

CLOSINGS = 20  # rounds in which a step is closed at most
NEARER = 0.25  # of its square, what is left of a distance by a round that helps
CLOSED = 1e-3  # of the first distance, at which it is


@njit(cache=True, error_model="numpy")
def joint_rows(first, second, anchors, x, R):
    """`Rows` of joints of bodies at x, turned by R, as a tuple, and how far sides are apart.

    anchors: points (k, 3) in axes of the first body, and of the second or, on the ground,
    global.
    """
    own, other = anchors
    k = len(first)
    axes, arms, others = np.zeros((k, 3, 3)), np.zeros((k, 3)), np.zeros((k, 3))
    apart = np.empty((k, 3))
    for j in range(k):
        a, b = first[j], second[j]
        for i in range(3):
            axes[j, i, i] = 1.0
            for d in range(3):
                arms[j, i] += R[a, i, d] * own[j, d]
                if b >= 0:
                    others[j, i] += R[b, i, d] * other[j, d]
            fixed = x[b, i] + others[j, i] if b >= 0 else other[j, i]
            apart[j, i] = x[a, i] + arms[j, i] - fixed
    return (first, second, axes, arms, others), apart


@njit(cache=True, error_model="numpy")
def kept_to(rows, pattern, factor, bodies, inverse, R, v, spin):  # noqa: PLR0913
    """v and spin (n, 3), in own axes, that keep to joints, impulses (k, 3), energy and work.

    bodies: masses (n,), inertia and its inverse in own axes; inverse: in global ones, for R.
    The kinetic energy that is gained, and what the impulses work: the same but for rounding.
    """
    slave, master, axes, arms, others = rows
    masses, inertia, _ = bodies
    omega = to_global(R, spin)
    before = row_velocities(slave, master, axes, arms, others, v, omega)
    r = -solved_bonds(pattern, factor, before)
    after, turning = _pushed(rows, r, masses, inverse, v, omega)
    left = row_velocities(slave, master, axes, arms, others, after, turning)
    gained = work = 0.0
    for j in range(len(r)):
        for i in range(3):
            work += 0.5 * r[j, i] * (before[j, i] + left[j, i])
    spun = to_own(R, turning)
    for b in range(len(masses)):
        for i in range(3):
            gained += 0.5 * masses[b] * (after[b, i] ** 2 - v[b, i] ** 2)
        gained += 0.5 * (twice_energy(inertia[b], spun[b]) - twice_energy(inertia[b], spin[b]))
    return after, spun, r, gained, work


@njit(cache=True, error_model="numpy")
def closed_by(rows, pattern, anchors, bodies, begin, middle, v, h, gravity):  # noqa: PLR0913
    """How joints are closed at the end of a step h: rows, r and c (k, 3), see `joints`.

    rows: in the middle; begin (n, 3, 3): rotations where the step begins; middle: of
    `middle_of`; v (n, 3): velocities before it.  Newton's method with W_JJ, first for the arms
    of the middle, then for those of the chord.  Parts that come no nearer to it keep the first
    arms, and have c = 0.
    """
    slave, master, axes, arms, others = rows
    x, Q, R, spun = middle
    linked, k = pattern[3], len(slave)
    omega, free = to_global(R, spun), v + h * gravity
    inverse = global_inverse(R, bodies[2])
    r, failed = np.zeros((k, 3)), np.zeros(k, np.bool_)
    first, chord = r, rows
    for stage in range(2):
        factor = factorised(chord, pattern, bodies[0], inverse)
        if stage == 0:
            first = -solved_bonds(pattern, factor, _doubled(chord, v, free, omega))
            r = first.copy()
        ended = _closing_inplace(
            chord, pattern, factor, anchors, bodies, inverse, (x, Q, R), free, omega, h, r,
            failed,
        )  # fmt: skip
        if stage == 0:
            chord = _chord_rows(rows, anchors, begin, ended)
            for j in range(k):
                if failed[linked[j]]:
                    chord[3][j], chord[4][j] = arms[j], others[j]
    for j in range(k):
        if failed[linked[j]]:
            r[j], chord[3][j], chord[4][j] = first[j], arms[j], others[j]
    after, turning = _pushed(chord, r, bodies[0], inverse, free, omega)
    c = _doubled(chord, v, after, 0.5 * (omega + turning))
    for j in range(k):
        if failed[linked[j]]:
            c[j] = 0.0
    return chord, r, c


@njit(cache=True, error_model="numpy")
def aimed(rows, joints, pattern, anchors, bodies, begin, middle, v, h, gravity, r):  # noqa: PLR0913
    """What closes joints beside impulses r of all rows: their chords, c (k, 3), sides apart.

    rows: contacts and joints that r belongs to; joints: those of joints in the middle; the rest
    as in `closed_by`.  c is what the chords have of velocities after r, less what parts the
    sides at the end, as far as joints can give it; apart (k, 3): the sides then.
    """
    slave, master = joints[0], joints[1]
    x, Q, R, spun = middle
    inverse = global_inverse(R, bodies[2])
    omega = to_global(R, spun)
    after, turning = _pushed(rows, r, bodies[0], inverse, v + h * gravity, omega)
    turned, _ = turned_freely(bodies[1], bodies[2], Q, to_own(R, turning), 0.5 * h)
    ended = rotations(turned)
    _, apart = joint_rows(slave, master, anchors, x + 0.5 * h * after, ended)
    chord = _chord_rows(joints, anchors, begin, ended)
    factor = factorised(chord, pattern, bodies[0], inverse)
    mended = solved_bonds(pattern, factor, -2 / h * apart)
    after, turning = _pushed(chord, mended, bodies[0], inverse, after, turning)
    c = _doubled(chord, v, after, 0.5 * (omega + turning))
    return chord, c, apart


@njit(cache=True, error_model="numpy")
def _chord_rows(rows, anchors, begin, ended):
    """Rows of joints with the arms of the chords from rotations where a step begins."""
    slave, master, axes, arms, others = rows
    return (slave, master, axes, _chords(slave, arms, anchors[0], begin, ended),
            _chords(master, others, anchors[1], begin, ended))  # fmt: skip


@njit(cache=True, error_model="numpy")
def _doubled(rows, v, after, omega):
    """u of v and of what comes after, with the mean omega of both, added."""
    slave, master, axes, arms, others = rows
    return row_velocities(slave, master, axes, arms, others, v + after, 2 * omega)


@njit(cache=True, error_model="numpy")
def _closing_inplace(  # noqa: PLR0913
    rows, pattern, factor, anchors, bodies, inverse, middle, free, omega, h, r, failed
):  # fmt: skip
    """r (k, 3) with which sides of joints meet at the end; failed parts (k,) are noted.

    Returns the rotations (n, 3, 3) at the end.
    """
    x, Q, R = middle
    slave, master = rows[0], rows[1]
    linked, k = pattern[3], len(slave)
    active, size, last = ~failed, np.zeros(k), np.full(k, np.inf)
    left, least, ended = np.empty((k, 3)), np.zeros(k), R
    for step in range(CLOSINGS):
        after, turning = _pushed(rows, r, bodies[0], inverse, free, omega)
        turned, _ = turned_freely(bodies[1], bodies[2], Q, to_own(R, turning), 0.5 * h)
        ended = rotations(turned)
        _, apart = joint_rows(slave, master, anchors, x + 0.5 * h * after, ended)
        size[:] = 0.0
        for j in range(k):
            for i in range(3):
                size[linked[j]] += apart[j, i] ** 2
        any_left = False
        for g in range(k):
            if step == 0:
                least[g] = CLOSED * CLOSED * size[g]
            if active[g] and not size[g] <= NEARER * last[g]:
                failed[g], active[g] = True, False
            active[g] = active[g] and size[g] > least[g]
            any_left = any_left or active[g]
        if not any_left:
            break
        for j in range(k):
            for i in range(3):
                left[j, i] = -2 / h * apart[j, i] if active[linked[j]] else 0.0
        last[:] = size
        r += solved_bonds(pattern, factor, left)
    failed |= active
    return ended


@njit(cache=True, error_model="numpy")
def _chords(sides, arms, own, begin, end):
    """Arms a (k, 3) with h omega x a = (R1 - R0) X of turns about an axis, from R0 to R1.

    Across the axis that is the mean of both by tan(p) / p, p half the angle.  On the ground,
    and for turns too long for it, those of the middle.
    """
    out, n = arms.copy(), np.empty(3)
    mean, D = np.empty(3), np.empty((3, 3))
    for j in range(len(sides)):
        b = sides[j]
        if b < 0:
            continue
        for i in range(3):
            mean[i] = 0.0
            for k in range(3):
                mean[i] += 0.5 * (begin[b, i, k] + end[b, i, k]) * own[j, k]
                D[i, k] = 0.0
                for d in range(3):
                    D[i, k] += end[b, i, d] * begin[b, k, d]
        n[0], n[1], n[2] = D[2, 1] - D[1, 2], D[0, 2] - D[2, 0], D[1, 0] - D[0, 1]
        sine = 0.5 * np.sqrt(dot(n, n))
        cosine = 0.5 * (D[0, 0] + D[1, 1] + D[2, 2] - 1.0)
        if cosine <= 0.0:
            continue
        half = 0.5 * np.arctan2(sine, cosine)
        factor = np.tan(half) / half if half > 1e-8 else 1.0
        along = dot(n, mean) / (4 * sine * sine) if sine > 1e-8 else 0.0
        for i in range(3):
            out[j, i] = along * n[i] + factor * (mean[i] - along * n[i])
    return out


@njit(cache=True, error_model="numpy")
def _pushed(rows, r, masses, inverse, v, omega):  # noqa: PLR0913
    """v and omega (n, 3), in global axes, after impulses r of the rows."""
    slave, master, axes, arms, others = rows
    push, turn = row_impulses(slave, master, axes, arms, others, r, len(masses))
    after, turning = v.copy(), omega.copy()
    for b in range(len(masses)):
        for i in range(3):
            after[b, i] += push[b, i] / masses[b]
            for k in range(3):
                turning[b, i] += inverse[b, i, k] * turn[b, k]
    return after, turning


@njit(cache=True, error_model="numpy")
def left_of(levers, sides, joint_levers, joint_sides, pattern, factor, bodies):  # noqa: PLR0913
    """Parts (n, m) of |g|^2 of rows levers (n, 2, m, 6) on sides (n, 2) that joints leave."""
    n, m = levers.shape[0], levers.shape[2]
    out, w = np.zeros((n, m)), np.zeros((bodies, 6))
    u = np.empty((len(joint_sides), 3))
    for c in range(n):
        for a in range(m):
            whole = decided = 0.0
            for p in range(2):
                if sides[c, p] >= 0:
                    for e in range(6):
                        w[sides[c, p], e] = levers[c, p, a, e]
                        whole += levers[c, p, a, e] ** 2
            felt_inplace(joint_levers, joint_sides, w, u)
            x = solved_bonds(pattern, factor, u)
            for j in range(len(u)):
                for i in range(3):
                    decided += u[j, i] * x[j, i]
            for p in range(2):
                if sides[c, p] >= 0:
                    w[sides[c, p]] = 0.0
            out[c, a] = 1.0 - decided / whole
    return out


@njit(cache=True, error_model="numpy")
def pulled_by(normals, sides, joint_levers, joint_sides, pattern, factor, u, bodies):  # noqa: PLR0913
    """X^T u (n,) of rows normals (n, 2, 6) on sides (n, 2), by u (k, 3) of joints."""
    x, w = solved_bonds(pattern, factor, u), np.empty((bodies, 6))
    driven_inplace(joint_levers, joint_sides, x, w)
    out = np.zeros(len(sides))
    for c in range(len(sides)):
        for p in range(2):
            if sides[c, p] >= 0:
                for e in range(6):
                    out[c] += normals[c, p, e] * w[sides[c, p], e]
    return out
