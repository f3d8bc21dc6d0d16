"""Both ends of a step in compiled passes: the way to its middle, and from there to its end."""

from __future__ import annotations

import numpy as np

from ...core.compiled import njit
from .rows import rotations, row_impulses, turned, turned_freely


@njit(cache=True, error_model="numpy")
def middle_of(position, orientation, velocity, spin, h):
    """Positions (n, 3) and rotations (n, 3, 3) in the middle of a step h, as bodies move."""
    half = 0.5 * h
    return position + half * velocity, rotations(turned(orientation, half * spin))


@njit(cache=True, error_model="numpy")
def freely(velocity, spin, inertia, gravity, h):
    """Velocities after a step h without reactions, angular ones in own axes after half of it.

    All (n, 3).  The other half follows after the impulses, in `ended`: they act in the middle.
    """
    return velocity + h * gravity, turned_freely(inertia, spin, 0.5 * h)


@njit(cache=True, error_model="numpy")
def ended(rows, r, couples, R, bodies, gravity, h, begin, motion, free):  # noqa: PLR0913
    """Position, orientation, velocity and spin after impulses r of the rows, and energies.

    couples (n, 3): angular impulses on the bodies besides, in global axes.

    R: in the middle; bodies: masses (n,), inertia and its inverse (n, 3, 3) in own axes;
    begin (n, 3): positions before overlaps were mended, motion: after that, as `Motion`; free:
    of `freely`.  Energies: kinetic, potential, gain, of contacts, of mending.
    """
    masses, inertia, inverse = bodies
    slave, master, axes, arms, master_arms = rows
    position, orientation, velocity, spin = motion
    push, turn = row_impulses(slave, master, axes, arms, master_arms, r, len(masses))
    turn += couples
    after, turning = np.empty_like(velocity), np.empty_like(spin)
    x = np.empty_like(position)
    contact = kinetic = gain = potential = mending = 0.0
    own = np.empty(3)
    for b in range(len(masses)):
        moved = before = 0.0
        for i in range(3):
            own[i] = R[b, 0, i] * turn[b, 0] + R[b, 1, i] * turn[b, 1] + R[b, 2, i] * turn[b, 2]
        for i in range(3):
            after[b, i] = free[0][b, i] + push[b, i] / masses[b]
            turning[b, i] = free[1][b, i]
            for k in range(3):
                turning[b, i] += inverse[b, i, k] * own[k]
            x[b, i] = position[b, i] + 0.5 * h * (velocity[b, i] + after[b, i])
            contact += 0.5 * push[b, i] * (velocity[b, i] + after[b, i])
            contact += 0.5 * own[i] * (free[1][b, i] + turning[b, i])
            moved += after[b, i] * after[b, i]
            before += velocity[b, i] * velocity[b, i]
            weight = masses[b] * gravity[i]
            gain -= weight * (x[b, i] - begin[b, i])
            potential -= weight * x[b, i]
            mending -= weight * (position[b, i] - begin[b, i])
        new = 0.5 * (masses[b] * moved + _twice_turning(inertia[b], turning[b]))
        old = 0.5 * (masses[b] * before + _twice_turning(inertia[b], spin[b]))
        kinetic += new
        gain += new - old
    turning = turned_freely(inertia, turning, 0.5 * h)  # keeps the energy
    angle = 0.5 * h * (spin + turning)
    energies = kinetic, potential, gain, contact, mending
    return (x, turned(orientation, angle), after, turning), energies


@njit(cache=True, error_model="numpy")
def _twice_turning(J, W):
    total = 0.0
    for i in range(3):
        total += W[i] * (J[i, 0] * W[0] + J[i, 1] * W[1] + J[i, 2] * W[2])
    return total
