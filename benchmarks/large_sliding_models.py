"""Two bodies that slide far on each other: the cases of `large_sliding`.

A die with a round underside is pressed into a slab, then dragged over it; a round end is
pressed flat against another.  All energies are neo-Hookean.
"""

import json
import os
import subprocess
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from scipy.spatial import cKDTree

import amontons as am
from amontons.mechanics.meshes import Facets
from amontons.mechanics.meshes.order import second_order

POISSON = 0.32


@dataclass(frozen=True)
class Case:
    """lower, upper: meshes; moduli of both; depth and way of the upper one's top.

    The depth is reached in `presses` load steps, the way in `drags` more; the lower one's
    bottom is held, and `upper.bottom` meets `lower.top`.
    """

    lower: am.Mesh
    upper: am.Mesh
    moduli: tuple[float, float]
    depth: float
    way: float
    mu: float
    presses: int
    drags: int

    def top(self, step):
        """Displacement (d,) of the top of the upper body after a (part of a) step."""
        along = self.way * max(step - self.presses, 0) / max(self.drags, 1)
        down = -self.depth * min(step / self.presses, 1)
        d = self.lower.points.shape[1]
        return np.array([along, *[0.0] * (d - 2), down])

    @property
    def steps(self):
        """Load steps."""
        return self.presses + self.drags

    def model(self, swap=False):
        """The model; with swap the lower body's side is the slave."""
        bodies = [am.Body(mesh, am.NeoHookean(young, POISSON), name=name)
                  for mesh, young, name in zip((self.lower, self.upper), self.moduli,
                                               ("lower", "upper"), strict=True)]  # fmt: skip
        d = self.lower.points.shape[1]

        def component(c):
            return lambda x, t: self.top(t)[c]

        sides = ("upper.bottom", "lower.top")[:: -1 if swap else 1]
        return am.Model(bodies, [am.Fix("lower.bottom", 0),
                                 am.Fix("upper.top", tuple(component(c) for c in range(d)))],
                        [am.Contact(sides[0], master=sides[1], mu=self.mu)])  # fmt: skip


def rounded(mesh, radius):
    """A box around x = 0 with its underside bent to a circle (a cylinder) that touches 0."""
    points = mesh.points.copy()
    points[:, 0] -= np.ptp(points[:, 0]) / 2
    x, y = points[:, 0], points[:, -1]
    height = np.ptp(y)
    points[:, -1] = y + (radius - np.sqrt(radius**2 - x**2)) * (1 - y / height)
    return points


def die(size, cells, at, radius=1.0):
    """A die of a size whose lowest point (or line) is at x = at[0], height at[1]."""
    mesh = am.box(size, cells)
    points = rounded(mesh, radius)
    points[:, 0] += at[0]
    points[:, -1] += at[1]
    if len(size) == 3:
        points[:, 1] += at[2]
    return replace(mesh, points=points)


def shallow():
    """A die of width 1.2 on a slab of 6 x 2, ten times as soft."""
    slab = am.box((6, 2), (32, 10))
    upper = die((1.2, 0.75), (9, 5), (1.5, 2.0))
    return Case(slab, upper, (1.0, 10.0), 0.4, 2.0, 0.3, 20, 40)


def of_second_order():
    """As `shallow`, with half the cells in both directions and a die that is curved."""
    slab = second_order(am.box((6, 2), (16, 5)))
    upper = second_order(am.box((1.2, 0.75), (5, 3)))
    points = rounded(upper, 1.0) + [1.5, 2.0]
    return Case(slab, replace(upper, points=points), (1.0, 10.0), 0.4, 2.0, 0.3, 20, 40)


def deep():
    """The same with a die of a smaller radius, as deep as its half width."""
    slab = am.box((6, 2), (40, 13))
    upper = die((1.2, 1.0), (12, 6), (1.5, 2.0), radius=0.75)
    return Case(slab, upper, (1.0, 10.0), 0.6, 2.0, 0.3, 20, 50)


def beyond_the_rim():
    """A die pressed in beyond its rim: its sides are in the contact, too."""
    slab = am.box((6, 2), (40, 13))
    upper = die((1.2, 1.0), (12, 6), (1.5, 2.0))
    round_it = [f.nodes for side in ("bottom", "left", "right") for f in upper.surface(side)]
    outline = {"bottom": (Facets("line", np.concatenate(round_it)),)}
    upper = replace(upper, surfaces=dict(upper.surfaces) | outline)
    return Case(slab, upper, (1.0, 10.0), 1.0, 2.0, 0.3, 20, 50)


def hertz():
    """Two like round ends, pressed together by half of what both are high."""
    upper = die((1.6, 1.0), (20, 10), (0.0, 0.0))
    lower = die((1.6, 1.0), (17, 9), (0.0, 0.0))
    return Case(replace(lower, points=-lower.points, surfaces=_upside_down(lower)), upper,
                (1.0, 1.0), 0.6, 0.0, 0.3, 20, 0)  # fmt: skip


def _upside_down(mesh):
    """Surfaces after half a turn: top and bottom, left and right change places."""
    other = {"bottom": "top", "top": "bottom", "left": "right", "right": "left"}
    return {other[name]: mesh.surfaces[name] for name in mesh.surfaces}


