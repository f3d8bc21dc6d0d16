"""FCLib's HDF5 exchange format: read and write discrete problems, number for number.

    fclib_local/  spacedim, W/, vectors/{q, mu}, info/{title, description, math_info}
    fclib_global/ spacedim, M/, H/, vectors/{f, w, mu}, info/…
    solution/     r, u[, v]   (optional)

A sparse group holds m, n, nz, nzmax, p, i, x.  nz >= 0: triplets, p the columns and i the rows;
nz = -1: compressed columns; -2: compressed rows.  Indices start at 0, duplicates are summed.

A file that is read and written again keeps numbers, storage, texts byte for byte with their
types, and the attributes of the groups info, W, M and H that are numbers or texts.  Dropped are
other attributes and further datasets.

Left out: bilateral constraints (G, b; V, R, s), which raise an error, and the groups `solution`
and `guesses` of a file, which are not read: in the published files they are all zero.
"""

from __future__ import annotations

import os
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from .errors import FileFormatError, InvalidInput, UnsupportedForm
from .files import replacing
from .nitsche_problem import NO_MULTIPLIERS, NitscheProblem
from .problem import Form, FrictionProblem
from .solution import FrictionSolution

Array = NDArray[np.float64]
Index = NDArray[np.int64]
GROUPS = {"fclib_local": Form.DELASSUS, "fclib_global": Form.GLOBAL}
BILATERAL = {Form.DELASSUS: ("V", "R", "vectors/s"), Form.GLOBAL: ("G", "vectors/b")}
TEXTS = ("title", "description", "math_info")
WITH_ATTRIBUTES = ("info", "W", "M", "H")
DEFLATE_LIMIT = 1032  # bytes that one stored byte can unpack to; more is a damaged header
PACKED = 2000  # entries above which an array is compressed
# all that h5py raises on damaged files; MemoryError: a shape that no machine holds
DAMAGE = (OSError, RuntimeError, KeyError, ValueError, TypeError, MemoryError, OverflowError)


@dataclass(frozen=True, eq=False)
class StoredMatrix:
    """A sparse group as it stands in the file, and the matrix made of it."""

    matrix: sparse.csc_array | sparse.csr_array
    nz: int
    nzmax: int
    p: NDArray
    i: NDArray
    x: NDArray


@dataclass(frozen=True)
class StoredText:
    """A text of fixed length as it stands in the file; type in HDF5's encoding."""

    type: bytes
    shape: tuple[int, ...]
    raw: bytes


@dataclass(frozen=True, eq=False)
class FclibProblem(FrictionProblem):
    """A problem read from a file, with what is needed to write that file again bit by bit."""

    texts: dict[str, bytes] = field(default_factory=dict, repr=False)
    stored: dict[str, StoredMatrix] = field(default_factory=dict, repr=False)
    stored_texts: dict[str, StoredText] = field(default_factory=dict, repr=False)
    attributes: dict[str, dict[str, Any]] = field(default_factory=dict, repr=False)


# ------------------------------------------------------------------------------- reading
def read_fclib(path: str | os.PathLike[str]) -> FclibProblem:
    """The problem in an FCLib file, local or global; its name is that of the file.

    Raises FileFormatError naming the file, the dataset, the value found and the one expected.
    """
    path = Path(path)
    _check_is_file(path)
    try:
        with h5py.File(path, "r") as file:
            return _read(_Source(path, file))
    except FileFormatError:
        raise
    except InvalidInput as reason:
        raise FileFormatError(f"{path}: {reason}") from reason
    except DAMAGE as reason:
        text = str(reason).strip().splitlines() or [type(reason).__name__]
        raise FileFormatError(
            f"{path}: expected a readable HDF5 file in FCLib's layout, got: {text[0]}; "
            "the file may be truncated or damaged"
        ) from reason


def _check_is_file(path: Path) -> None:
    try:
        if path.is_dir():
            raise FileFormatError(f"{path}: expected an FCLib HDF5 file, this is a folder")
        if not path.exists():
            raise FileFormatError(f"{path}: no such file")
        with path.open("rb") as file:
            empty = not file.read(1)
    except OSError as reason:
        raise FileFormatError(f"{path}: can not be read: {reason.strerror}") from None
    if empty:
        raise FileFormatError(f"{path}: expected an FCLib HDF5 file, this one is empty")
    if not h5py.is_hdf5(path):
        raise FileFormatError(
            f"{path}: expected an FCLib HDF5 file, this is not HDF5 (or it is truncated)"
        )


