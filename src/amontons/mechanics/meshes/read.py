"""Mesh files: gmsh text files by our own reader, every other format through meshio."""

from __future__ import annotations

import contextlib
import io
import os
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from ...core.errors import FileFormatError, MissingDependency
from ...core.files import check_is_regular
from ...core.words import near_file
from . import gmsh
from .mesh import Mesh
from .raw import RawBlock, RawMesh, to_mesh
from .split import Glue, check_glue, split
from .write import with_all_kinds

KINDS = {
    "triangle": "tri", "tetra": "tet", "hexahedron": "hex", "triangle6": "tri6",
    "tetra10": "tet10", "hexahedron20": "hex20", "hexahedron27": "hex27",
}  # fmt: skip
CAD_SUFFIXES = (".step", ".stp", ".iges", ".igs", ".brep")
EXPORTS = {
    suffix: "; export it as .msh, .inp, .med or .vtu, which keep the names of groups"
    for suffix in (".unv", ".bdf", ".nas", ".cdb", ".neu", ".k")
}
TAGS = ("gmsh:physical", "medit:ref", "cell_tags", "MaterialID", "region", "avsucd:material")


def read_mesh(path: str | os.PathLike[str], *, glue: Glue = True) -> Mesh:
    """The mesh in a file of any format but decks, which `io.meshes.read_mesh` reads too.

    Arguments, groups and errors are those of that function.
    """
    check_glue(glue)
    name = os.fspath(path)
    if is_cad(name):
        raise FileFormatError(
            f"{name}: expected a mesh file; a CAD file holds shapes, mesh it with "
            "read_cad(path, size)"
        )
    head = file_head(Path(name))
    if gmsh.is_text(head):
        try:
            text = Path(name).read_text(encoding="utf-8")
        except UnicodeDecodeError as error:
            raise FileFormatError(f"{name}: expected a text file in UTF-8 ({error})") from None
        return split(to_mesh(gmsh.read_text(name, text), name), glue)
    return split(to_mesh(_from_meshio(name), name), glue)


def is_cad(path: str | os.PathLike[str]) -> bool:
    """Whether the suffix is that of a CAD file, for read_cad."""
    return Path(path).suffix.lower() in CAD_SUFFIXES


def file_head(path: Path) -> bytes:
    """The first bytes of a file that exists, can be read and is not empty."""
    if path.is_dir():
        raise FileFormatError(f"{path}: expected a file, this is a folder")
    check_is_regular(path)
    try:
        with path.open("rb") as file:
            head = file.read(4096)
    except FileNotFoundError:
        raise FileFormatError(f"{path}: no such file{near_file(Path(path))}") from None
    except OSError as error:
        raise FileFormatError(f"{path}: can not be read: {error.strerror}") from None
    if not head.strip():
        raise FileFormatError(f"{path}: this file is empty")
    return head


def _from_meshio(path: str) -> RawMesh:
    return mesh_of_meshio(Path(path), _raw)


def mesh_of_meshio(path: Path, use: Callable[[Any], Any] = lambda mesh: mesh) -> Any:
    """What `use` makes of the mesh that meshio reads; raises FileFormatError, said by it."""
    try:
        meshio = with_all_kinds()
    except ImportError as error:
        raise MissingDependency(
            f"{path}: this format needs the package meshio: python -m pip install meshio"
        ) from error
    from ...core.hdf5 import check_file

    said = io.StringIO()
    try:
        with (
            contextlib.redirect_stdout(said),
            contextlib.redirect_stderr(said),
            warnings.catch_warnings(),
        ):
            warnings.simplefilter("ignore")
            check_file(path)
            return use(meshio.read(path))
    except FileFormatError:
        raise
    # A broken file makes meshio's forty parsers raise anything, or leave the interpreter.
    except (Exception, SystemExit) as error:
        reason = " ".join(said.getvalue().split()) or str(error) or type(error).__name__
        raise FileFormatError(
            f"{path}: expected a mesh in gmsh 2.2 or 4.1 or another format of meshio, told by "
            f"the suffix; {reason}{EXPORTS.get(Path(path).suffix.lower(), '')}"
        ) from None


def _raw(mesh: Any) -> RawMesh:
    """Blocks split by the groups that meshio found."""
    points = np.zeros((len(mesh.points), 3))
    given = np.asarray(mesh.points, dtype=float)
    points[:, : given.shape[1]] = given
    blocks = []
    for k, block in enumerate(mesh.cells):
        nodes = np.asarray(block.data, dtype=np.int64)
        kind = str(KINDS.get(block.type, block.type))
        groups = _groups(mesh, k, block.type, len(nodes))
        for key in dict.fromkeys(groups):
            rows = [row for row, found in enumerate(groups) if found == key]
            blocks.append(RawBlock(kind, nodes[rows], key))
    sets = {k: np.asarray(v, dtype=np.int64) for k, v in mesh.point_sets.items()}
    return RawMesh(points, blocks, sets)


def _groups(mesh: Any, k: int, kind: str, count: int) -> list[tuple[str, ...]]:
    """Names of the groups of every element of block k."""
    out: list[list[str]] = [[] for _ in range(count)]
    for name, parts in mesh.cell_sets.items():
        if name.startswith("gmsh:") or parts[k] is None:
            continue
        for row in np.asarray(parts[k], dtype=np.int64):
            out[row].append(str(name))
    if not any(out):
        tags = next((mesh.cell_data[t][k] for t in TAGS if t in mesh.cell_data), [])
        for row, tag in enumerate(np.asarray(tags).ravel()):
            out[row] += _tag_names(mesh, int(tag), kind)
    return [tuple(names) for names in out]


def _tag_names(mesh: Any, tag: int, kind: str) -> list[str]:
    """Names of a numeric tag: MED families, gmsh's physical names, else the number itself."""
    families = getattr(mesh, "cell_tags", None)
    if families and tag in families:
        return list(families[tag])
    dim = 3 if kind.startswith(("tet", "hex", "wed", "pyr")) else 1 if "line" in kind else 2
    for name, value in mesh.field_data.items():
        if len(value) == 2 and int(value[0]) == tag and int(value[1]) == dim:
            return [str(name)]
    return [str(tag)] if tag else []
