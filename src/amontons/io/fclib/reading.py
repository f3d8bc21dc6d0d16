"""An FCLib file as a problem: one group, its vectors, its matrices, its texts."""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from ...core.errors import FileFormatError, InvalidInput
from ...core.hdf5 import TEXT, check_contained
from ...problem.equalities import GlobalEqualities, LocalEqualities
from ...problem.friction import Form
from .matrices import read_matrix
from .source import DAMAGE, Array, Source, check_is_file
from .stored import (
    GROUPS,
    TEXTS,
    WITH_ATTRIBUTES,
    FclibProblem,
    StoredMatrix,
    StoredText,
)

EQUALITIES = {Form.DELASSUS: (("V", "R"), "s"), Form.GLOBAL: (("G",), "b")}


def read_fclib(path: str | os.PathLike[str]) -> FclibProblem:
    """The problem in an FCLib file, local or global; its name is that of the file.

    Raises FileFormatError naming the file, the dataset, the value found and the one expected.
    """
    path = Path(path)
    check_is_file(path)
    try:
        with h5py.File(path, "r") as file:
            check_contained(path, file)
            return _read(Source(path, file))
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


def _read(source: Source) -> FclibProblem:
    root = _root(source)
    form = GROUPS[root]
    d = source.integer(f"{root}/spacedim")
    if d not in (2, 3):
        raise source.error(f"{root}/spacedim", f"expected 2 or 3, got {d}")
    source.group(f"{root}/vectors")
    mu = source.reals(f"{root}/vectors/mu")
    bad = np.flatnonzero(mu < 0)
    if bad.size:
        where = f"{root}/vectors/mu"
        raise source.error(where, f"entry {bad[0]}: expected friction >= 0, got {mu[bad[0]]}")
    read = _read_local if form is Form.DELASSUS else _read_global
    group = source.group(root)
    return replace(
        read(source, root, d, mu), texts=_texts(source, root),
        stored_texts=_stored_texts(group), attributes=_attributes(group),
    )  # fmt: skip


def _root(source: Source) -> str:
    """The one problem group of the file."""
    found = [name for name in GROUPS if name in source.file]
    if len(found) == 2:
        raise FileFormatError(
            f"{source.path}: expected fclib_local or fclib_global, got both; "
            "split the file, it is not clear which problem is meant"
        )
    if not found and "schema" in source.file.attrs:  # written by us
        raise FileFormatError(
            f"{source.path}: the results of a model hold no problem to read; give the case file"
        )
    if not found:
        names = ", ".join(list(source.file)[:8]) or "nothing"
        raise FileFormatError(
            f"{source.path}: expected a group fclib_local or fclib_global, got {names}"
        )
    source.group(found[0])
    return found[0]


def _constrained(
    source: Source, root: str, problem: FclibProblem, stored: dict[str, StoredMatrix]
) -> FclibProblem:
    """The problem with the equality constraints of its file, if there are any."""
    names, vector = EQUALITIES[problem.form]
    if not _has_equalities(source, root, names, vector):
        return replace(problem, stored=stored)
    count = source.integer(f"{root}/{names[-1]}/n")
    rows = {"G": problem.unknowns, "V": problem.unknowns, "R": count}
    read = {name: read_matrix(source, f"{root}/{name}", (rows[name], count)) for name in names}
    right = source.reals(f"{root}/vectors/{vector}", count)
    make = GlobalEqualities if problem.form is Form.GLOBAL else LocalEqualities
    try:
        found = make.of(problem, *(read[name].matrix for name in names), right)
    except InvalidInput as reason:
        at = str(reason.at[0]) if reason.at else names[-1]
        place = f"vectors/{at}" if at == vector else at
        raise source.error(f"{root}/{place}", reason.text) from None
    stored |= {name: replace(read[name], matrix=getattr(found, name)) for name in names}
    return replace(FclibProblem.of_equalities(found), stored=stored)


def _has_equalities(source: Source, root: str, names: tuple[str, ...], vector: str) -> bool:
    """Whether the file has constraints; empty ones are none.

    Some without others are refused: nothing that is in a file is dropped silently.
    """
    there = [name for name in names if f"{root}/{name}" in source.file]
    if not there:
        where = f"{root}/vectors/{vector}"
        node = source.file.get(where)
        if isinstance(node, h5py.Dataset) and node.size:
            raise source.error(where, f"expected a group {' and a group '.join(names)} beside "
                               "it, which this is the right-hand side of")  # fmt: skip
        return False
    for name in names:
        source.group(f"{root}/{name}")
    sizes = [source.integer(f"{root}/{name}/{key}") for name in names for key in ("m", "n")]
    return 0 not in sizes


def _contact_vector(source: Source, where: str, d: int, mu: Array) -> Array:
    """A vector with d entries per contact, as rows (nc, d)."""
    values = source.reals(where)
    if values.size != d * mu.size:
        raise source.error(
            where, f"expected {d} values for each of the {mu.size} contacts in mu, "
            f"{d * mu.size} in all, got {values.size}"
        )  # fmt: skip
    return values.reshape(mu.size, d)


def _read_local(source: Source, root: str, d: int, mu: Array) -> FclibProblem:
    q = _contact_vector(source, f"{root}/vectors/q", d, mu)
    W = read_matrix(source, f"{root}/W", (q.size, q.size))
    problem = FclibProblem.from_delassus(W.matrix, q, mu, name=source.path.stem)
    assert isinstance(problem, FclibProblem)
    return _constrained(source, root, problem, {"W": replace(W, matrix=problem.W)})


def _read_global(source: Source, root: str, d: int, mu: Array) -> FclibProblem:
    f = source.reals(f"{root}/vectors/f")
    w = _contact_vector(source, f"{root}/vectors/w", d, mu)
    M = read_matrix(source, f"{root}/M", (f.size, f.size))
    H = read_matrix(source, f"{root}/H", (f.size, w.size))
    problem = FclibProblem.from_global(M.matrix, H.matrix, f, w, mu, name=source.path.stem)
    assert isinstance(problem, FclibProblem)
    stored = {"M": replace(M, matrix=problem.M), "H": replace(H, matrix=problem.H)}
    return _constrained(source, root, problem, stored)


def _texts(source: Source, root: str) -> dict[str, bytes]:
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
        if len(texts[name]) > TEXT:  # of variable length: no longer than the file
            raise source.error(where, f"expected texts of at most {TEXT} bytes")
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
                stored = group.attrs.get_id(key)
                kind = stored.dtype.kind
                if kind in "iufbS" or (kind == "O" and stored.shape == ()):  # O: one text
                    value = group.attrs[key]
                    if isinstance(value, str | np.generic) or (
                        isinstance(value, np.ndarray) and value.dtype.kind != "O"
                    ):
                        found.setdefault(where, {})[key] = value
    return found
