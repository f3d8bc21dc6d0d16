"""The friction law of a model: values and functions on surfaces as numbers of contacts."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ...core.arrays import LARGEST
from ...core.errors import InvalidInput, UnsupportedLaw, within
from ...problem.law import (
    CappedCoulomb,
    Cohesive,
    Compliant,
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

SPRINGS = ("stiffness", "stick_stiffness")
CHANGES = {"mu_across": "orthotropic friction"} | dict.fromkeys(
    SPRINGS, "compliance of contact"
)  # numbers of laws that are changes of variables of u
SLANT = 1e-6  # part of a direction in the tangent plane that is one


def check_law(k: int, contact: Contact, dimension: int, *, large: bool) -> None:
    """Raise InvalidInput or UnsupportedLaw where contact k of a model can not have its law.

    large: contact is found in the current configuration.
    """
    where = f"contact on {contact.slave!r}"
    given = contact.numbers
    if "mu_across" in given and dimension == 2:
        raise InvalidInput(
            "in 2D there is one direction to slide along; expected one coefficient",
            ("contacts", k, "mu_across"), where,
        )  # fmt: skip
    if large and "cohesion" in given:
        raise UnsupportedLaw(
            "cohesion needs small strains and contact in the reference configuration",
            ("contacts", k, "cohesion"), where,
        )  # fmt: skip
    if not (large or contact.nitsche is not None):
        return
    for name, what in CHANGES.items():
        if name in given:
            raise UnsupportedLaw(
                f"{what} needs contact forces, method 'nodal' or 'mortar', and small strains "
                "with contact in the reference configuration", ("contacts", k, name), where,
            )  # fmt: skip


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
    values = {
        name: (_stiff if name in SPRINGS else _values)(contact, name, placed)
        for name in contact.numbers
    }
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
    if "cohesion" in values:
        size = weights ** (1 / (placed.rows.points.shape[1] - 1))
        touching = placed.rows.gap <= TOUCHING * size
        law = Cohesive(law, np.where(touching, values["cohesion"] * weights, 0.0))
    if not any(name in values for name in SPRINGS):
        return law
    rigid = np.zeros(len(weights))
    return Compliant(
        law, *(1 / (values[name] * weights) if name in values else rigid for name in SPRINGS)
    )


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


def _stiff(contact: Contact, name: str, placed: Placed) -> Array:
    """A stiffness per area at the contacts, (k,), > 0."""
    out = _values(contact, name, placed)
    for i in np.flatnonzero(out < 1 / LARGEST)[:1]:
        raise InvalidInput(
            f"contact on {contact.slave!r}: expected a {name} > 0, got {out[i]:g} at "
            f"{placed.rows.points[i].tolist()}; without one contact is rigid"
        )
    return out
