"""CAD shapes meshed by Netgen on OpenCascade: STEP, IGES and BREP files, shapes made in Python.

Solids become tetrahedra; a shape of plane faces only becomes triangles in 2D.  Elements have
straight sides: a curved face becomes plane facets with their corners on it.  Solids (in 2D
faces) that touch are glued: they share the nodes of their common face.  With glue=False each
is meshed by itself.
"""

from __future__ import annotations

import importlib.util
import json
import os
import pickle
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...core.errors import AmontonsError, FileFormatError, InvalidInput, MissingDependency
from .cells import FACET_KIND
from .facets import Cells, Facets
from .mesh import Mesh, unknown
from .read import CAD_SUFFIXES, file_head, is_cad
from .split import Glue, check_glue, split

Index = NDArray[np.int64]
MAX_CELLS = 10_000_000  # a typing error in the size must not run for days
TOLERANCE = 1e-6  # OpenCascade's boxes are larger than the shape by some 1e-7
COLOUR = re.compile(r"\x1b\[[0-9;]*m")
NEEDS = "CAD needs the extra cad: python -m pip install 'amontons[cad]'"
UNNAMED = ("", "default", "NONE")  # what Netgen and CAD programs write instead of no name


def read_cad(
    path: str | os.PathLike[str], size: float, *, names: Mapping[str, str] | None = None,
    glue: Glue = True,
) -> Mesh:  # fmt: skip
    """The mesh of a CAD file (.step, .stp, .iges, .igs, .brep), cell edges of about `size`.

    Regions are the names of the solids, surfaces those of the faces; faces without a name are
    face1, face2, … in the order of the file, several solids without one solid1, solid2, …
    names renames some: {"face3": "bottom"}.  Lengths are millimetres: STEP and IGES files know
    their unit and are converted.  BREP files hold neither names nor a unit.  Small details get
    smaller cells.  Raises MissingDependency without the extra `cad`, Netgen.

    Solids that touch are bonded.  glue=False keeps all apart, so that they can be in contact:
    each has a mesh of its own, face1, face2, … count over all of them, and where several have a
    face "top", it is also "top-bracket" and "top-plate" after the solids.
    glue={"face3": False} takes the bonded mesh apart along one surface only, see
    `meshes.split.split`.
    """
    check_glue(glue)
    name = os.fspath(path)
    if not is_cad(name):
        raise FileFormatError(
            f"{name}: expected a CAD file ({', '.join(CAD_SUFFIXES)}); meshes are read by "
            "read_mesh"
        )
    _check_size(size)
    file_head(Path(name))
    if importlib.util.find_spec("netgen") is None:
        raise MissingDependency(f"{name}: {NEEDS}")
    return _renamed(_read_apart(name, float(size), glue), names or {}, name)


def _read_apart(name: str, size: float, glue: Glue) -> Mesh:
    """The mesh by another process: OpenCascade prints, and broken files can make it crash."""
    code = f"import sys; sys.path[:] = {sys.path!r}; from {__name__} import _child; _child()"
    suffix = Path(name).suffix.lower()
    with tempfile.TemporaryDirectory() as folder:
        answer = Path(folder) / "answer"
        part = Path(folder) / f"part{'.iges' if suffix == '.igs' else suffix}"
        shutil.copyfile(name, part)  # Netgen knows neither .igs nor .STEP
        done = subprocess.run(
            [sys.executable, "-c", code, str(part), repr(size), str(answer), json.dumps(glue)],
            capture_output=True, stdin=subprocess.DEVNULL,
        )  # fmt: skip
        found = pickle.loads(answer.read_bytes()) if answer.exists() else None
    if isinstance(found, Mesh):
        return found
    if isinstance(found, MissingDependency):
        raise found
    said = COLOUR.sub("", (done.stdout + done.stderr).decode(errors="replace"))
    reason = str(found) if found else "OpenCascade can not read this file, it crashed"
    raise FileFormatError(" ".join(f"{name}: {reason} {said}".split()))


