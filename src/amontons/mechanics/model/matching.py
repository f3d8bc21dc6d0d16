"""A doubt about nodal contact between bodies: meshes that do not match."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ...core.warned import ResultWarning
from .fields import ContactFields
from .placing import Placed

if TYPE_CHECKING:
    from .model import Model
    from .parts import Contact

Array = NDArray[np.float64]
UNEVEN = 1e-2  # of a pressure, above which what does not match is told


def pairs_of(model: Model) -> Iterator[tuple[Contact, Placed, NDArray[np.int64]]]:
    """Contacts, what they are placed to, and their numbers in the fields."""
    ends = np.cumsum([0, *(len(p.rows.nodes) for p in model.discretisation.placed)])
    numbers = [np.arange(a, b) for a, b in zip(ends[:-1], ends[1:], strict=True)]
    return zip(model.contacts, model.discretisation.placed, numbers, strict=True)


def nodal_on_non_matching(model: Model, fields: ContactFields) -> list[ResultWarning]:
    """Nodal contacts that would get a uniform pressure wrong by more than UNEVEN.

    Or whose facets lie behind the surfaces that they stand for by more than this part of what
    contact closes: where a gap is off by as much as an overlap, so is the pressure.
    """
    out = []
    for contact, placed, numbers in pairs_of(model):
        here = np.flatnonzero(fields.pressure[numbers] > 0)
        rows, touching = placed.rows, numbers[here]
        if contact.method != "nodal" or placed.sides is None or not len(touching):
            continue
        off = placed.mismatch.force[placed.kept][here]
        behind = placed.mismatch.behind[placed.kept][here]
        closed = float((fields.gap[touching] - rows.gap[here] - behind).max())
        share = behind / closed if closed > 0 else np.where(behind > 0, np.inf, 0.0)
        wrong = (off > UNEVEN) | (share > UNEVEN)
        if wrong.any():
            text = _told(contact, float(off.max()), float(behind.max()), float(share.max()))
            contacts = tuple(touching[wrong].tolist())
            out.append(ResultWarning("nodal-on-non-matching-meshes", text, contacts))
    return out


def _told(contact: Contact, off: float, behind: float, share: float) -> str:
    parts = []
    if off > UNEVEN:
        parts.append(f"a uniform pressure reaches nodes of the master off by up to {off:.0%}")
    if share > UNEVEN:
        than = f"{share:.0%} of" if np.isfinite(share) else "more than"
        parts.append(
            f"facets of the master lie up to {behind:.3g} behind its curved surface, {than} "
            "what contact closes"
        )
    return (
        f"contact on {contact.slave!r} with {contact.master!r}: nodal contact needs meshes "
        f"that match, here {' and '.join(parts)}; take method='mortar', the default"
    )
