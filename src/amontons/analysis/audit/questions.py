"""The questions of an audit to one contact pair, each answered by a `Finding`."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from .laws import INSIDE, Seen, along_facets, pair_as_one
from .verdict import RIGHT, UNDECIDED, WRONG, Finding

Array = NDArray[np.float64]
OVERLAP = 0.05  # share of the approach that gaps may keep where contact presses
ONE_SIDED = 0.25  # the same as the worse side sees it, whose facets may be coarse
MISSING = 0.012  # part of the work of friction; right answers of others have 2e-3
EXCESS = 0.01  # friction above its bound, over that bound
CONE = 0.02  # tension over all pressure, or friction where none is allowed
IMPOSSIBLE = 0.05  # part of the load on contacts whose status can not be
BULGE = 0.05  # share of the approach that facets may take from the curved surfaces
HIDDEN = 0.3  # part of the contact forces that rounding may hide before they say nothing
OFF = 0.1  # of the approach: facets this far off the surface spoil the pressure
FACETED = 0.25  # of the longest slip: slip on facets by closing alone that spoils friction
NAMED = 10
Name = Callable[[int], str]


def penetration(seen: tuple[Seen, ...], approach: float, element: float, moved: float,
                name: Name, *, deck: bool) -> Finding:  # fmt: skip
    """Whether the bodies overlap, or stay apart where they press.

    element: length of the smallest facet's side; moved: largest displacement; deck: the law's
    own stiffness counts as meant.
    """
    shares = [one.overlap_deck if deck else min(one.overlap, one.overlap_flat) for one in seen]
    deepest = max(seen, key=lambda one: one.deepest)
    own = min(one.overlap_deck for one in seen)
    depth = deepest.deepest
    hit = name(deepest.deepest_node) if depth > 0 else None
    numbers = {
        "share": min(shares), "share_other_side": max(shares), "share_by_deck_law": own,
        "deepest": depth, "deepest_node": hit, "approach": approach,
        "deepest_over_element": depth / element if element > 0 else 0.0,
        "deepest_over_displacement": depth / moved if moved > 0 else 0.0,
    }  # fmt: skip
    inside = _inside(seen, deck=deck)
    if min(one.hidden for one in seen) > HIDDEN and inside <= OVERLAP:
        return Finding(UNDECIDED, _hidden(seen), numbers)  # nobody knows where contact presses
    wrong = min(shares) > OVERLAP or max(shares) > ONE_SIDED or inside > OVERLAP
    text = (
        "no overlap" if depth <= 0 or not hit else
        f"deepest overlap {depth:.3g} at node {hit}, {numbers['deepest_over_element']:.2g} of "
        f"the smallest facet's side and {numbers['deepest_over_displacement']:.2g} of the "
        "largest displacement"
    )  # fmt: skip
    text += f"; gaps where contact presses are {max(shares):.2g} of what contact closes"
    if not wrong and depth > OVERLAP * approach > 0 and _carries_nothing(deepest):
        text += (f"; node {hit} carries no load, and overlaps by {depth / approach:.2g} of "
                 "that: only gaps where contact presses count, and area that lies a quarter "
                 f"of it inside, here {inside:.1%}")  # fmt: skip
    if wrong and not deck and own < 0.5 * min(shares):
        text += (f", of which the deck's own stiffness explains {1 - own / min(shares):.0%}: "
                 "a hard contact would not give way like that")  # fmt: skip
    if max(one.blurred for one in seen) > OVERLAP and not wrong:
        return Finding(UNDECIDED, "displacements have too few digits to tell gaps", numbers)
    return Finding(WRONG if wrong else RIGHT, text, numbers, (hit,) if wrong and hit else ())


def _carries_nothing(one: Seen) -> bool:
    """Whether the node that overlaps most is none of those that are pressed."""
    return not one.pressed[one.side.node == one.deepest_node].any()


def _inside(seen: tuple[Seen, ...], *, deck: bool) -> float:
    """Area of contacts deep in the other side, over that of all that are pressed or so deep."""
    if deck:
        return 0.0
    out = 0.0
    for one in seen:
        deep = one.why == INSIDE
        area = one.side.weight
        both = float(area[deep | one.pressed].sum())
        out = max(out, float(area[deep].sum()) / both if both > 0 else 0.0)
    return out


def cone(seen: tuple[Seen, ...], name: Name) -> Finding:
    """Whether friction is within its bound, and nothing pulls."""
    over, pull = [one.cone for one in seen], [one.tension for one in seen]
    numbers = {"excess": min(over), "excess_other_side": max(over), "tension": min(pull),
               "ratio": max(_ratio(one) for one in seen)}  # fmt: skip
    if min(one.hidden for one in seen) > HIDDEN:
        return Finding(UNDECIDED, _hidden(seen), numbers)
    rubbing = max(float(one.side.law.bound(one.side.r).sum()) for one in seen)
    pressure = max(float(np.maximum(one.side.r[:, 0], 0.0).sum()) for one in seen)
    share = rubbing / pressure if 0 < rubbing < pressure else 1.0
    wrong = min(over) > EXCESS * share or min(pull) > CONE or max(*over, *pull) > ONE_SIDED
    text = f"friction exceeds its bound by {min(over):.1%} of the pressure"
    if not wrong:
        text = f"friction is within its bound to {min(over):.1e} of the pressure"
    if min(pull) > CONE:
        text += f"; contacts pull with {min(pull):.1%} of the pressure"
    return Finding(
        WRONG if wrong else RIGHT, text, numbers,
        _nodes(seen, name, ("above the cone", "pulls")) if wrong else (),
    )  # fmt: skip


def _ratio(one: Seen) -> float:
    """Largest |r_T| / r_N of contacts that carry load and whose forces are known."""
    known = one.pressed & one.side.known.all(axis=1)
    shear = np.linalg.norm(one.side.r[known, 1:], axis=1)
    return float((shear / one.side.r[known, 0]).max(initial=0.0))


def status(
    seen: tuple[Seen, ...], sheared: float, name: Name, *, history: bool, deck: bool
) -> Finding:  # fmt: skip
    """Whether everything that slips is held back by the friction that it should have.

    history: the slip that is judged is that against which friction acts at the end.
    """
    missing = [one.missing_deck if deck else one.missing for one in seen]
    shares = [one.impossible_share for one in seen]
    count = max(int(one.impossible.sum()) for one in seen)
    numbers = {"missing_friction": min(missing), "missing_other_side": max(missing),
               "missing_by_deck_law": min(one.missing_deck for one in seen),
               "impossible": count, "impossible_share": min(shares),
               "slip_along_facets": along_facets(seen[0].side)}  # fmt: skip
    if min(one.hidden for one in seen) > HIDDEN:
        return _as_one(seen, sheared, numbers)
    wrong = min(missing) > MISSING or max(missing) > ONE_SIDED or min(shares) > IMPOSSIBLE
    if not wrong:
        few = f"; {count} contacts at the margin are not" if count else ""
        return Finding(RIGHT, f"statuses are possible, {min(missing):.1e} of the friction is "
                       f"missing{few}", numbers)  # fmt: skip
    if min(missing) > MISSING:
        text = f"{min(missing):.0%} of the friction is missing where contacts slip"
        own = numbers["missing_by_deck_law"]
        if not deck and own < 0.5 * min(missing):
            text += (f", of which the deck's stick slope explains "
                     f"{1 - own / min(missing):.0%}: what should stick creeps")  # fmt: skip
    elif max(missing) > ONE_SIDED:
        text = "friction and slip do not fit as the other side sees them"
    else:
        text = "forces and motions do not fit"
    turned = numbers["slip_along_facets"]
    if turned > FACETED * _slipped(seen[0]):
        text += ("; facets turn from node to node, and closing alone moves points along them "
                 f"by {turned:.2g}, against friction that the curved surface has not"
                 )  # fmt: skip
    if count:
        text += f"; the statuses of {count} contacts are impossible ({_reasons(seen)})"
    if not history and min(shares) <= IMPOSSIBLE:
        return Finding(UNDECIDED, "the loads do not grow along one straight way, and friction "
                       "needs the slip of the last increment, which one state does not tell; "
                       "against all slip since the start, " + text, numbers)  # fmt: skip
    return Finding(WRONG if history else UNDECIDED, text, numbers, _nodes(seen, name, None))


def _slipped(one: Seen) -> float:
    """Longest slip of contacts that carry load."""
    return float(np.linalg.norm(one.side.slip, axis=1)[one.pressed].max(initial=0.0))


def _as_one(seen: tuple[Seen, ...], sheared: float, numbers: dict) -> Finding:
    """Where forces at nodes say nothing: the pair as one contact, if it is flat."""
    share, ratio, slid = pair_as_one(seen[0], sheared)
    side = seen[0].side  # errors of single nodes add up as random ones do
    is_noise = abs(float(side.r[:, 0].sum())) <= float(np.linalg.norm(side.bound[:, 0]))
    if share is not None and share > MISSING and not is_noise:
        text = (f"the pair slips by {slid:.3g} as a whole, with {1 - ratio:.0%} less friction "
                "than that takes: it should stick, or friction should be at its bound; forces "
                "at single nodes are lost in rounding")  # fmt: skip
        return Finding(WRONG, text, numbers | {"missing_friction": share})
    return Finding(UNDECIDED, _hidden(seen), numbers)


def _hidden(seen: tuple[Seen, ...]) -> str:
    part = min(one.hidden for one in seen)
    return (f"rounding of the displacements may move contact forces by {part:.0%} of them: "
            "forces at nodes can not be told; give more digits")  # fmt: skip


def _reasons(seen: tuple[Seen, ...]) -> str:
    most = max(seen, key=lambda one: int(one.impossible.sum()))
    words, counts = np.unique(most.why[most.impossible].astype(str), return_counts=True)
    return ", ".join(f"{n} {word}" for word, n in zip(words, counts, strict=True)) or "none"


def _nodes(
    seen: tuple[Seen, ...], name: Name, words: tuple[str, ...] | None
) -> tuple[str, ...]:
    """Contacts whose status can not be, those with the largest forces first."""
    out: list[str] = []
    for one in seen:
        bad = one.impossible if words is None else np.isin(one.why.astype(str), words)
        order = np.argsort(-np.linalg.norm(one.side.r, axis=1) * bad, kind="stable")
        out += [name(int(one.side.node[k])) for k in order[: int(bad.sum())]]
    return tuple(dict.fromkeys(out))[:NAMED]


def geometry(seen: tuple[Seen, ...], approach: float) -> Finding:
    """Whether the overlap that the facets make stands for that of the curved surfaces."""
    one = min(seen, key=lambda s: min(s.overlap, s.overlap_flat))
    side, pressed = one.side, one.pressed
    traction = side.r[pressed, 0] / side.weight[pressed]
    numbers: dict = {
        "initial_gap": _range(side.start),
        "initial_gap_of_facets": _range(side.start_points),
        "pressure": _range(traction),
        "pressure_spread": float(traction.std() / traction.mean()) if len(traction) else 0.0,
        "share": min(s.overlap for s in seen),
    }  # fmt: skip
    force = np.abs(side.r[:, 0]) * pressed  # a contact beside an edge is not all of them
    bulge = float(np.abs(side.start - side.start_flat) @ force) / (float(force.sum()) or 1.0)
    numbers["facets_off"] = bulge / approach if approach > 0 else 0.0
    low, high = numbers["initial_gap_of_facets"] or (0.0, 0.0)
    least = min(abs(low), abs(high)) or 1e-300
    if numbers["share"] > BULGE and numbers["facets_off"] > OFF:
        varies = f", varying by {(high - low) / least:.0%}" if high < 0 else ""
        text = (
            f"facets lie {bulge:.3g} off the curved surfaces that they stand for, on average, "
            f"{numbers['facets_off']:.0%} of what contact closes: the initial gap is from "
            f"{low:.4g} to {high:.4g} on facets{varies}, where the curved surfaces "
            f"have {numbers['initial_gap'][0]:.4g} to {numbers['initial_gap'][1]:.4g}; "
            "the pressure spreads by "
            f"{numbers['pressure_spread']:.0%} of its mean, from {traction.min():.3g} to "
            f"{traction.max():.3g}. The contact laws hold on the "
            "facets, not on the shape; refine, match the meshes, or take the curved gap"
        )
        return Finding(WRONG, text, numbers)
    return Finding(RIGHT, f"facets lie on average {numbers['facets_off']:.1%} of what contact "
                   "closes off the curved surfaces", numbers)  # fmt: skip


def _range(values: Array) -> tuple[float, float] | None:
    return (float(values.min()), float(values.max())) if len(values) else None


__all__ = ["cone", "geometry", "penetration", "status"]
