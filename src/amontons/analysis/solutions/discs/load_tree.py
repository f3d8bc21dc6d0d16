"""The compiled part of the search over load or friction in 3D: boxes that can not be excluded.

Boxes hold a state of every contact (`statuses`), an arc of directions of those that slip, and a
span of t.  Each is excluded (`cone_exclusion`), or a contact that is not decided is: open or
closed, stick or slip on a third of the circle.  Where all are, it is a leaf.
"""

from __future__ import annotations

import math

import numpy as np

from ....core.compiled import njit
from ....core.copies import copy_inplace, copy_rows_inplace
from ...statuses import ANY, CLOSED, FREE, FRICTIONLESS, SLIP, STICK
from .cone_exclusion import exclude

THIRD = math.pi / 3
PARTS = 4  # most entries that a box turns into


@njit(cache=True)
def _push_inplace(stack, top, states, middle, half, span):
    """Put a box on the stack (states, middles, halves, spans); the new top."""
    copy_inplace(states, stack[0][top])
    copy_inplace(middle, stack[1][top])
    copy_inplace(half, stack[2][top])
    copy_inplace(span, stack[3][top])
    return top + 1


@njit(cache=True)
def undecided(W, load, states, mu, guess):
    """The contact to decide next, -1 for none: where the guess breaks the law most."""
    nc = len(states)
    u = load.copy()
    for k in range(3 * nc):
        for j in range(nc):
            for part in range(3):
                u[k] += W[k, 3 * j + part] * guess[j, part]
    worst, where = -1.0, -1
    for i in range(nc):
        normal = guess[i, 0]
        if states[i] == ANY:
            score = 1e-6 + max(min(normal, u[3 * i]), 0.0)
        elif states[i] == CLOSED:
            slip = math.hypot(u[3 * i + 1], u[3 * i + 2])
            inside = mu[i] * normal - math.hypot(guess[i, 1], guess[i, 2])
            score = 1e-9 + max(min(slip, inside), 0.0)
        else:
            continue
        if score > worst:
            worst, where = score, i
    return where


@njit(cache=True)
def _decide_inplace(stack, top, states, middle, half, span, i, reacts, mu, guess):  # noqa: PLR0913
    """Boxes for what a contact may do."""
    if states[i] == CLOSED:
        first = math.atan2(-guess[i, 2], -guess[i, 1])
        for part in range(3):
            states[i], middle[i], half[i] = SLIP, first + 2 * part * THIRD, THIRD
            top = _push_inplace(stack, top, states, middle, half, span)
        states[i], middle[i], half[i] = STICK, 0.0, math.pi
        return _push_inplace(stack, top, states, middle, half, span)
    if reacts[i]:
        states[i] = CLOSED if mu[i] > 0 else FRICTIONLESS
        top = _push_inplace(stack, top, states, middle, half, span)
    states[i] = FREE
    return _push_inplace(stack, top, states, middle, half, span)


@njit(cache=True)
def _ends_inplace(q, mu, span, mus, loads, load):
    """Fill in friction and loads of a span as `exclude` wants them, and the load in its middle.

    Sizes are those of the terms: near a t at which a load or friction vanishes it is off by
    more than its own rounding.
    """
    for i in range(mu.shape[1]):
        a, b = mu[0, i] + span[0] * mu[1, i], mu[0, i] + span[1] * mu[1, i]
        mus[0, i], mus[1, i] = min(a, b), max(a, b)
        mus[2, i] = abs(mu[0, i]) + abs(mu[1, i])
    for j in range(len(load)):
        loads[2, j] = abs(q[0, j]) + abs(q[1, j])
        for side in range(2):
            loads[side, j] = q[0, j] + span[side] * q[1, j]
        load[j] = (loads[0, j] + loads[1, j]) / 2


@njit(cache=True)
def leaves_inplace(  # noqa: PLR0913
    W, q, mu, reacts, most, fastest, stack, top, budget, leaves, guesses
):
    """Go on with the search: (boxes on the stack, boxes seen, leaves).

    W (3 nc, 3 nc), q (2, 3 nc), mu (2, nc): load and friction at t = 0, and their change.
    most: bound of sum r_N, fastest (nc,): of |u_T|.  stack, leaves: states, middles, halves
    (k, nc), spans (k, 2); guesses (k, nc, 6): (r, u) of leaves.  Ends with `budget` boxes seen,
    or with no room in one of these.
    """
    nc = len(reacts)
    seen = found = 0
    y, guess, arcs = np.zeros(3 * nc), np.zeros((nc, 6)), np.zeros((2, nc))
    mus, loads, load = np.zeros((3, nc)), np.zeros((3, 3 * nc)), np.zeros(3 * nc)
    while top > 0 and seen < budget:
        if top + PARTS > len(stack[0]) or found == len(guesses):
            break
        top -= 1
        seen += 1
        states, span = stack[0][top].copy(), stack[3][top].copy()
        copy_inplace(stack[1][top], arcs[0])
        copy_inplace(stack[2][top], arcs[1])
        _ends_inplace(q, mu, span, mus, loads, load)
        if exclude(W, states, arcs, mus, loads, most, fastest, y, guess):
            continue
        i = undecided(W, load, states, mus[1], guess)
        if i >= 0:
            top = _decide_inplace(
                stack, top, states, arcs[0], arcs[1], span, i, reacts, mus[1], guess
            )
            continue
        _push_inplace(leaves, found, states, arcs[0], arcs[1], span)
        copy_rows_inplace(guess, guesses[found])
        found += 1
    return top, seen, found
