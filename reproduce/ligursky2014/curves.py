"""Curves of figures: smooth between the points of a branch, and how far chords are off them.

Between two points of one piece a quantity is the cubic with its values and slopes at both ends,
where a piece ends the parabola that begins like it: the points of a continuation are as far
apart as the corrector allows, and straight chords between them would be seen.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import Any

import numpy as np

import amontons as am

Array = np.ndarray
Values = Callable[[Array, float], dict[str, float]]
PARTS = 16  # of an interval between two points, where a curve is drawn
STEP = 1e-5  # along the tangent, weighted, to difference a quantity


def sampled(branch: am.Branch, values: Values) -> dict[str, list[float]]:
    """The parameter "gamma" and values(state, parameter) along a branch, densely."""
    rows = [_row(point, values) for point in branch]
    if branch.linear:
        return _columns([at for at, _ in rows])
    dense = [rows[0][0]]
    for (one, two), (before, after) in zip(pairwise(branch), pairwise(rows), strict=True):
        same = one.piece == two.piece
        length = abs(two.arclength - one.arclength)
        dense += [
            _between(before, after, length, same, k / PARTS) for k in range(1, PARTS)
        ] + [after[0]]  # fmt: skip
    return _columns(dense)


def _row(point: Any, values: Values) -> tuple[dict[str, float], dict[str, float]]:
    """Values at a point, and their slopes along its tangent."""
    y, p = point.state, point.parameter
    here = {"gamma": p, **values(y, p)}
    dy, dp = STEP * point.direction, STEP * point.rate
    ahead, behind = values(y + dy, p + dp), values(y - dy, p - dp)
    slopes = {key: (ahead[key] - behind[key]) / (2 * STEP) for key in ahead}
    return here, {"gamma": point.rate, **slopes}


def _between(before: Any, after: Any, length: float, same: bool, share: float) -> Any:
    """Values at a share of the interval between two points."""
    (a, slope_a), (b, slope_b) = before, after
    out = {}
    for key in a:
        rise, start = b[key] - a[key], length * slope_a[key]
        end = length * slope_b[key] if same else 2 * rise - start
        curve = (start - rise) * (1 - share) + (rise - end) * share
        out[key] = a[key] + share * rise + share * (1 - share) * curve
    return out


def _columns(rows: Sequence[dict[str, float]]) -> dict[str, list[float]]:
    return {key: [row[key] for row in rows] for key in rows[0]}


def thinned(curve: dict[str, list[float]], most: float = 3e-5) -> dict[str, list[float]]:
    """As few of its points as keep every chord within `most` of the range of each quantity."""
    keys = list(curve)
    points = np.array([curve[key] for key in keys]).T
    scaled = points / np.maximum(np.ptp(points, axis=0), 1e-300)
    kept, first = [0], 0
    while first < len(points) - 1:
        last = first + 1
        while last + 1 < len(points) and _off(scaled[first : last + 2]) <= most:
            last += 1
        kept.append(last)
        first = last
    return {key: points[kept, k].tolist() for k, key in enumerate(keys)}


def _off(points: Array) -> float:
    """Largest distance of points from the chord of the first and the last, per component."""
    chord = points[-1] - points[0]
    size = chord @ chord
    share = (points - points[0]) @ chord / size if size > 0 else np.zeros(len(points))
    on = points[0] + np.clip(share, 0, 1)[:, None] * chord
    return float(np.abs(points - on).max())


def chord_error(drawn: dict[str, list[float]], curve: dict[str, list[float]]) -> float:
    """How far the chords of a drawn curve are from the points of a denser one; of the ranges.

    In the plane of gamma and each of the other quantities.
    """
    worst = 0.0
    for key in (key for key in curve if key != "gamma"):
        size = [max(np.ptp(curve[name]), 1e-300) for name in ("gamma", key)]
        line = np.array([drawn["gamma"], drawn[key]]).T / size
        points = np.array([curve["gamma"], curve[key]]).T / size
        worst = max(worst, max(_distance(point, line) for point in points))
    return worst


def _distance(point: Array, line: Array) -> float:
    """Of a point from a polygon."""
    start, chord = line[:-1], np.diff(line, axis=0)
    size = (chord**2).sum(axis=1)
    size[size == 0] = 1.0  # two points in one
    share = ((point - start) * chord).sum(axis=1) / size
    near = start + np.clip(share, 0, 1)[:, None] * chord
    return float(np.sqrt(((point - near) ** 2).sum(axis=1).min()))
