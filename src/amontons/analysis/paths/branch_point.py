"""Locating a branch point between two points of a curve.

There the matrix A of the corrector, bordered by the tangent, is singular.  With one row c and
one column b more, of which hardly any choice is wrong,

    [A  b; c^T  0] (v, tau) = (0, 1)                                                    (1)

stays regular, and tau, smooth along the curve, vanishes where A is singular ([G] section 3.1).
Regula falsi finds its zero from both sides.  The corrector itself fails close by; the chord
between the last points then leads on, with an error of the square of their distance.

[G] W. Govaerts, "Numerical methods for bifurcations of dynamical equilibria", SIAM 2000.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from .corrector import Curve, Factored, Spot, Tolerances

Array = NDArray[np.float64]
ROUNDS = 40
NEAR = 1e-11  # distance of the points on both sides, in that of the first ones, that is none
ASIDE = (0.0, 0.25, -0.25, 0.45, -0.45)  # of the way to either side, where the corrector fails


def branch_point(curve: Curve, a: Spot, b: Spot, tolerances: Tolerances) -> Spot | None:
    """The branch point between two points of a curve, None where tau keeps its sign."""
    borders = np.random.default_rng(0).standard_normal((2, len(a.y) + 1))
    fa, fb = _tau(curve, a, borders), _tau(curve, b, borders)
    if not fa * fb < 0:
        return None
    whole = _distance(curve, a, b)
    ga, gb, kept = fa, fb, 0  # halved on a side that stays, so that both come nearer
    for _ in range(ROUNDS):
        if _distance(curve, a, b) <= NEAR * whole:
            break
        new = next(_corrected(curve, a, b, ga / (ga - gb), tolerances), None)
        if new is None:
            break
        value = _tau(curve, new, borders)
        if value == 0:
            return new
        if value * fa > 0:
            a, fa, ga = new, value, value
            gb, kept = (gb / 2 if kept > 0 else gb), 1
        else:
            b, fb, gb = new, value, value
            ga, kept = (ga / 2 if kept < 0 else ga), -1
    return _between(curve, a, b, fa / (fa - fb))


def _tau(curve: Curve, spot: Spot, borders: Array) -> float:
    """tau of (1) at a point; 0 where even that matrix is singular."""
    A = curve.bordered(*curve.jacobian(spot.y, spot.p), spot.ty, spot.tp)
    column, row = borders
    right = np.zeros(len(row) + 1)
    right[-1] = 1.0
    if isinstance(A, np.ndarray):
        whole = np.block([[A, column[:, None]], [row[None, :], np.zeros((1, 1))]])
    else:
        whole = sparse.csc_array(
            sparse.block_array([[A, column[:, None]], [row[None, :], None]])
        )
    try:
        return float(Factored(whole).solve(right)[-1])
    except np.linalg.LinAlgError:
        return 0.0


def _corrected(
    curve: Curve, a: Spot, b: Spot, t: float, tolerances: Tolerances
) -> Iterator[Spot]:
    """Points of the curve near a share t of the way from a to b, where the corrector works."""
    reach = 0.5 * _distance(curve, a, b)
    for aside in ASIDE:
        guess = _between(curve, a, b, t + aside * (1 - t if aside > 0 else t))
        found = curve.correct(guess.y, guess.p, guess.ty, guess.tp, tolerances)
        if found is not None and _distance(curve, found[0], guess) <= reach:
            yield found[0]


def _between(curve: Curve, a: Spot, b: Spot, t: float) -> Spot:
    """The point of the chord at a share t, with the tangent in between."""
    ty, tp = curve.unit((1 - t) * a.ty + t * b.ty, (1 - t) * a.tp + t * b.tp)
    return replace(a, y=(1 - t) * a.y + t * b.y, p=(1 - t) * a.p + t * b.p, ty=ty, tp=tp)


def _distance(curve: Curve, a: Spot, b: Spot) -> float:
    return curve.length(b.y - a.y, b.p - a.p)
