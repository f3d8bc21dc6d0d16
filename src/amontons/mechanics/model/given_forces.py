"""Forces that contacts of two bodies give to other nodes, (1) to (3) of `moved_pairs`."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ..contact.current import ContactPoint, Pieces
from ..contact.current_pairs import Meetings
from ..contact.dragged import between_bodies
from .nonlinear_parts import NonlinearParts

Array = NDArray[np.float64]
Known = tuple[Array, Meetings, Array | None, Array | None, Array | None]


def balanced(
    parts: NonlinearParts, meeting: Meetings, needed: Array, less: Array | None = None
) -> Array:
    """f_int - f (dofs,) without the forces that contacts give to nodes other than the slave.

    At slaves it is C times that.  less (nc, d): what (3) takes off lambda.
    """
    if meeting.only_obstacles:
        return needed
    own = parts.gathers @ needed
    if parts.chained:
        to_others = others(parts, meeting)
        if less is not None:
            own = own + parts.gathers @ (given_to_others(parts, meeting) @ less.ravel())
        own = unchained(parts, to_others, own)
    own = own.reshape(parts.at.shape) * carried(parts, meeting)
    out = needed - meeting.given(own if less is None else own - less)
    out[parts.at] = (parts.gathers @ out).reshape(parts.at.shape)
    return out


def carried(parts: NonlinearParts, meeting: Meetings) -> Array:
    """1 for components of forces that contacts take, (nc, d), 0 for the others."""
    return (parts.contact.free & meeting.met[:, None]).astype(np.float64)


def balanced_law(
    parts: NonlinearParts, needed: Array, rest: Array,
    known: Known, pieces: Pieces | None = None,
) -> tuple[ContactPoint, Array]:  # fmt: skip
    """The law, and `balanced`, with (3) by the active or given pieces.

    rest: `balanced` without (3); known: s, where contacts meet, drawn, play and
    given of `CurrentContact.at`.
    """
    point = parts.contact.at(rest[parts.at], *known, pieces)
    if point.mixed is None and between_bodies(point) is None:
        return point, rest
    for _ in range(parts.chained + 1):  # forces on the next pair of a chain follow
        rest = balanced(parts, known[1], needed, kept_back(point, pieces))
        point = parts.contact.at(rest[parts.at], *known, pieces)
    return point, rest


def kept_back(point: ContactPoint, pieces: Pieces | None = None) -> Array | None:
    """(1 - theta) law of (3), (nc, d), of active or given pieces; None where nothing fades."""
    held = between_bodies(point)
    given = None if held is None else point.force * held
    if point.mixed is None:
        return None if given is None else -given
    faint = 1 - point.mixed.theta
    out = faint[:, None] * point.residual(pieces) * point.contact.free
    return out if given is None else out - given


def with_held(
    parts: NonlinearParts, needed: Array, rest: Array,
    known: Known,
) -> Array:  # fmt: skip
    """`balanced` with what friction along held components gives to others; as above."""
    for _ in range(parts.chained + 1):
        point = parts.contact.at(rest[parts.at], *known)
        if (held := between_bodies(point)) is None:
            return rest
        rest = balanced(parts, known[1], needed, -point.force * held)
    return rest


def unchained(parts: NonlinearParts, given: sparse.csr_array, gathered: Any) -> Any:
    """(I + C O)^-1 of (2) times an array or matrix (nc d, ...), given (dofs, nc d): O."""
    out = term = gathered
    for _ in range(parts.chained):
        term = -(parts.gathers @ (given @ term))
        out = out + term
    return out


def others(parts: NonlinearParts, meeting: Meetings) -> sparse.csr_array:
    """Forces on other nodes per force on the slaves, (dofs, nc d)."""
    return meeting.returned(carried(parts, meeting))


def given_to_others(parts: NonlinearParts, meeting: Meetings) -> sparse.csr_array:
    """The same per force of components that are heard, too."""
    heard = parts.contact.heard & meeting.met[:, None]
    return meeting.returned(heard.astype(np.float64))