@dataclass(frozen=True)
class _Source:
    """An open file; every value that leaves it has been checked."""

    path: Path
    file: h5py.File

    def error(self, where: str, message: str) -> FileFormatError:
        return FileFormatError(f"{self.path}: /{where}: {message}")

    def group(self, where: str) -> h5py.Group:
        """An existing group."""
        node = self.file.get(where)
        if node is None:
            raise self.error(where, "missing group")
        if not isinstance(node, h5py.Group):
            raise self.error(where, "expected a group, got a dataset")
        return node

    def values(self, where: str, kinds: str, expected: str) -> NDArray:
        """A dataset whose numbers are of one of the NumPy kinds, flattened."""
        node = self.file.get(where)
        if node is None:
            raise self.error(where, f"missing dataset, expected {expected}")
        if not isinstance(node, h5py.Dataset):
            raise self.error(where, f"expected a dataset with {expected}, got a group")
        if node.shape is None or node.dtype.kind not in kinds:
            raise self.error(where, f"expected {expected}, got type {node.dtype}")
        if len(node.shape) > 1 and max(node.shape) != node.size:
            raise self.error(where, f"expected one dimension, got shape {node.shape}")
        if node.size * node.dtype.itemsize > DEFLATE_LIMIT * self.path.stat().st_size:
            raise self.error(where, f"declares {node.size} values, more than the file can hold")
        return np.asarray(node[()]).reshape(-1)

    def integer(self, where: str) -> int:
        """A dataset with exactly one integer."""
        values = self.values(where, "iu", "one integer")
        if values.size != 1:
            raise self.error(where, f"expected one integer, got {values.size} of them")
        return int(values[0])

    def indices(self, where: str) -> Index:
        """A dataset of indices or pointers."""
        return self.values(where, "iu", "integers").astype(np.int64)

    def reals(self, where: str, size: int | None = None, used: int | None = None) -> Array:
        """A dataset of finite numbers, `size` of them; only the first `used` are checked."""
        values = self.values(where, "fiu", "real numbers").astype(np.float64)
        if size is not None and values.size != size:
            raise self.error(where, f"expected {size} values, got {values.size}")
        bad = np.flatnonzero(~np.isfinite(values[:used]))
        if bad.size:
            k = bad[0]
            raise self.error(where, f"entry {k}: expected a finite number, got {values[k]}")
        return values


def _read(source: _Source) -> FclibProblem:
    root = _root(source)
    form = GROUPS[root]
    d = source.integer(f"{root}/spacedim")
    if d not in (2, 3):
        raise source.error(f"{root}/spacedim", f"expected 2 or 3, got {d}")
    _refuse_bilateral(source, root, form)
    source.group(f"{root}/vectors")
    mu = source.reals(f"{root}/vectors/mu")
    bad = np.flatnonzero(mu < 0)
    if bad.size:
        where = f"{root}/vectors/mu"
        raise source.error(where, f"entry {bad[0]}: expected friction >= 0, got {mu[bad[0]]}")
    read = _read_local if form is Form.DELASSUS else _read_global
    group = source.file[root]
    return replace(
        read(source, root, d, mu), texts=_texts(source, root),
        stored_texts=_stored_texts(group), attributes=_attributes(group),
    )  # fmt: skip


def _root(source: _Source) -> str:
    """The one problem group of the file."""
    found = [name for name in GROUPS if name in source.file]
    if len(found) == 2:
        raise FileFormatError(
            f"{source.path}: expected fclib_local or fclib_global, got both; "
            "split the file, it is not clear which problem is meant"
        )
    if not found:
        names = ", ".join(list(source.file)[:8]) or "nothing"
        raise FileFormatError(
            f"{source.path}: expected a group fclib_local or fclib_global, got {names}"
        )
    source.group(found[0])
    return found[0]


def _refuse_bilateral(source: _Source, root: str, form: Form) -> None:
    """Equality constraints change the problem: never drop them silently. Empty ones pass."""
    for name in BILATERAL[form]:
        where = f"{root}/{name}"
        node = source.file.get(where)
        if node is None:
            continue
        if isinstance(node, h5py.Group):
            empty = 0 in (source.integer(f"{where}/m"), source.integer(f"{where}/n"))
        else:
            empty = isinstance(node, h5py.Dataset) and not node.size
        if not empty:
            raise source.error(where, "bilateral constraints are not supported; "
                               "eliminate them, or add them to M as stiff springs")  # fmt: skip


