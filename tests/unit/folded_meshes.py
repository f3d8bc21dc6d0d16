"""Meshes of one body with sides that meet each other."""

from dataclasses import replace

import numpy as np

import amontons as am
from amontons.mechanics.meshes import Facets

ARM, GAP, THICK = 2.0, 0.3, 0.2


def hairpin():
    """A strip bent to a U, arms along x: surfaces "low" and "high" inside, "press" outside."""
    radius = (GAP + THICK) / 2
    half = np.pi * radius
    mesh = am.box((2 * ARM + half, THICK), (48, 4))
    s, h = mesh.points.T
    angle = np.clip((s - ARM) / radius, 0, np.pi) - np.pi / 2
    past = np.maximum(s - ARM - half, 0)
    centre = np.stack([np.minimum(s, ARM) - past + radius * np.cos(angle),
                       radius * np.sin(angle)], axis=1)  # fmt: skip
    inward = -np.stack([np.cos(angle), np.sin(angle)], axis=1)
    mesh = replace(mesh, points=centre + (h - THICK / 2)[:, None] * inward)
    (inside,), (outside,) = mesh.surface("top"), mesh.surface("bottom")
    first, second = (mesh.points[f.nodes].mean(axis=1) for f in (inside, outside))
    tip = (second[:, 1] > 0) & (second[:, 0] < 0.4)
    return mesh.with_surfaces({
        "low": (Facets("line", inside.nodes[first[:, 1] < 0]),),
        "high": (Facets("line", inside.nodes[first[:, 1] > 0]),),
        "press": (Facets("line", outside.nodes[tip]),),
    })  # fmt: skip


def fork(gap, cells=(12, 4)):
    """Two beams 3 x 1 joined at the left, a slot between them, symmetric about y = 0.

    One mesh: the columns of the left third go through, the others leave the slot open.
    """
    parts = []
    for sign in (1, -1):
        mesh = am.box((3, 1), cells)
        y = gap / 2 + mesh.points[:, 1]
        parts.append((np.stack([mesh.points[:, 0], sign * y], axis=1), mesh.cells[0].nodes))
    bridge = am.box((1, gap), (cells[0] // 3, 2))
    parts.append((np.stack([bridge.points[:, 0], bridge.points[:, 1] - gap / 2], axis=1),
                  bridge.cells[0].nodes))  # fmt: skip
    points = np.concatenate([p for p, _ in parts])
    starts = np.cumsum([0, *(len(p) for p, _ in parts)])
    nodes = np.concatenate([c + s for (_, c), s in zip(parts, starts, strict=False)])
    _, first, same = np.unique(points.round(9), axis=0, return_index=True, return_inverse=True)
    kept = points[first]
    return am.Mesh(kept, (am.Cells("quad", same.ravel()[nodes]),),
                   node_sets={"left": np.flatnonzero(kept[:, 0] < 1e-9),
                              "up": np.flatnonzero(kept[:, 1] > gap / 2 + 1 - 1e-9),
                              "down": np.flatnonzero(kept[:, 1] < -gap / 2 - 1 + 1e-9)})
