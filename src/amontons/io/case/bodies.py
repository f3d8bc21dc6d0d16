"""Meshes and materials of a case file."""

from __future__ import annotations

import math
import os
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ...core.arrays import LARGEST
from ...core.errors import FileFormatError, shown
from ...core.files import check_is_regular
from ...core.words import near, near_file, nearest
from .tables import Table

if TYPE_CHECKING:
    from ...mechanics.elements.rigid import Rigid
    from ...mechanics.meshes import Mesh
    from ...mechanics.model.parts import Body, Material

NUMBERS = ("young", "poisson", "density", "expansion")
GENERAL = ("name", "order", "move", "axisymmetric", "integration",
           "corotational")  # keys of every mesh
LAWS = {  # of materials, with their keys
    "linear-elastic": ("young", "poisson", "plane", "density", "expansion"),
    "orthotropic-elastic": ("young", "poisson", "shear", "axes", "plane", "density",
                            "expansion"),
    "elasto-plastic": ("young", "poisson", "yield_stress", "hardening", "density", "expansion"),
    "neo-hookean": ("young", "poisson", "plane", "density"),
    "ciarlet-geymonat": ("young", "poisson", "a", "plane", "density"),
    "mooney-rivlin": ("c10", "c01", "bulk", "plane", "density"),
    "ogden": ("shears", "exponents", "bulk", "plane", "density"),
    "reduced-polynomial": ("coefficients", "bulk", "plane", "density"),
    "saint-venant-kirchhoff": ("young", "poisson", "plane", "density"), "rigid": ("density",),
}  # fmt: skip
MAX_NODES = 20_000_000  # of a box: a typing error must not fill the memory


def read_bodies(top: Table, path: Path) -> list[Body]:
    """A body for the table [mesh], or one for each table [[mesh]], which then have names."""
    from ...mechanics.model import Body

    given = top.need("mesh", 'a table [mesh] with box = [1, 1] and cells, or file = "part.msh"')
    tables = top.tables("mesh") if isinstance(given, list) else [top.table("mesh")]
    if not tables:
        raise top.error("mesh", "expected at least one table [[mesh]]")
    meshes = [read_mesh_table(table, path) for table in tables]
    names = [_body_name(table, needed=len(tables) > 1) for table in tables]
    for k, name in enumerate(names):
        if name in names[:k]:
            raise tables[k].error("name", f"'{name}' is that of mesh[{names.index(name)}], "
                                  "expected another for every mesh")  # fmt: skip
    laws = _materials(top.table("material"), names, meshes)
    bodies = []
    for table, mesh, law, name in zip(tables, meshes, laws, names, strict=True):
        order = table.whole("order", 1)
        if order not in (1, 2):
            raise table.error("order", f"expected 1 or 2, got {order}")
        around = table.data.get("axisymmetric", False)
        if not isinstance(around, bool):
            raise table.error("axisymmetric", f"expected true or false, got {shown(around)}")
        if around:
            with table.blamed("axisymmetric"):
                mesh = mesh.turned()  # noqa: PLW2901
        integration = table.text("integration", "") or None
        with top.blamed("material"):
            body = Body(mesh, law, name, order)
        if "corotational" in table.data:
            with table.blamed("corotational"):
                body = replace(body, corotational=table.data["corotational"])
        if integration is not None:
            with table.blamed("integration"):
                body = replace(body, integration=integration)
        bodies.append(body)
    return bodies


def _body_name(table: Table, *, needed: bool) -> str:
    if "name" not in table.data and needed:
        raise table.error("name", 'missing, expected a name for each of several meshes, such '
                          'as name = "bracket"')  # fmt: skip
    name = table.text("name", "")
    if "." in name:
        raise table.error("name", f"expected a name without a point, got {shown(name)}")
    return name


def _materials(table: Table, names: list[str], meshes: list[Mesh]) -> list[Any]:
    """The material of every body: [material.NAME] of the mesh, else by its regions.

    A table for nothing at all is refused with the names that there are.
    """
    if len(meshes) == 1 and names[0] not in table.data:
        return [read_materials(table, meshes[0])]
    regions = [r for mesh in meshes for r in mesh.regions if r != "default"]
    for key in table.data:
        if key not in (*names, *regions, "default"):
            raise table.error(key, "no mesh and no region of one has this name"
                              f"{nearest(key, dict.fromkeys([*names, *regions, 'default']))}"
                              )  # fmt: skip
    found = []
    for name, mesh in zip(names, meshes, strict=True):
        kept = {k: v for k, v in table.data.items() if k == "default" or k in mesh.regions}
        if name in table.data:
            found.append(read_material(table.table(name)))
        elif kept:
            found.append(read_materials(Table(table.file, table.where, kept), mesh))
        else:
            raise table.error(name, f"missing, expected a table [material.{name}], or "
                              "[material.default] for all")  # fmt: skip
    return found


