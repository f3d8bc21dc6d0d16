"""Which options of the keywords that are read say something that is read, or nothing at all.

An option that is in neither list changes the answer as a keyword would, and is an error;
`--allow KEYWORD.OPTION` goes on without it.  Abaqus takes the first letters of an option for
the whole where they are those of one alone, and so do we, from three letters on.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace

from .cards import Card, Row, number, whole

SHORTEST = 3  # letters that an option may be cut to
ANYWHERE = {"INPUT"}  # another file with the data
OPTIONS = {  # read, or without a meaning for a static answer
    "HEADING": "SPARSE",
    "PART": "NAME",
    "INSTANCE": "NAME PART",
    "ASSEMBLY": "NAME",
    "NODE": "NSET SYSTEM",
    "ELEMENT": "TYPE ELSET",
    "NSET": "NSET GENERATE INSTANCE INTERNAL UNSORTED FREQUENCY",
    "ELSET": "ELSET GENERATE INSTANCE INTERNAL UNSORTED",
    "SURFACE": "NAME TYPE INTERNAL TRIM FILLETRADIUS REGIONTYPE",
    "MATERIAL": "NAME RTOL SRATEFACTOR STRAINRATEREGULARIZATION",
    "ELASTIC": "TYPE MODULI",
    "HYPERELASTIC": "NEOHOOKE MOONEY-RIVLIN YEOH REDUCEDPOLYNOMIAL POLYNOMIAL OGDEN N MODULI",
    "DENSITY": "",
    "EXPANSION": "ZERO TYPE",
    "ORIENTATION": "NAME SYSTEM DEFINITION LOCALDIRECTIONS",
    "SOLIDSECTION": "ELSET MATERIAL ORIENTATION CONTROLS OFFSET STACKDIRECTION",
    "SURFACEINTERACTION": "NAME",
    "SURFACEBEHAVIOR": "PRESSURE-OVERCLOSURE NOSEPARATION AUGMENTEDLAGRANGE DIRECT PENALTY",
    "FRICTION": "SLIPTOLERANCE TAUMAX LAGRANGE USER EXPONENTIALDECAY ROUGH",
    "CONTACTPAIR": "INTERACTION TYPE SMALLSLIDING ADJUST TIED TRACKING EXTENSIONZONE HCRIT "
    "SMOOTH SUPPLEMENTARYCONSTRAINTS NOTHICKNESS CPSET MECHANICALCONSTRAINT "
    "GEOMETRICCORRECTION WEIGHT SLIDINGTRANSITION MINIMUMDISTANCE",
    "CONTACT": "OP",
    "CONTACTINCLUSIONS": "ALLEXTERIOR",
    "CONTACTEXCLUSIONS": "",
    "CONTACTPROPERTYASSIGNMENT": "",
    "CLEARANCE": "MASTER SLAVE VALUE",
    "TIE": "NAME POSITIONTOLERANCE ADJUST TYPE NOROTATION NOTHICKNESS CONSTRAINTRATIO "
    "CYCLICSYMMETRY MULTISTAGE FLUIDPERIODIC",
    "EQUATION": "",
    "MPC": "",
    "TRANSFORM": "NSET TYPE",
    "COUPLING": "REFNODE SURFACE CONSTRAINTNAME ORIENTATION",
    "KINEMATIC": "",
    "DISTRIBUTING": "",
    "RIGIDBODY": "NSET ELSET REFNODE ROTNODE ANALYTICALSURFACE ISOTHERMAL",
    "PRE-TENSIONSECTION": "SURFACE NODE ELEMENT",
    "SPRING": "ELSET NONLINEAR ORIENTATION RTOL",
    "AMPLITUDE": "NAME DEFINITION TIME SHIFTX SHIFTY USER",
    "INITIALCONDITIONS": "TYPE",
    "STEP": "NAME NLGEOM INC INCF UNSYMM EXTRAPOLATION SOLVER CONVERTSDI AMPLITUDE",
    "STATIC": "DIRECT SOLVER STABILIZE ALLSDTOL CONTINUE FACTOR",
    "BOUNDARY": "OP AMPLITUDE TIMEDELAY FIXED TYPE USER SUBMODEL MASSFLOW REGIONTYPE",
    "CLOAD": "OP AMPLITUDE TIMEDELAY FOLLOWER USER SECTOR REGIONTYPE",
    "DLOAD": "OP AMPLITUDE TIMEDELAY FOLLOWER CONSTANTRESULTANT REGIONTYPE",
    "DSLOAD": "OP AMPLITUDE TIMEDELAY FOLLOWER CONSTANTRESULTANT REGIONTYPE",
    "TEMPERATURE": "OP AMPLITUDE FILE BSTEP USER SUBMODEL",
    "CHANGEFRICTION": "INTERACTION",
    "CHANGESURFACEBEHAVIOR": "INTERACTION",
    "MODELCHANGE": "TYPE ADD REMOVE",
}
PLACED = {"PART", "INSTANCE", "ASSEMBLY", "NODE", "ELEMENT", "NSET", "ELSET", "SURFACE"}
KNOWN = {keyword: frozenset(words.split()) for keyword, words in OPTIONS.items()}
NOTHING = {  # values that say what is so anyway
    ("CLOAD", "LOADCASE"): "1", ("DLOAD", "LOADCASE"): "1", ("DSLOAD", "LOADCASE"): "1",
    ("BOUNDARY", "LOADCASE"): "1", ("AMPLITUDE", "VALUE"): "RELATIVE",
    ("AMPLITUDE", "SMOOTH"): "0", ("RIGIDBODY", "POSITION"): "INPUT",
    ("DISTRIBUTING", "WEIGHTINGMETHOD"): "UNIFORM", ("ELASTIC", "DEPENDENCIES"): "0",
    ("DENSITY", "DEPENDENCIES"): "0", ("EXPANSION", "DEPENDENCIES"): "0",
    ("STEP", "PERTURBATION"): "NO",
}  # fmt: skip
NUMBERS = {  # options that are numbers and say nothing here: others are slips all the same
    "STEP": "INC INCF", "STATIC": "STABILIZE ALLSDTOL FACTOR", "NSET": "FREQUENCY",
    "MATERIAL": "RTOL SRATEFACTOR", "SPRING": "RTOL", "FRICTION": "SLIPTOLERANCE",
    "CONTACTPAIR": "EXTENSIONZONE HCRIT SMOOTH", "TIE": "CONSTRAINTRATIO",
    "EXPANSION": "ZERO", "SURFACE": "FILLETRADIUS",
}  # fmt: skip
WHOLE = {"INC", "INCF", "FREQUENCY"}  # those that count
SPELLED = {name.replace(" ", ""): name for name in (
    "EXPONENTIAL DECAY", "CYCLIC SYMMETRY", "FLUID PERIODIC", "MASS FLOW",
    "CONTACT PAIR", "CONTACT INCLUSIONS", "CONTACT EXCLUSIONS", "CONTACT PROPERTY ASSIGNMENT",
    "SOLID SECTION", "SURFACE INTERACTION", "SURFACE BEHAVIOR", "RIGID BODY",
    "PRE-TENSION SECTION", "CHANGE FRICTION", "CHANGE SURFACE BEHAVIOR", "MODEL CHANGE",
    "INITIAL CONDITIONS", "LOAD CASE", "WEIGHTING METHOD",
)}  # fmt: skip
MEANS = {
    "DEPENDENCIES": "the property would depend on fields",
    "LOADCASE": "the load would be the imaginary part of another",
    "PERTURBATION": "the answer would be the change from the step before",
    "RIKS": "the load would be found with the state",
    "ORIENTATION": "directions would be turned",
}  # fmt: skip


def with_known_options(card: Card, allowed: Collection[str], notes: list[str]) -> Card:
    """The card with its options by their whole names, without those that are allowed to go.

    Raises FileFormatError for one that is not read.  notes: gets what is left out.
    """
    known = KNOWN.get(card.keyword)
    if known is None:
        return card
    if known.issuperset(card.options):
        _check_numbers(card)
        return card
    options = {}
    for option, value in card.options.items():
        if option in known or option in ANYWHERE:
            options[option] = value
            continue
        whole = [one for one in known if one.startswith(option)]
        if len(option) >= SHORTEST and len(whole) == 1:
            options[whole[0]] = value
        elif f"{card.keyword}.{option}" in allowed:
            notes.append(f"AT YOUR RISK: {option} of {card} (line {card.number}) is left out")
        elif value.upper() != NOTHING.get((card.keyword, option)):
            would = f" ({MEANS[option]})" if option in MEANS else ""
            raise card.error(
                f"{spelled(option)}: is not read and may change the answer{would}; "
                f"--allow {card.keyword}.{option} goes on without it"
            )
    card = replace(card, options=options)
    _check_numbers(card)
    return card


def _check_numbers(card: Card) -> None:
    """Raise FileFormatError for a number that is none."""
    for option in NUMBERS.get(card.keyword, "").split():
        if card.options.get(option):
            read = whole if option in WHOLE else number
            read(card.options[option], Row(card.file, card.number, []), f"{card}: {option}")


def spelled(word: str) -> str:
    """A keyword or option as manuals write it, with its blanks."""
    return SPELLED.get(word, word)
