"""Arrays from outside: checked, copied and locked; every complaint names argument and value."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import sparse

from .errors import InvalidInput

Array = NDArray[np.float64]
Matrix = sparse.csr_array | sparse.csc_array | Array
LARGEST = 1e100  # entry in any unit: squares must stay finite, and 1 / LARGEST positive


def expect_shape(name: str, found: tuple[int, ...], expected: tuple[int, ...]) -> None:
    """Raises InvalidInput where the two differ."""
    if found != expected:
        raise InvalidInput(f"{name}: expected shape {expected}, got {found}")


def real(name: str, values: object) -> Array:
    """A float copy; rejects texts, ragged lists and complex numbers."""
    try:
        raw = np.asarray(values)
        if np.iscomplexobj(raw):
            raise InvalidInput(f"{name}: expected real numbers, got complex ones")
        return np.array(raw, dtype=float, order="C")
    except (TypeError, ValueError) as error:
        if isinstance(error, InvalidInput):
            raise
        raise InvalidInput(f"{name}: expected an array of numbers ({error})") from error


def numbers(name: str, values: ArrayLike, shape: tuple[int, ...]) -> Array:
    """A read-only copy of that shape, of finite numbers whose squares are numbers."""
    array = real(name, values)
    expect_shape(name, array.shape, shape)
    return _numbers(name, array)


def contact_rows(name: str, values: ArrayLike, nc: int) -> Array:
    """The same for contact rows (nc, 2 or 3), also from FCLib's flat vector."""
    array = real(name, values)
    if array.ndim == 1 and nc and array.size in (2 * nc, 3 * nc):
        array = array.reshape(nc, -1)
    if array.ndim != 2 or array.shape[0] != nc or array.shape[1] not in (2, 3):
        raise InvalidInput(f"{name}: expected shape ({nc}, 2) or ({nc}, 3), got {array.shape}")
    return _numbers(name, array)


def sparse_matrix(name: str, matrix: Matrix) -> sparse.csc_array:
    """A canonical read-only copy: columns sorted, duplicates summed, every entry finite."""
    if not sparse.issparse(matrix):
        matrix = real(name, matrix)
    elif np.iscomplexobj(matrix.data):
        raise InvalidInput(f"{name}: expected real numbers, got complex ones")
    out = sparse.csc_array(matrix, dtype=float, copy=True)
    out.sum_duplicates()
    bad = np.flatnonzero(~np.isfinite(out.data))
    if bad.size:
        row = out.indices[bad[0]]
        column = int(np.searchsorted(out.indptr, bad[0], side="right")) - 1
        raise InvalidInput(
            f"{name}[{row}, {column}]: expected a finite number, got {out.data[bad[0]]}"
        )
    _squarable(name, out.data)
    return locked(out)


def locked(matrix):
    """The same sparse matrix with read-only arrays, so that sharing it is safe."""
    for array in (matrix.data, matrix.indices, matrix.indptr):
        array.flags.writeable = False
    return matrix


def _numbers(name: str, array: Array) -> Array:
    bad = np.argwhere(~np.isfinite(array))
    if len(bad):
        where = ", ".join(str(k) for k in bad[0])
        raise InvalidInput(
            f"{name}[{where}]: expected a finite number, got {array[tuple(bad[0])]}"
        )
    _squarable(name, array)
    array.flags.writeable = False
    return array


def _squarable(name: str, values: Array) -> None:
    """Refuse what is so large or small in all entries that its square is no number any more."""
    size = float(np.abs(values).max(initial=0.0))
    if size > LARGEST or 0 < size < 1 / LARGEST:
        raise InvalidInput(
            f"{name}: its largest entry is {size:.1e}, which can not be squared; use units in "
            f"which it lies between {1 / LARGEST:g} and {LARGEST:g}"
        )
