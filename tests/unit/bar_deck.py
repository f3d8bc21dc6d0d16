"""Decks of a bar of 16 bricks, 2 x 2 x 4, whose uppermost layer is a part that is glued on."""

from __future__ import annotations

COUNTS = (2, 2, 4)
GLUED = 3  # layers below the glue


def node(i: int, j: int, k: int, *, upper: bool = False) -> int:
    """The number of a grid point; those of the glue exist twice."""
    return 1 + i + 3 * (j + 3 * k) + (1000 if upper else 0)


def bar_deck(model: str, steps: str) -> str:
    """The deck with more cards before and after the first step; E 1000, nu 0.3.

    Sets BOT, TOP (nodes), EALL; surfaces BELOW and ABOVE at the glue, TOPFACE; elements are
    numbered layer by layer from 1.
    """
    nodes, elements, below, above = [], [], [], []
    for k in range(5):
        for upper in (False, True):
            if (upper and k < GLUED) or (not upper and k > GLUED):
                continue
            nodes += [
                f"{node(i, j, k, upper=upper)}, {i}., {j}., {k}."
                for j in range(3) for i in range(3)
            ]  # fmt: skip
    number = 0
    for k in range(4):
        up = k >= GLUED
        for j in range(2):
            for i in range(2):
                number += 1
                ring = ((0, 0), (1, 0), (1, 1), (0, 1))
                corners = [node(i + a, j + b, k + c, upper=up) for c in (0, 1) for a, b in ring]
                elements.append(f"{number}, " + ", ".join(map(str, corners)))
                if k == GLUED - 1:
                    below.append(f"{number}, S2")
                if k == GLUED:
                    above.append(f"{number}, S1")
    bottom = [node(i, j, 0) for j in range(3) for i in range(3)]
    top = [node(i, j, 4, upper=True) for j in range(3) for i in range(3)]
    faces = [line.replace("S1", "S2") for line in above]
    lines = ["*NODE, NSET=NALL", *nodes, "*ELEMENT, TYPE=C3D8, ELSET=EALL", *elements,
             "*NSET, NSET=BOT", ", ".join(map(str, bottom)),
             "*NSET, NSET=TOP", ", ".join(map(str, top)),
             "*MATERIAL, NAME=EL", "*ELASTIC", "1000., 0.3",
             "*SOLID SECTION, ELSET=EALL, MATERIAL=EL",
             "*SURFACE, NAME=BELOW", *below, "*SURFACE, NAME=ABOVE", *above,
             "*SURFACE, NAME=TOPFACE", *faces,
             "*TIE, NAME=GLUE, POSITION TOLERANCE=0.01", "ABOVE, BELOW",
             model.strip(), steps.strip()]  # fmt: skip
    return "\n".join(lines) + "\n"
