"""Mesh files with fields, for viewers."""

from __future__ import annotations

import math
import os
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any, BinaryIO
from xml.sax.saxutils import quoteattr

import numpy as np
from numpy.typing import NDArray

from ...core.files import put_from
from .mesh import Mesh

Array = NDArray[np.float64]
CELL_TYPES = {
    "tri": "triangle", "quad": "quad", "tet": "tetra", "hex": "hexahedron", "wedge": "wedge",
    "pyramid": "pyramid", "tri6": "triangle6", "quad9": "quad9", "tet10": "tetra10",
    "hex27": "hexahedron27", "quad8": "quad8", "hex20": "hexahedron20", "wedge15": "wedge15",
}  # fmt: skip

END = 1000  # bytes of a VTU file that hold its last tags


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
    who look into the file, both in VTU files only.
    """
    meshio = with_all_kinds()
    starts = np.cumsum([0, *(len(mesh.points) for mesh in meshes)])
    cells: list[Any] = [
        (CELL_TYPES[block.kind], block.nodes + start if start else block.nodes)
        for mesh, start in zip(meshes, starts, strict=False)
        for block in mesh.cells
    ]
    ends = np.cumsum([len(nodes) for _, nodes in cells])[:-1]
    points = np.zeros((starts[-1], 3))
    for mesh, first, last in zip(meshes, starts, starts[1:], strict=False):
        points[first:last, : mesh.dim] = mesh.points
    split: Any = {name: np.split(values, ends) for name, values in cell_data.items()}
    whole = meshio.Mesh(points, cells, point_data=point_data, cell_data=split)
    if path.suffix != ".vtu":
        whole.write(path)
        return
    with tempfile.TemporaryFile() as scratch:  # its writer takes no buffer
        meshio.vtu.write(os.dup(scratch.fileno()), whole)
        _add_fields(scratch, field_data or {}, remark)
        put_from(path, scratch)


def _add_fields(file: BinaryIO, fields: Mapping[str, float], remark: str) -> None:
    """Put field data before the end of a VTU file, as its writer knows none."""
    arrays = "".join(
        f'<DataArray type="{"Int32" if isinstance(value, int) else "Float64"}" '
        f'Name={quoteattr(name)} '
        f'NumberOfTuples="1" format="ascii">{value!r}</DataArray>\n'
        for name, value in fields.items()
        if math.isfinite(value)
    )
    note = f"<!-- {remark.replace('--', '- ')} -->\n" if remark else ""
    start = max(file.seek(0, os.SEEK_END) - END, 0)
    file.seek(start)
    head, end, rest = file.read().rpartition(b"</UnstructuredGrid>")
    file.seek(start + len(head))
    file.write(f"<FieldData>\n{arrays}</FieldData>\n{note}".encode() + end + rest)
