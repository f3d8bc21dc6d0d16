"""What contacts face where the bodies are now, for what is told of stresses on both sides."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ..contact.current_pairs import Meeting, Meetings, between_bodies

Array = NDArray[np.float64]
Index = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Onto:
    """What contacts of a pair, k of them, give the nodes (m,) of the model that are its master.

    parts (m, k): weights N of the nodes in the contacts; force (m, d): on them, global axes.
    """

    nodes: Index
    parts: sparse.csr_array
    force: Array


@dataclass(frozen=True, eq=False)
class Faced:
    """Areas and masters of the contacts of a model at one state.

    areas (nc,): of now, that forces at contacts act on, those of `contact.grown_areas`; passed
    (nc,): forces of all nodes of the slave's side over these, and their areas over those; onto:
    of every pair, None with an obstacle.
    """

    areas: Array
    passed: Array
    onto: tuple[Onto | None, ...]

    @classmethod
    def of(cls, meeting: Meetings, weights: Array, force: Array) -> Faced:
        """Where contacts meet; weights (nc,): undeformed areas; force (nc, d): global axes."""
        areas, passed = weights * meeting.stretch, meeting.passed
        return cls(areas, passed, tuple(_each(meeting, force)))

    @classmethod
    def whole(cls, meeting: Meetings, weights: Array, force: Array) -> Faced:
        """The same with force (nc, d): those of all nodes of the slave's side."""
        told = cls.of(meeting, weights, force / meeting.passed[:, None])
        return cls(told.areas * told.passed, np.ones_like(told.passed), told.onto)


def _each(meeting: Meetings, force: Array) -> Iterator[Onto | None]:
    start = 0
    for part in meeting.parts:
        mine = slice(start, start + len(part.slaves))
        start = mine.stop
        mortar = None if isinstance(part, Meeting) else between_bodies(part.pair)
        if mortar is None:
            yield None
            continue
        nodes = mortar.master.every
        given = Meetings([part]).given(force[mine]).reshape(-1, force.shape[1])
        parts = sparse.csr_array(-part.averages.tocsc()[:, nodes].T)
        yield Onto(nodes, parts, given[nodes])
