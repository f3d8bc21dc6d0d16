"""Held components of contacts between bodies along which these move on each other.

At a plane of symmetry both bodies are held in the same component, at nodes in one plane across
it, and go together: by symmetry there is no friction along it.  What else supports hold of a
slave along the surface may have friction from a master that moves past it.

Paths of solutions (`without_rubbed`) leave it out: where such a contact turns from slip to slip
the other way a path has a piece as steep as springs that stick, which the walk does not find.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ..contact.carried import TiedPair
from ..contact.current_mortar import MortarPair
from .nonlinear_parts import NonlinearParts

if TYPE_CHECKING:
    from .large_deformation import LargeDeformation

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
SAME = 1e-9  # distance over the size of the bodies that is none


def rubbed_between(parts: NonlinearParts, before: Array, now: Array) -> Mask | None:
    """Components (nc, d), None for none.

    before, now (dofs,): displacements at the end of the last step, and those that supports
    prescribe.
    """
    contact, d = parts.contact, parts.dimension
    if contact.free.all():
        return None
    fixed = np.ones(parts.X.size, dtype=bool)
    fixed[parts.free] = False
    fixed = fixed.reshape(parts.X.shape)
    out, start = np.zeros(contact.free.shape, dtype=bool), 0
    ends = [parts.X + moved.reshape(parts.X.shape) for moved in (before, now)]
    size = SAME * np.ptp(parts.X, axis=0).max()
    for pair in contact.pairs:
        mine = slice(start, start + len(pair.slaves))
        start = mine.stop
        if not isinstance(pair, MortarPair) or isinstance(pair, TiedPair):
            continue
        others = (pair.master if pair.fold is None else pair.fold.skin).every
        for c in range(d):
            held = pair.slaves[~contact.free[mine, c]]
            there = others[fixed[others, c]]
            if not len(held):
                continue
            apart = sum(
                (np.abs(x[held, None, c] - x[None, there, c]) for x in ends),
                np.zeros((len(held), len(there))),
            )
            together = (apart <= size).any(axis=1)
            out[mine, c] = ~contact.free[mine, c]
            out[mine, c][~contact.free[mine, c]] = ~together
    return out if out.any() else None


def hearing(parts: NonlinearParts, rubbed: Mask | None) -> NonlinearParts:
    """The same with friction along held components rubbed (nc, d) between bodies."""
    own = parts.contact.rubbed
    if _same(own, rubbed):
        return parts
    for known, other in tuple(parts.variants):
        if _same(known, rubbed):
            return other
    other = replace(parts, contact=replace(parts.contact, rubbed=rubbed))
    parts.variants.append((rubbed, other))
    other.variants.append((own, parts))
    return other


def without_rubbed(problem: LargeDeformation) -> LargeDeformation:
    """The problem as paths have it."""
    parts = hearing(problem.parts, None)
    return problem if parts is problem.parts else replace(problem, parts=parts)


def _same(one: Mask | None, other: Mask | None) -> bool:
    if one is None or other is None:
        return one is other
    return np.array_equal(one, other)
