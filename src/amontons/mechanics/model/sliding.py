"""Doubts about small sliding: contacts that slid farther than their pairs and normals know.

Pairs, gaps and normals are those of the start.  A contact that slides along a plane obstacle
loses nothing by that; on another body its force stays at its old place, and on a curved
obstacle it goes on along the old tangent.  Contacts that stay open may pass into what they do
not know of.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ...core.errors import InvalidInput
from ...core.warned import ResultWarning
from ..contact import Plane
from ..contact.geometry import Obstacle
from ..contact.pairs import Projection, project
from .fields import ContactFields
from .matching import pairs_of

if TYPE_CHECKING:
    from .model import Model
    from .parts import Contact
    from .placing import Placed

Array = NDArray[np.float64]
Index = NDArray[np.int64]
FACETS = 1.0  # slip over the master's facet, along the slip, that its pairs may not know
OFF = 0.1  # the same for what lies outside of the master's edge
TURNED = 0.1  # radians by which a normal may turn
NOTICED = 5e-3  # the same below which nothing is said
FALLEN = 0.1  # how far a surface may fall back, relative to how far contact reaches
UNIFORM = 1e-2  # gaps that differ by less, relative, are one
PASSED = 1e-2  # depth, relative to the motion, that is no matter of rounding
WAY = (0.25, 0.5, 0.75, 1.0)  # parts of the slip at which normals are compared


def sliding_beyond_pairs(model: Model, fields: ContactFields) -> list[ResultWarning]:
    """Contacts that slid over a facet of their master, off it, or into another part of it."""
    out = []
    for contact, placed, numbers in pairs_of(model):
        if placed.sides is None:
            continue
        length = np.linalg.norm(fields.slip[numbers], axis=1)
        moved = length > OFF * placed.narrowest
        touches = fields.pressure[numbers] > 0
        slid = numbers[touches & moved]
        away = np.flatnonzero(~touches & moved)
        passed = _passed_master(placed, fields, numbers[away], placed.rows.gap[away])
        ratio, off = _beyond(placed, fields, slid)
        far = np.concatenate([slid[(ratio > FACETS) | (off > 0)], passed])
        if len(far):
            text = _told_of_pairs(contact, length[moved].max(), ratio, off, len(passed))
            contacts = tuple(np.sort(far).tolist())
            out.append(ResultWarning("sliding-beyond-pairs", text, contacts))
    return out


def _slips(fields: ContactFields, contacts: Index) -> Array:
    """Slip of some contacts in global axes, (k, d)."""
    return np.einsum("pkc,pk->pc", fields.frames[contacts, 1:], fields.slip[contacts])


def _beyond(placed: Placed, fields: ContactFields, contacts: Index) -> tuple[Array, Array]:
    """Slip over the facet met, (k,), and distance outside of the master's edge, (k,), or 0.

    A facet counts as no longer than the slave: a master of one cell knows less than its size.
    """
    if not len(contacts):
        return np.zeros(0), np.zeros(0)
    slip, points = _slips(fields, contacts), fields.points[contacts]
    length = np.linalg.norm(slip, axis=1)
    way = slip / length[:, None]
    before = _on_master(placed, fields, contacts, points)
    along = placed.master.points[placed.master.nodes[before.facet]] @ way[:, :, None]
    facet = np.ptp(along[:, :, 0], axis=1)
    whole = np.abs(way) @ np.ptp(placed.rows.points, axis=0)
    size = np.where(whole > 0, np.minimum(facet, whole), facet)
    after = _on_master(placed, fields, contacts, points + slip)
    beside = np.where(np.isfinite(before.beside), before.beside, 0.0)
    off = np.minimum(after.beside - beside, length) * ~after.found
    return length / size, np.where(off > OFF * size, off, 0.0)


def _on_master(
    placed: Placed, fields: ContactFields, contacts: Index, points: Array
) -> Projection:
    """Facets of the master closest to where contacts are, (k, d)."""
    master, free = placed.master, np.ones(len(points), dtype=bool)
    facing = -fields.frames[contacts, 0]
    return project(points, master.points, master.blocks, facing=facing, free=free)


def _passed_master(
    placed: Placed, fields: ContactFields, contacts: Index, gap: Array
) -> Index:
    """Those of some open contacts that are inside of the master now, by its first shape.

    gap (k,): at the start.
    """
    if not len(contacts):
        return contacts
    motion = _slips(fields, contacts)
    motion += (fields.gap[contacts] - gap)[:, None] * fields.frames[contacts, 0]
    points = fields.points[contacts] + motion
    hit = _on_master(placed, fields, contacts, points)
    depth = np.einsum("kc,kc->k", hit.closest - points, hit.normal)
    return contacts[hit.found & (depth > PASSED * np.linalg.norm(motion, axis=1))]


def _told_of_pairs(
    contact: Contact, length: float, ratio: Array, off: Array, passed: int
) -> str:
    left = int((off > 0).sum())
    told = [f"slid by up to {length:.3g}"]
    if len(ratio):
        told.append(f"{ratio.max():.2g} times the facet of the master there")
    if left:
        told.append(f"{left} of them off its edge by up to {off.max():.3g}")
    if passed:
        told.append(f"{passed} that are open have passed into another part of it")
    return (
        f"contact on {contact.slave!r} with {contact.master!r}: contacts {', '.join(told)}; "
        "pairs and gaps are those of the start, so that forces stay at their old places: move "
        "the meshes to where they slide and solve again, or take a Plane for a master that is "
        "flat and rigid"
    )


def sliding_beyond_curvature(model: Model, fields: ContactFields) -> list[ResultWarning]:
    """Contacts that slid along a curved obstacle farther than its normal and gap stay true."""
    out = []
    for contact, _, numbers in pairs_of(model):
        obstacle = contact.obstacle
        if obstacle is None or isinstance(obstacle, Plane) or not len(numbers):
            continue
        gap = obstacle.gap(fields.points[numbers])
        turned, fallen, depth = _curved(obstacle, fields, numbers, gap)
        touches = fields.pressure[numbers] > 0
        reach = _reach(gap[touches])
        slid = touches & ((turned > TURNED) | ((turned > NOTICED) & (fallen > FALLEN * reach)))
        passed = ~touches & (turned > NOTICED) & (depth > 0)
        far = slid | passed
        if far.any():
            length = float(np.linalg.norm(fields.slip[numbers[far]], axis=1).max())
            text = _told_of_curvature(contact, length, turned[far].max(), fallen[far].max(),
                                      int(passed.sum()))  # fmt: skip
            contacts = tuple(numbers[far].tolist())
            out.append(ResultWarning("sliding-beyond-curvature", text, contacts))
    return out


def _curved(
    obstacle: Obstacle, fields: ContactFields, contacts: Index, gap: Array
) -> tuple[Array, Array, Array]:
    """How far an obstacle is from its tangents where contacts slid to, (k,) each.

    gap (k,): at the start.  Largest angle by which the normal turns on the way; change of the
    gap, compared with the same point without its slip; depth inside of the obstacle, or 0 if
    hardly any.  Infinite angles where a function of the user ends before the slip does.
    """
    start, normals = fields.points[contacts], fields.frames[contacts, 0]
    slip = _slips(fields, contacts)
    closed = (fields.gap[contacts] - gap)[:, None] * normals
    turned = np.zeros(len(contacts))
    try:
        for part in WAY:
            there = obstacle.normals(start + part * slip)
            half = np.linalg.norm(there - normals, axis=1) / 2
            turned = np.maximum(turned, 2 * np.arcsin(np.minimum(half, 1.0)))
        now = obstacle.gap(start + closed + slip)
        left = np.abs(now - obstacle.gap(start + closed))
    except InvalidInput:
        moved = np.linalg.norm(slip, axis=1) > 0
        return np.where(moved, np.inf, 0.0), np.where(moved, np.inf, 0.0), 0 * turned
    hardly = PASSED * np.linalg.norm(closed + slip, axis=1)
    return turned, left, np.where(now < -hardly, -now, 0.0)


def _reach(gap: Array) -> float:
    """How far apart surfaces were where they touch now: spread of the gaps (k,), or all."""
    if not len(gap):
        return 0.0
    spread, largest = float(np.ptp(gap)), float(np.abs(gap).max())
    return spread if spread > UNIFORM * largest else largest


def _told_of_curvature(
    contact: Contact, length: float, turned: float, fallen: float, passed: int
) -> str:
    what = "whose function ends before that"
    if np.isfinite(turned):
        what = (
            f"whose normal turns by {np.degrees(turned):.2g} degrees on this way and whose "
            f"surface leaves the tangent by {fallen:.3g}"
        )
    if passed:
        what += f", {passed} that are open have passed into it"
    return (
        f"contact on {contact.slave!r}: contacts slid by up to {length:.3g} along a curved "
        f"obstacle, {what}; gaps and normals are those of the start: move the mesh to where it "
        "slides and solve again, or take kinematics='finite' of the contact (or a "
        "hyperelastic law), which is found where the nodes are"
    )