def _contact_vector(source: _Source, where: str, d: int, mu: Array) -> Array:
    """A vector with d entries per contact, as rows (nc, d)."""
    values = source.reals(where)
    if values.size != d * mu.size:
        raise source.error(
            where, f"expected {d} values for each of the {mu.size} contacts in mu, "
            f"{d * mu.size} in all, got {values.size}"
        )  # fmt: skip
    return values.reshape(mu.size, d)


def _read_local(source: _Source, root: str, d: int, mu: Array) -> FclibProblem:
    q = _contact_vector(source, f"{root}/vectors/q", d, mu)
    W = _sparse(source, f"{root}/W", (q.size, q.size))
    problem = FclibProblem.from_delassus(W.matrix, q, mu, name=source.path.stem)
    assert isinstance(problem, FclibProblem)
    return replace(problem, stored={"W": replace(W, matrix=problem.W)})


def _read_global(source: _Source, root: str, d: int, mu: Array) -> FclibProblem:
    f = source.reals(f"{root}/vectors/f")
    w = _contact_vector(source, f"{root}/vectors/w", d, mu)
    M = _sparse(source, f"{root}/M", (f.size, f.size))
    H = _sparse(source, f"{root}/H", (f.size, w.size))
    problem = FclibProblem.from_global(M.matrix, H.matrix, f, w, mu, name=source.path.stem)
    assert isinstance(problem, FclibProblem)
    stored = {"M": replace(M, matrix=problem.M), "H": replace(H, matrix=problem.H)}
    return replace(problem, stored=stored)


def _texts(source: _Source, root: str) -> dict[str, bytes]:
    """Title and so on as bytes: some files hold text that is not UTF-8."""
    texts = {}
    for name in TEXTS:
        where = f"{root}/info/{name}"
        node = source.file.get(where)
        if node is None:
            continue
        if not isinstance(node, h5py.Dataset) or node.shape not in ((), (1,)):
            raise source.error(where, "expected one text")
        if node.dtype.kind not in "SO":
            raise source.error(where, f"expected a text, got type {node.dtype}")
        value = node[()] if node.shape == () else node[0]
        texts[name] = bytes(value) if isinstance(value, bytes) else str(value).encode()
    return texts


def _stored_texts(root: h5py.Group) -> dict[str, StoredText]:
    """The same texts with their types, checked before; not those of variable length."""
    found = {}
    for name in TEXTS:
        node = root.get(f"info/{name}")
        if node is not None and node.dtype.kind == "S":
            values = np.empty(node.shape, dtype=node.dtype)
            node.id.read(h5py.h5s.ALL, h5py.h5s.ALL, values, mtype=node.id.get_type())
            found[name] = StoredText(node.id.get_type().encode(), node.shape, values.tobytes())
    return found


def _attributes(root: h5py.Group) -> dict[str, dict[str, Any]]:
    """Attributes of the groups that we write, those that are numbers or texts."""
    found: dict[str, dict[str, Any]] = {}
    for where in WITH_ATTRIBUTES:
        group = root.get(where)
        if isinstance(group, h5py.Group):
            for key in group.attrs:
                if group.attrs.get_id(key).dtype.kind in "iufbSO":
                    value = group.attrs[key]
                    if isinstance(value, str | np.generic) or (
                        isinstance(value, np.ndarray) and value.dtype.kind != "O"
                    ):
                        found.setdefault(where, {})[key] = value
    return found


# ------------------------------------------------------------------------ sparse matrices
def _sparse(source: _Source, where: str, shape: tuple[int, int]) -> StoredMatrix:
    """A sparse group of the given shape, checked entry by entry."""
    source.group(where)
    found = source.integer(f"{where}/m"), source.integer(f"{where}/n")
    if found != shape:
        raise source.error(
            where, f"expected m, n = {shape[0]}, {shape[1]} as the vectors say, "
            f"got {found[0]}, {found[1]}"
        )  # fmt: skip
    nz, nzmax = source.integer(f"{where}/nz"), source.integer(f"{where}/nzmax")
    if nz < -2:
        raise source.error(
            f"{where}/nz", "expected a number of triplets >= 0, -1 for compressed columns or "
            f"-2 for compressed rows, got {nz}"
        )  # fmt: skip
    read = _triplets if nz >= 0 else _compressed
    return read(source, where, shape, nz, nzmax)


