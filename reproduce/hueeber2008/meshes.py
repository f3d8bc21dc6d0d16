"""How shell.msh and block.msh were made: `python -m reproduce.hueeber2008.meshes`, with gmsh.

Red refinement turns V nodes, E edges, F faces and T tetrahedra into V + E nodes, 2 E + 3 F + T
edges, 4 F + 8 T faces and 8 T tetrahedra.  The numbers of nodes that the paper prints for four
levels, 104, 541, 3 384 and 23 694, leave one choice for its coarsest mesh, `counts_of_paper`:
437 edges, 576 faces and 241 tetrahedra, which is that of two balls (V - E + F - T = 2) with 98
nodes outside.  Hexahedra would give fractions.  How the nodes are shared between the bodies and
where they are the paper does not say.

Sizes and inner points below were found by trying until nodes and triangles outside came out,
with cells as good as possible, curved ones on finer levels too; flips of three cells around an
edge into two do the rest.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from .shapes import HIGH, INNER, LOW, OUTER, RADIUS, RIM, TOP

PRINTED = (104, 541, 3384, 23694)
HERE = Path(__file__).parent


def counts_of_paper() -> dict[str, int]:
    """Nodes, edges, faces and tetrahedra of the coarsest mesh, and its triangles outside."""
    nodes, edges = PRINTED[0], PRINTED[1] - PRINTED[0]
    # E_1 = 2 E + 3 F + T and E_2 = 2 E_1 + 3 (4 F + 8 T) + 8 T are differences of nodes too
    once, twice = PRINTED[2] - PRINTED[1], PRINTED[3] - PRINTED[2]
    faces, cells = np.linalg.solve([[3, 1], [12, 32]], [once - 2 * edges, twice - 2 * once])
    faces, cells = round(faces), round(cells)
    return {"nodes": nodes, "edges": edges, "faces": faces, "cells": cells,
            "outside": 2 * faces - 4 * cells}  # fmt: skip


@dataclass(frozen=True)
class Recipe:
    """Sizes of cells at both ends of the profile, points inside, 3-2 flips afterwards."""

    size: float  # shell: outside; block: on the cap
    other: float  # shell: inside; block: on the top
    inside: tuple[tuple[float, float, float], ...]
    flips: int


RECIPES = {
    "shell": Recipe(
        0.5806157971533259, 0.5685750694329635,
        ((-0.7644, -0.2867, -0.2861), (0.4039, 0.6859, -0.4211)), 6,
    ),
    "block": Recipe(
        0.23400384841203625, 0.31250131213105337,
        ((0.0368, -0.0712, -0.5918), (-0.1275, -0.0711, -0.2909), (-0.0216, 0.1539, -0.504),
         (0.2713, 0.0026, -0.2773)), 4,
    ),
}  # fmt: skip


def _profile(name: str, recipe: Recipe) -> int:
    """The half section of a body in the plane y = 0, as a surface of gmsh."""
    import gmsh

    build = gmsh.model.occ

    def point(x: float, z: float, size: float = recipe.size) -> int:
        return build.addPoint(x, 0, z, size)

    if name == "shell":
        centre, a, b = point(0, 0), point(0, -OUTER), point(OUTER, 0)
        c, d = point(INNER, 0, recipe.other), point(0, -INNER, recipe.other)
        lines = [build.addCircleArc(a, centre, b), build.addLine(b, c),
                 build.addCircleArc(c, centre, d), build.addLine(d, a)]  # fmt: skip
    else:
        centre, a, b = point(0, RADIUS - INNER), point(0, -INNER), point(RIM, LOW)
        c, d = point(TOP, HIGH, recipe.other), point(0, HIGH, recipe.other)
        lines = [build.addCircleArc(a, centre, b), build.addLine(b, c), build.addLine(c, d),
                 build.addLine(d, a)]  # fmt: skip
    return build.addPlaneSurface([build.addCurveLoop(lines)])


def _generated(name: str, recipe: Recipe) -> tuple[np.ndarray, np.ndarray]:
    """Points (n, 3) and tetrahedra (k, 4) of gmsh for a body."""
    import gmsh

    gmsh.clear()
    profile = [(2, _profile(name, recipe))]
    made = gmsh.model.occ.revolve(profile, 0, 0, 0, 0, 0, 1, 2 * np.pi)
    gmsh.model.occ.remove(profile, recursive=True)
    inside = [gmsh.model.occ.addPoint(*p) for p in recipe.inside]
    gmsh.model.occ.synchronize()
    gmsh.model.mesh.embed(0, inside, 3, next(tag for dim, tag in made if dim == 3))
    for end in gmsh.model.getEntities(0):
        x = gmsh.model.getValue(0, end[1], [])
        first = np.linalg.norm(x) > 0.9 if name == "shell" else x[2] < HIGH - 1e-6
        gmsh.model.mesh.setSize([end], recipe.size if first else recipe.other)
    options = {"Algorithm": 6, "Algorithm3D": 1, "RandomSeed": 1, "RandomFactor": 1e-9,
               "MeshSizeFromCurvature": 0, "Optimize": 1}  # fmt: skip
    for key, value in options.items():
        gmsh.option.setNumber(f"Mesh.{key}", value)
    gmsh.model.mesh.generate(3)
    tags, xyz, _ = gmsh.model.mesh.getNodes()
    (nodes,) = gmsh.model.mesh.getElements(3)[2]
    used, cells = np.unique(nodes, return_inverse=True)
    place = {tag: k for k, tag in enumerate(tags)}
    points = xyz.reshape(-1, 3)[[place[tag] for tag in used]]
    return points, _oriented(points, cells.reshape(-1, 4))


def _volume(points: np.ndarray, cells: np.ndarray) -> np.ndarray:
    sides = points[cells[:, 1:]] - points[cells[:, :1]]
    return np.linalg.det(sides) / 6


def _oriented(points: np.ndarray, cells: np.ndarray) -> np.ndarray:
    """The cells with positive volumes."""
    cells = np.array(cells)
    turned = _volume(points, cells) < 0
    cells[turned] = cells[turned][:, [1, 0, 2, 3]]
    return cells


def quality(points: np.ndarray, cells: np.ndarray) -> np.ndarray:
    """Volume over the cube of the mean edge, 1 for a regular tetrahedron, (k,)."""
    pairs = itertools.combinations(range(4), 2)
    edges = [((points[cells[:, i]] - points[cells[:, j]]) ** 2).sum(axis=1) for i, j in pairs]
    return 6 * np.sqrt(2) * np.abs(_volume(points, cells)) / np.mean(edges, axis=0) ** 1.5


def _flipped(points: np.ndarray, cells: np.ndarray) -> np.ndarray:
    """Three cells around an edge made two, where the worse of these is best."""
    around: dict[tuple[int, int], list[int]] = {}
    for k, cell in enumerate(cells):
        for pair in itertools.combinations(sorted(cell.tolist()), 2):
            around.setdefault(pair, []).append(k)
    found = []
    for (a, b), three in around.items():
        ring = sorted(set(cells[three].ravel().tolist()) - {a, b})
        if len(three) != 3 or len(ring) != 3:
            continue
        two = _oriented(points, np.array([[a, *ring], [b, *ring]]))
        before, after = (np.abs(_volume(points, c)).sum() for c in (cells[three], two))
        if abs(before - after) < 1e-9 * before:
            found.append((quality(points, two).min(), three, two))
    _, three, two = max(found, key=lambda choice: choice[0])
    return np.concatenate([np.delete(cells, three, axis=0), two])


def _surfaces(name: str, x: np.ndarray) -> dict[str, np.ndarray]:
    """Which nodes of points x (n, 3) lie on the surfaces of a body, (n,) each."""
    size, ray = np.linalg.norm(x, axis=1), np.hypot(x[:, 0], x[:, 1])
    if name == "shell":
        off = {"top": size - INNER, "bottom": size - OUTER, "rim": x[:, 2]}
    else:
        middle = np.array([0, 0, RADIUS - INNER])
        share = (x[:, 2] - LOW) / (HIGH - LOW)
        off = {"bottom": np.linalg.norm(x - middle, axis=1) - RADIUS, "top": x[:, 2] - HIGH,
               "side": ray - RIM - share * (TOP - RIM)}  # fmt: skip
    return {surface: np.abs(distance) < 1e-6 for surface, distance in off.items()}


def _text(name: str, points: np.ndarray, cells: np.ndarray) -> str:
    """The mesh as a gmsh file of version 2.2, with names of its surfaces."""
    sides = np.concatenate([cells[:, list(s)] for s in itertools.combinations(range(4), 3)])
    key = np.sort(sides, axis=1)
    _, first, times = np.unique(key, axis=0, return_index=True, return_counts=True)
    outside = sides[first[times == 1]]
    on = _surfaces(name, points)
    lines = ["$MeshFormat", "2.2 0 8", "$EndMeshFormat", "$PhysicalNames", str(len(on) + 1)]
    lines += [f'2 {k + 1} "{surface}"' for k, surface in enumerate(on)]
    lines += [f'3 {len(on) + 1} "{name}"', "$EndPhysicalNames", "$Nodes", str(len(points))]
    lines += [f"{k + 1} {x:.12g} {y:.12g} {z:.12g}" for k, (x, y, z) in enumerate(points)]
    lines += ["$EndNodes", "$Elements", str(len(outside) + len(cells))]
    number = itertools.count(1)
    for facet in outside:
        (tag,) = (k + 1 for k, mask in enumerate(on.values()) if mask[facet].all())
        lines.append(f"{next(number)} 2 2 {tag} {tag} " + " ".join(map(str, facet + 1)))
    tag = len(on) + 1
    for cell in cells:
        lines.append(f"{next(number)} 4 2 {tag} {tag} " + " ".join(map(str, cell + 1)))
    return "\n".join([*lines, "$EndElements", ""])


def main() -> None:
    """Write both files beside this one."""
    import gmsh

    gmsh.initialize()
    gmsh.option.setNumber("General.Terminal", 0)
    try:
        for name, recipe in RECIPES.items():
            points, cells = _generated(name, recipe)
            for _ in range(recipe.flips):
                cells = _flipped(points, cells)
            (HERE / f"{name}.msh").write_text(_text(name, points, cells))
            print(f"{name}: {len(points)} nodes, {len(cells)} tetrahedra, worst quality "
                  f"{quality(points, cells).min():.2f}")  # fmt: skip
    finally:
        gmsh.finalize()


if __name__ == "__main__":
    main()
