"""Element types of decks: the cell they are, what they assume, and the nodes of their sides.

Sides are numbered as CalculiX and Abaqus do, from S1; nodes are those of the deck's element.
Integration is that of the type, but for first order with one point, which has motions without
energy: there it is full, and `note` says so.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass

from ...core.words import near
from .cards import is_whole

FULL = "full integration"


@dataclass(frozen=True)
class Shape:
    """An element of a deck.

    cell: kind of our mesh; nodes: how many the deck gives; plane: "" in 3D, else "strain",
    "stress" or "axisymmetric"; sides: nodes of each, corners first; note: what the type means
    beyond the cell; integration: as in `Cells`.
    """

    cell: str
    nodes: int
    sides: tuple[tuple[int, ...], ...]
    plane: str = ""
    note: str = ""
    integration: str = "full"


TRI = ((0, 1), (1, 2), (2, 0))
TRI6 = ((0, 1, 3), (1, 2, 4), (2, 0, 5))
QUAD = ((0, 1), (1, 2), (2, 3), (3, 0))
QUAD8 = ((0, 1, 4), (1, 2, 5), (2, 3, 6), (3, 0, 7))
TET = ((0, 1, 2), (0, 3, 1), (1, 3, 2), (2, 3, 0))
TET10 = ((0, 1, 2, 4, 5, 6), (0, 3, 1, 7, 8, 4), (1, 3, 2, 8, 9, 5), (2, 3, 0, 9, 7, 6))
HEX = ((0, 1, 2, 3), (4, 7, 6, 5), (0, 4, 5, 1), (1, 5, 6, 2), (2, 6, 7, 3), (3, 7, 4, 0))
HEX20 = (
    (0, 1, 2, 3, 8, 9, 10, 11), (4, 7, 6, 5, 15, 14, 13, 12), (0, 4, 5, 1, 16, 12, 17, 8),
    (1, 5, 6, 2, 17, 13, 18, 9), (2, 6, 7, 3, 18, 14, 19, 10), (3, 7, 4, 0, 19, 15, 16, 11),
)  # fmt: skip
WEDGE = ((0, 1, 2), (3, 5, 4), (0, 3, 4, 1), (1, 4, 5, 2), (2, 5, 3, 0))
WEDGE15 = (
    (0, 1, 2, 6, 7, 8), (3, 5, 4, 11, 10, 9), (0, 3, 4, 1, 12, 9, 13, 6),
    (1, 4, 5, 2, 13, 10, 14, 7), (2, 5, 3, 0, 14, 11, 12, 8),
)  # fmt: skip
REDUCED = "one point of integration there, full here: no motions without energy"
INCOMPATIBLE = "incompatible modes there, none here"
MODES = "incompatible modes that pass the patch test; those of CalculiX do on parallelepipeds"
REDUCED_HYBRID = "fewer points of integration there, full here; the pressure is the same"
CONSTANT = "linear pressure there, constant here"
THIN = "no stress across the plane; CalculiX has a solid there, whose thickness changes evenly"


def _planes() -> dict[str, Shape]:
    found = {}
    for prefix, plane in (("CPE", "strain"), ("CPS", "stress"), ("CAX", "axisymmetric")):
        thin = THIN if plane == "stress" else ""
        for name, cell, nodes, sides in (
            ("3", "tri", 3, TRI), ("4", "quad", 4, QUAD), ("6", "tri6", 6, TRI6),
            ("8", "quad8", 8, QUAD8),
        ):  # fmt: skip
            few = "reduced" if prefix + name == "CAX3" else "full"  # one point
            found[prefix + name] = Shape(cell, nodes, sides, plane, thin, few)
            if name == "8":
                found[f"{prefix}8R"] = Shape(cell, nodes, sides, plane, thin, "reduced")
            if plane != "stress" and name != "3":
                note = CONSTANT if name == "6" else ""
                found[f"{prefix}{name}H"] = Shape(cell, nodes, sides, plane, note, "hybrid")
            if plane != "stress" and name in ("4", "8"):
                note = REDUCED_HYBRID if name == "8" else REDUCED
                found[f"{prefix}{name}RH"] = Shape(cell, nodes, sides, plane, note, "hybrid")
            if name == "4":
                found[f"{prefix}4R"] = Shape(cell, nodes, sides, plane, REDUCED)
                found[f"{prefix}4I"] = (
                    Shape(cell, nodes, sides, plane, INCOMPATIBLE) if plane == "axisymmetric"
                    else Shape(cell, nodes, sides, plane, MODES, "incompatible")
                )  # fmt: skip
                if plane == "strain":
                    found["CPE4IH"] = Shape(
                        cell, nodes, sides, plane, "", "hybrid-incompatible"
                    )
    return found


SHAPES = {
    "C3D4": Shape("tet", 4, TET), "C3D10": Shape("tet10", 10, TET10),
    "C3D8": Shape("hex", 8, HEX), "C3D8R": Shape("hex", 8, HEX, note=REDUCED),
    "C3D8I": Shape("hex", 8, HEX, note=MODES, integration="incompatible"),
    "C3D6": Shape("wedge", 6, WEDGE, integration="reduced"),
    "C3D15": Shape("wedge15", 15, WEDGE15, integration="reduced"),
    "C3D20": Shape("hex20", 20, HEX20),
    "C3D8H": Shape("hex", 8, HEX, integration="hybrid"),
    "C3D8IH": Shape("hex", 8, HEX, integration="hybrid-incompatible"),
    "C3D8RH": Shape("hex", 8, HEX, note=REDUCED, integration="hybrid"),
    "C3D10H": Shape("tet10", 10, TET10, integration="hybrid"),
    "C3D20H": Shape("hex20", 20, HEX20, integration="hybrid"),
    "C3D20RH": Shape("hex20", 20, HEX20, note=REDUCED_HYBRID, integration="hybrid"),
    "C3D20R": Shape("hex20", 20, HEX20, integration="reduced"),
} | _planes()  # fmt: skip


FAMILIES = {  # elements that are not read, by how their names begin
    "DC": "of heat", "AC": "of sound", "F3D": "of flow", "D": "of a network of flow",
    "S": "shells", "M3D": "membranes", "B": "beams", "T2D": "bars", "T3D": "bars",
    "GAP": "of contact between two nodes", "DASHPOT": "dampers", "MASS": "masses",
    "CONN": "connectors", "R2D": "rigid surfaces", "R3D": "rigid surfaces", "U": "of users",
    "DCOUP": "couplings", "SFM": "surfaces", "COH": "of glue", "CGAX": "solids that twist",
}  # fmt: skip


def unread(kind: str, known: Iterable[str]) -> str:
    """What to say of a type that is not read."""
    names = sorted(known)
    starts = sorted((f for f in FAMILIES if kind.startswith(f)), key=len)
    what = f", {FAMILIES[starts[-1]]}," if starts else ""
    meant = "" if starts else near(kind, names)
    hint = f"; did you mean {meant}?" if meant else ""
    return f"elements of this type{what} are not read, expected {', '.join(names)}{hint}"


def side_named(
    label: str, kind: str, shape: Shape, error: Callable[[str], Exception]
) -> tuple[int, ...]:
    """Nodes of the side that a label names; raises what `error` makes of the words."""
    side = side_of(label)
    if side is None or not 0 <= side < len(shape.sides):
        raise error(f"face {label}: expected S1 to S{len(shape.sides)} for {kind}")
    return shape.sides[side]


def side_of(label: str) -> int | None:
    """The number of a side from 0 of "S3", also "P3" of a pressure; None for another word."""
    if label[:1] in ("S", "P") and is_whole(label[1:]):
        return int(label[1:]) - 1
    return None
