"""Where the contacts of a model are: those of all pairs one after another."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .placing import Placed

Array = NDArray[np.float64]
Index = NDArray[np.int64]


class Sites(NamedTuple):
    """points (nc, d), frames (nc, d, d) by rows, weights (nc,): areas; body, node (nc,).

    Nodes are those of slaves, numbered in their body.  A model without contacts has none.
    """

    points: Array
    frames: Array
    weights: Array
    body: Index
    node: Index

    @classmethod
    def of(cls, placed: Sequence[Placed], d: int) -> Sites:
        """Those of pairs in d dimensions."""
        rows = [one.rows for one in placed]
        return cls(
            np.concatenate([np.zeros((0, d)), *(row.points for row in rows)]),
            np.concatenate([np.zeros((0, d, d)), *(row.frames for row in rows)]),
            np.concatenate([np.zeros(0), *(row.weights for row in rows)]),
            np.repeat(
                np.array([one.body for one in placed], dtype=np.int64),
                np.array([len(row.nodes) for row in rows], dtype=np.int64),
            ),
            np.concatenate([np.zeros(0, np.int64), *(row.nodes for row in rows)]),
        )
