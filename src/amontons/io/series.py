"""Steps in time as XDMF with HDF5: one list, one file with the mesh, one for every step.

Each file is complete or not there at all, as a series in one HDF5 file would not be while it
grows.  Arrays have the names and meanings of those in VTU files, but for stresses, which have
all nine entries, row by row.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any
from xml.sax.saxutils import quoteattr

import h5py
import numpy as np

from ..core.files import make_folder, write_bytes
from .fclib import write_hdf5
from .vtk import ModelFields, model_fields

if TYPE_CHECKING:
    from ..mechanics.meshes import Mesh
    from ..mechanics.steps import TimeStep

MESH, LIST = "steps-mesh.h5", "steps.xdmf"
KINDS = {  # name and number of XDMF, for all cells alike and for mixed ones
    "tri": ("Triangle", 4), "quad": ("Quadrilateral", 5), "tet": ("Tetrahedron", 6),
    "pyramid": ("Pyramid", 7), "wedge": ("Wedge", 8), "hex": ("Hexahedron", 9),
    "quad9": ("Quadrilateral_9", 0x23), "tri6": ("Triangle_6", 0x24),
    "tet10": ("Tetrahedron_10", 0x26), "hex27": ("Hexahedron_27", 0x32),
    "quad8": ("Quadrilateral_8", 0x25), "wedge15": ("Wedge_15", 0x28),
    "hex20": ("Hexahedron_20", 0x30),
}  # fmt: skip
TYPES = {1: "Scalar", 3: "Vector", 9: "Tensor"}  # by components
FULL = (0, 3, 5, 3, 1, 4, 5, 4, 2)  # entries of a VTK tensor, row by row


def export_xdmf(
    steps: Iterator[TimeStep], folder: str | os.PathLike[str], every: int = 1, title: str = ""
) -> Iterator[TimeStep]:
    """The same steps, every so many of them written; FOLDER/steps.xdmf opens as a film.

    The list is complete after every step.  Raises NotWritten where a file can not be.
    """
    place, written = Path(folder), []
    make_folder(place)
    for step in steps:
        if step.state.index % every == 0:
            write_step(place, step, title, with_mesh=not written)
            written.append((step.time, step.state.index))
            write_list(place, written)
        yield step


def step_name(index: int) -> str:
    """The name of the HDF5 file of a step."""
    return f"step-{index:05d}.h5"


def write_step(folder: Path, step: TimeStep, title: str, *, with_mesh: bool) -> None:
    """Write the HDF5 file of a step, with the first one that of the mesh."""
    found = model_fields(step.model, step.fields, step, title)
    if with_mesh:
        write_hdf5(folder / MESH, lambda file: _put_mesh(file, found.meshes))
    write_hdf5(folder / step_name(step.state.index), lambda file: _put_fields(file, found))


def write_list(folder: Path, written: list[tuple[float, int]]) -> None:
    """Write steps.xdmf: (time, index) of the steps whose files are there."""
    with h5py.File(folder / MESH, "r") as file:
        mesh = _mesh_text(file)
    grids = "".join(_grid_text(folder, time, index, mesh) for time, index in written)
    text = (
        '<?xml version="1.0"?>\n<Xdmf Version="3.0">\n<Domain>\n'
        '<Grid Name="steps" GridType="Collection" CollectionType="Temporal">\n'
        f"{grids}</Grid>\n</Domain>\n</Xdmf>\n"
    )
    write_bytes(folder / LIST, text.encode("utf-8"))


def _put_mesh(file: h5py.File, meshes: list[Mesh]) -> None:
    starts = np.cumsum([0, *(len(mesh.points) for mesh in meshes)])
    points = np.zeros((starts[-1], 3))
    points[:, : meshes[0].dim] = np.concatenate([mesh.points for mesh in meshes])
    blocks = [(b.kind, b.nodes + start) for mesh, start in zip(meshes, starts, strict=False)
              for b in mesh.cells]  # fmt: skip
    kinds = {kind for kind, _ in blocks}
    if len(kinds) == 1:
        cells = np.concatenate([nodes for _, nodes in blocks])
    else:
        cells = np.concatenate([
            np.column_stack([np.full(len(nodes), KINDS[kind][1]), nodes]).ravel()
            for kind, nodes in blocks
        ])  # fmt: skip
    file["points"], file["cells"] = points, cells.astype(np.int64)
    file.attrs["count"] = sum(len(nodes) for _, nodes in blocks)
    file.attrs["type"] = KINDS[kinds.pop()][0] if len(kinds) == 1 else "Mixed"


def _put_fields(file: h5py.File, found: ModelFields) -> None:
    for group, values in (("point", found.point), ("cell", found.cell)):
        for name, array in values.items():
            kept = array[:, FULL] if array.ndim == 2 and array.shape[1] == 6 else array
            whole = kept.dtype.kind in "iu"
            file[f"{group}/{name}"] = kept.astype(np.int32) if whole else kept
    for name, value in found.whole.items():
        file.attrs[name] = value
    if found.stamp:
        file.attrs["stamp"] = found.stamp


def _mesh_text(file: h5py.File) -> str:
    points, cells = file["points"], file["cells"]
    kind, count = file.attrs["type"], file.attrs["count"]
    return (
        f'<Topology TopologyType="{kind}" NumberOfElements="{count}">\n'
        f"{_item(cells, MESH)}</Topology>\n"
        f'<Geometry GeometryType="XYZ">\n{_item(points, MESH)}</Geometry>\n'
    )


def _grid_text(folder: Path, time: float, index: int, mesh: str) -> str:
    name = step_name(index)
    with h5py.File(folder / name, "r") as file:
        fields = "".join(
            f"<Attribute Name={quoteattr(key)} "
            f'AttributeType="{TYPES[array.shape[1] if array.ndim == 2 else 1]}" '
            f'Center="{center}">\n{_item(array, name)}</Attribute>\n'
            for group, center in (("point", "Node"), ("cell", "Cell"))
            for key, array in _members(file, group)
        )
        told = "".join(
            f"<Information Name={quoteattr(str(key))} Value={quoteattr(str(value))}/>\n"
            for key, value in file.attrs.items()
        )
    return (
        f'<Grid Name="{name[:-3]}" GridType="Uniform">\n<Time Value="{time:.17g}"/>\n'
        f"{mesh}{fields}{told}</Grid>\n"
    )


def _members(file: Any, group: str) -> list[tuple[str, Any]]:
    return list(file[group].items())


def _item(array: Any, name: str) -> str:
    kind, size = ("Int", array.dtype.itemsize) if array.dtype.kind == "i" else ("Float", 8)
    shape = " ".join(map(str, array.shape))
    return (
        f'<DataItem DataType="{kind}" Precision="{size}" Dimensions="{shape}" Format="HDF">'
        f"{name}:{array.name}</DataItem>\n"
    )
