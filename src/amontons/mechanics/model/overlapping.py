"""A doubt about where bodies are put: sides of a contact that overlap by a part of a facet.

A press fit overlaps by far less than its facets are wide, or says by how much (`clearance`).
What overlaps by more was mostly put into the wrong place, or given in other units; static or in
time, contact pushes it out, which strains bodies or throws them.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ...core.warned import ResultWarning
from .fields import ContactFields
from .matching import pairs_of

if TYPE_CHECKING:
    from .model import Model

DEEP = 0.1  # of the narrowest facet of the master


def overlap_at_start(model: Model, fields: ContactFields) -> list[ResultWarning]:
    """Pairs of surfaces that overlap as they are given by more than DEEP of a facet."""
    out = []
    for contact, placed, numbers in pairs_of(model):
        if placed.sides is None or contact.clearance is not None or not len(numbers):
            continue
        depth = -placed.rows.gap
        deep = depth > DEEP * placed.narrowest
        if not deep.any():
            continue
        worst = int(depth.argmax())
        at = model.discretisation.sites.points[numbers[worst]]
        text = (
            f"contact on {contact.slave!r} with {contact.master!r}: the bodies overlap at the "
            f"start by {depth[worst]:.3g} at ({', '.join(f'{x:.4g}' for x in at)}), which "
            "contact pushes out at once; give positions without overlap, or say that it is "
            "meant, as in a press fit, by clearance="
        )
        out.append(ResultWarning("overlap-at-start", text, tuple(numbers[deep].tolist())))
    return out
