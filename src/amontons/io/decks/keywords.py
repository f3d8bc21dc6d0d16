"""Which keywords of a deck are read, which say nothing about the answer, and which change it.

A card that changes the answer and is not read is an error; `--allow KEYWORD` goes on
without it at the user's risk, which every result then says.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from difflib import get_close_matches

from .cards import Card
from .options import spelled, with_known_options

READ = {
    "HEADING", "MATERIAL", "ELASTIC", "HYPERELASTIC", "PLASTIC", "DENSITY", "SOLIDSECTION",
    "SURFACEINTERACTION",
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
PROCEDURES = {  # what a step may do instead of *STATIC
    "FREQUENCY": "vibrations", "COMPLEXFREQUENCY": "vibrations", "BUCKLE": "buckling",
    "DYNAMIC": "inertia", "MODALDYNAMIC": "inertia", "STEADYSTATEDYNAMICS": "vibrations",
    "HEATTRANSFER": "heat", "COUPLEDTEMPERATURE-DISPLACEMENT": "heat",
    "UNCOUPLEDTEMPERATURE-DISPLACEMENT": "heat", "VISCO": "creep", "CFD": "flow",
    "GREEN": "vibrations", "SENSITIVITY": "sensitivities", "ELECTROMAGNETICS": "currents",
    "SUBSTRUCTUREGENERATE": "a substructure", "NOANALYSIS": "nothing",
}  # fmt: skip
EMPTY = {"SYSTEM"}  # of no effect without an option
MEANS = {  # what a card would have done
    "GAP": "contact elements would act",
}  # fmt: skip

SLIP = 0.85  # share of letters that keywords have in common from which one is a slip


def sorted_out(
    cards: Iterable[Card], allowed: Sequence[str]
) -> tuple[list[Card | None], list[str]]:
    """The cards that are read, None for others, and what is to be said of what is left out.

    Raises FileFormatError for the first one that changes the answer and is not allowed, and
    for options that are not read.
    """
    kept: list[Card | None] = []
    skipped: dict[str, list[int]] = {}
    notes: list[str] = []
    allow = plain(allowed)
    for card in cards:
        key = card.keyword
        reads = key not in allow and (key in READ or _is_first_temperature(card))
        kept.append(with_known_options(card, allow, notes) if reads else None)
        if reads:
            continue
        if key in allow:
            notes.append(f"AT YOUR RISK: {card} (line {card.number}) is left out{_would(key)}")
        elif key == "RESTART" and "READ" in card.options:
            raise card.error("READ: the results of another run are not read, give its deck")
        elif key in OUTPUT | NUMERICS | EMPTY or _is_thermal(card):
            skipped.setdefault(str(card), []).append(card.number)
        else:
            kind = card.label("TYPE")
            raise card.error(
                f"{f'TYPE={kind}: ' if kind else ''}changes the answer and is not "
                f"read{_would(key)}; without it the result is "
                f"that of another model: --allow {key} takes this risk{_meant(key)}"
            )
    for name, lines in skipped.items():
        where = ", ".join(map(str, lines[:4])) + (", ..." if len(lines) > 4 else "")
        notes.append(f"{name} (line {where}) is skipped: it does not change the answer")
    return kept, notes


def plain(allowed: Iterable[str]) -> set[str]:
    """Keywords that may go, in capitals without blanks and stars."""
    return {"".join(word.upper().split()).removeprefix("*") for word in allowed}


def left_out(step: Sequence[Card], allowed: Sequence[str], *, has_static: bool) -> str:
    """What to say of a step that is not static and is left out, "" for one that is read.

    Raises FileFormatError for one that is not allowed; has_static: other steps are static.
    """
    allow = plain(allowed)
    for card in step:
        if card.keyword in PROCEDURES:
            what = f"{card} (line {card.number}), a step of {PROCEDURES[card.keyword]}"
            if card.keyword in allow and has_static:
                return f"AT YOUR RISK: {what}, is left out with all that stands in it"
            hint = (f"; --allow {card.keyword} leaves the whole step out" if has_static
                    else ", and no other step is one: there is nothing to solve")  # fmt: skip
            raise card.error(
                f"this step is one of {PROCEDURES[card.keyword]}, expected *STATIC{hint}"
            )
    return ""


def _is_thermal(card: Card) -> bool:
    return card.keyword in THERMAL


def _would(key: str) -> str:
    return f" ({MEANS[key]})" if key in MEANS else ""


def _meant(key: str) -> str:
    """What a keyword may be a slip of the pen for; none that exists is so near another."""
    close = [] if key in MEANS else get_close_matches(key, READ, 1, SLIP)
    return f"; did you mean *{spelled(close[0])}?" if close else ""


def _is_first_temperature(card: Card) -> bool:
    return card.keyword == "INITIALCONDITIONS" and card.label("TYPE") == "TEMPERATURE"
