"""Mesh files with fields, for viewers."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from .mesh import Mesh

Array = NDArray[np.float64]
CELL_TYPES = {
    "tri": "triangle", "quad": "quad", "tet": "tetra", "hex": "hexahedron", "wedge": "wedge",
    "pyramid": "pyramid", "tri6": "triangle6", "quad9": "quad9", "tet10": "tetra10",
    "hex27": "hexahedron27",
}  # fmt: skip


def write_meshes(
    path: Path,
    meshes: list[Mesh],
    point_data: dict[str, NDArray],
    cell_data: dict[str, NDArray],
) -> None:
    """Write meshes as one file of the format that the suffix names.

    point_data, cell_data: one row per point or cell, in the order of the meshes.  In 2D the
    third coordinate is zero.
    """
    import meshio

    starts = np.cumsum([0, *(len(mesh.points) for mesh in meshes)])
    cells = [
        (CELL_TYPES[block.kind], block.nodes + start)
        for mesh, start in zip(meshes, starts, strict=False)
        for block in mesh.cells
    ]
    ends = np.cumsum([len(nodes) for _, nodes in cells])[:-1]
    points = np.zeros((starts[-1], 3))
    points[:, : meshes[0].dim] = np.concatenate([mesh.points for mesh in meshes])
    split = {name: np.split(values, ends) for name, values in cell_data.items()}
    meshio.Mesh(points, cells, point_data=point_data, cell_data=split).write(path)
