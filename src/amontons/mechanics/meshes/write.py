"""Mesh files with fields, for viewers."""

from __future__ import annotations

import math
import os
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any
from xml.sax.saxutils import quoteattr

import numpy as np
from numpy.typing import NDArray

from ...core.files import put
from .mesh import Mesh

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
    who look into the file, both in VTU files only.
    """
    meshio = with_all_kinds()
    starts = np.cumsum([0, *(len(mesh.points) for mesh in meshes)])
    cells: list[Any] = [
        (CELL_TYPES[block.kind], block.nodes + start)
        for mesh, start in zip(meshes, starts, strict=False)
        for block in mesh.cells
    ]
    ends = np.cumsum([len(nodes) for _, nodes in cells])[:-1]
    points = np.zeros((starts[-1], 3))
    points[:, : meshes[0].dim] = np.concatenate([mesh.points for mesh in meshes])
    split: Any = {name: np.split(values, ends) for name, values in cell_data.items()}
    whole = meshio.Mesh(points, cells, point_data=point_data, cell_data=split)
    if path.suffix != ".vtu":
        whole.write(path)
        return
    with tempfile.TemporaryFile() as scratch:  # its writer takes no buffer
        meshio.vtu.write(os.dup(scratch.fileno()), whole)
        scratch.seek(0)
        put(path, _with_fields(scratch.read(), field_data or {}, remark))


def _with_fields(text: bytes, fields: Mapping[str, float], remark: str) -> bytes:
    """A VTU file with field data before its end, as its writer knows none."""
    arrays = "".join(
        f'<DataArray type="{"Int32" if isinstance(value, int) else "Float64"}" '
        f'Name={quoteattr(name)} '
        f'NumberOfTuples="1" format="ascii">{value!r}</DataArray>\n'
        for name, value in fields.items()
        if math.isfinite(value)
    )
    note = f"<!-- {remark.replace('--', '- ')} -->\n" if remark else ""
    head, end, rest = text.rpartition(b"</UnstructuredGrid>")
    return head + f"<FieldData>\n{arrays}</FieldData>\n{note}".encode() + end + rest
