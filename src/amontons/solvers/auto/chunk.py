"""What the tracks of a race hand over: chunks, what they are asked for, and their sum."""

from __future__ import annotations

import math
from collections.abc import Generator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


class Chunk(NamedTuple):
    """What a track has after a chunk: r (nc, 3), its iterations, cost in ns and operations.

    flops None where they are not counted; error of r, unit of u, where it is known.  path: the
    error of where a method has got to, unit of u, where r, the best that it has come by, does
    not tell that.
    """

    r: Array
    iterations: int
    cost: float
    flops: float | None = None
    error: float = math.inf
    linear_iterations: int = 0
    path: float = math.inf


class Turn(NamedTuple):
    """What a track is sent: what a chunk may cost, in ns, and its best error, unit of u."""

    cost: float
    error: float


Chunks = Generator[Chunk, Turn, None]


@dataclass(eq=False)
class Done:
    """What tracks have done since the last iterate, and the last of them."""

    iterations: int = 0
    flops: float | None = 0.0  # None where one does not count them
    linear_iterations: int = 0
    stage: str = ""

    def add(self, chunk: Chunk, stage: str) -> None:
        """Count a chunk in."""
        self.iterations += chunk.iterations
        self.linear_iterations += chunk.linear_iterations
        if self.flops is not None:
            self.flops = None if chunk.flops is None else self.flops + chunk.flops
        self.stage = stage
