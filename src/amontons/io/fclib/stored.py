"""Names in the files, and what a file holds beyond its problem, to write it again exactly."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from numpy.typing import NDArray
from scipy import sparse

from ...problem.friction import Form, FrictionProblem

GROUPS = {"fclib_local": Form.DELASSUS, "fclib_global": Form.GLOBAL}
TEXTS = ("title", "description", "math_info")
WITH_ATTRIBUTES = ("info", "W", "M", "H")


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
