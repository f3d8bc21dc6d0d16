"""A problem, and its solution, as an FCLib file; one that was read keeps storage and texts."""

from __future__ import annotations

import os
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ...core.errors import InvalidInput, UnsupportedForm, UnsupportedLaw
from ...problem.friction import FrictionProblem
from ...problem.law import Coulomb
from ...problem.solution import FrictionSolution
from .memory import write_hdf5
from .stored import GROUPS, FclibProblem, StoredMatrix, StoredText

PACKED = 2000  # entries above which an array is compressed
VECTORS = ("f", "w", "q", "b", "s")
MATRICES = ("M", "H", "W", "G", "V", "R")


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
    description means the old text.  Raises UnsupportedLaw for laws other than
    Coulomb's and UnsupportedForm for Nitsche's method, which FCLib does not know.
    """
    def fill(file: h5py.File) -> None:
        put_fclib(file, problem, solution=solution, title=title, description=description)

    write_hdf5(path, fill)


def put_fclib(
    file: h5py.File, problem: FrictionProblem, *, solution: FrictionSolution | None = None,
    title: str = "", description: str = "",
) -> None:  # fmt: skip
    """Put a problem into an empty file; raises like `write_fclib`."""
    if not isinstance(problem, FrictionProblem):
        raise UnsupportedForm(f"fclib: {problem.unfit}")
    if not isinstance(problem.law, Coulomb):
        raise UnsupportedLaw(
            f"fclib: stores a coefficient of Coulomb friction per contact, not "
            f"{problem.law.name}"
        )
    mu, problem = problem.mu, problem.assembled()
    if solution is not None and solution.r.shape != (problem.contacts, problem.dimension):
        raise InvalidInput(
            f"solution: expected r of shape {(problem.contacts, problem.dimension)}, "
            f"got {solution.r.shape}"
        )
    root = file.create_group(next(k for k, form in GROUPS.items() if form is problem.form))
    root["spacedim"] = np.array([problem.dimension], dtype=np.int32)
    vectors = root.create_group("vectors")
    held = _contents(problem)
    for name in VECTORS:
        values = held.get(name)
        if values is not None:
            _put(vectors, name, values.ravel())
    _put(vectors, "mu", mu)
    for name in MATRICES:
        if held.get(name) is not None:
            group = root.create_group(name)
            _put_matrix(group, _storage(problem, name, held[name]))
            _put_attributes(group, problem)
    info = root.create_group("info")
    _put_texts(info, problem, title, description)
    _put_attributes(info, problem)
    if solution is not None:
        _put_solution(file.create_group("solution"), problem, solution)


def put_arrays(
    file: h5py.File, arrays: dict[str, NDArray], notes: dict[str, str | float]
) -> None:
    """Add datasets to a file, and attributes of the file."""
    file.attrs.update(notes)
    for name, values in arrays.items():
        file[name] = values


def _put_solution(
    group: h5py.Group, problem: FrictionProblem, solution: FrictionSolution
) -> None:
    """FCLib's standard group: r, u, for the global form v, of equality constraints l."""
    _put(group, "r", solution.r.ravel())
    _put(group, "u", solution.u.ravel())
    if solution.v is not None:
        _put(group, "v", solution.v)
    if isinstance(problem, FclibProblem) and problem.holds_equalities:
        _put(group, "l", problem.multipliers(solution))


def _contents(problem: FrictionProblem) -> dict[str, Any]:
    """Vectors and matrices by name, with equality constraints as their file has them."""
    if isinstance(problem, FclibProblem):
        return problem.in_file
    return {name: getattr(problem, name) for name in ("f", "w", "q", "M", "H", "W")}


def _storage(problem: FrictionProblem, name: str, matrix: Any) -> StoredMatrix:
    """The file's own storage while the matrix is still that of the file, else a fresh one."""
    old = problem.stored.get(name) if isinstance(problem, FclibProblem) else None
    if old is not None and old.matrix is matrix:
        return old
    by_rows = name == "W"
    made = sparse.csr_array(matrix) if by_rows else sparse.csc_array(matrix)
    return StoredMatrix(
        made, -2 if by_rows else -1, made.nnz, made.indptr, made.indices, made.data
    )


def _put_matrix(group: h5py.Group, stored: StoredMatrix) -> None:
    m, n = stored.matrix.shape  # type: ignore[misc]
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
