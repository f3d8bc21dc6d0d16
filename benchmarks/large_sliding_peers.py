"""What every program is given of a case of `large_sliding`, and what is measured of an answer.

A `Setting` has meshes, supports, the driven nodes with their way, and the two sides; forces are
those of the support on the driven nodes.
"""

import json
import os
import resource
import subprocess
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from large_sliding_models import Case, corners
from scipy.spatial import cKDTree

SYSTEM = "/usr/bin/python3"  # an interpreter that has GetFEM
RELEASE = 0.3  # length beyond which GetFEM's rays see nothing
AUGMENTATION = 10.0  # GetFEM's r over the softer modulus, as its manual advises


@dataclass(frozen=True)
class Setting:
    """A case as every program gets it.

    bodies: (mesh, modulus); supports: (body, nodes, components at rest); driven: (body,
    nodes (n,), displacements (steps + 1, n, d)); sides: (body, facets) of slave and master.
    """

    bodies: tuple
    supports: tuple
    driven: tuple
    sides: tuple
    mu: float
    poisson: float

    @property
    def steps(self):
        """Load steps."""
        return len(self.driven[2]) - 1

    @property
    def dim(self):
        """2 or 3."""
        return self.driven[2].shape[2]

    @property
    def facet(self):
        """Mean size of a facet of the slave's side."""
        body, facets = self.sides[0]
        return float(np.mean(_sizes(self.bodies[body][0].points[facets])))

    @property
    def unknowns(self):
        """Displacements of all nodes."""
        return sum(mesh.points.size for mesh, _ in self.bodies)

    def moduli(self, k):
        """(G, K) of a body at small strains."""
        young, nu = self.bodies[k][1], self.poisson
        return young / (2 * (1 + nu)), young / (3 * (1 - 2 * nu))

    def row(self, step, forces):
        """[step, force along x, along the last axis, moment about that axis through 0].

        forces (n, d): on the driven nodes, in the order of `driven`.
        """
        body, nodes, ways = self.driven
        k = min(round(step), self.steps)
        x = self.bodies[body][0].points[nodes] + ways[k]
        moment = (x[:, 0] * forces[:, 1] - x[:, 1] * forces[:, 0]).sum()
        total = forces.sum(axis=0)
        return [float(step), float(total[0]), float(total[-1]), float(moment)]

    def penetration(self, moved):
        """The deepest that a node of one side lies behind the other; moved: of all bodies."""
        worst = 0.0
        for (k, facets), (other, theirs) in (self.sides, self.sides[::-1]):
            nodes = np.unique(facets)
            worst = max(worst, _deepest(moved[k][nodes], moved[other][theirs], self.facet))
        return worst


def setting(case, swap=False):
    """The setting of a `Case` or a `Driven`; with swap the other side is the slave."""
    if isinstance(case, Case):
        meshes = {"lower": (case.lower, case.moduli[0]), "upper": (case.upper, case.moduli[1])}
        supports, driven = [("lower.bottom", None)], "upper.top"
        sides, poisson = ("upper.bottom", "lower.top"), case.poisson

        def way(points, step):
            return np.broadcast_to(case.top(step), points.shape)
    else:
        meshes, driven, way = case.bodies, case.driven, case.way
        supports = [(fix.on, fix.value) for fix in case.fixed]
        sides, poisson = case.sides, case.poisson
    names = list(meshes)
    d = meshes[names[0]][0].points.shape[1]

    def at(surface):
        body, name = surface.split(".")
        return names.index(body), corners(meshes[body][0], name)

    held = []
    for on, value in supports:
        body, facets = at(on)
        parts = value if isinstance(value, tuple) else (0,) * d
        held.append((body, np.unique(facets),
                     [c for c in range(d) if parts[c] is not None]))  # fmt: skip
    body, facets = at(driven)
    nodes = np.unique(facets)
    points = meshes[names[body]][0].points[nodes]
    ways = np.stack([way(points, step) for step in range(case.steps + 1)])
    both = tuple(at(side) for side in sides[:: -1 if swap else 1])
    return Setting(tuple(meshes.values()), tuple(held), (body, nodes, ways), both, case.mu,
                   poisson)  # fmt: skip


