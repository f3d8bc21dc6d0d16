"""How far forces and motions of one side are from the law of hard contact.

All deviations are lengths, weighted by the forces that act along them: a contact with the
pressure force r_N > 0 should have the gap 0, one that slips by s the friction mu r_N against
s.  With the approach of the pair, the length over which contact closes and flattens it,

    share = sum |r_N gap| / (approach sum r_N),
    missing = sum (mu r_N |s| + r_T . s)+ / sum mu r_N max(largest |s|, sheared),

the second that of de Saxce's bipotential: zero where friction is at its bound against the
slip, or nothing slips; sheared is the length by which friction at its bound shears what it acts
on.  Both are numbers without a unit, and about the error of the forces that contact hard and
rigid would have.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from .sides import Side

Array = NDArray[np.float64]
Index = NDArray[np.int64]
Mask = NDArray[np.bool_]
PRESSED = 0.02  # of the largest force per area, above which a contact carries load
AWAY = 0.25  # of the approach: a contact that is so far open, inside or slid is no mistake
NOTHING = 1e-9  # of the largest nodal force: contact forces that are none
FAIR = 0.02  # share of gaps at points with which an answer holds contact there
UNEVEN = 5.0  # pressure at points over its mean around a node, as stiff penalties have it
SECTOR = np.sin(np.radians(1.0))  # of half the angle of CalculiX' bricks around an axis
RATIO = 0.1  # of mu: friction that is off its bound by more is off
INSIDE = "inside the other side"
FLAT = 0.99  # length of the mean of unit normals from which a surface is flat


@dataclass(frozen=True, eq=False)
class Give:
    """What the deck's own law gives way by: lengths per traction, 0 for hard and rigid.

    meant: it counts as the law, not as a means.
    """

    normal: float = 0.0
    shear: float = 0.0
    meant: bool = False


@dataclass(frozen=True, eq=False)
class Seen:
    """How one side obeys the law; numbers without a unit but for lengths and forces.

    overlap, missing: the shares above, overlap_flat that of the facets, *_deck those of the
    deck's own law; hidden: part of the forces that rounding may have moved.  cone: friction
    above its bound, over all pressure; tension: pull over all pressure.  deepest (length, <= 0:
    none), at which node.  impossible: contacts whose status can not be, `why` (nc,) in words.
    """

    side: Side
    pressed: Mask
    overlap: float
    overlap_flat: float
    overlap_deck: float
    missing: float
    missing_deck: float
    cone: float
    tension: float
    hidden: float
    blurred: float
    deepest: float
    deepest_node: int
    impossible: Mask
    why: NDArray[np.object_]
    impossible_share: float
    slides: Mask


def approach_of(side: Side, young: float, force: float) -> tuple[float, float]:
    """Lengths over which contact and friction act.

    The first is what contact closes, or how deep its pressure reaches; the second how far
    friction shears, mu times the latter.  force: the largest at any node of the model, to tell
    what carries load.
    """
    tied = bool(side.law.tied.any())
    carried = np.linalg.norm(side.r, axis=1) if tied else np.maximum(side.r[:, 0], 0.0)
    total = float(carried.sum())
    pressed = carried > NOTHING * force if tied else _pressed(side, force)
    if not pressed.any() or not total > 0:
        return float(np.abs(side.start_flat - side.flat).max(initial=0.0)), 0.0
    area = float(side.weight[pressed].sum())
    d = side.points.shape[1]
    size = float(np.ptp(side.points[pressed], axis=0).max(initial=0.0))
    around = 2 * np.pi * float(side.points[pressed, 0].mean()) if side.turned else 1.0
    size = max(size, float((area / around) ** (1.0 / (d - 1))))
    deep = total / area * size / young
    if tied:  # a bond closes nothing
        return deep, 0.0
    closing = float(np.abs(side.start_flat - side.flat)[pressed].max(initial=0.0))
    bound = float(side.law.bound(side.r)[pressed].sum()) / total
    return max(closing, deep), bound * deep


def _pressed(side: Side, force: float) -> Mask:
    traction = side.r[:, 0] / side.weight
    most = float(traction.max(initial=0.0))
    loaded = side.r[:, 0] > np.maximum(2 * side.bound[:, 0], NOTHING * force)
    return (traction > PRESSED * most) & loaded


def _carries_nothing(side: Side, force: float) -> bool:
    """True where all forces of a side are rounding, and that rounding is small."""
    size = np.abs(side.r).max(initial=0.0)
    blind = float(side.bound.max(initial=0.0))
    return bool(size <= max(2 * blind, NOTHING * force)) and blind <= RATIO * force


def seen(  # noqa: PLR0913
    side: Side, give: Give, approach: float, sheared: float, slip: Array, force: float
) -> Seen:  # fmt: skip
    """Hold one side against its law; slip (nc, d-1): the motion that friction answers.

    sheared: the length over which friction acts; force: the largest at any node of the model.
    """
    if _carries_nothing(side, force):
        side = replace(side, r=np.zeros_like(side.r), bound=np.zeros_like(side.bound))
    r, weight = side.r, side.weight
    normal, push = np.maximum(r[:, 0], 0.0), np.linalg.norm(r[:, 1:], axis=1)
    if side.law.tied.any():
        return _tied(side, give, approach)
    total = float(normal.sum())
    most = max(total, float(np.maximum(-r[:, 0], 0.0).sum()))
    pressed = _pressed(side, force)
    scale = approach * total
    bound = side.law.bound(r)
    rubs: Mask = np.asarray(side.known.all(axis=1))
    excess = np.maximum(push - bound - side.bound[:, 1:].max(axis=1, initial=0.0), 0.0) * rubs
    pull = np.maximum(-r[:, 0] - side.bound[:, 0], 0.0)
    soft_gap = give.normal * normal / weight
    views = {"curved": side.gap, "flat": side.flat, "points": side.points_gap}
    shares = {name: _pressing(normal, gap, side.blur, scale) for name, gap in views.items()}
    best = min(views, key=lambda name: shares[name])
    best = "points" if shares["points"] <= FAIR else best
    gap = views[best]
    deck = min(_pressing(normal, g + soft_gap, side.blur, scale) for g in views.values())
    lost, hard = _missing(side, bound, slip, rubs, sheared)
    plastic = _plastic(side, give, slip, bound)
    soft = min(_missing(side, bound, each, rubs, sheared)[1] for each in plastic)
    if give.meant:
        lost, slip = _missing(side, bound, plastic[1], rubs, sheared)[0], plastic[1]
    why = _statuses(side, (pressed, bound, gap), (push, slip, lost, rubs), (approach, sheared))
    bad = why != ""
    carried = np.maximum(normal, total / max(len(normal), 1))
    deepest = int(side.node[gap.argmin()]) if len(gap) else 0
    return Seen(
        side, pressed, shares["curved"], min(shares["flat"], shares["points"]), deck,
        hard, soft,
        _over(float(excess.sum()), most), _over(float(pull.sum()), most),
        _over(float(side.bound[:, 0].sum()), total), _over(float(side.blur.max(initial=0.0)),
        approach), max(-float(gap.min(initial=0.0)), 0.0), deepest, bad, why,
        _over(float(carried[bad & (why != INSIDE)].sum()), float(carried.sum())),
        pressed & rubs & (push >= (1 - RATIO) * bound),
    )  # fmt: skip


def _pressing(normal: Array, gap: Array, blur: Array, scale: float) -> float:
    """Share of gaps (nc,) that pressure forces (nc,) have, over approach times pressure."""
    left = np.maximum(np.abs(gap) - blur, 0.0)
    return _over(float((normal * left).sum()), scale)


def _missing(
    side: Side, bound: Array, slip: Array, rubs: Mask, sheared: float
) -> tuple[Array, float]:
    """Work that friction should have taken, as a length of each contact; their share."""
    length = np.linalg.norm(slip, axis=1)
    work = np.maximum(bound * length + (side.r[:, 1:] * slip).sum(axis=1), 0.0) * rubs
    able = (bound > 0) & rubs
    lost = np.where(able, work / np.where(able, bound, 1.0), 0.0)
    longest = float(length[able].max(initial=0.0))
    left = np.maximum(work - bound * _unsettled(side, slip, bound), 0.0)
    return lost, _over(float(left.sum()), float(bound[able].sum()) * max(longest, sheared))


def _plastic(side: Side, give: Give, slip: Array, bound: Array) -> tuple[Array, Array]:
    """Slips (nc, d-1) less what the deck's stick slope gives way: by the force, and at most.

    Where pressure varies over a facet, friction is at its bound at some points, and below at
    others that have not slipped as far: the mean is below either, until all points slip.
    """
    weight = side.weight[:, None]
    length = np.linalg.norm(slip, axis=1)
    most = UNEVEN * give.shear * bound / side.weight
    left = np.maximum(1.0 - most / np.where(length > 0, length, 1.0), 0.0)
    return slip + give.shear * side.r[:, 1:] / weight, slip * left[:, None]


def _unsettled(side: Side, slip: Array, bound: Array) -> Array:
    """Slip (nc,) without friction that an average may have where its facets slip in part.

    Half a patch that sticks without friction, and half that slips twice the mean against all of
    it: a quarter of how slip varies over the patch.  None where all neighbours slip that way,
    or friction is nowhere near its bound.
    """
    length = np.linalg.norm(slip, axis=1)
    moved = np.einsum("pk,pkc->pc", slip, side.frame[:, 1:])
    way = moved / np.where(length > 0, length, 1.0)[:, None]
    own, other = side.around.nonzero()
    least = length.copy()
    np.minimum.at(least, own, (way[own] * moved[other]).sum(axis=1))
    full = np.linalg.norm(side.r[:, 1:], axis=1) >= (1 - RATIO) * bound
    near = side.around @ full > 0
    return np.where((least < AWAY * length) & near, (length - least) / 4.0, 0.0)


def _statuses(
    side: Side, pressing: tuple[Mask, Array, Array],
    rubbing: tuple[Array, Array, Array, Mask], lengths: tuple[float, float],
) -> NDArray[np.object_]:  # fmt: skip
    """Why the status of a contact can not be, "" where it can."""
    push, slip, lost, rubs = rubbing
    off = 2 * side.bound[:, 0]
    pressed, bound, gap = pressing
    traction = side.r[:, 0] / side.weight
    most = float(np.abs(traction).max(initial=0.0))
    far, slid = (AWAY * length + side.blur for length in lengths)
    length = np.linalg.norm(slip, axis=1)
    why = np.full(len(gap), "", dtype=object)
    clear = push > bound * (1 + RATIO) + side.bound[:, 1:].max(axis=1, initial=0.0)
    least = RATIO * (bound if bound.any() else side.r[:, 0]).max(initial=0.0)  # or no friction
    why[pressed & rubs & clear & (push > least)] = "above the cone"
    slipped = pressed & rubs & (length > slid) & (lost > AWAY * length)
    why[slipped] = "slips without the friction that it should have"
    along = (side.r[:, 1:] * slip).sum(axis=1)
    why[slipped & (along > 0) & (push > RATIO * bound)] = "friction drives it along"
    why[pressed & (gap > far)] = "pressed, though open"
    why[gap < -far] = INSIDE
    why[(traction < -PRESSED * most) & (-side.r[:, 0] > off)] = "pulls"
    return why


def along_facets(side: Side) -> float:
    """How far closing moves points of facets along them, where these turn from node to node.

    Around an axis facets are flat over the sector of 2 degrees that programs with bricks have.
    """
    normals = side.frame[:, 0]
    own, other = side.around.nonzero()
    cosine = np.clip((normals[own] * normals[other]).sum(axis=1), -1.0, 1.0)
    closing = np.abs(side.start_flat - side.flat)[own]
    half = np.sqrt((1.0 - cosine) / 2.0)
    half = np.maximum(half, SECTOR) if side.turned else half
    return float((closing * half).max(initial=0.0))


def _tied(side: Side, give: Give, approach: float) -> Seen:
    """A bond: neither gap nor slip, whatever the force."""
    size = np.abs(side.r).sum(axis=1)
    total = float(size.sum())
    moved = np.linalg.norm(np.column_stack([side.gap, side.slip]), axis=1)
    left = np.maximum(moved - side.blur, 0.0)
    share = _over(float((size * left).sum()), approach * total)
    why = np.full(len(size), "", dtype=object)
    far = left > AWAY * approach if approach > 0 else left > side.blur
    why[far] = "tied, and moved apart"
    worst = int(left.argmax()) if len(left) else 0
    return Seen(
        side, size > 0, share, share, share if not give.normal else 0.0, 0.0, 0.0, 0.0, 0.0,
        _over(float(side.bound.sum()), total), 0.0, float(left.max(initial=0.0)),
        int(side.node[worst]), far, why, float(far.mean()) if len(far) else 0.0,
        np.zeros(len(size), dtype=bool),
    )  # fmt: skip


def _over(part: float, whole: float) -> float:
    """part / whole, 0 of nothing."""
    return part / whole if whole > 0 else 0.0


def pair_as_one(one: Seen, approach: float) -> tuple[float | None, float, float]:
    """(share of friction that is missing, friction over its bound, slip) of a flat pair.

    All contacts as one: resultants are known where forces at nodes are lost in rounding.  None
    for a surface that is not flat, or an unknown law.
    """
    side = one.side
    normals, area = side.frame[:, 0], side.weight
    mean = (area[:, None] * normals).sum(axis=0) / area.sum()
    if np.linalg.norm(mean) < FLAT or not side.known.all() or side.law.given(side.r).any():
        return None, 0.0, 0.0
    force = np.einsum("pk,pkc->c", side.r, side.frame)
    slip = np.einsum("p,pk,pkc->c", area, side.slip, side.frame[:, 1:]) / area.sum()
    normal = mean / np.linalg.norm(mean)
    push = float(force @ normal)
    shear = force - push * normal
    mu = float((side.law.parameters[:, 0] * area).sum() / area.sum())
    length, bound = float(np.linalg.norm(slip)), mu * max(push, 0.0)
    work = max(bound * length + float(shear @ slip), 0.0)
    share = _over(work, bound * max(length, approach))
    return share, _over(float(np.linalg.norm(shear)), bound), length
