"""Which key of a case file an error comes from that only shows when the model is assembled."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from ...core.errors import AmontonsError, SingularOperator

if TYPE_CHECKING:
    from ...mechanics.model import Body, Contact, Model


KINDS = {"Traction": "traction", "Pressure": "pressure", "BodyForce": "body_force"}


def key_of(model: Model, error: AmontonsError, *, wall: bool = False) -> str:
    """Path such as "fix[1].value" or "contact[0].friction", found by trying part after part.

    wall: contacts come from [wall] and have no tables of their own.
    """
    from ...mechanics.model.supports import external_load, prescribed_values

    bodies = tuple(model.bodies)
    offsets = np.cumsum([0, *(body.mesh.points.size for body in bodies)])
    for k in range(len(model.supports)):
        supports = tuple(model.supports[: k + 1])
        if _fails(lambda s=supports: prescribed_values(bodies, s, offsets)):
            return f"fix[{k}].value"
    counts = dict.fromkeys(KINDS.values(), 0)
    for load in model.loads:
        kind = KINDS[type(load).__name__]
        if _fails(lambda one=load: external_load(bodies, (one,), offsets)):
            region = getattr(load, "region", None) is not None and "region" in str(error)
            return f"{kind}[{counts[kind]}].{'region' if region else 'value'}"
        counts[kind] += 1
    if wall:
        return "wall"
    for k, contact in enumerate(model.contacts):
        key = _key_of_contact(bodies, contact, str(error))
        if key is not None:
            return f"contact[{k}]{key}"
    if isinstance(error, SingularOperator) or str(error).startswith("supports"):
        return "fix"
    return "contact"


def _key_of_contact(bodies: tuple[Body, ...], contact: Contact, message: str) -> str | None:
    """The part of a contact that can not be placed, "" for the contact itself, None if none."""
    from ...mechanics.contact import contact_nodes, nodal_contact, pair_contact
    from ...mechanics.model.assembly import locate
    from ...mechanics.model.values import scalar_at

    k, surface = locate(bodies, contact.slave)
    mesh, obstacle = bodies[k].mesh, contact.obstacle
    if obstacle is not None:
        if _fails(lambda: nodal_contact(mesh, surface, obstacle)):
            return ".slave" if message.startswith("surface") else ".obstacle"
    elif contact.master is not None:
        j, other = locate(bodies, contact.master)
        if _fails(lambda: pair_contact(mesh, surface, bodies[j].mesh, other)):
            return ".slave" if message.startswith(f"surface {surface!r}") else ".master"
    name = contact.friction
    points = mesh.points[contact_nodes(mesh, surface)[0]]
    if _fails(lambda: scalar_at(getattr(contact, name), points, name)):
        return f".friction.{'coulomb' if name == 'mu' else 'tresca'}"
    return "" if message.startswith(f"contact on {contact.slave!r}") else None


def _fails(attempt: Callable[[], object]) -> bool:
    try:
        attempt()
    except AmontonsError:
        return True
    return False
