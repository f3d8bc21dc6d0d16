"""Anderson acceleration of a fixed-point iteration on long vectors, with a short memory."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..core.compiled import njit
from ..core.threads import BLOCK, over_blocks
from ..linear.vectors import blocks_of

Array = NDArray[np.float64]
RANK = 1e-13  # is added to the diagonal of the scaled Gram matrix


class Anderson:
    """Combines the last `depth` steps x -> g(x) so that the steps nearly cancel."""

    def __init__(self, size: int, depth: int) -> None:
        self.depth = depth
        self.steps = np.zeros((depth, size))  # differences of g(x) - x
        self.images = np.zeros((depth, size))  # differences of g(x)
        self.last_step, self.last_image = np.zeros(size), np.zeros(size)
        self.gram = np.zeros((depth, depth))
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
        sums = np.empty((blocks_of(len(x)), used, 2))
        over_blocks(
            _record, len(x), (3.0 + 3 * used) * len(x), x, image, self.last_step,
            self.last_image, self.steps, self.images, slot, used, sums,
        )  # fmt: skip
        row, dots = np.add.reduce(sums, axis=0).T
        self.count += 1
        if not used:
            return
        self.gram[slot, :used] = self.gram[:used, slot] = row
        scale = 1 / np.sqrt(np.maximum(np.diag(self.gram)[:used], np.finfo(float).tiny))
        gram = self.gram[:used, :used] * np.outer(scale, scale)
        if not (np.isfinite(gram).all() and np.isfinite(dots).all()):
            return
        weights = scale * np.linalg.solve(gram + RANK * np.eye(used), scale * dots)
        work = (1.0 + used) * len(image)
        over_blocks(_combine, len(image), work, image, self.images, weights)


@njit(cache=True, error_model="numpy", fastmath={"contract", "reassoc"}, nogil=True)
def _record(begin, end, x, image, last_step, last_image, steps, images, slot, used, sums):  # noqa: PLR0913
    """Store the newest differences; their products with all steps, and those of g(x) - x."""
    for first in range(begin, end, BLOCK):
        last = min(first + BLOCK, end)
        for i in range(first, last):
            step = image[i] - x[i]
            if used:
                steps[slot, i] = step - last_step[i]
                images[slot, i] = image[i] - last_image[i]
            last_step[i] = step
            last_image[i] = image[i]
        for k in range(used):
            a, b = 0.0, 0.0
            for i in range(first, last):
                a += steps[k, i] * steps[slot, i]
                b += steps[k, i] * last_step[i]
            sums[first // BLOCK, k, 0], sums[first // BLOCK, k, 1] = a, b


@njit(cache=True, error_model="numpy", nogil=True)
def _combine(begin, end, image, images, weights):
    for first in range(begin, end, BLOCK):
        last = min(first + BLOCK, end)
        for k in range(len(weights)):
            w = weights[k]
            for i in range(first, last):
                image[i] -= w * images[k, i]
