"""The turns of `pattern_search`: what it could not exclude, some patterns at a time."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from ..statuses import ANY, LOAD, States
from . import pattern_search as search

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Cut = tuple[States, Array]  # pattern and multipliers
NODES = 2000  # patterns between two looks at the clock, up to 20 contacts
NODE = 10.0  # operations of a pattern per square of the reactions


def leaves_of(
    A: Array, spread: Array, c: Array, box: tuple[Array, Array], reacts: Mask, frictional: Mask,
    cuts: list[Cut] | None = None, *, loaded: bool = False,
) -> Iterator[tuple[States, int, bool]]:  # fmt: skip
    """(complete patterns that the search could not exclude, nodes, done?) in turns.

    Arguments as of `pattern_search.search_inplace`; box: low, high; cuts takes the excluded
    patterns with their multipliers.  loaded: the last contact is the load (`statuses.LOAD`).
    """
    m, nc = len(c), len(reacts)
    levels = m + 2
    D = np.empty((levels, m, m + 1))
    basic, nonbasic = np.empty((2, levels, m), dtype=np.int64)
    states, turn = np.empty((levels, nc), dtype=np.int8), np.zeros((levels, 3), dtype=np.int64)
    nodes = max(20, NODES * 20**2 // max(20, nc) ** 2)  # a node costs some nc^2 and more
    leaves, cut = np.empty((2, nodes, nc), dtype=np.int8)
    proofs = np.empty((nodes, m))
    root = np.full(nc, ANY, dtype=np.int8)
    if loaded:
        root[-1] = LOAD
    search.start_inplace(D, basic, nonbasic, states, A, c, root)
    done, level = False, 0
    while not done:
        done, level, nodes, count, excluded = search.search_inplace(
            A, spread, c, *box, reacts, frictional,
            D, basic, nonbasic, states, turn, level, leaves, cut, proofs,
        )  # fmt: skip
        if cuts is not None:
            cuts += zip(cut[:excluded].copy(), proofs[:excluded].copy(), strict=True)
        yield leaves[:count].copy(), nodes, done