def _child() -> None:
    """Write the mesh, or what went wrong, for the process that asked."""
    name, size, answer, glue = sys.argv[1:]
    try:
        found: Mesh | AmontonsError = mesh_shape(
            _shape(name), float(size), glue=json.loads(glue)
        )
    except AmontonsError as error:
        found = error
    Path(answer).write_bytes(pickle.dumps(found))


def _shape(name: str) -> Any:
    occ = _occ()
    try:
        return occ.OCCGeometry(name).shape
    except Exception as error:  # of OpenCascade, without a common base
        raise InvalidInput(f"OpenCascade can not read this file: {error}") from None


def mesh_shape(shape: Any, size: float, *, glue: Glue = True) -> Mesh:
    """The mesh of a netgen.occ shape, cell edges of about `size`, unit of the shape.

    Names are those of the shape: `shape.faces.Min(Z).name = "bottom"`, in 2D of its edges;
    see `read_cad` for what has none, and for glue.
    """
    check_glue(glue)
    occ = _occ()
    if not isinstance(shape, occ.TopoDS_Shape):
        raise InvalidInput(f"shape: expected a shape of netgen.occ, got {shape!r}")
    _check_size(size)
    parts = list(shape.solids) or list(shape.faces)
    if not parts:
        raise InvalidInput(
            "shape: expected solids, or faces in a plane of constant z, got none of them"
        )
    dim = 3 if list(shape.solids) else 2
    if dim == 2:
        _check_plane(shape)
    _check_count(parts, size, dim)
    if glue is False and len(parts) > 1:
        return _side_by_side(parts, size, dim)
    try:
        whole = occ.Glue(parts) if len(parts) > 1 else parts[0]
    except Exception as error:  # of OpenCascade, without a common base
        raise InvalidInput(f"shape: OpenCascade can not glue its solids: {error}") from None
    return split(_from_netgen(_meshed(whole, size, dim), dim), glue)


def _side_by_side(parts: Sequence[Any], size: float, dim: int) -> Mesh:
    """One mesh of solids that share no nodes; a face is also known with its solid behind it."""
    points, cells, count, faces = [], [], 0, 0
    surfaces: dict[str, list[tuple[str, Facets]]] = {}
    for k, part in enumerate(parts):
        found = _meshed(part, size, dim)
        mesh = _from_netgen(found, dim, (k, faces))
        faces += len(found.GetRegionNames(dim - 1))
        region = _free(mesh.regions[0], {block.region for block in cells})
        cells += [Cells(b.kind, b.nodes + count, region) for b in mesh.cells]
        for name, blocks in mesh.surfaces.items():
            surfaces.setdefault(name, []).extend(
                (region, Facets(b.kind, b.nodes + count)) for b in blocks
            )
        points.append(mesh.points)
        count += len(mesh.points)
    named: dict[str, list[Facets]] = {}
    for name, entries in surfaces.items():
        named.setdefault(name, []).extend(facets for _, facets in entries)
        if len({region for region, _ in entries}) > 1:
            for region, facets in entries:
                named.setdefault(f"{name}-{region}", []).append(facets)
    return Mesh(np.concatenate(points), tuple(cells), {k: tuple(v) for k, v in named.items()})


def _free(name: str, taken: set[str]) -> str:
    """The name, or name-2, name-3, … where solids have the same one."""
    tries = (name, *(f"{name}-{k}" for k in range(2, len(taken) + 2)))
    return next(one for one in tries if one not in taken)


def _meshed(shape: Any, size: float, dim: int) -> Any:
    """Netgen's mesh of a shape."""
    try:
        # in parallel it is no faster and gives another mesh every time
        return _occ().OCCGeometry(shape, dim=dim).GenerateMesh(
            maxh=float(size), parallel_meshing=False
        )
    except Exception as error:  # of Netgen or OpenCascade, without a common base
        raise InvalidInput(f"shape: Netgen can not mesh it: {error}") from None


def _occ() -> Any:
    try:
        import netgen.occ
    except ImportError as error:
        raise MissingDependency(f"{NEEDS} ({error})") from error
    return netgen.occ


