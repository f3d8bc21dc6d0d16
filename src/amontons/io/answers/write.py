"""Our results for viewers: `.frd` (cgx, PrePoMax), and tables as in CalculiX' `.dat`."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ... import __version__
from ...core.errors import FileFormatError, InvalidInput
from ...core.files import put

if TYPE_CHECKING:
    from ..results import Output

Array = NDArray[np.float64]
Index = NDArray[np.int64]
TINY = 1e-99  # exponents of three digits have no room
LINE = 10  # nodes of an element in one line
SUFFIXES = (".frd", ".dat")
HEX20 = (*range(12), *range(16, 20), *range(12, 16))
WEDGE15 = (*range(9), *range(12, 15), *range(9, 12))
TYPES: dict[str, tuple[int, Sequence[int]]] = {  # number of the type, order of our nodes in it
    "hex": (1, range(8)), "wedge": (2, range(6)), "tet": (3, range(4)), "hex20": (4, HEX20),
    "hex27": (4, HEX20), "wedge15": (5, WEDGE15), "tet10": (6, range(10)),
    "tri": (7, range(3)), "tri6": (8, range(6)), "quad": (9, range(4)),
    "quad8": (10, range(8)), "quad9": (10, range(8)),
}  # fmt: skip
MESHIO = {"hexahedron": "hex", "hexahedron20": "hex20", "hexahedron27": "hex27",
          "tetra": "tet", "tetra10": "tet10", "triangle": "tri", "triangle6": "tri6",
          "wedge": "wedge", "wedge15": "wedge15", "quad": "quad", "quad8": "quad8",
          "quad9": "quad9"}  # fmt: skip


@dataclass(frozen=True, eq=False)
class Shown:
    """What is written: points (n, 3), cells by kind, fields (n, c), numbers of nodes."""

    points: Array
    cells: list[tuple[str, Index]]
    displacement: Array
    stress: Array | None
    contact: tuple[Index, Array] | None
    labels: Index
    time: float = 1.0

    @classmethod
    def of(cls, output: Output, labels: Index | None = None) -> Shown:
        """Of a solved model; labels (n,): numbers of its nodes, by default from 1 on."""
        from ...linear.blocks import spatial
        from ..vtk import model_fields

        if output.model is None or output.fields is None:
            raise InvalidInput("this solution has no mesh; write .h5 or .json")
        found = model_fields(output.model, output.fields, output.solution, output.title)
        points = np.concatenate([spatial(mesh.points) for mesh in found.meshes])
        starts = np.cumsum([0, *(len(mesh.points) for mesh in found.meshes)])
        cells: list[tuple[str, Index]] = [
            (str(block.kind), start + block.nodes)
            for start, mesh in zip(starts, found.meshes, strict=False)
            for block in mesh.cells
        ]
        return cls._of_fields(points, cells, found.point, labels)

    @classmethod
    def of_vtu(cls, path: Path) -> Shown:
        """Of a VTU file that we wrote; raises FileFormatError for others."""
        from ...mechanics.meshes.read import mesh_of_meshio

        mesh: Any = mesh_of_meshio(path)
        if "displacement" not in mesh.point_data:
            raise FileFormatError(f"{path}: has no field 'displacement' at its nodes")
        cells: list[tuple[str, Index]] = [
            (str(MESHIO.get(block.type, block.type)), np.asarray(block.data, dtype=np.int64))
            for block in mesh.cells
        ]
        fields = {str(k): np.asarray(v) for k, v in mesh.point_data.items()}
        return cls._of_fields(np.asarray(mesh.points, dtype=float), cells, fields, None)

    @classmethod
    def _of_fields(
        cls, points: Array, cells: list[tuple[str, Index]], fields: dict[str, Array],
        labels: Index | None,
    ) -> Shown:  # fmt: skip
        contact = None
        if "CSIDE" in fields:
            on = np.flatnonzero(fields["CSIDE"] > 0)
            zero = np.zeros(len(on))
            columns = (fields["COPEN"][on], fields["CSLIP"][on], zero, fields["CPRESS"][on],
                       fields["CSHEAR"][on], zero)  # fmt: skip
            contact = on, np.column_stack(columns)
        numbers = np.arange(1, len(points) + 1) if labels is None else labels
        moved, stress = fields["displacement"], fields.get("stress")
        return cls(points, cells, moved, stress, contact, numbers)


def write_answer(path: Path, shown: Shown) -> None:
    """Fill a new file, as that of `replacing`; the suffix decides: .frd or .dat."""
    text = frd_text(shown) if path.suffix.lower() == ".frd" else dat_text(shown)
    put(path, text.encode("ascii"))


def frd_text(shown: Shown) -> str:
    """All of a .frd file."""
    return "\n".join([*_head(shown), *_mesh(shown), *_results(shown), " 9999", ""])


def dat_text(shown: Shown) -> str:
    """Displacements in the table that CalculiX prints, with all their digits."""
    head = f" displacements (vx,vy,vz) for set NALL and time  {shown.time:.7E}"
    rows = (
        f"{label:10d} {u[0]: .15E} {u[1]: .15E} {u[2]: .15E}"
        for label, u in zip(shown.labels.tolist(), shown.displacement.tolist(), strict=True)
    )
    return "\n".join(["", head, "", *rows, ""])


def _head(shown: Shown) -> Iterator[str]:
    yield "    1C"
    yield f"    1UPGM               {'amontons':<48}"
    yield f"    1UVERSION           {__version__:<48}"


def _mesh(shown: Shown) -> Iterator[str]:
    yield f"    2C{'':18}{len(shown.points):12d}{'':37}1"
    yield from _rows(shown.labels, shown.points)
    yield " -3"
    unknown = {kind for kind, _ in shown.cells} - set(TYPES)
    if unknown:
        raise InvalidInput(f".frd: has no element like {', '.join(sorted(unknown))}")
    yield f"    3C{'':18}{sum(len(n) for _, n in shown.cells):12d}{'':37}1"
    number = 0
    for material, (kind, nodes) in enumerate(shown.cells, 1):
        code, order = TYPES[kind]
        for row in shown.labels[nodes[:, list(order)]].tolist():
            number += 1
            yield f" -1{number:10d}{code:5d}{0:5d}{material:5d}"
            for at in range(0, len(row), LINE):
                yield " -2" + "".join(f"{label:10d}" for label in row[at : at + LINE])
    yield " -3"


def _results(shown: Shown) -> Iterator[str]:
    every = np.arange(len(shown.points))
    yield from _block(shown, 1, "DISP", ("D1", "D2", "D3"), every, shown.displacement)
    if shown.stress is not None:
        names = ("SXX", "SYY", "SZZ", "SXY", "SYZ", "SZX")
        yield from _block(shown, 2, "STRESS", names, every, shown.stress)
    if shown.contact is not None:
        names = ("COPEN", "CSLIP1", "CSLIP2", "CPRESS", "CSHEAR1", "CSHEAR2")
        yield from _block(shown, 3, "CONTACT", names, *shown.contact)


def _block(
    shown: Shown, number: int, name: str, parts: Sequence[str], on: Index, values: Array
) -> Iterator[str]:  # fmt: skip
    vector = name == "DISP"
    yield f"    1PSTEP{number:26d}{1:12d}{1:12d}"
    head = f"  100CL{100 + number:5d}{shown.time:12.5E}{len(on):12d}"
    yield f"{head}{'':20}{0:2d}{1:5d}{'':10}{1:2d}"
    yield f" -4  {name:<8}{len(parts) + vector:5d}{1:5d}"
    for k, part in enumerate(parts, 1):
        kind, row, column = (2, k, 0) if vector else (1, 0, 0)
        if name == "STRESS":
            kind, row, column = 4, *_place(part)
        yield f" -5  {part:<8}{1:5d}{kind:5d}{row:5d}{column:5d}"
    if vector:
        yield " -5  ALL         1    2    0    0    1ALL"
    yield from _rows(shown.labels[on], values)
    yield " -3"


def _place(part: str) -> tuple[int, int]:
    """Row and column of an entry of the stress."""
    row, column = ("XYZ".index(letter) + 1 for letter in part[1:])
    return row, column


def _rows(labels: Index, values: Array) -> Iterator[str]:
    clean = np.where(np.abs(values) < TINY, 0.0, values)
    for label, row in zip(labels.tolist(), clean.tolist(), strict=True):
        yield f" -1{label:10d}" + "".join(f"{v:12.5E}" for v in row)
