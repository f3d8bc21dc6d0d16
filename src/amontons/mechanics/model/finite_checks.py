"""What contact where the bodies are now does not have, said before anything is computed."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ...core.errors import UnsupportedForm
from ..contact.carried import TiedPair
from ..contact.current_mortar import MortarPair
from ..contact.current_pairs import Pair, between_bodies
from ..elements.given import GivenMatrices
from ..elements.rigid import Rigid
from .parts import FINITE

if TYPE_CHECKING:
    from .model import Model

Index = NDArray[np.int64]
Mask = NDArray[np.bool_]


def check_supported(model: Model) -> None:
    """Raise UnsupportedForm for bodies and contacts that finite kinematics do not have."""
    asked = all(contact.kinematics == FINITE for contact in model.contacts)
    for k, body in enumerate(model.bodies):
        at, what = ("bodies", k, "material"), f"body {body.name!r}"
        if isinstance(body.material, Rigid):
            raise UnsupportedForm(
                f"{what} is rigid, and contact of finite kinematics needs bodies that deform",
                at, "",
            )  # fmt: skip
        if isinstance(body.material, GivenMatrices):
            raise UnsupportedForm(
                f"{what} has a given K, and contact of finite kinematics needs bodies with a "
                "law; give its contacts kinematics='small'", at, "",
            )  # fmt: skip
        if not (asked or body.turns):
            raise UnsupportedForm(
                "others have hyperelastic laws or turn, and this one is linear elastic; give "
                "it corotational=True, NeoHookean or the like, or say that it keeps small "
                "strains by kinematics='finite' of the contacts", at, what,
            )  # fmt: skip
    for k, contact in enumerate(model.contacts):
        what = f"contact on {contact.slave!r}"
        if contact.obstacle is None:
            _check_pair(model, k)
            continue
        if contact.tied:
            raise UnsupportedForm(
                "a tie to an obstacle is a support here; use Fix in the place of the contact",
                ("contacts", k, "tied"), what,
            )  # fmt: skip
        if contact.method != "nodal":
            raise UnsupportedForm(
                "finite kinematics has nodal contact with an obstacle only; use method='nodal'",
                ("contacts", k, "method"), what,
            )  # fmt: skip
        for name in ("gap_slopes", "normal_slopes"):
            if not hasattr(contact.obstacle, name):
                raise UnsupportedForm(
                    f"large deformations need its method {name}, as Plane, Sphere and "
                    f"LevelSet have it; got {contact.obstacle!r}",
                    ("contacts", k, "obstacle"), "obstacle",
                )  # fmt: skip


def _check_pair(model: Model, k: int) -> None:
    """Raise UnsupportedForm for what a pair of finite kinematics does not have."""
    contact = model.contacts[k]
    what = f"contact on {contact.slave!r}"
    if contact.method != "mortar":
        raise UnsupportedForm(
            "two bodies that deform meet by averages in finite kinematics; use "
            "method='mortar', as by default", ("contacts", k, "method"), what,
        )  # fmt: skip


def check_nodes(pairs: Sequence[Pair], slaves: Index, is_free: Mask) -> None:
    """Raise UnsupportedForm for nodes that would need two laws, or part of one.

    slaves (nc,): nodes of all contacts; is_free (nodes, d): components without a support.
    """
    _check_single(slaves)
    _check_apart(pairs, slaves)
    _check_middles(pairs, is_free)


def chains(pairs: Sequence[Pair]) -> list[set[int]]:
    """For every pair the others of which some of its slaves are in the master."""
    return [
        {
            k for k, other in enumerate(pairs)
            if other is not pair and np.isin(pair.slaves, _whole(other)).any()
        }
        for pair in pairs
    ]  # fmt: skip


def _whole(pair: Pair) -> Index:
    """Nodes that a pair may press as those of its master."""
    if isinstance(pair, TiedPair):
        return pair.pressed
    if not isinstance(pair, MortarPair):
        return np.zeros(0, dtype=np.int64)
    return (pair.master if pair.fold is None else pair.fold.skin).every


def _check_apart(pairs: Sequence[Pair], slaves: Index) -> None:
    """Raise UnsupportedForm for nodes that carry forces of pairs in a ring, or of a middle."""
    middles = [m.slave.means[0] for m in map(between_bodies, pairs) if m is not None]
    if middles and np.isin(np.concatenate(middles), slaves).any():
        raise UnsupportedForm(
            "a node between the corners of a slave surface carries a contact of its own; leave "
            "it out of that (where), or make the surfaces smaller", ("contacts",),
        )  # fmt: skip
    links = chains(pairs)
    for _ in pairs:  # what follows no other is no part of a ring
        links = [{k for k in link if links[k]} for link in links]
    if any(links):
        raise UnsupportedForm(
            "nodes are slave in one contact and master in another, and the other way round in "
            "a ring; leave them out of one of the slaves (where), or make the surfaces smaller",
            ("contacts",),
        )  # fmt: skip


def _check_middles(pairs: Sequence[Pair], is_free: Mask) -> None:
    """Raise UnsupportedForm where a middle is held in a component that its corner is free in.

    is_free (nodes, d).
    """
    for pair in map(between_bodies, pairs):
        if pair is None:
            continue
        middle, corner, _ = pair.slave.means
        has_row = np.isin(corner, pair.slaves)
        if (has_row[:, None] & is_free[corner] & ~is_free[middle]).any():
            raise UnsupportedForm(
                "a support holds a node in the middle of an edge of a slave surface, and not "
                "a corner beside it; hold both, or make the other surface the slave",
                ("supports",),
            )  # fmt: skip


def _check_single(nodes: Index) -> None:
    if len(np.unique(nodes)) < len(nodes):
        raise UnsupportedForm(
            "a node is the slave of two contacts, large deformations allow one; leave it out "
            "of one of them (where), join obstacles into one LevelSet, give both masters to "
            "one contact with one law (more_masters), or let the masters be the slaves",
            ("contacts",),
        )  # fmt: skip
