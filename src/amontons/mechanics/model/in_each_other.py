"""A doubt about finite sliding: one body of a contact lies deep in the other, or through it.

A slave in front of which no master lies passes no force, wherever it is: with its sides through
a thin body it has equilibrium.  Gaps are averages over facets, so that bodies may overlap by a
part of them; no averages lead deeper than DEEP of the longer facet there.  Deeper are where
contacts give way, and what has a clearance.  A body in contact with itself is left out.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ...core.warned import ResultWarning
from ..contact.current_mortar import MortarPair
from ..contact.in_each_other import Boundary, Depth, deepest
from .fields import ContactFields

if TYPE_CHECKING:
    from .model import Model
    from .nonlinear_parts import NonlinearParts

Array = NDArray[np.float64]
DEEP = 0.25  # of the longer facet there


def bodies_in_each_other(model: Model, fields: ContactFields) -> list[ResultWarning]:
    """The pair of bodies in contact that lie in each other the deepest, by more than DEEP."""
    displacement = np.concatenate(fields.displacement)
    if not np.isfinite(displacement).all():
        return []
    from .nonlinear_parts import nonlinear_parts  # which has the outlines

    depth, told = deepest_overlap(nonlinear_parts(model), displacement)
    if not told:
        return []
    return [ResultWarning(
        "bodies-in-each-other",
        f"{told}, or {depth.share:.2g} of the longer facet there, which contact does not see: "
        "they do not get there without passing through each other; go there in smaller steps, "
        "with finer facets, or load it less",
    )]  # fmt: skip


def deepest_overlap(parts: NonlinearParts, u: Array, least: float = DEEP) -> tuple[Depth, str]:
    """How deep bodies in contact lie in each other at displacements u (nodes, d), in words.

    Of depths above `least` of a facet; "" for none.
    """
    worst, told = Depth(), ""
    for k, between in enumerate(parts.outlines):
        for (one, mine), (other, theirs) in between:
            depth = deepest(mine, theirs, parts.X + u, max(least, worst.share))
            if depth.share and depth.depth > _by_law(parts, u, k):
                where = ", ".join(f"{c:.4g}" for c in depth.place)
                worst = depth
                told = (f"bodies {one!r} and {other!r} lie in each other at ({where}), "
                        f"{depth.depth:.3g} deep")  # fmt: skip
    return worst, told


def _by_law(parts: NonlinearParts, u: Array, k: int) -> float:
    """How deep a pair of bodies may be by its clearance, and is where its contacts give way."""
    pairs, give = parts.contact.pairs, parts.contact.law.give
    offset = pairs[k].offset
    allowed = float(np.max(offset, initial=0.0))
    if give is None:
        return allowed
    first = sum(len(pair.slaves) for pair in pairs[:k])
    meeting = parts.meet(u).parts[k]
    soft = meeting.met & (give[first : first + len(meeting.met), 0] > 0)
    return max(allowed, -float((meeting.gap - offset)[soft].min(initial=0.0)))


def outlines(parts: NonlinearParts) -> tuple[tuple, ...]:
    """Of every contact pair the pairs of different bodies that it is between.

    Each twice (name, boundary).
    """
    starts, found, out = [0, *parts.ends.tolist()], {}, []

    def outline(body: int) -> tuple[str, Boundary]:
        if body not in found:
            found[body] = Boundary.of(parts.bodies[body].mesh, starts[body])
        return parts.names[body], found[body]

    for pair in parts.contact.pairs:
        if not isinstance(pair, MortarPair) or pair.fold is not None:
            out.append(())
            continue
        slave, master = (
            np.unique(np.searchsorted(parts.ends, skin.all, side="right")).tolist()
            for skin in (pair.slave, pair.master)
        )
        out.append(tuple((outline(i), outline(j)) for i in slave for j in master if i != j))
    return tuple(out)