def _sizes(facets):
    """Lengths, or square roots of areas, of facets (f, a, d)."""
    if facets.shape[2] == 2:
        return np.linalg.norm(facets[:, 1] - facets[:, 0], axis=1)
    one, two = facets[:, 2] - facets[:, 0], facets[:, 3] - facets[:, 1]
    return np.sqrt(np.linalg.norm(np.cross(one, two), axis=1) / 2)


def _deepest(points, facets, near):
    """Of points (n, d) behind facets (f, a, d), outward by right hand, at most `near`."""
    if points.shape[1] == 3:  # both halves of quadrilaterals
        facets = np.concatenate([facets[:, [0, 1, 2]], facets[:, [0, 2, 3]]])
    centre = facets.mean(axis=1)
    found = cKDTree(centre).query(points, k=min(12, len(centre)))[1]
    deepest = 0.0
    for point, some in zip(points, found, strict=True):
        best, depth = near, 0.0
        for facet in facets[some]:
            normal, part = _over(point, facet)
            if part is None:
                continue
            height = float((point - facet[0]) @ normal)
            if abs(height) < best:
                best, depth = abs(height), -height
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


def limited(command, seconds, **options):
    """Run a process of at most so many CPU seconds; those that it took.

    Its status is not looked at: what it has written tells how far it came.
    """

    def limit():
        resource.setrlimit(resource.RLIMIT_CPU, (int(seconds), int(seconds) + 5))

    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run(command, capture_output=True, text=True, check=False,
                          preexec_fn=limit, **options)  # fmt: skip
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    spent = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return spent, done


def by_getfem(given, folder, limit=600, factor=1.0):
    """GetFEM's answer, a row as of `large_sliding_ccx.solved`; factor: on its r."""
    bodies = []
    for k, (mesh, young) in enumerate(given.bodies):
        shear, bulk = given.moduli(k)
        (block,) = mesh.cells
        bodies.append({"points": mesh.points.tolist(), "cells": block.nodes.tolist(),
                       "young": young, "shear": shear,
                       "lame": bulk - 2 * shear / 3})  # fmt: skip
    body, nodes, ways = given.driven
    source, target = Path(folder) / "given.json", Path(folder) / "found.json"
    source.write_text(json.dumps({
        "bodies": bodies, "mu": given.mu, "release": RELEASE, "limit": limit,
        "augmentation": AUGMENTATION * factor,
        "supports": [[k, held.tolist(), parts] for k, held, parts in given.supports],
        "driven": [body, nodes.tolist(), ways.tolist()],
        "sides": [[k, facets.tolist()] for k, facets in given.sides],
    }))  # fmt: skip
    script = Path(__file__).with_name("large_sliding_getfem.py")
    spent, done = limited([SYSTEM, script, source, target], limit + 60,
                          env={"OMP_NUM_THREADS": "1", "PATH": os.defpath})  # fmt: skip
    if not target.exists():
        return {"steps": 0, "newton": 0, "seconds": spent, "penetration": 0.0, "forces": [],
                "reached": 0.0, "why": done.stderr[-200:]}  # fmt: skip
    out = json.loads(target.read_text())
    worst = 0.0
    for state in out["states"]:
        moved = [mesh.points + np.array(u) for (mesh, _), u in zip(
            given.bodies, state, strict=True)]  # fmt: skip
        worst = max(worst, given.penetration(moved))
    forces = [[k + 1.0, *force] for k, force in enumerate(out["forces"])]
    late = out["seconds"] >= limit or done.returncode < 0
    return {"steps": len(forces), "newton": out["newton"],
            "seconds": max(out["seconds"], limit * (done.returncode < 0)),
            "penetration": worst, "forces": forces, "reached": len(forces) / given.steps,
            "why": "out of time" if late else out["why"]}  # fmt: skip
