"""Sets of tangents: where a piece has more than one tangent line, a cone of them leads on.

So it is at the points of [LR] example 4 (ii): first-order systems with a continuous branch of
solutions.  The cone { c : G c >= 0 } is told by its edges, and by the lines that it contains.

[LR] T. Ligurský, Y. Renard, CMAME 280 (2014), section 3.1.1.
"""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import dataclass
from itertools import combinations, islice

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

from ..tolerances import SAME, SLACK

Array = NDArray[np.float64]
CORNERS = 20_000  # combinations of conditions that are looked at


@dataclass(frozen=True, eq=False)
class TangentCone:
    """All tangents into one piece: sums of its edges with factors >= 0, and of its lines.

    edges (k, n + 1), lines (m, n + 1): rows (y', p') of weighted length 1.
    """

    piece: Hashable
    edges: Array
    lines: Array


def edges_and_lines(G: Array) -> tuple[Array, Array]:
    """(edges (k, n), lines (m, n)) of { c : G c >= 0 }, rows of length 1; G (conditions, n)."""
    size = np.linalg.norm(G, axis=1)
    G = G[size > SLACK] / size[size > SLACK, None]
    n = G.shape[1]
    if not len(G):
        return np.zeros((0, n)), np.eye(n)
    lines = linalg.null_space(G, rcond=SLACK).T
    across = linalg.orth(G.T, rcond=SLACK)  # the cone holds no line in this space
    H = G @ across
    kept: list[Array] = []
    for rows in islice(combinations(range(len(H)), H.shape[1] - 1), CORNERS):
        null = linalg.null_space(H[list(rows)], rcond=SLACK) if rows else np.eye(H.shape[1])
        if null.shape[1] != 1:
            continue
        for edge in (null[:, 0], -null[:, 0]):
            new = all(np.linalg.norm(edge - other) > SAME for other in kept)
            if new and (H @ edge >= -SLACK).all():
                kept.append(edge)
    edges = np.array(kept) @ across.T if kept else np.zeros((0, n))
    return edges, lines


def unit_rows(rows: Array, weight: float) -> Array:
    """Rows (y', p') of weighted length 1."""
    size = np.sqrt(weight * (rows[:, :-1] ** 2).sum(axis=1) + rows[:, -1] ** 2)
    return rows / size[:, None]
