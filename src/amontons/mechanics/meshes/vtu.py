"""VTU files, written array by array: meshio's writer holds all connectivity three times.

Arrays are those of VTK's XML format: 32 KiB at a time compressed by zlib, a header with the
lengths of these blocks first, both in base64.
"""

from __future__ import annotations

import base64
import zlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import BinaryIO
from xml.sax.saxutils import quoteattr

import numpy as np
from numpy.typing import NDArray

BLOCK = 32768  # bytes that are compressed together
ROWS = 1 << 16  # of a table that are taken at a time
TYPES = {  # numbers of kinds of cells in VTK
    "tri": 5, "quad": 9, "tet": 10, "hex": 12, "wedge": 13, "pyramid": 14, "tri6": 22,
    "quad8": 23, "tet10": 24, "hex20": 25, "wedge15": 26, "quad9": 28, "hex27": 29,
}  # fmt: skip
ORDERS = {"wedge": [0, 2, 1, 3, 5, 4]}  # of nodes in VTK, where it is another
WORDS = {"f": "Float", "i": "Int", "u": "UInt"}


def write_vtu(
    file: BinaryIO,
    points: Sequence[NDArray],
    cells: Sequence[tuple[str, int, NDArray[np.int64]]],
    point_data: dict[str, NDArray],
    cell_data: dict[str, NDArray],
    field_data: Mapping[str, float],
    remark: str,
) -> None:
    """Write points (n, 3) in parts, cells (kind, number of the first node, table), and fields.

    point_data and cell_data are emptied, so that what is written need not be kept; remark: ""
    or a line for those who look into the file.
    """
    count = sum(len(nodes) for _, _, nodes in cells)
    size = sum(len(part) for part in points)
    file.write(
        b'<?xml version="1.0"?>\n<VTKFile type="UnstructuredGrid" version="0.1" '
        b'byte_order="LittleEndian" compressor="vtkZLibDataCompressor">\n<UnstructuredGrid>\n'
        + f'<Piece NumberOfPoints="{size}" NumberOfCells="{count}">\n<Points>\n'.encode()
    )
    _write_array(file, "Points", lambda: iter(points))
    file.write(b"</Points>\n<Cells>\n")
    _write_array(file, "connectivity", lambda: _connectivity(cells))
    _write_array(file, "offsets", lambda: _offsets(cells))
    _write_array(file, "types", lambda: (
        np.full(len(nodes), TYPES[kind], dtype=np.int64) for kind, _, nodes in cells
    ))  # fmt: skip
    file.write(b"</Cells>\n")
    for tag, data in (("PointData", point_data), ("CellData", cell_data)):
        file.write(f"<{tag}>\n".encode())
        for name in list(data):
            values = [data.pop(name)]
            _write_array(file, name, lambda values=values: iter(values))
        file.write(f"</{tag}>\n".encode())
    file.write(b"</Piece>\n<FieldData>\n")
    for name, value in field_data.items():
        kind = "Int32" if isinstance(value, int) else "Float64"
        if np.isfinite(value):
            text = f'<DataArray type="{kind}" Name={quoteattr(name)} NumberOfTuples="1" '
            text += f'format="ascii">{value!r}</DataArray>\n'
            file.write(text.encode())
    note = f"<!-- {remark.replace('--', '- ')} -->\n" if remark else ""
    file.write(f"</FieldData>\n{note}</UnstructuredGrid>\n</VTKFile>\n".encode())


def _connectivity(cells: Sequence[tuple[str, int, NDArray[np.int64]]]) -> Iterator[NDArray]:
    for kind, first, nodes in cells:
        for row in range(0, len(nodes), ROWS):
            part = nodes[row : row + ROWS] + first
            yield part[:, ORDERS.get(kind, slice(None))].ravel()


def _offsets(cells: Sequence[tuple[str, int, NDArray[np.int64]]]) -> Iterator[NDArray]:
    end = 0
    for _, _, nodes in cells:
        yield end + nodes.shape[1] * np.arange(1, len(nodes) + 1, dtype=np.int64)
        end += nodes.size


def _write_array(file: BinaryIO, name: str, parts: Callable[[], Iterator[NDArray]]) -> None:
    """One array, of parts that follow each other."""
    blocks, rest, first, length = [], b"", None, 0
    for part in parts():
        first = part if first is None else first
        part = np.ascontiguousarray(part, dtype=part.dtype.newbyteorder("<"))
        data = memoryview(part.reshape(-1).view(np.uint8))  # type: ignore[arg-type]
        length += len(data)
        begin = 0
        if rest:
            begin = min(BLOCK - len(rest), len(data))
            rest += bytes(data[:begin])
            if len(rest) < BLOCK:
                continue
            blocks.append(zlib.compress(rest))
            rest = b""
        whole = begin + (len(data) - begin) // BLOCK * BLOCK
        blocks += [zlib.compress(data[k : k + BLOCK]) for k in range(begin, whole, BLOCK)]
        rest = bytes(data[whole:])
    if rest:
        blocks.append(zlib.compress(rest))
    assert first is not None
    kind = f"{WORDS[first.dtype.kind]}{8 * first.dtype.itemsize}"
    width = f' NumberOfComponents="{first.shape[1]}"' if first.ndim == 2 else ""
    head = f'<DataArray type="{kind}" Name={quoteattr(name)}{width} format="binary">\n'
    file.write(head.encode())
    last = length - (len(blocks) - 1) * BLOCK if blocks else 0
    header = np.array([len(blocks), BLOCK, last, *map(len, blocks)], dtype="<u4")
    file.write(base64.b64encode(header.tobytes()))
    rest = b""
    for block in blocks:  # of three bytes four letters are made
        rest += block
        whole = len(rest) // 3 * 3
        file.write(base64.b64encode(rest[:whole]))
        rest = rest[whole:]
    file.write(base64.b64encode(rest) + b"\n</DataArray>\n")
