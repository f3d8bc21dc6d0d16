"""A doubt about bodies that slide far: supports hold sliding contacts along the surface.

What supports take of friction between bodies is there (`contact.dragged`) but along components
in which the master is held in the same plane, too, and in steps along paths, which leave it out
(`rubbed_between`).  Nothing is missing where the sides do not move on each other there, as in
planes of symmetry.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ...core.warned import ResultWarning
from .fields import ContactFields
from .laws import rubs
from .nonlinear_parts import nonlinear_parts
from .rubbed_between import rubbed_between

if TYPE_CHECKING:
    from .model import Model

Array = NDArray[np.float64]
MISSING = 0.01  # part of what friction may bear in a pair, missing, that is told
NONE = 1e-9  # part of it that is rounding of no friction
SAME_PLANE = (
    ", where they hold the master in the same plane, too; these have no friction with "
    "kinematics 'finite'", "hold one elsewhere",
)  # fmt: skip
ALONG_PATHS = (
    "; paths leave out what friction these have",
    "solve without a path (follow, PathCrossing), hold the body elsewhere, or take the other "
    "surface as the slave",
)  # fmt: skip


def held_friction(model: Model, fields: ContactFields) -> list[ResultWarning]:
    """Pairs whose friction is notably less for want of that along held components."""
    displacement = np.concatenate(fields.displacement)
    contact = nonlinear_parts(model).contact
    if contact.free.all() or not np.isfinite(displacement).all():
        return []
    missing, bound, why = _missing(model, fields, displacement)
    out, start = [], 0
    for k, pair in enumerate(contact.pairs):
        mine = slice(start, start + len(pair.slaves))
        start = mine.stop
        most, lost = bound[mine].sum(), missing[mine]
        if lost.sum() > MISSING * most:
            worst = fields.points[mine][int(lost.argmax())]
            told = int((lost > 0).sum()), lost.sum() / most, worst, why
            out.append(_warning(model, k, *told))
    return out


def _missing(
    model: Model, fields: ContactFields, displacement: Array
) -> tuple[Array, Array, tuple[str, str]]:
    """(friction missing for supports, the most that friction bears, why), forces (nc,).

    Of a contact that moves by s along components that are held what is missing is at most the
    force that its body answers s with, rho |s|, as a contact that sticks shows.
    """
    parts = nonlinear_parts(model)
    contact = parts.contact
    r = np.c_[fields.pressure, fields.shear] * fields.weights[:, None]
    meeting = contact.meet(parts.X + displacement)
    law = contact.over(meeting).law
    bound = np.where((r[:, 0] > 0) & rubs(law) & ~law.tied, law.bound(r), 0.0)
    motion = meeting.relative(displacement)
    normal = fields.frames[:, 0]
    along = motion - (motion * normal).sum(axis=1)[:, None] * normal
    heard, why = contact.heard, SAME_PLANE
    rubbed = rubbed_between(parts, np.zeros_like(displacement), displacement)
    if rubbed is not None:
        force = np.einsum("pk,pkc->pc", r[:, 1:], fields.frames[:, 1:])
        if (np.abs(force[rubbed]) > NONE * bound.sum()).any():
            heard = heard | rubbed
        else:
            why = ALONG_PATHS
    held = np.linalg.norm(np.where(heard, 0.0, along), axis=1)
    return np.minimum(bound, contact.rho * held), bound, why


def _warning(
    model: Model, k: int, count: int, part: float, at: Array, why: tuple[str, str]
) -> ResultWarning:
    contact = model.contacts[k]
    where = ", ".join(f"{c:.6g}" for c in at)
    return ResultWarning(
        "held-without-friction",
        f"contact on {contact.slave!r} with {contact.master!r}: supports hold {count} of its "
        f"contacts along the surface on which they slide, as at [{where}]{why[0]}, and about "
        f"{100 * part:.3g} % of what friction bears is missing; {why[1]}",
    )
