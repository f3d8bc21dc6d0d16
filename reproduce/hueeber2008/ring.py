"""Section 7: a ring pushed over a tool that it penetrates in the reference configuration.

The paper gives the materials, the friction 0.7 and "66.600 degrees of freedom", and the shapes
in a drawing only.  Read here as: a ring fixed on its upper outer edge around a conical tube,
fixed on its bottom, that is wider than the hole below and narrower above.
"""

from __future__ import annotations

from functools import cache

import numpy as np

import amontons as am
from amontons.mechanics.meshes import Cells, Facets

from .runs import Run, run

FRICTION, C = 0.7, 1e8
RING = {"inner": 1.0, "outer": 1.3, "low": 0.0, "high": 0.5}
TOOL = {"inner": 0.7, "low": -0.2, "high": 0.7}
WIDE, NARROW = 1.02, 0.995  # outer radius of the tool at its lower and upper end
FINE = ((112, 16, 5), (96, 18, 5))  # cells around, along and through the ring and the tool


def _tube(counts: tuple[int, int, int], inner, outer, low: float, high: float) -> am.Mesh:
    """Hexahedra around, along z and through; inner and outer: radius as functions of z.

    Surfaces inner, outer, bottom, top, and rim: the uppermost row of outer.
    """
    around, along, through = counts
    k, j, i = (a.ravel() for a in np.meshgrid(np.arange(through + 1), np.arange(along + 1),
                                              np.arange(around), indexing="ij"))  # fmt: skip
    z = low + (high - low) * j / along
    radius = inner(z) + (outer(z) - inner(z)) * k / through
    angle = 2 * np.pi * i / around
    points = np.column_stack([radius * np.cos(angle), radius * np.sin(angle), z])

    def number(i, j, k):
        return (k * (along + 1) + j) * around + i % around

    k, j, i = (a.ravel() for a in np.meshgrid(np.arange(through), np.arange(along),
                                              np.arange(around), indexing="ij"))  # fmt: skip
    faces = [[number(i + a, j + b, k + c) for a, b in ((0, 0), (1, 0), (1, 1), (0, 1))]
             for c in (0, 1)]  # fmt: skip
    cells = np.column_stack([*faces[0], *faces[1]])
    sides = {
        "inner": cells[k == 0][:, :4], "outer": cells[k == through - 1][:, 4:],
        "bottom": cells[j == 0][:, [0, 1, 5, 4]], "top": cells[j == along - 1][:, [3, 2, 6, 7]],
        "rim": cells[(k == through - 1) & (j == along - 1)][:, 4:],
    }  # fmt: skip
    surfaces = {name: (Facets("quad", nodes),) for name, nodes in sides.items()}
    return am.Mesh(points, (Cells("hex", cells),), surfaces)


def _cone(z: np.ndarray) -> np.ndarray:
    part = (z - TOOL["low"]) / (TOOL["high"] - TOOL["low"])
    return WIDE + part * (NARROW - WIDE)


@cache
def model(fine: bool = True) -> am.Model:
    """Ring (slave) and tool; coarse meshes for a quick look."""
    counts = FINE if fine else ((48, 6, 2), (40, 8, 2))
    ring = am.Body(
        _tube(counts[0], lambda z: 0 * z + RING["inner"], lambda z: 0 * z + RING["outer"],
              RING["low"], RING["high"]),
        am.LinearElastic(young=9e7, poisson=0.3), "ring",
    )  # fmt: skip
    tool = am.Body(
        _tube(counts[1], lambda z: 0 * z + TOOL["inner"], _cone, TOOL["low"], TOOL["high"]),
        am.LinearElastic(young=8.13e8, poisson=0.3),
        "tool",
    )
    return am.Model(
        [ring, tool],
        supports=[am.Fix("ring.rim", (0, 0, 0)), am.Fix("tool.bottom", (0, 0, 0))],
        contacts=[am.Contact("ring.inner", master="tool.outer", mu=FRICTION, method="mortar")],
    )


def newton(fine: bool = True) -> dict[str, Run]:
    """Full Newton and the fixed point with k_f = 1 and exact linear solves, from zero."""
    problem = model(fine).assemble()
    given = {"c_normal": C, "c_tangential": C}
    return {
        "newton": run(problem, am.ActiveSet(**given), 1e-9, limit=60),
        "fixed-point": run(
            problem, am.ActiveSet(bound=am.FrictionBound.FIXED_POINT, **given), 1e-9, limit=60
        ),
    }
