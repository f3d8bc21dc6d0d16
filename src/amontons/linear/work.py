"""Vectors to work in, which nobody keeps anything in from one call to the next."""

from __future__ import annotations

from functools import cached_property
from threading import local

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


class Work(local):
    """x, b and r of a level, (nodes, 3); every thread has its own, each from its first use."""

    def __init__(self, nodes: int) -> None:
        self.nodes = nodes

    @cached_property
    def x(self) -> Array:
        """Zero at first."""
        return np.zeros((self.nodes, 3))

    @cached_property
    def b(self) -> Array:
        """Zero at first."""
        return np.zeros((self.nodes, 3))

    @cached_property
    def r(self) -> Array:
        """Zero at first."""
        return np.zeros((self.nodes, 3))

    def rest(self) -> None:
        """Give up the vectors of this thread, until they are used again."""
        for name in ("x", "b", "r"):
            self.__dict__.pop(name, None)

    def __reduce__(self) -> tuple:
        return Work, (self.nodes,)
