"""Mesh files with fields, for viewers."""

from __future__ import annotations

import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...core.files import put_from
from .mesh import Mesh
from .vtu import write_vtu

Array = NDArray[np.float64]
CELL_TYPES = {
    "tri": "triangle", "quad": "quad", "tet": "tetra", "hex": "hexahedron", "wedge": "wedge",
    "pyramid": "pyramid", "tri6": "triangle6", "quad9": "quad9", "tet10": "tetra10",
    "hex27": "hexahedron27", "quad8": "quad8", "hex20": "hexahedron20", "wedge15": "wedge15",
}  # fmt: skip


def with_all_kinds() -> Any:
    """The package meshio, told the dimension of wedge15, which its own table lacks."""
    import meshio

    table = getattr(meshio, "_mesh", None)
    getattr(table, "topological_dimension", {}).setdefault("wedge15", 3)
    return meshio


def write_meshes(
    path: Path,
    meshes: list[Mesh],
    point_data: dict[str, Any],
    cell_data: dict[str, NDArray],
    field_data: Mapping[str, float] | None = None,
    remark: str = "",
) -> None:
    """Write meshes as one file of the format that the suffix names.

    point_data, cell_data: one row per point or cell, in the order of the meshes.  In 2D the
    third coordinate is zero.  field_data: numbers of the whole, and remark: a line for those
    who look into the file, both in VTU files only.  These empty point_data and cell_data, see
    `write_vtu`.
    """
    starts = np.cumsum([0, *(len(mesh.points) for mesh in meshes)])
    if path.suffix == ".vtu":
        blocks = [
            (block.kind, int(start), block.nodes)
            for mesh, start in zip(meshes, starts, strict=False)
            for block in mesh.cells
        ]
        points = [_spatial(mesh.points) for mesh in meshes]
        with tempfile.TemporaryFile() as scratch:
            write_vtu(scratch, points, blocks, point_data, cell_data, field_data or {}, remark)
            put_from(path, scratch)
        return
    cells: list[Any] = [
        (CELL_TYPES[block.kind], block.nodes + start)
        for mesh, start in zip(meshes, starts, strict=False)
        for block in mesh.cells
    ]
    ends = np.cumsum([len(nodes) for _, nodes in cells])[:-1]
    points = np.concatenate([_spatial(mesh.points) for mesh in meshes])
    split: Any = {name: np.split(values, ends) for name, values in cell_data.items()}
    meshio = with_all_kinds()
    meshio.Mesh(points, cells, point_data=point_data, cell_data=split).write(path)


def _spatial(points: Array) -> Array:
    """Points (n, 3), also of meshes in 2D."""
    if points.shape[1] == 3:
        return points
    return np.column_stack([points, np.zeros(len(points))])
