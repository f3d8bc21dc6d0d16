"""Both ends of a step in compiled passes: the way to its middle, and from there to its end."""

from __future__ import annotations

import numpy as np

from ...core.compiled import njit
from .free_rotation import turned_freely, twice_energy
from .rows import rotations, row_impulses


@njit(cache=True, error_model="numpy")
def middle_of(position, orientation, velocity, spin, bodies, h):  # noqa: PLR0913
    """Half a step h as bodies move freely; bodies: see `ended`.

    Positions (n, 3), quaternions (n, 4), rotations (n, 3, 3) and angular velocities (n, 3) in
    own axes.
    The other half follows after the impulses, in `ended`: they act in the middle.
    """
    half = 0.5 * h
    Q, spun = turned_freely(bodies[1], bodies[2], orientation, spin, half)
    return position + half * velocity, Q, rotations(Q), spun


@njit(cache=True, error_model="numpy")
def ended(rows, r, couples, middle, bodies, gravity, h, begin, motion):  # noqa: PLR0913
    """Position, orientation, velocity and spin after impulses r of the rows, and energies.

    couples (n, 3): angular impulses on the bodies besides, in global axes; middle: of
    `middle_of`; bodies: masses (n,), inertia and its inverse (n, 3, 3) in own axes; begin
    (n, 3): positions before overlaps were mended, motion: after that, as `Motion`.  Energies:
    kinetic, potential, gain, of contacts and joints, of mending.
    """
    masses, inertia, inverse = bodies
    slave, master, axes, arms, master_arms = rows
    position, _, velocity, spin = motion
    _, Q, R, spun = middle
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
            after[b, i] = velocity[b, i] + h * gravity[i] + push[b, i] / masses[b]
            turning[b, i] = spun[b, i]
            for k in range(3):
                turning[b, i] += inverse[b, i, k] * own[k]
            x[b, i] = position[b, i] + 0.5 * h * (velocity[b, i] + after[b, i])
            contact += 0.5 * push[b, i] * (velocity[b, i] + after[b, i])
            contact += 0.5 * own[i] * (spun[b, i] + turning[b, i])
            moved += after[b, i] * after[b, i]
            before += velocity[b, i] * velocity[b, i]
            weight = masses[b] * gravity[i]
            gain -= weight * (x[b, i] - begin[b, i])
            potential -= weight * x[b, i]
            mending -= weight * (position[b, i] - begin[b, i])
        new = 0.5 * (masses[b] * moved + twice_energy(inertia[b], turning[b]))
        old = 0.5 * (masses[b] * before + twice_energy(inertia[b], spin[b]))
        kinetic += new
        gain += new - old
    turned, left = turned_freely(inertia, inverse, Q, turning, 0.5 * h)  # keeps the energy
    energies = kinetic, potential, gain, contact, mending
    return (x, turned, after, left), energies
