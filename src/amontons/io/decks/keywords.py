"""Which keywords of a deck are read, which say nothing about the answer, and which change it.

A card that changes the answer and is not read is an error; `--allow KEYWORD` goes on
without it at the user's risk, which every result then says.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from .cards import Card

READ = {
    "HEADING", "MATERIAL", "ELASTIC", "DENSITY", "SOLIDSECTION", "SURFACEINTERACTION",
    "SURFACEBEHAVIOR", "FRICTION", "CONTACTPAIR", "BOUNDARY", "AMPLITUDE", "STEP", "STATIC",
    "CLOAD", "DLOAD", "DSLOAD", "EQUATION", "MPC", "TIE", "TRANSFORM", "COUPLING", "KINEMATIC",
    "DISTRIBUTING", "RIGIDBODY", "PRE-TENSIONSECTION", "SPRING", "CLEARANCE",
    "CHANGEFRICTION", "CHANGESURFACEBEHAVIOR", "MODELCHANGE", "EXPANSION", "TEMPERATURE",
    "ORIENTATION", "CONTACT", "CONTACTINCLUSIONS", "CONTACTEXCLUSIONS",
    "CONTACTPROPERTYASSIGNMENT",
}  # fmt: skip
OUTPUT = {
    "NODEPRINT", "NODEFILE", "NODEOUTPUT", "ELPRINT", "ELFILE", "ELEMENTOUTPUT", "CONTACTFILE",
    "CONTACTPRINT", "CONTACTOUTPUT", "OUTPUT", "ENERGYOUTPUT", "ENERGYPRINT", "ENERGYFILE",
    "RESTART", "PREPRINT", "PRINT", "MONITOR", "FILEFORMAT", "FACEPRINT", "SECTIONPRINT",
    "SECTIONFILE", "TIMEPOINTS", "MODALOUTPUT", "INTEGRATEDOUTPUT", "DIAGNOSTICS",
    "FILTER", "PREPROCESS",
}  # fmt: skip
NUMERICS = {  # how another program iterates
    "CONTROLS", "CONTACTCONTROLS", "CONTACTFORMULATION", "CONTACTSTABILIZATION",
    "SOLVERCONTROLS", "SECTIONCONTROLS", "HOURGLASSSTIFFNESS",
}  # fmt: skip
THERMAL = {  # without a change of temperature they change nothing
    "CONDUCTIVITY", "SPECIFICHEAT", "PHYSICALCONSTANTS", "GAPCONDUCTANCE",
}  # fmt: skip
EMPTY = {"SYSTEM"}  # of no effect without an option
MEANS = {  # what a card would have done
    "PLASTIC": "the material would yield", "HYPERELASTIC": "the material would be rubber",
    "DYNAMIC": "inertia would act",
    "GAP": "contact elements would act",
    "FREQUENCY": "vibrations would be computed", "BUCKLE": "buckling would be computed",
}  # fmt: skip


def sorted_out(cards: Iterable[Card], allowed: Sequence[str]) -> tuple[list[Card], list[str]]:
    """The cards that are read, and what is to be said of those that are left out.

    Raises FileFormatError for the first one that changes the answer and is not allowed.
    """
    kept: list[Card] = []
    skipped: dict[str, list[int]] = {}
    notes: list[str] = []
    allow = {"".join(word.upper().split()).removeprefix("*") for word in allowed}
    for card in cards:
        key = card.keyword
        if key in allow:
            notes.append(f"AT YOUR RISK: {card} (line {card.number}) is left out{_would(key)}")
        elif key in READ or _is_first_temperature(card):
            kept.append(card)
        elif key in OUTPUT | NUMERICS | EMPTY or _is_thermal(card):
            skipped.setdefault(str(card), []).append(card.number)
        else:
            raise card.error(
                f"changes the answer and is not read{_would(key)}; without it the result is "
                f"that of another model: --allow {key} takes this risk"
            )
    for name, lines in skipped.items():
        where = ", ".join(map(str, lines[:4])) + (", ..." if len(lines) > 4 else "")
        notes.append(f"{name} (line {where}) is skipped: it does not change the answer")
    return kept, notes


def _is_thermal(card: Card) -> bool:
    return card.keyword in THERMAL


def _would(key: str) -> str:
    return f" ({MEANS[key]})" if key in MEANS else ""


def _is_first_temperature(card: Card) -> bool:
    return card.keyword == "INITIALCONDITIONS" and card.label("TYPE") == "TEMPERATURE"