def _triplets(
    source: _Source, where: str, shape: tuple[int, int], nz: int, nzmax: int
) -> StoredMatrix:
    if nz > nzmax:
        raise source.error(f"{where}/nz", f"expected at most nzmax = {nzmax}, got {nz}")
    p, i = source.indices(f"{where}/p"), source.indices(f"{where}/i")
    x = source.reals(f"{where}/x", used=nz)
    for name, values in (("p", p), ("i", i), ("x", x)):
        if values.size < nz:
            raise source.error(
                f"{where}/{name}", f"expected nz = {nz} entries, got {values.size}"
            )
    _check_range(source, f"{where}/i", i[:nz], shape[0], "row")
    _check_range(source, f"{where}/p", p[:nz], shape[1], "column")
    matrix = sparse.coo_array((x[:nz], (i[:nz], p[:nz])), shape=shape).tocsc()
    return StoredMatrix(matrix, nz, nzmax, p, i, x)


def _compressed(
    source: _Source, where: str, shape: tuple[int, int], nz: int, nzmax: int
) -> StoredMatrix:
    by_rows = nz == -2
    lines, width = shape if by_rows else shape[::-1]
    p = source.indices(f"{where}/p")
    if p.size != lines + 1:
        kind = "rows" if by_rows else "columns"
        raise source.error(f"{where}/p", f"expected {lines + 1} starts of {kind}, got {p.size}")
    falls = np.flatnonzero(np.diff(p) < 0)
    if p[0] != 0 or falls.size:
        k = 0 if p[0] != 0 else falls[0] + 1
        raise source.error(
            f"{where}/p",
            f"entry {k}: expected starts that begin with 0 and never fall, got {p[k]}",
        )
    count = int(p[-1])
    if count > nzmax:
        raise source.error(
            f"{where}/p", f"expected at most nzmax = {nzmax} entries, got {count}"
        )
    i, x = source.indices(f"{where}/i"), source.reals(f"{where}/x", used=count)
    for name, values in (("i", i), ("x", x)):
        if values.size < count:
            raise source.error(
                f"{where}/{name}", f"expected {count} entries as p says, got {values.size}"
            )
    _check_range(source, f"{where}/i", i[:count], width, "column" if by_rows else "row")
    kind = sparse.csr_array if by_rows else sparse.csc_array
    return StoredMatrix(kind((x[:count], i[:count], p), shape=shape), nz, nzmax, p, i, x)


def _check_range(source: _Source, where: str, index: Index, size: int, kind: str) -> None:
    bad = np.flatnonzero((index < 0) | (index >= size))
    if bad.size:
        k = bad[0]
        raise source.error(
            where, f"entry {k}: expected a {kind} from 0 to {size - 1}, got {index[k]}"
        )


# ------------------------------------------------------------------------------- writing
def write_fclib(
    problem: FrictionProblem,
    path: str | os.PathLike[str],
    *,
    solution: FrictionSolution | None = None,
    title: str = "",
    description: str = "",
) -> None:
    """Write a problem, in the form it has, and optionally its solution; nothing on failure.

    A problem from `read_fclib` keeps storage and texts of its file; an empty title or
    description means the old text.  Raises UnsupportedForm for Tresca friction and for
    Nitsche's method, which FCLib does not know.
    """
    if isinstance(problem, NitscheProblem):
        raise UnsupportedForm(f"fclib: {NO_MULTIPLIERS}")
    mu, problem = problem.mu, problem.assembled()
    if solution is not None and solution.r.shape != (problem.contacts, problem.dimension):
        raise InvalidInput(
            f"solution: expected r of shape {(problem.contacts, problem.dimension)}, "
            f"got {solution.r.shape}"
        )
    with replacing(path) as temporary, h5py.File(temporary, "w") as file:
        root = file.create_group(next(k for k, form in GROUPS.items() if form is problem.form))
        root["spacedim"] = np.array([problem.dimension], dtype=np.int32)
        vectors = root.create_group("vectors")
        for name in ("f", "w", "q"):
            values = getattr(problem, name)
            if values is not None:
                _put(vectors, name, values.ravel())
        _put(vectors, "mu", mu)
        for name in ("M", "H", "W"):
            if getattr(problem, name) is not None:
                _put_matrix(root.create_group(name), _storage(problem, name))
                _put_attributes(root[name], problem)
        _put_texts(root.create_group("info"), problem, title, description)
        _put_attributes(root["info"], problem)
        if solution is not None:
            _put_solution(file.create_group("solution"), solution)


