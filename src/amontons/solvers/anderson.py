"""Anderson acceleration of a fixed-point iteration on long vectors, with a short memory."""

from __future__ import annotations

import numpy as np
from numba import float64
from numpy.typing import NDArray

from ..core.compiled import njit
from ..core.threads import BLOCK, over_blocks
from ..linear.vectors import blocks_of, norm

Array = NDArray[np.float64]
RANK = 1e-13  # is added to the diagonal of the scaled Gram matrix


class Anderson:
    """Combines the last `depth` steps x -> g(x) so that the steps nearly cancel.

    Differences are kept in single precision, in a unit of their own: they only choose between
    points, and their rounding falls with them.  Between two calls of `mix`, x is what the last
    one returned.
    """

    def __init__(self, size: int, depth: int) -> None:
        self.depth = depth
        self.steps = np.zeros((depth, size), np.float32)  # differences of g(x) - x
        self.images = np.zeros((depth, size), np.float32)  # differences of g(x)
        self.last_step = np.zeros(size if depth else 0, np.float32)
        self.gram = np.zeros((depth, depth))
        self.weights = np.zeros(0)  # of the last point: it was g(x) less these images
        self.unit = 1.0  # of the differences
        self.count = -1  # differences stored so far; -1: not even a step

    def forget(self) -> None:
        """Start again from the next step."""
        self.count = -1

    def mix(self, x: Array, image: Array) -> None:
        """image = g(x) becomes the next point, in place; x and image flat."""
        if self.depth == 0:
            return
        slot = max(self.count, 0) % self.depth
        used = min(self.count + 1, self.depth) if self.count >= 0 else 0
        if not used:
            self.unit = _unit(norm(image) / max(len(image), 1) ** 0.5)
        sums = np.empty((blocks_of(len(x)), used, 2))
        over_blocks(
            _record, len(x), (2.5 + 2 * used) * len(x), x, image, self.last_step,
            self.steps, self.images, self.weights, self.unit, slot, used, sums,
        )  # fmt: skip
        row, dots = np.add.reduce(sums, axis=0).T
        self.count += 1
        self.weights = np.zeros(0)
        if not used:
            return
        self.gram[slot, :used] = self.gram[:used, slot] = row
        scale = 1 / np.sqrt(np.maximum(np.diag(self.gram)[:used], np.finfo(float).tiny))
        gram = self.gram[:used, :used] * np.outer(scale, scale)
        if not (np.isfinite(gram).all() and np.isfinite(dots).all()):
            return
        found = scale * np.linalg.solve(gram + RANK * np.eye(used), scale * dots)
        self.weights = self.unit * found
        work = (1.0 + 0.5 * used) * len(image)
        over_blocks(_combine, len(image), work, image, self.images, self.weights)


def _unit(size: float) -> float:
    """A power of two near a size, 1 where there is none."""
    return 2.0 ** np.frexp(size)[1] if 0 < size < np.inf else 1.0


@njit(cache=True, error_model="numpy", fastmath={"contract", "reassoc"}, nogil=True)
def _record(begin, end, x, image, last_step, steps, images, weights, unit, slot, used, sums):  # noqa: PLR0913
    """Store the newest differences; their products with all steps, and those of g(x) - x.

    The last g(x) is x and what the last point lacked of it: images, which are still there.
    """
    inverse = 1 / unit
    for first in range(begin, end, BLOCK):
        last = min(first + BLOCK, end)
        for i in range(first, last):
            step = (image[i] - x[i]) * inverse
            if used:
                before = x[i]
                for k in range(len(weights)):
                    before += weights[k] * images[k, i]
                steps[slot, i] = step - last_step[i]
                images[slot, i] = (image[i] - before) * inverse
            last_step[i] = step
        for k in range(used):
            a, b = 0.0, 0.0
            for i in range(first, last):
                a += float64(steps[k, i]) * float64(steps[slot, i])
                b += float64(steps[k, i]) * float64(last_step[i])
            sums[first // BLOCK, k, 0], sums[first // BLOCK, k, 1] = a, b


@njit(cache=True, error_model="numpy", nogil=True)
def _combine(begin, end, image, images, weights):
    for first in range(begin, end, BLOCK):
        last = min(first + BLOCK, end)
        for k in range(len(weights)):
            w = weights[k]
            for i in range(first, last):
                image[i] -= w * images[k, i]
