"""Vectors to work in, which nobody keeps anything in from one call to the next."""

from __future__ import annotations

from threading import local

import numpy as np


class Work(local):
    """x, b and r of a level, (nodes, 3); every thread has its own."""

    def __init__(self, nodes: int) -> None:
        self.nodes = nodes
        self.x, self.b, self.r = (np.zeros((nodes, 3)) for _ in range(3))

    def __reduce__(self) -> tuple:
        return Work, (self.nodes,)
