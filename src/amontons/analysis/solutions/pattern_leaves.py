"""The turns of `pattern_search`: what it could not exclude, some patterns at a time."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from ..statuses import ANY, States
from . import pattern_search as search

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Cut = tuple[States, Array]  # pattern and multipliers
NODES = 2000  # patterns between two looks at the clock, up to 20 contacts
NODE = 60.0  # operations of a pattern per square of the reactions


def leaves_of(
    A: Array, spread: Array, c: Array, box: tuple[Array, Array], reacts: Mask, frictional: Mask,
    cuts: list[Cut] | None = None, *, root: States | None = None,
    partner: NDArray[np.int64] | None = None,
) -> Iterator[tuple[States, int, bool]]:  # fmt: skip
    """(complete patterns that the search could not exclude, nodes, done?) in turns.

    Arguments as of `pattern_search.search_inplace`; box: low, high; cuts takes the excluded
    patterns with their multipliers.  root (nc,): where the search begins, by default with all
    contacts undecided; the first one has to be.
    """
    m, nc = len(c), len(reacts)
    levels = m + 2
    D = np.empty((levels, m, m + 1))
    basic, nonbasic = np.empty((2, levels, m), dtype=np.int64)
    states, turn = np.empty((levels, nc), dtype=np.int8), np.zeros((levels, 3), dtype=np.int64)
    nodes = max(20, NODES * 20**2 // max(20, nc) ** 2)  # a node costs some nc^2 and more
    leaves, cut = np.empty((2, nodes, nc), dtype=np.int8)
    proofs = np.empty((nodes, m))
    search.start_inplace(D, basic, nonbasic, states, A, c, ANY if root is None else root)
    partner = np.full(nc, -1) if partner is None else partner
    done, level = False, 0
    while not done:
        done, level, nodes, count, excluded = search.search_inplace(
            A, spread, c, *box, reacts, frictional, partner,
            D, basic, nonbasic, states, turn, level, leaves, cut, proofs,
        )  # fmt: skip
        if cuts is not None:
            cuts += zip(cut[:excluded].copy(), proofs[:excluded].copy(), strict=True)
        yield leaves[:count].copy(), nodes, done
