"""`amontons info part.step`: surfaces of a mesh or CAD file, numbered on a picture."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from ...core.errors import InvalidInput
from ...io.readers import MESHES
from ...io.results import to_json
from ...mechanics.meshes import Mesh, is_cad, read_cad, read_mesh
from ...mechanics.meshes.surfaces import facet_areas
from .sources import check_is_plain
from .terminal import check_writable, deliver_json, show_table

FIGURES = (".png", ".svg", ".pdf")
CELLS_ALONG = 15  # of a CAD file without --size, along its longest side


def is_mesh(source: str) -> bool:
    """Whether the suffix is that of a mesh or CAD file."""
    return Path(source).suffix.lower() in MESHES


def run(
    source: str, size: float | None, picture: str | None, json_copy: str | None
) -> None:  # fmt: skip
    """Print names, areas and middles of all surfaces, and draw them with their numbers."""
    check_writable(json_copy, "--json")
    check_writable(picture, "--picture", FIGURES)
    check_is_plain(Path(source))
    mesh = _read(source, size)
    facts = describe(mesh)
    if json_copy != "-":
        surfaces = facts["surfaces"]
        rows = [
            [str(k), name, f"{each['area']:.4g}", _point(each["middle"])]
            for k, (name, each) in enumerate(surfaces.items(), 1)
        ]
        kinds = f"{mesh.dim}D, {len(mesh.points)} points, regions {', '.join(mesh.regions)}"
        area = "area" if mesh.dim == 3 else "length"
        show_table(f"{source}: {kinds}", ["", "surface", area, "middle"], rows, "left")
    if picture is not None:
        from ...io.plots.saving import save_figure
        from ...io.plots.surface_names import draw_surface_names

        save_figure(draw_surface_names(mesh), picture)
    if json_copy is not None:
        deliver_json(to_json(facts), json_copy)


def describe(mesh: Mesh) -> dict[str, Any]:
    """Size, regions, and area and middle of all surfaces."""
    low, high = mesh.bounding_box()
    surfaces = {}
    for name, blocks in mesh.surfaces.items():
        areas = np.concatenate([facet_areas(mesh.points, f) for f in blocks])
        middles = np.concatenate([mesh.points[f.nodes].mean(axis=1) for f in blocks])
        surfaces[name] = {"area": float(areas.sum()),
                          "middle": (areas @ middles / areas.sum()).tolist()}  # fmt: skip
    return {"dimension": mesh.dim, "points": len(mesh.points), "cells": mesh.cell_count,
            "low": low.tolist(), "high": high.tolist(), "regions": list(mesh.regions),
            "surfaces": surfaces}  # fmt: skip


def _read(source: str, size: float | None) -> Mesh:
    if not is_cad(source):
        if size is not None:
            raise InvalidInput("--size: only for CAD files, a mesh file has its cells")
        return read_mesh(source)
    if size is not None:
        return read_cad(source, size)
    low, high = read_cad(source, COARSE).bounding_box()
    return read_cad(source, float((high - low).max()) / CELLS_ALONG)


COARSE = 1e6  # mm: cells as large as the part allows


def _point(values: list[float]) -> str:
    return ", ".join(f"{value:.4g}" for value in values)
