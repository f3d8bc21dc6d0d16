"""Whether a deck is read with finite strains: NLGEOM, or rubber.

CalculiX takes *ELASTIC with NLGEOM for Green's strain and its stress, the law of Saint Venant
and Kirchhoff.  What such models do not have, such as equations, keeps them at small strains.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ...core.errors import AmontonsError, UnsupportedForm
from ...mechanics.contact.current_mortar import MortarPair
from ...mechanics.model.nonlinear_parts import NonlinearParts, nonlinear_parts
from ..readers import Case
from .flat import Deck

STRAIGHT = 1e-9  # bulge of a facet over the size of all bodies that is none
Make = Callable[[list[str], bool], Case]
FINITE = (
    "NLGEOM: strains and rotations are finite, *ELASTIC is the law of Saint Venant and "
    "Kirchhoff, contact is found where nodes are; --set deck.small=true takes small strains"
)


def is_large(deck: Deck) -> bool:
    """Whether a step has NLGEOM, and so all of them here."""
    heads = [step[0].card for step in deck.steps]
    return any("NLGEOM" in card.options and card.label("NLGEOM") != "NO" for card in heads)


def of_size(make: Make, deck: Deck, notes: list[str], *, small: bool) -> Case:
    """The case make(notes, finite), at finite strains where the deck asks and models have them.

    small: small ones as far as the materials go.
    """
    has_rubber = any(placed.card.keyword == "HYPERELASTIC" for placed in deck.model)
    large = is_large(deck)
    if not has_rubber and (small or not large):
        return make([*notes, *([SMALL.format("asked for")] if large else [])], False)
    try:
        case = make([*notes, *([FINITE] if large else [])], True)
        parts = nonlinear_parts(case.model)
        if any("ADJUST" in placed.card.options for placed in deck.model):
            _check_straight(parts)
    except AmontonsError as reason:
        if has_rubber:
            raise
        return make([*notes, SMALL.format(str(reason).split("; ")[0])], False)
    return case


def _check_straight(parts: NonlinearParts) -> None:
    """Raise UnsupportedForm where a surface that is put onto its master has bent facets.

    Averages of their gaps then differ from those of the nodes, which are zero.
    """
    for pair in parts.contact.pairs:
        if isinstance(pair, MortarPair):
            bulges = pair.slave.bulges(len(parts.X)) @ parts.X
            if np.abs(bulges).max(initial=0.0) > STRAIGHT * np.ptp(parts.X, axis=0).max():
                raise UnsupportedForm("ADJUST puts nodes of bent facets onto the master")


SMALL = "NLGEOM: strains are taken as small ({}); a rotation that spoils this is warned of"