def read_mesh_table(table: Table, path: Path) -> Mesh:
    """The mesh of a table [mesh]: a box, a mesh file or a CAD file, moved where it says so."""
    mesh = _read_mesh(table, path)
    if "move" not in table.data:
        return mesh
    points = mesh.points + np.array(table.numbers("move", (mesh.dim,)))
    with table.blamed("move"):
        return replace(mesh, points=points)


def _read_mesh(table: Table, path: Path) -> Mesh:
    from ...mechanics.meshes import box

    if ("box" in table.data) == ("file" in table.data):
        raise table.error("", "expected either box, the sizes of a box, or file")
    if "file" in table.data:
        return _mesh_file(table, path)
    table.only("box", "cells", "kind", *GENERAL)
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

    table.only("file", "size", "refine", "glue", *GENERAL)
    times = table.whole("refine", 0, minimum=0) or 0
    mesh = _read_file(table, path)
    if mesh.cell_count * 2 ** (mesh.dim * times) > MAX_NODES:
        raise table.error("refine", f"expected at most {MAX_NODES} cells, got {times}; "
                          "build larger models in Python")  # fmt: skip
    return refined(mesh, times)


def _read_file(table: Table, path: Path) -> Mesh:
    """The mesh of a mesh file, or of a CAD file, which needs a size of cells."""
    from ...mechanics.meshes import is_cad, read_cad
    from ..meshes import read_mesh

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
            return read_mesh(name, glue=_glue(table))
    table.need("size", "the size of cells in mm, as a CAD file has no mesh")
    size = table.number("size")
    if size <= 0:
        raise table.error("size", f"expected a length > 0, got {size}")
    with table.blamed("file"):
        return read_cad(name, size, glue=_glue(table))


def _glue(table: Table) -> bool | dict[str, bool]:
    """Whether parts that touch are bonded, all or by surface."""
    given = table.data.get("glue", True)
    if isinstance(given, bool):
        return given
    if not isinstance(given, dict) or not all(isinstance(v, bool) for v in given.values()):
        raise table.error("glue", "expected true, false, or a table of surfaces, "
                          f"{{ joint = false }}, got {shown(given)}")  # fmt: skip
    return given


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
    from ...mechanics.model import (
        CiarletGeymonat,
        ElastoPlastic,
        LinearElastic,
        NeoHookean,
        Rigid,
        SaintVenantKirchhoff,
    )

    law = table.choice("law", tuple(LAWS), "linear-elastic")
    table.only("law", *LAWS[law])
    density = table.number("density") if "density" in table.data else None
    if law == "rigid":
        with table.blamed():
            return Rigid(density)
    plane = table.choice("plane", ("strain", "stress"), "strain")
    if law == "orthotropic-elastic":
        return _orthotropic(table, plane, density)
    if "bulk" in LAWS[law]:
        return _rubber(table, law, density, plane)
    young, poisson = table.number("young"), table.number("poisson")
    with table.blamed():
        if law == "elasto-plastic":
            return ElastoPlastic(
                young, poisson, "strain", density, table.number("expansion", 0.0),
                table.data.get("yield_stress"), table.number("hardening", 0.0),
            )  # fmt: skip
        if law == "saint-venant-kirchhoff":
            return SaintVenantKirchhoff(young, poisson, density, plane)
        if law == "neo-hookean":
            return NeoHookean(young, poisson, density, plane)
        if law == "ciarlet-geymonat":
            return CiarletGeymonat(
                young, poisson, table.number("a") if "a" in table.data else None, density, plane
            )
        return LinearElastic(
            young, poisson, plane, density, table.number("expansion", 0.0)
        )


def _rubber(table: Table, law: str, density: float | None, plane: str) -> Material:
    """A law of what is isochoric, and a bulk modulus."""
    from ...mechanics.model import MooneyRivlin, Ogden, ReducedPolynomial

    bulk = table.number("bulk")
    if law == "mooney-rivlin":
        c10, c01 = table.number("c10"), table.number("c01", 0.0)
        with table.blamed():
            return MooneyRivlin(c10, c01, bulk, density, plane)
    if law == "reduced-polynomial":
        coefficients = table.numbers("coefficients", range(1, 7))
        with table.blamed():
            return ReducedPolynomial(coefficients, bulk, density, plane)
    shears, exponents = (table.numbers(k, range(1, 7)) for k in ("shears", "exponents"))
    with table.blamed():
        return Ogden(shears, exponents, bulk, density, plane)


def _orthotropic(table: Table, plane: str, density: float | None) -> Material:
    from ...mechanics.model import OrthotropicElastic

    young, poisson, shear = (table.numbers(k, (3,)) for k in ("young", "poisson", "shear"))
    expansion: Any = 0.0
    if "expansion" in table.data:
        several = isinstance(table.data["expansion"], list)
        expansion = table.numbers("expansion", (3,)) if several else table.number("expansion")
    given = table.data.get("axes")
    with table.blamed():
        if given is None:
            return OrthotropicElastic(young, poisson, shear, plane=plane, density=density,
                                      expansion=expansion)  # fmt: skip
        return OrthotropicElastic(young, poisson, shear, given, plane, density, expansion)
