"""`amontons info part.step`: surfaces of a mesh or CAD file, numbered on a picture."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ...core.errors import InvalidInput
from ...io.meshes import read_mesh
from ...io.readers import MESHES
from ...io.results import to_json
from ...mechanics.meshes import Cells, Facets, Mesh, is_cad, read_cad
from ...mechanics.meshes.surfaces import facet_areas
from .sources import check_is_plain
from .terminal import check_writable, deliver_json, show_table

if TYPE_CHECKING:
    from ...mechanics.model import Body

FIGURES = (".png", ".svg", ".pdf")
CELLS_ALONG = 15  # of a CAD file without --size, along its longest side


def is_mesh(source: str) -> bool:
    """Whether the suffix is that of a mesh or CAD file."""
    return Path(source).suffix.lower() in MESHES


def run(
    source: str, size: float | None, picture: str | None, json_copy: str | None,
    glue: bool = True,
) -> None:  # fmt: skip
    """Print names, areas and middles of all surfaces, and draw them with their numbers."""
    check_writable(json_copy, "--json")
    check_writable(picture, "--picture", FIGURES)
    check_is_plain(Path(source))
    mesh = _read(source, size, glue)
    facts = describe(mesh)
    if json_copy != "-":
        surfaces = facts["surfaces"]
        rows = [
            [str(k), name, f"{each['area']:.4g}", _point(each["middle"]),
             " and ".join(each["between"])]
            for k, (name, each) in enumerate(surfaces.items(), 1)
        ]
        kinds = f"{mesh.dim}D, {len(mesh.points)} points, regions {', '.join(mesh.regions)}"
        area = "area" if mesh.dim == 3 else "length"
        show_table(source, ["", "surface", area, "middle", "between"], rows, "left")
        print(kinds)
        print(*_bonds(facts, glue and is_cad(source)), sep="\n", end="")
    if picture is not None:
        draw(mesh, picture)
    if json_copy is not None:
        deliver_json(to_json(facts), json_copy)


def draw(mesh: Mesh, picture: str) -> None:
    """Write the picture of its surfaces with their numbers and names."""
    from ...io.plots.saving import save_figure
    from ...io.plots.surface_names import draw_surface_names

    save_figure(draw_surface_names(mesh), picture)


def assembly(bodies: Sequence[Body]) -> Mesh:
    """All bodies in one mesh; of several, surfaces are named after body and surface."""
    cells: list[Cells] = []
    surfaces: dict[str, tuple[Facets, ...]] = {}
    first = 0
    for body in bodies:
        mesh = body.mesh
        cells += [replace(block, nodes=block.nodes + first) for block in mesh.cells]
        for name, blocks in mesh.surfaces.items():
            whole = f"{body.name}.{name}" if len(bodies) > 1 else name
            surfaces[whole] = tuple(replace(f, nodes=f.nodes + first) for f in blocks)
        first += len(mesh.points)
    points = np.concatenate([body.mesh.points for body in bodies])
    return Mesh(points, tuple(cells), surfaces)


def describe(mesh: Mesh) -> dict[str, Any]:
    """Size, regions, and area and middle of all surfaces."""
    low, high = mesh.bounding_box()
    surfaces = {}
    for name, blocks in mesh.surfaces.items():
        areas = np.concatenate([facet_areas(mesh.points, f) for f in blocks])
        middles = np.concatenate([mesh.points[f.nodes].mean(axis=1) for f in blocks])
        surfaces[name] = {"area": float(areas.sum()),
                          "middle": (areas @ middles / areas.sum()).tolist(),
                          "between": _between(mesh, blocks)}  # fmt: skip
    return {"dimension": mesh.dim, "points": len(mesh.points), "cells": mesh.cell_count,
            "low": low.tolist(), "high": high.tolist(), "regions": list(mesh.regions),
            "surfaces": surfaces}  # fmt: skip


def _between(mesh: Mesh, blocks: Sequence[Facets]) -> list[str]:
    """Regions that a surface bonds: those that have all its nodes, where there are two."""
    nodes = np.unique(np.concatenate([facets.nodes.ravel() for facets in blocks]))
    found: dict[str, list[np.ndarray]] = {}
    for cells in mesh.cells:
        found.setdefault(cells.region, []).append(cells.nodes.ravel())
    having = [name for name, parts in found.items()
              if np.isin(nodes, np.concatenate(parts)).all()]  # fmt: skip
    return having if len(having) > 1 else []


def _bonds(facts: dict[str, Any], is_glued: bool) -> list[str]:
    """What to know of surfaces that bond regions, in lines."""
    bonds = [name for name, each in facts["surfaces"].items() if each["between"]]
    if not bonds:
        return []
    keys = ", ".join(f"{name} = false" for name in bonds)
    lines = [f"bonded; for contact there write glue = {{ {keys} }} under [mesh]"]
    if is_glued:
        lines[0] += ";\nwith glue = false faces count anew, as --no-glue shows"
    return [*lines, ""]


def _read(source: str, size: float | None, glue: bool) -> Mesh:
    if not is_cad(source):
        for given, name in ((size is not None, "--size"), (not glue, "--no-glue")):
            if given:
                raise InvalidInput(f"{name}: only for CAD files, a mesh file has its cells")
        return read_mesh(source)
    if size is not None:
        return read_cad(source, size, glue=glue)
    low, high = read_cad(source, COARSE).bounding_box()
    return read_cad(source, float((high - low).max()) / CELLS_ALONG, glue=glue)


COARSE = 1e6  # mm: cells as large as the part allows


def _point(values: list[float]) -> str:
    return ", ".join(f"{value:.4g}" for value in values)
