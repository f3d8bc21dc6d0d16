"""What an audit asks of a deck beyond its model: what nodes are called, and how loads grow."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from ...core.errors import InvalidInput
from .course import Course
from .flat import Deck
from .history import History
from .large import is_large
from .mpc import turning_mpcs
from .scopes import Index
from .shapes import SHAPES
from .stages import Held

if TYPE_CHECKING:
    from ...mechanics.model import Model

STRAIGHT = 1e-9  # part of a value by which a course may leave its straight line


@dataclass(frozen=True, eq=False)
class About:
    """labels (nodes,): numbers of the mesh's nodes in the deck; are_unique: no two alike.

    plane: "", "strain", "stress" or "axisymmetric"; other: types of elements that are
    formulated otherwise, in words; large: NLGEOM, or *MPC
    with which CalculiX takes it; until: the end of the last step; one_way: all
    loads grow in proportion; at: the model at a time.  cells: numbers (k,) of elements in the
    deck and their nodes (k, n) in the mesh.  turning: types of nonlinear *MPC, and their nodes.
    """

    labels: Index
    are_unique: bool
    plane: str
    other: tuple[str, ...]
    large: bool
    until: float
    one_way: bool
    at: Callable[[float], Model]
    cells: tuple[tuple[Index, Index], ...]
    turning: tuple[tuple[str, Index], ...]

    @classmethod
    def of(
        cls, deck: Deck, history: History, numbers: Index, stages: Sequence[Held],
        make: Callable[[Held, float], Model],
    ) -> About:  # fmt: skip
        """Of a flat deck; numbers: of its nodes in the mesh, -1 for one without elements.

        make: the model of a stage at a time.
        """
        labels = np.zeros(len(numbers), dtype=np.int64)
        for names, _ in deck.point_labels:
            labels[names.node_at] = names.node_labels
        own = labels[numbers >= 0]
        kinds = dict.fromkeys(block.kind for block in deck.blocks)
        other = tuple(f"{k}: {SHAPES[k].note}" for k in kinds if SHAPES[k].note)
        courses = [*history.supports.courses, *history.forces.courses]
        courses += [course for course, _, _ in history.faces.values()]
        courses += [course for course, _, _, _ in history.bodies.values()]
        turning = tuple(turning_mpcs(deck, numbers))  # with one CalculiX takes NLGEOM
        plane = SHAPES[deck.blocks[0].kind].plane
        return cls(
            own, len(np.unique(own)) == len(own), plane, other,
            is_large(deck) or bool(turning), history.until,
            len(stages) == 1 and all(_is_ramp(c, history.until) for c in courses),
            partial(_at, tuple(stages), make), _cells(deck, numbers),
            turning,
        )  # fmt: skip


def _cells(deck: Deck, numbers: Index) -> tuple[tuple[Index, Index], ...]:
    """Elements of every block: what the deck calls them, and their nodes in the mesh."""
    labels = deck.element_labels()
    return tuple(
        (labels[block.first : block.first + len(block.nodes)], numbers[block.nodes])
        for block in deck.blocks
    )


def _at(stages: Sequence[Held], make: Callable[[Held, float], Model], time: float) -> Model:
    """The model at a time, that of the stage which ends there where two meet."""
    begun = [stage for stage in stages if stage.begin < time] or list(stages[:1])
    if any(c is not None and c.is_open for _, courses in begun[-1].supports for c in courses):
        raise InvalidInput(
            "the deck holds nodes where a step has brought them (FIXED, or a support that "
            "comes later): an audit of its state at the end needs to know where that is"
        )
    return make(begun[-1], time)


def _is_ramp(course: Course, until: float) -> bool:
    """True for a value that grows from 0 along one straight line until the end."""
    wanted = np.array(course.times) / until * course.at(until)
    inside = np.array(course.times) <= until
    off = np.abs(np.array(course.values) - wanted)[inside].max(initial=0.0)
    return bool(off <= STRAIGHT * max(abs(v) for v in course.values)) and course.times[0] <= 0