def _check_size(size: float) -> None:
    if not (isinstance(size, int | float | np.number) and np.isfinite(size) and size > 0):
        raise InvalidInput(f"size: expected a finite length > 0, got {size!r}")


def _check_plane(shape: Any) -> None:
    low, high = (np.array([p.x, p.y, p.z]) for p in shape.bounding_box)
    if high[2] - low[2] > TOLERANCE * (1 + (high - low).max()):
        raise InvalidInput(
            "shape: expected solids, or faces in a plane of constant z; got loose faces, which "
            "IGES files often hold: export the part as a STEP file"
        )


def _check_count(parts: Sequence[Any], size: float, dim: int) -> None:
    """Refuse a size that gives far too many cells: regular ones fill size^dim / factor."""
    content = sum(part.mass for part in parts)
    count = content / size**dim * {2: 4 / np.sqrt(3), 3: 6 * np.sqrt(2)}[dim]
    if count > MAX_CELLS:
        raise InvalidInput(
            f"size: {size} gives about {count:.2g} cells, expected at most {MAX_CELLS:.2g}"
        )


def _from_netgen(mesh: Any, dim: int, before: tuple[int, int] | None = None) -> Mesh:
    """Our mesh, with the names that Netgen has kept or automatic ones.

    before: solids and faces of other meshes that automatic names count first.
    """
    solids, faces = before or (0, 0)
    solid, face = ("solid", "face") if dim == 3 else ("face", "edge")
    elements = {1: mesh.Elements1D, 2: mesh.Elements2D, 3: mesh.Elements3D}
    cells, facets = elements[dim]().NumPy(), elements[dim - 1]().NumPy()
    nodes = cells["nodes"][:, : dim + 1].astype(np.int64) - 1
    used = np.unique(nodes)
    number = np.full(int(mesh.Coordinates().shape[0]), -1)
    number[used] = np.arange(len(used))
    regions = _by_name(cells["index"], mesh.GetRegionNames(dim), solid, solids)
    if before is None and len(regions) == 1 and f"{solid}1" in regions:
        regions = {"default": regions[f"{solid}1"]}
    sides = number[facets["nodes"][:, :dim].astype(np.int64) - 1]
    surfaces = _by_name(facets["index"], mesh.GetRegionNames(dim - 1), face, faces)
    return Mesh(
        np.array(mesh.Coordinates())[used],
        tuple(
            Cells("tet" if dim == 3 else "tri", number[nodes[rows]], name)
            for name, rows in regions.items()
        ),
        {name: (Facets(FACET_KIND[dim, dim], sides[rows]),) for name, rows in surfaces.items()},
    )


def _by_name(
    index: Index, names: Sequence[str], word: str, before: int = 0
) -> dict[str, Index]:
    """Rows of elements by the name of what they lie in: index counts from 1.

    What has no name is called `word` and its number, `before` more than the index, with "_"
    behind if that name is taken.
    """
    given = {name for name in names if name not in UNNAMED}
    rows: dict[str, list[Index]] = {}
    for k in np.unique(index):
        name = str(names[k - 1]) if k <= len(names) else ""
        if name in UNNAMED:
            name = f"{word}{before + k}"
            while name in given:
                name += "_"
        rows.setdefault(name, []).append(np.flatnonzero(index == k))
    return {name: np.concatenate(parts) for name, parts in rows.items()}


def _renamed(mesh: Mesh, names: Mapping[str, str], title: str) -> Mesh:
    """The same mesh with other names of regions and surfaces, and the title."""
    known = (*mesh.regions, *mesh.surfaces)
    for old in names:
        if old not in known:
            raise InvalidInput("names: " + unknown("name", old, known))
    surfaces: dict[str, tuple[Facets, ...]] = {}
    for old, facets in mesh.surfaces.items():
        new = names.get(old, old)
        surfaces[new] = (*surfaces.get(new, ()), *facets)
    cells = tuple(Cells(b.kind, b.nodes, names.get(b.region, b.region)) for b in mesh.cells)
    return Mesh(mesh.points, cells, surfaces, name=title)
