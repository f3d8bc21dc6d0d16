"""Tangents of problems with contact in the current configuration against differences."""

import numpy as np

STEP = 1e-6


def checked_tangents(problem, draws):
    """Check the tangent at states v in directions; how many had the same pieces nearby.

    draws: pairs (v, direction), each (n,).
    """
    checked = 0
    for v, direction in draws:
        behind, ahead = v - STEP * direction, v + STEP * direction
        if not all((problem.pieces(x) == problem.pieces(v)).all() for x in (behind, ahead)):
            continue
        difference = (problem.residual(ahead) - problem.residual(behind)) / (2 * STEP)
        found = problem.tangent(v) @ direction
        assert np.abs(found - difference).max() < 1e-7 * np.abs(found).max()
        checked += 1
    return checked
