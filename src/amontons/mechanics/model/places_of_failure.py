"""Where no equilibrium is found further on: sides that have parted, cells that are flat."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from ..contact.current_mortar import MortarMeeting
from ..contact.current_pairs import Meetings
from ..elements.hyperelasticity import HyperelasticBody
from .nonlinear_parts import NonlinearParts
from .worst_cells import flattest, turned_corner

Array = NDArray[np.float64]
FLAT = 0.3  # det F below which a cell is worth a word
LEFT = 0.5  # of what a node bore for itself, `fading`, below which it is worth a word


def places_of_failure(parts: NonlinearParts, u: Array, earlier: Meetings) -> str:
    """What may be wrong at displacements u (nodes, d), in words; "" where nothing is seen.

    earlier: where sides met at the beginning of the step.
    """
    told = [*_parted(parts.meet(u), earlier), *_flat(parts, u)]
    return f"at the last state {', '.join(told)}" if told else ""


def _parted(now: Meetings, earlier: Meetings) -> Iterator[str]:
    """Slaves that face nothing of their masters, or are leaving their edges."""
    for here, before in zip(now.parts, earlier.parts, strict=True):
        if not (isinstance(here, MortarMeeting) and isinstance(before, MortarMeeting)):
            continue
        if here.pair.fold is not None:
            continue
        names = "{!r} faces {!r}".format(*here.pair.names)
        left = np.flatnonzero(here.remembered < LEFT * before.remembered)
        if not here.met.any():
            yield f"{names} nowhere: no contact force holds anything there"
        elif len(left):
            place = ", ".join(f"{c:.4g}" for c in here.x[here.slaves[left[0]]])
            less = f"by less than half, or no more, at {len(left)} nodes"
            yield f"{names} {less}, as at ({place})"


def _flat(parts: NonlinearParts, u: Array) -> Iterator[str]:
    """The flattest cell of each body that has finite strains, and the worst corner.

    A surface that folds turns corners inside out before any integration point.
    """
    each = zip(parts.names, parts.bodies, np.split(u, parts.ends), strict=True)
    for name, body, own in each:
        if isinstance(body, HyperelasticBody):
            least, cell = flattest(body.mesh, own)
            if least < FLAT:
                yield f"{cell} of body {name!r} is pressed to det F = {least:.3g}"
            if corner := turned_corner(body.mesh, own):
                yield f"{corner} in body {name!r}"
