"""All kinds of reference cells by name."""

from __future__ import annotations

from .linear_cells import LINEAR, ReferenceCell
from .quadratic_cells import FIRST, QUADRATIC, SECOND, SERENDIPITY

__all__ = ["CELLS", "FACET_KIND", "FIRST", "LINEAR", "SECOND", "SERENDIPITY", "ReferenceCell"]

CELLS = LINEAR | QUADRATIC
FACET_KIND = {  # by dimension of the mesh and number of nodes
    (2, 2): "line", (2, 3): "line3",
    (3, 3): "tri", (3, 4): "quad", (3, 6): "tri6", (3, 8): "quad8",
    (3, 9): "quad9",
}  # fmt: skip