def ironing_in_space(fine=1):
    """A die of 0.8 x 1 on a slab of 3 x 1.6 x 1, which is wider; fine: times as many cells."""
    slab = am.box((3, 1.6, 1), (15 * fine, 8 * fine, 4 * fine))
    upper = die((0.8, 1.0, 0.5), (5 * fine, 6 * fine, 3 * fine), (0.9, 1.0, 0.3))
    return Case(slab, upper, (1.0, 10.0), 0.2, 1.0, 0.3, 8, 20)


CASES = {
    "ironing, shallow": shallow,
    "ironing, second order": of_second_order,
    "ironing, deep": deep,
    "ironing, beyond the rim": beyond_the_rim,
    "Hertz, large": hertz,
    "ironing in 3D": ironing_in_space,
    "ironing in 3D, fine": lambda: ironing_in_space(2),
}


# ------------------------------------------------------------------------ penetration
def corners(mesh, name):
    """Facets (f, a) of first order of a surface, in one table (all of one kind)."""
    (facets,) = mesh.surface(name)
    return facets.nodes


def penetration(case, moved):
    """The deepest that a surface node of one body lies in the other, at positions `moved`.

    moved: of lower and upper, (n, d).  Measured to the nearest facet that the node faces.
    """
    sides = ((0, "top"), (1, "bottom"))
    meshes = (case.lower, case.upper)
    worst = 0.0
    for (k, name), (other, theirs) in (sides, sides[::-1]):
        nodes = np.unique(corners(meshes[k], name))
        facets = moved[other][corners(meshes[other], theirs)]
        worst = max(worst, _deepest(moved[k][nodes], facets))
    return worst


def _deepest(points, facets):
    """Of points (n, d) inside of the body behind facets (f, a, d); outward by right hand."""
    d = points.shape[1]
    if d == 3:  # both halves of quadrilaterals
        facets = np.concatenate([facets[:, [0, 1, 2]], facets[:, [0, 2, 3]]])
    centre = facets.mean(axis=1)
    near = cKDTree(centre).query(points, k=min(12, len(centre)))[1]
    deepest = 0.0
    for point, some in zip(points, near, strict=True):
        best, depth = np.inf, 0.0
        for facet in facets[some]:
            normal, part = _over(point, facet)
            if part is None:
                continue
            height = float((point - facet[0]) @ normal)
            if abs(height) < best:
                best, depth = abs(height), -height
        if np.isfinite(best):
            deepest = max(deepest, depth)
    return deepest


def _over(point, facet):
    """(outward normal, where the point lies over it or None)."""
    if len(point) == 2:
        edge = facet[1] - facet[0]
        part = (point - facet[0]) @ edge / (edge @ edge)
        normal = np.array([edge[1], -edge[0]]) / np.linalg.norm(edge)
        return normal, part if 0 <= part <= 1 else None
    a, b = facet[1] - facet[0], facet[2] - facet[0]
    normal = np.cross(a, b)
    normal = normal / np.linalg.norm(normal)
    part = np.linalg.lstsq(np.stack([a, b], axis=1), point - facet[0], rcond=None)[0]
    return normal, part if part.min() >= 0 and part.sum() <= 1 else None


# ---------------------------------------------------------------------------- GetFEM
SYSTEM = "/usr/bin/python3"  # an interpreter that has GetFEM
RELEASE = 0.3  # length beyond which its rays see nothing


def by_getfem(case, folder, limit=600):
    """A row as of `large_sliding_ccx.solved`, of a 2D case."""
    bodies = []
    sides = (("bottom", "top"), ("top", "bottom"))
    for mesh, young, (held, side) in zip(
        (case.lower, case.upper), case.moduli, sides, strict=True
    ):
        shear = young / (2 * (1 + POISSON))
        bodies.append({
            "points": mesh.points.tolist(), "cells": mesh.cells[0].nodes.tolist(),
            "held": np.unique(corners(mesh, held)).tolist(),
            "side": np.unique(corners(mesh, side)).tolist(), "young": young,
            "shear": shear, "lame": 2 * shear * POISSON / (1 - 2 * POISSON),
        })  # fmt: skip
    tops = [case.top(k).tolist() for k in range(1, case.steps + 1)]
    given, found = Path(folder) / "given.json", Path(folder) / "found.json"
    given.write_text(json.dumps({"bodies": bodies, "mu": case.mu, "release": RELEASE,
                                 "tops": tops}))  # fmt: skip
    script = Path(__file__).with_name("large_sliding_getfem.py")
    subprocess.run([SYSTEM, script, given, found], capture_output=True, timeout=limit,
                   check=True, env={"OMP_NUM_THREADS": "1", "PATH": os.defpath})  # fmt: skip
    out = json.loads(found.read_text())
    meshes = (case.lower, case.upper)
    order = [cKDTree(np.array(there)).query(mesh.points)[1]
             for there, mesh in zip(out["places"], meshes, strict=True)]  # fmt: skip
    worst = 0.0
    for state in out["states"]:
        moved = [mesh.points + np.reshape(u, (-1, 2))[k]
                 for mesh, u, k in zip(meshes, state, order, strict=True)]  # fmt: skip
        worst = max(worst, penetration(case, moved))
    forces = [[k + 1, *force] for k, force in enumerate(out["forces"])]
    return {"steps": len(forces), "newton": out["newton"], "seconds": out["seconds"],
            "penetration": worst, "forces": forces, "reached": len(forces) / case.steps,
            "why": out["why"]}  # fmt: skip