def write_arrays(path: Path, arrays: dict[str, NDArray], notes: dict[str, str | float]) -> None:
    """Add datasets, and attributes of the file, to an HDF5 file that may not exist yet."""
    with h5py.File(path, "a") as file:
        file.attrs.update(notes)
        for name, values in arrays.items():
            file[name] = values


def _put_solution(group: h5py.Group, solution: FrictionSolution) -> None:
    """FCLib's standard group: r, u and, for the global form, v."""
    _put(group, "r", solution.r.ravel())
    _put(group, "u", solution.u.ravel())
    if solution.v is not None:
        _put(group, "v", solution.v)


def _storage(problem: FrictionProblem, name: str) -> StoredMatrix:
    """The file's own storage while the matrix is still that of the file, else a fresh one."""
    matrix = getattr(problem, name)
    old = problem.stored.get(name) if isinstance(problem, FclibProblem) else None
    if old is not None and old.matrix is matrix:
        return old
    by_rows = name == "W"
    made = sparse.csr_array(matrix) if by_rows else sparse.csc_array(matrix)
    return StoredMatrix(
        made, -2 if by_rows else -1, made.nnz, made.indptr, made.indices, made.data
    )


def _put_matrix(group: h5py.Group, stored: StoredMatrix) -> None:
    m, n = stored.matrix.shape
    if max(m, n, stored.nzmax) > np.iinfo(np.int32).max:
        raise InvalidInput(
            f"{group.name}: {stored.nzmax} entries do not fit FCLib's 32-bit indices"
        )
    for name, value in (("m", m), ("n", n), ("nz", stored.nz), ("nzmax", stored.nzmax)):
        group[name] = np.array([value], dtype=np.int32)
    _put(group, "p", stored.p.astype(np.int32))
    _put(group, "i", stored.i.astype(np.int32))
    _put(group, "x", stored.x)


def _put(group: h5py.Group, name: str, values: NDArray) -> None:
    pack = {"compression": "gzip", "shuffle": True} if values.size > PACKED else {}
    group.create_dataset(name, data=values, **pack)


def _put_attributes(group: h5py.Group, problem: FrictionProblem) -> None:
    """The attributes that a group of this name had in the file."""
    if isinstance(problem, FclibProblem):
        group.attrs.update(problem.attributes.get(group.name.rpartition("/")[2], {}))


def _put_texts(group: h5py.Group, problem: FrictionProblem, title: str, about: str) -> None:
    """Old texts as they were; new ones one byte longer, so that readers in C find the end."""
    texts = {"title": problem.name.encode(), "description": b"", "math_info": b"unknown"}
    old = problem.texts if isinstance(problem, FclibProblem) else {}
    texts |= old
    for name, given in (("title", title), ("description", about)):
        if given:
            texts[name] = given.encode("utf-8", "surrogateescape")
    for name, text in texts.items():
        stored = problem.stored_texts.get(name) if isinstance(problem, FclibProblem) else None
        if stored is not None and text == old.get(name):
            _put_stored_text(group, name, stored)
        else:
            group.create_dataset(name, data=np.array(text, dtype=f"S{len(text) + 1}"))


def _put_stored_text(group: h5py.Group, name: str, text: StoredText) -> None:
    """Type with length and padding, shape and bytes as they were."""
    kind = h5py.h5t.decode(text.type)
    dataset = h5py.h5d.create(group.id, name.encode(), kind, _space(text.shape))
    values = np.frombuffer(text.raw, dtype=f"S{kind.get_size()}").reshape(text.shape).copy()
    dataset.write(h5py.h5s.ALL, h5py.h5s.ALL, values, mtype=kind)


def _space(shape: tuple[int, ...]) -> h5py.h5s.SpaceID:
    return h5py.h5s.create_simple(shape) if shape else h5py.h5s.create(h5py.h5s.SCALAR)
