"""The friction law of a model: values and functions on surfaces as numbers of contacts."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from ...core.arrays import LARGEST
from ...core.errors import InvalidInput, UnsupportedLaw, within
from ...problem.law import (
    CappedCoulomb,
    Cohesive,
    Compliant,
    Coulomb,
    FrictionCurve,
    Kind,
    Law,
    Orthotropic,
    Overclosure,
    Tied,
    Tresca,
    VaryingCompliance,
    VaryingFriction,
    joined,
)
from ...problem.law.law import BOUND, MU
from .assembly import Discretisation
from .parts import BONDS, Contact
from .placing import Placed
from .values import ScalarValue, scalar_at

Array = NDArray[np.float64]
TOUCHING = 1e-6  # gap, relative to the size of a node's area, up to which both sides touch

APART = 0.5  # the same, up to which sides may be tied
SPRINGS = BONDS
NEEDS_FORCES = {  # numbers of laws that need both r and u, and why some formulations lack them
    name: f"{what} needs contact forces, method 'nodal' or 'mortar'"
    for name, what in (("mu_across", "orthotropic friction"), ("mu", VaryingFriction.name),
                       *((name, "compliance of contact") for name in SPRINGS))
}  # fmt: skip
OF_LINEAR_BODIES = {
    "mu": f"{VaryingFriction.name} needs bodies that do not yield",
}
SLANT = 1e-6  # part of a direction in the tangent plane that is one


def check_law(k: int, contact: Contact, dimension: int, lacks: Mapping[str, str]) -> None:
    """Raise InvalidInput or UnsupportedLaw where contact k of a model can not have its law.

    lacks: names of numbers that the model's formulation does not take, and why; "mu" is that
    of a curve.
    """
    where = f"contact on {contact.slave!r}"
    given = contact.numbers
    if "mu_across" in given and dimension == 2:
        raise InvalidInput(
            "in 2D there is one direction to slide along; expected one coefficient",
            ("contacts", k, "mu_across"), where,
        )  # fmt: skip
    asked = {name for name, value in given.items()
             if name != "mu" or isinstance(value, FrictionCurve)}  # fmt: skip
    asked |= {"tied"} if contact.tied else set()
    asked |= {"clearance"} if contact.clearance is not None else set()
    if contact.tied and "tied" not in lacks:  # bonds have springs where ties are
        asked.discard("stick_stiffness")
    for name, why in lacks.items():
        if name in asked:
            raise UnsupportedLaw(why, ("contacts", k, name), where)


def law_of(contacts: Sequence[Contact], parts: Discretisation) -> Law:
    """The laws of all contacts one after another, stresses being forces in the unit of r."""
    return law_of_placed(contacts, parts.placed)


def law_of_placed(contacts: Sequence[Contact], every: Sequence[Placed]) -> Law:
    """The same of contacts that have been placed."""
    laws = []
    for k, (contact, placed) in enumerate(zip(contacts, every, strict=True)):
        with within("contacts", k):
            laws.append(_law(contact, placed))
    return joined(laws)


def rubs(law: Law) -> NDArray[np.bool_]:
    """Contacts with friction, (nc,)."""
    most = law.widest
    if most is None:
        return np.ones(len(law), dtype=bool)
    mu, bound = most.parameters[:, MU], most.parameters[:, BOUND]
    return ((mu > 0) | (law.kind == Kind.TRESCA) | law.tied) & (bound > 0)


def _law(contact: Contact, placed: Placed) -> Law:
    """The law of one pair of surfaces."""
    values = {
        name: (_stiff if name in SPRINGS else _values)(contact, name, placed)
        for name, value in contact.numbers.items()
        if not isinstance(value, FrictionCurve | Overclosure)
    }  # fmt: skip
    if isinstance(contact.stiffness, Overclosure):
        law = _law_of(contact, values, placed)
        return VaryingCompliance(contact.stiffness, placed.rows.weights, law)
    if isinstance(contact.mu, FrictionCurve):
        values["mu"] = np.zeros(len(placed.rows.weights))
        law = _law_of(contact, values, placed)
        return VaryingFriction(contact.mu, placed.rows.weights, law=law)
    return _law_of(contact, values, placed)


def _law_of(contact: Contact, values: dict[str, Array], placed: Placed) -> Law:
    """The law of numbers at the contacts, (k,) each."""
    weights = placed.rows.weights
    if contact.tied:
        law: Law = _tied(contact, placed)
    elif "tresca" in values:
        law = Tresca(values["tresca"] * weights)
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


def _tied(contact: Contact, placed: Placed) -> Tied:
    """Ties of sides that are not too far apart to be meant."""
    gap, weights = placed.rows.gap, placed.rows.weights
    far = np.abs(gap) > APART * weights ** (1 / (placed.rows.points.shape[1] - 1))
    for i in np.flatnonzero(far)[:1]:
        raise InvalidInput(
            f"contact on {contact.slave!r}: {int(far.sum())} of its points are farther from "
            f"the other side than half of their facets are long, the first {gap[i]:.3g} at "
            f"{placed.rows.points[i].tolist()}; leave out by where= what is not to be tied"
        )
    return Tied(len(gap))


def _angle(contact: Contact, placed: Placed) -> Array:
    """From t1 to the direction in the tangent plane of each contact, (k,), in radians."""
    direction = np.asarray(contact.direction, dtype=float)
    frames = placed.rows.frames if placed.axes is None else placed.axes.frames
    _, along, across = np.moveaxis(frames @ direction, 1, 0)
    if (np.hypot(along, across) < SLANT * np.linalg.norm(direction)).any():
        raise InvalidInput(
            f"contact on {contact.slave!r}: expected a direction along the surface, got "
            f"{direction.tolist()}, the normal of one of its contacts"
        )
    return np.arctan2(across, along)


def _values(contact: Contact, name: str, placed: Placed) -> Array:
    """A number of the law at the contacts, (k,); a stress that is a function as its mean."""
    numbers: dict[str, ScalarValue] = contact.numbers
    value = numbers[name]
    what = f"{name} on {contact.slave!r}"
    with within(name):
        given = scalar_at(
            value, placed.all_points, what,
            each=placed.each,
        )
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
