"""Doubts about small sliding: contacts that slid farther than their pairs and normals know.

Pairs, gaps and normals are those of the start.  A contact that slides along a plane obstacle
loses nothing by that; on another body its force stays at its old place, and on a curved
obstacle it goes on along the old tangent.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ..contact import Plane
from ..contact.geometry import Obstacle
from ..contact.pairs import project
from ..errors import InvalidInput
from ..warned import ResultWarning
from .fields import ContactFields
from .matching import pairs_of

if TYPE_CHECKING:
    from .model import Model
    from .parts import Contact
    from .placing import Placed

Array = NDArray[np.float64]
FACETS = 1.0  # slip over the master's facet, along the slip, that its pairs may not know
OFF = 0.1  # the same for what lies outside of the master's edge
TURNED = 0.1  # radians by which a normal may turn
NOTICED = 5e-3  # the same below which nothing is said
FALLEN = 0.1  # how far a surface may fall back, relative to how far contact reaches
UNIFORM = 1e-2  # gaps that differ by less, relative, are one
WAY = (0.25, 0.5, 0.75, 1.0)  # parts of the slip at which normals are compared


def sliding_beyond_pairs(model: Model, fields: ContactFields) -> list[ResultWarning]:
    """Contacts that slid over a facet of their master, or off it."""
    if model.is_large:
        return []
    out = []
    for contact, placed, touching in pairs_of(model, fields):
        if placed.sides is None:
            continue
        slip = _vectors(fields, touching)
        moves = np.linalg.norm(slip, axis=1) > OFF * placed.narrowest
        touching, slip = touching[moves], slip[moves]
        if not len(touching):
            continue
        ratio, off = _beyond(placed, fields.points[touching], fields.frames[touching, 0], slip)
        far = (ratio > FACETS) | (off > 0)
        if far.any():
            text = _told_of_pairs(contact, np.linalg.norm(slip, axis=1), ratio, off)
            contacts = tuple(touching[far].tolist())
            out.append(ResultWarning("sliding-beyond-pairs", text, contacts))
    return out


def _vectors(fields: ContactFields, contacts: NDArray[np.int64]) -> Array:
    """Slip of some contacts in global axes, (k, d)."""
    return np.einsum("pkc,pk->pc", fields.frames[contacts, 1:], fields.slip[contacts])


def _beyond(placed: Placed, points: Array, normals: Array, slip: Array) -> tuple[Array, Array]:
    """Slip over the facet met, (k,), and distance outside of the master's edge, (k,), or 0.

    A facet counts as no longer than the slave: a master of one cell knows less than its size.
    """
    master, free = placed.master, np.ones(len(points), dtype=bool)
    length = np.linalg.norm(slip, axis=1)
    way = slip / length[:, None]
    before = project(points, master.points, master.blocks, facing=-normals, free=free)
    along = np.einsum("kac,kc->ka", master.points[master.nodes[before.facet]], way)
    facet = np.ptp(along, axis=1)
    whole = np.ptp(placed.rows.points @ way.T, axis=0)
    size = np.where(whole > 0, np.minimum(facet, whole), facet)
    after = project(points + slip, master.points, master.blocks, facing=-normals, free=free)
    beside = np.where(np.isfinite(before.beside), before.beside, 0.0)
    off = np.minimum(after.beside - beside, length) * ~after.found
    return length / size, np.where(off > OFF * size, off, 0.0)


def _told_of_pairs(contact: Contact, length: Array, ratio: Array, off: Array) -> str:
    k = int(ratio.argmax())
    left = int((off > 0).sum())
    gone = f", {left} of them off its edge by up to {off.max():.3g}" if left else ""
    return (
        f"contact on {contact.slave!r} with {contact.master!r}: contacts slid by up to "
        f"{length.max():.3g}, {ratio[k]:.2g} times the facet of the master there{gone}; "
        "pairs and gaps are those of the start, so that forces stay at their old places: move "
        "the meshes to where they slide and solve again, or take a Plane for a master that is "
        "flat and rigid"
    )


def sliding_beyond_curvature(model: Model, fields: ContactFields) -> list[ResultWarning]:
    """Contacts that slid along a curved obstacle farther than its normal and gap stay true."""
    if model.is_large:
        return []
    out = []
    for contact, _, touching in pairs_of(model, fields):
        obstacle = contact.obstacle
        if obstacle is None or isinstance(obstacle, Plane) or not len(touching):
            continue
        try:
            turned, fallen = _curved(obstacle, fields, touching)
        except InvalidInput:  # a function of the user that ends before the slip does
            turned, fallen = np.full((2, len(touching)), np.inf)
        reach = _reach(obstacle.gap(fields.points[touching]))
        far = (turned > TURNED) | ((turned > NOTICED) & (fallen > FALLEN * reach))
        if far.any():
            length = float(np.linalg.norm(fields.slip[touching], axis=1).max())
            text = _told_of_curvature(contact, length, turned.max(), fallen.max())
            contacts = tuple(touching[far].tolist())
            out.append(ResultWarning("sliding-beyond-curvature", text, contacts))
    return out


def _curved(
    obstacle: Obstacle, fields: ContactFields, touching: NDArray[np.int64]
) -> tuple[Array, Array]:
    """Largest angle by which the normal turns on the way, (k,), and change of the gap, (k,).

    The gap is compared with that of the same point without its slip.
    """
    start, normals = fields.points[touching], fields.frames[touching, 0]
    slip = _vectors(fields, touching)
    closed = (fields.gap[touching] - obstacle.gap(start))[:, None] * normals
    turned = np.zeros(len(touching))
    for part in WAY:
        there = obstacle.normals(start + part * slip)
        angle = 2 * np.arcsin(np.minimum(np.linalg.norm(there - normals, axis=1) / 2, 1.0))
        turned = np.maximum(turned, angle)
    left = obstacle.gap(start + closed + slip) - obstacle.gap(start + closed)
    return turned, np.abs(left)


def _reach(gap: Array) -> float:
    """How far apart surfaces were where they touch now: spread of the gaps (k,), or all."""
    spread, largest = float(np.ptp(gap)), float(np.abs(gap).max())
    return spread if spread > UNIFORM * largest else largest


def _told_of_curvature(contact: Contact, length: float, turned: float, fallen: float) -> str:
    what = "whose function ends before that"
    if np.isfinite(turned):
        what = (
            f"whose normal turns by {np.degrees(turned):.2g} degrees on this way and whose "
            f"surface leaves the tangent by {fallen:.3g}"
        )
    return (
        f"contact on {contact.slave!r}: contacts slid by up to {length:.3g} along a curved "
        f"obstacle, {what}; gaps and normals are those of the start: move the mesh to where it "
        "slides and solve again, or give the body a hyperelastic law, whose contact is where "
        "its nodes are"
    )
