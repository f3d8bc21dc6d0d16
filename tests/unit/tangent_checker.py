"""Tangents of problems with contact in the current configuration against differences."""

import numpy as np

STEP = 1e-6
SECOND = {-1: -1 / 2, 1: 1 / 2}
FOURTH = {-2: 1 / 12, -1: -2 / 3, 1: 2 / 3, 2: -1 / 12}  # error of order STEP^4


def checked_tangents(problem, draws, parts=SECOND):
    """Check the tangent at states v in directions; how many had the same pieces nearby.

    draws: pairs (v, direction), each (n,); parts: of the difference, by steps.
    """
    checked = 0
    for v, direction in draws:
        around = {k: v + k * STEP * direction for k in parts}
        if not all((problem.pieces(x) == problem.pieces(v)).all() for x in around.values()):
            continue
        difference = sum(part * problem.residual(around[k]) for k, part in parts.items()) / STEP
        found = problem.tangent(v) @ direction
        assert np.abs(found - difference).max() < 1e-7 * np.abs(found).max()
        checked += 1
    return checked
