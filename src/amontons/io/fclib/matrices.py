"""Sparse groups of a file: triplets, compressed columns or rows, checked entry by entry."""

from __future__ import annotations

import numpy as np
from scipy import sparse

from .source import Index, Source
from .stored import StoredMatrix


def read_matrix(source: Source, where: str, shape: tuple[int, int]) -> StoredMatrix:
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
    source: Source, where: str, shape: tuple[int, int], nz: int, nzmax: int
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
    source: Source, where: str, shape: tuple[int, int], nz: int, nzmax: int
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


def _check_range(source: Source, where: str, index: Index, size: int, kind: str) -> None:
    bad = np.flatnonzero((index < 0) | (index >= size))
    if bad.size:
        k = bad[0]
        raise source.error(
            where, f"entry {k}: expected a {kind} from 0 to {size - 1}, got {index[k]}"
        )
