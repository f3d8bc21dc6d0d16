"""*HYPERELASTIC: rubber, as CalculiX and Abaqus write it.

With I1, I2 and l_i of F without its change of volume, and one number D1 of the volume,

    NEO HOOKE             c10 (I1 - 3)                       c10, D1
    MOONEY-RIVLIN         and c01 (I2 - 3)                   c10, c01, D1
    YEOH                  c10, c20, c30 of (I1 - 3)^k        c10, c20, c30, D1, D2, D3
    REDUCED POLYNOMIAL    the same, N of them                c10 .., D1 ..
    POLYNOMIAL, N=1       as MOONEY-RIVLIN
    OGDEN, N              sum 2 mu / alpha^2 (l1^alpha + l2^alpha + l3^alpha - 3)
                                                             mu, alpha, .., D1 ..

and (J - 1)^2 / D1, so that the bulk modulus is 2 / D1.  A D1 of 0 is 0.1 over the shear modulus
in CalculiX, a poisson of 0.475, and no change of volume in Abaqus.
"""

from __future__ import annotations

from ...core.errors import InvalidInput
from ...mechanics.elements.energies import MooneyRivlin, Ogden, ReducedPolynomial
from .cards import Card, number

Rubber = MooneyRivlin | Ogden | ReducedPolynomial
KINDS = {  # numbers of the shape, and of the volume, for an N
    "NEOHOOKE": lambda n: (1, 1), "MOONEY-RIVLIN": lambda n: (2, 1),
    "YEOH": lambda n: (3, 3), "REDUCEDPOLYNOMIAL": lambda n: (n, n),
    "POLYNOMIAL": lambda n: (2, 1), "OGDEN": lambda n: (2 * n, n),
}  # fmt: skip
MOST = {"OGDEN": 6, "REDUCEDPOLYNOMIAL": 6, "POLYNOMIAL": 1}  # the largest N that is read
NONE = 1e10  # times D1, from which on D2 and further ones do nothing
NO_D1 = 20.0  # bulk modulus over shear modulus where D1 is 0


def rubber(card: Card, notes: list[str]) -> Rubber:
    """The law of *HYPERELASTIC; raises FileFormatError for one that is not read."""
    kind, order = _kind(card)
    rows = list(card.rows())
    shapes, volumes = KINDS[kind](order)
    lines = -(-(shapes + volumes) // 8)  # of a temperature
    if not rows:
        raise card.error("expected a line of data, got none")
    if len(rows) > lines:
        raise rows[lines].error("*HYPERELASTIC: constants at several temperatures are not read")
    values = [number(text, row, "*HYPERELASTIC") for row in rows for text in row.fields if text]
    if not shapes <= len(values) <= shapes + volumes + 1:
        raise rows[0].error(
            f"*HYPERELASTIC, {kind}: expected {shapes + volumes} numbers, got {len(values)}"
        )
    volume = (values[shapes:] + [0.0] * volumes)[:volumes]
    if any(0 < d < NONE * volume[0] for d in volume[1:]):
        raise rows[-1].error(
            f"*HYPERELASTIC: D2 and further ones are not read, got {volume[1:]}; a "
            "stiffness of volume that grows needs am.UserEnergy"
        )
    shear = sum(values[:shapes:2]) if kind == "OGDEN" else 2 * values[0]
    if kind in ("MOONEY-RIVLIN", "POLYNOMIAL"):
        shear += 2 * values[1]
    try:
        return _law(kind, values[:shapes], _bulk(volume[0], shear, card, notes))
    except InvalidInput as reason:
        raise card.error(str(reason)) from None


def _kind(card: Card) -> tuple[str, int]:
    found = [name for name in KINDS if name in card.options]
    given = {"N", "MODULI", "INPUT"}
    others = [name for name in card.options if name not in KINDS and name not in given]
    if others or len(found) != 1:
        raise card.error(
            f"{', '.join(others) or 'no law'}: is not read, expected one of NEO HOOKE, "
            "MOONEY-RIVLIN, YEOH, REDUCED POLYNOMIAL, POLYNOMIAL, OGDEN, with its constants"
        )
    text = card.options.get("N", "1")
    most = MOST.get(found[0], 6)
    if not (text.isdigit() and 1 <= int(text) <= most):
        raise card.error(f"N={text}: expected a number from 1 to {most}")
    return found[0], int(text)


def _bulk(d1: float, shear: float, card: Card, notes: list[str]) -> float:
    if d1 < 0:
        raise card.error(f"D1: expected a number >= 0, got {d1:g}")
    if d1 > 0:
        return 2 / d1
    text = (
        f"{card} (line {card.number}): D1 is 0, a bulk modulus of {NO_D1:g} shear moduli is "
        "taken as in CalculiX; Abaqus keeps the volume"
    )
    notes += [text] if text not in notes else []
    return NO_D1 * shear


def _law(kind: str, values: list[float], bulk: float) -> Rubber:
    if kind == "OGDEN":
        return Ogden(values[::2], values[1::2], bulk)
    if kind in ("YEOH", "REDUCEDPOLYNOMIAL"):
        return ReducedPolynomial(values, bulk)
    return MooneyRivlin(values[0], values[1] if len(values) > 1 else 0.0, bulk)
