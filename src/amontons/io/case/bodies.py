"""Meshes and materials of a case file."""

from __future__ import annotations

import math
import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ...core.arrays import LARGEST
from ...core.errors import FileFormatError, shown
from ...core.files import check_is_regular
from ...core.words import near, near_file
from .tables import Table

if TYPE_CHECKING:
    from ...mechanics.elements.rigid import Rigid
    from ...mechanics.meshes import Mesh
    from ...mechanics.model.parts import Material

NUMBERS = ("young", "poisson", "density")
LAWS = {  # of materials, with their keys
    "linear-elastic": ("young", "poisson", "plane", "density"),
    "neo-hookean": ("young", "poisson"), "ciarlet-geymonat": ("young", "poisson", "a"),
    "rigid": ("density",),
}  # fmt: skip
MAX_NODES = 5_000_000  # of a box: a typing error must not fill the memory


def read_mesh_table(table: Table, path: Path) -> Mesh:
    """The mesh of a table [mesh]: a box, a mesh file or a CAD file."""
    from ...mechanics.meshes import box

    if ("box" in table.data) == ("file" in table.data):
        raise table.error("", "expected either box, the sizes of a box, or file")
    if "file" in table.data:
        return _mesh_file(table, path)
    table.only("box", "cells", "kind", "order")
    size = table.numbers("box", (2, 3))
    if any(0 < abs(length) < 1 / LARGEST for length in size):
        raise table.error("box", f"expected lengths above {1 / LARGEST:g}, got {size}")
    cells = table.need("cells", "a whole number or one per direction")
    counts = cells if isinstance(cells, list) else [cells] * len(size)
    if len(counts) != len(size) or not all(type(c) is int and c >= 1 for c in counts):
        raise table.error("cells", f"expected a whole number >= 1, or {len(size)} of them, "
                          f"got {shown(cells)}")  # fmt: skip
    if math.prod(c + 1 for c in counts) > MAX_NODES:
        raise table.error("cells", f"expected at most {MAX_NODES} nodes, got {shown(cells)}; "
                          "build larger models in Python")  # fmt: skip
    with table.blamed():
        return box(size, counts, table.text("kind") if "kind" in table.data else None)


def _mesh_file(table: Table, path: Path) -> Mesh:
    """The mesh of a mesh file or CAD file, refined if asked for."""
    from ...mechanics.meshes import refined

    table.only("file", "size", "order", "refine")
    times = table.whole("refine", 0, minimum=0) or 0
    mesh = _read_file(table, path)
    if mesh.cell_count * 2 ** (mesh.dim * times) > MAX_NODES:
        raise table.error("refine", f"expected at most {MAX_NODES} cells, got {times}; "
                          "build larger models in Python")  # fmt: skip
    return refined(mesh, times)


def _read_file(table: Table, path: Path) -> Mesh:
    """The mesh of a mesh file, or of a CAD file, which needs a size of cells."""
    from ...mechanics.meshes import is_cad, read_cad, read_mesh

    name = path.parent / table.text("file")
    try:
        check_is_regular(name)
    except FileFormatError as reason:
        raise table.error("file", str(reason)) from None
    if not os.path.isfile(name):  # also for names that no file can have
        raise table.error("file", f"no such file: {name}{near_file(name)}")
    if not is_cad(name):
        if "size" in table.data:
            raise table.error("size", "only for CAD files, a mesh file has its cells")
        with table.blamed("file"):
            return read_mesh(name)
    table.need("size", "the size of cells in mm, as a CAD file has no mesh")
    size = table.number("size")
    if size <= 0:
        raise table.error("size", f"expected a length > 0, got {size}")
    with table.blamed("file"):
        return read_cad(name, size)


def read_materials(table: Table, mesh: Mesh) -> Any:
    """One material for all, [material.default], and one per region named otherwise."""
    for key, value in table.data.items():
        if not isinstance(value, dict) and (key in NUMBERS or near(key, NUMBERS)):
            raise table.error(
                key, "a material stands under the name of its region: write [material.default] "
                "for one of all regions"
            )  # fmt: skip
    found = {region: read_material(table.table(region)) for region in table.data}
    if not found:
        raise table.error("", "expected a table [material.default]")
    if set(found) == {"default"}:
        return found["default"]
    if "default" in found and "default" not in mesh.regions:
        found = {region: found.get(region, found["default"]) for region in mesh.regions} | {
            region: law for region, law in found.items() if region != "default"
        }
    return found


def read_material(table: Table) -> Material | Rigid:
    """The law of one table."""
    from ...mechanics.model import CiarletGeymonat, LinearElastic, NeoHookean, Rigid

    law = table.choice("law", tuple(LAWS), "linear-elastic")
    table.only("law", *LAWS[law])
    density = table.number("density") if "density" in table.data else None
    if law == "rigid":
        with table.blamed():
            return Rigid(density)
    young, poisson = table.number("young"), table.number("poisson")
    with table.blamed():
        if law == "neo-hookean":
            return NeoHookean(young, poisson)
        if law == "ciarlet-geymonat":
            return CiarletGeymonat(
                young, poisson, table.number("a") if "a" in table.data else None
            )
        return LinearElastic(
            young, poisson, table.choice("plane", ("strain", "stress"), "strain"), density
        )
