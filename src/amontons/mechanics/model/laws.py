"""The friction law of a model: values and functions on surfaces as numbers of contacts."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ...core.errors import InvalidInput, within
from ...problem.law import (
    CappedCoulomb,
    Cohesive,
    Coulomb,
    Kind,
    Law,
    Orthotropic,
    Tresca,
    joined,
)
from ...problem.law.law import BOUND, MU
from .assembly import Discretisation
from .parts import Contact
from .placing import Placed
from .values import scalar_at

Array = NDArray[np.float64]
TOUCHING = 1e-6  # gap, relative to the size of a node's area, up to which both sides touch

SLANT = 1e-6  # part of a direction in the tangent plane that is one


def law_of(contacts: Sequence[Contact], parts: Discretisation) -> Law:
    """The laws of all contacts one after another, stresses being forces in the unit of r."""
    laws = []
    for k, (contact, placed) in enumerate(zip(contacts, parts.placed, strict=True)):
        with within("contacts", k):
            laws.append(_law(contact, placed))
    return joined(laws)


def rubs(law: Law) -> NDArray[np.bool_]:
    """Contacts with friction, (nc,)."""
    mu, bound = law.parameters[:, MU], law.parameters[:, BOUND]
    return ((mu > 0) | (law.kind == Kind.TRESCA)) & (bound > 0)


def _law(contact: Contact, placed: Placed) -> Law:
    """The law of one pair of surfaces."""
    values = {name: _values(contact, name, placed) for name in contact.numbers}
    weights = placed.rows.weights
    if "tresca" in values:
        law: Law = Tresca(values["tresca"] * weights)
    elif "cap" in values:
        law = CappedCoulomb(values["mu"], values["cap"] * weights)
    elif "mu_across" in values:
        angle = values.get("angle")
        with within("direction"):
            angle = _angle(contact, placed) if angle is None else angle
        law = Orthotropic(values["mu"], values["mu_across"], angle)
    else:
        law = Coulomb(values["mu"])
    if "cohesion" not in values:
        return law
    size = weights ** (1 / (placed.rows.points.shape[1] - 1))
    touching = placed.rows.gap <= TOUCHING * size
    return Cohesive(law, np.where(touching, values["cohesion"] * weights, 0.0))


def _angle(contact: Contact, placed: Placed) -> Array:
    """From t1 to the direction in the tangent plane of each contact, (k,), in radians."""
    direction = np.asarray(contact.direction, dtype=float)
    _, along, across = np.moveaxis(placed.rows.frames @ direction, 1, 0)
    if (np.hypot(along, across) < SLANT * np.linalg.norm(direction)).any():
        raise InvalidInput(
            f"contact on {contact.slave!r}: expected a direction along the surface, got "
            f"{direction.tolist()}, the normal of one of its contacts"
        )
    return np.arctan2(across, along)


def _values(contact: Contact, name: str, placed: Placed) -> Array:
    """A number of the law at the contacts, (k,); a stress that is a function as its mean."""
    value, what = contact.numbers[name], f"{name} on {contact.slave!r}"
    with within(name):
        given = scalar_at(
            value, placed.all_points, what,
            each="slave node" if contact.nitsche is None else "Gauss point",
        )  # fmt: skip
        if name in ("mu", "mu_across", "angle") or not callable(value):
            return given[placed.kept]
        # averaged as the gap is; dual functions may be negative
        return np.maximum(placed.rows.mean(lambda x: scalar_at(value, x, what)), 0.0)
