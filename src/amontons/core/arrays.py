"""Arrays from outside: checked, copied and locked; every complaint names argument and value.

Only arrays of numbers pass: NumPy would also make numbers of texts, dates and truth values, and
drop the mask of a masked array.  Sparse matrices are checked entry by entry before compiled
code sees them, which takes their indices on trust.
"""

from __future__ import annotations

import math
from numbers import Number
from typing import Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import sparse

from .canonical import largest as largest_entry
from .canonical import size_of_canonical
from .errors import InvalidInput, number_hint, shown

Array = NDArray[np.float64]
AnyArray = TypeVar("AnyArray", bound=NDArray[Any])
Matrix = sparse.csr_array | sparse.csc_array | Array
LARGEST = 1e100  # entry in any unit: squares must stay finite, and 1 / LARGEST positive
INDEX_TYPES = (np.dtype(np.int32), np.dtype(np.int64))
WHOLE = 2.0**53  # up to which floats hold every whole number
WORDS = {"b": "truth values", "U": "texts", "S": "bytes", "M": "dates", "m": "lengths of time"}


def expect_shape(name: str, found: tuple[int, ...] | None, expected: tuple[int, ...]) -> None:
    """Raises InvalidInput where the two differ."""
    if found != expected:
        raise InvalidInput(f"{name}: expected shape {expected}, got {found}")


def real(name: str, values: object) -> Array:
    """A float copy; rejects all that are not real numbers, and ragged lists."""
    if type(values) is np.ndarray and values.dtype == np.float64:
        return np.array(values, order="C")
    if sparse.issparse(values):
        raise InvalidInput(f"{name}: expected a dense array, got a sparse one")
    try:
        raw = np.asarray(values) if not np.ma.isMaskedArray(values) else _unmasked(name, values)
        _check_kind(name, raw)
        with np.errstate(over="ignore"):  # of longer floats; infinity is refused later
            return np.array(raw, dtype=float, order="C")
    except (TypeError, ValueError, OverflowError) as error:
        if isinstance(error, InvalidInput):
            raise
        raise InvalidInput(f"{name}: expected an array of numbers ({error})") from error


def _unmasked(name: str, values: Any) -> NDArray:
    """The data of a masked array without masked entries."""
    masked = int(np.ma.count_masked(values))
    if masked:
        raise InvalidInput(
            f"{name}: expected numbers, got a masked array with {masked} masked entries"
        )
    return np.ma.getdata(values)


def _check_kind(name: str, raw: NDArray) -> None:
    """Raise InvalidInput for what is no array of real numbers, though NumPy converts it."""
    kind = raw.dtype.kind
    if kind == "c":
        raise InvalidInput(f"{name}: expected real numbers, got complex ones")
    if kind == "O":
        for entry in raw.flat:
            if not isinstance(entry, Number) or isinstance(entry, bool | np.bool_):
                raise InvalidInput(f"{name}: expected numbers, got {shown(entry)}")
    elif kind not in "fiu":
        word = WORDS.get(kind, f"type {raw.dtype}")
        raise InvalidInput(f"{name}: expected numbers, got {word}")


def number(name: str, value: object, *, least: float = -LARGEST) -> float:
    """One number from `least` on, whose square is a number too."""
    try:
        found = real(name, value)
    except InvalidInput:
        raise InvalidInput(
            f"{name}: expected a number, got {shown(value)}{number_hint(value)}"
        ) from None
    if found.ndim:
        raise InvalidInput(f"{name}: expected a number, got {shown(value)}")
    if np.isfinite(found) and abs(found) > LARGEST:
        raise InvalidInput(
            f"{name}: expected a number up to {LARGEST:g} in size, whose square is a number "
            f"too, got {shown(value)}; take larger units"
        )
    if not least <= found <= LARGEST:
        bound = f" from {least:g} to {LARGEST:g}" if least > -LARGEST else ""
        raise InvalidInput(f"{name}: expected a finite number{bound}, got {shown(value)}")
    return float(found)


def whole(name: str, value: object, *, least: int) -> int:
    """One whole number from `least` on; truth values and floats are none."""
    if not isinstance(value, int | np.integer) or isinstance(value, bool) or value < least:
        raise InvalidInput(f"{name}: expected a whole number >= {least}, got {shown(value)}")
    return int(value)


def finite(name: str, values: object, dimensions: int) -> Array:
    """A read-only copy with so many dimensions, of finite numbers of any size."""
    array = real(name, values)
    if array.ndim != dimensions:
        raise InvalidInput(f"{name}: expected {dimensions} dimensions, got {array.shape}")
    return _finite(name, array)


def integers(name: str, values: object) -> NDArray[np.int64]:
    """A copy in whole numbers; floats without a fraction pass, a table of a file has them."""
    if isinstance(values, np.ndarray) and values.dtype.kind == "i":
        return np.array(values if not np.ma.isMaskedArray(values) else _unmasked(name, values),
                        dtype=np.int64)  # fmt: skip
    array = real(name, values)
    if not (array == np.floor(array)).all() or np.abs(array).max(initial=0.0) > WHOLE:
        raise InvalidInput(f"{name}: expected whole numbers, got {shown(values)}")
    return array.astype(np.int64)


def columns(name: str, values: object, rows: int) -> Array:
    """Finite numbers (rows, k); no copy of a float array, which may be as large as a matrix."""
    array = values if isinstance(values, np.ndarray) and values.dtype == float else None
    array = real(name, values) if array is None or np.ma.isMaskedArray(array) else array
    if array.ndim != 2:
        raise InvalidInput(f"{name}: expected {rows} rows of numbers, got {array.shape}")
    if len(array) != rows:
        raise InvalidInput(f"{name}: expected {rows} rows, got {len(array)}")
    if not np.isfinite(array).all():
        raise InvalidInput(f"{name}: expected finite numbers, got others")
    return array


def numbers(name: str, values: ArrayLike, shape: tuple[int, ...]) -> Array:
    """A read-only copy of that shape, of finite numbers whose squares are numbers."""
    array = real(name, values)
    expect_shape(name, array.shape, shape)
    return squarable(name, array)


def contact_rows(name: str, values: ArrayLike, nc: int) -> Array:
    """The same for contact rows (nc, 2 or 3), also from FCLib's flat vector."""
    array = real(name, values)
    if array.ndim == 1 and nc and array.size in (2 * nc, 3 * nc):
        array = array.reshape(nc, -1)
    if array.ndim != 2 or array.shape[0] != nc or array.shape[1] not in (2, 3):
        raise InvalidInput(
            f"{name}: expected shape ({nc}, 2) or ({nc}, 3), as friction is given for {nc} "
            f"contacts, got {array.shape}"
        )
    return squarable(name, array)


def sparse_matrix(name: str, matrix: Matrix) -> sparse.csc_array:
    """A canonical read-only copy: columns sorted, duplicates summed, every entry finite."""
    return _canonical(name, matrix, sparse.csc_array)


def sparse_rows(name: str, matrix: Matrix) -> sparse.csr_array:
    """The same by rows."""
    return _canonical(name, matrix, sparse.csr_array)


def _canonical(name: str, matrix: Any, kind: Any) -> Any:
    if type(matrix) is kind and (found := _copied(matrix)) is not None:
        return found
    if sparse.issparse(matrix):
        matrix = compressed(name, matrix)
    else:
        matrix = real(name, matrix)
        if matrix.ndim != 2:
            raise InvalidInput(f"{name}: expected a matrix, got shape {matrix.shape}")
    out = kind(matrix, dtype=float, copy=True)
    out.sum_duplicates()
    size = float(np.abs(out.data).max(initial=0.0))
    if not np.isfinite(size):
        k = int(np.flatnonzero(~np.isfinite(out.data))[0])
        line = int(np.searchsorted(out.indptr, k, side="right")) - 1
        row, column = (line, out.indices[k]) if out.format == "csr" else (out.indices[k], line)
        raise InvalidInput(
            f"{name}[{row}, {column}]: expected a finite number, got {out.data[k]}"
        )
    _squarable(name, size)
    return locked(out)


def _copied(matrix: Any) -> Any:
    """A read-only copy of what is canonical already; None of what has to be looked at."""
    arrays = matrix.indptr, matrix.indices, matrix.data
    if any(type(array) is not np.ndarray or array.ndim != 1 for array in arrays):
        return None
    kinds = [array.dtype for array in arrays]
    if kinds[0] not in INDEX_TYPES or kinds[1] != kinds[0] or kinds[2] != np.float64:
        return None
    lines, width = matrix.shape if matrix.format == "csr" else matrix.shape[::-1]
    size = size_of_canonical(*arrays, lines, width)
    if not (1 / LARGEST <= size <= LARGEST):
        return None
    out = object.__new__(type(matrix))  # as copy() does, without its way there
    vars(out).update(vars(matrix))
    out.indptr, out.indices, out.data = (read_only(array.copy()) for array in arrays)
    return out


def compressed(name: str, matrix: Any) -> Any:
    """A sparse matrix of any format by rows or columns, every index and entry checked.

    matrix: a sparse array or matrix of scipy.  The matrix itself where it is stored so:
    nothing is copied, nothing changed.
    """
    if len(matrix.shape) != 2:
        raise InvalidInput(f"{name}: expected a matrix, got shape {matrix.shape}")
    if matrix.format == "lil":
        _check_rows_of_lists(name, matrix)
    try:
        if matrix.format not in ("csr", "csc", "bsr"):  # coo checks its indices by itself
            coo = matrix.tocoo()
            _check_values(name, coo.data)
            _check_triplets(name, coo)
            matrix = coo.tocsr()
        _check_compressed(name, matrix)
        return matrix.tocsr() if matrix.format == "bsr" else matrix
    except (MemoryError, ValueError, TypeError, IndexError) as error:
        if isinstance(error, InvalidInput):
            raise
        raise InvalidInput(f"{name}: not a valid sparse matrix: {error}") from error


def _check_rows_of_lists(name: str, matrix: Any) -> None:
    """Raise InvalidInput where a row of a lil matrix has not one column per value."""
    if matrix.rows.shape != matrix.data.shape or len(matrix.rows) != matrix.shape[0]:
        raise InvalidInput(f"{name}: not a valid sparse matrix: lists of other rows")
    for row, (where, values) in enumerate(zip(matrix.rows, matrix.data, strict=True)):
        if len(where) != len(values):
            raise InvalidInput(
                f"{name}[{row}]: expected as many columns as values, got {len(where)} and "
                f"{len(values)}"
            )


def _check_triplets(name: str, matrix: Any) -> None:
    """Raise InvalidInput for a row or column that the matrix has not."""
    for index, size, word in zip(matrix.coords, matrix.shape, ("row", "column"), strict=True):
        if index.shape != matrix.data.shape:
            raise InvalidInput(f"{name}: expected one {word} per value, got {index.shape}")
        _check_indices(name, index, size, word)


def _check_compressed(name: str, matrix: Any) -> None:
    """Raise InvalidInput for rows, columns or blocks whose indices lead out of the arrays."""
    by_rows = matrix.format != "csc"
    _check_values(name, matrix.data)
    lines, width = matrix.shape if by_rows else matrix.shape[::-1]
    word = "column" if by_rows else "row"
    if matrix.format == "bsr":
        tall, wide = matrix.data.shape[1:] if matrix.data.ndim == 3 else (0, 0)
        if not (tall and wide) or lines % tall or width % wide:
            raise InvalidInput(f"{name}: not a valid sparse matrix: blocks that do not fit")
        lines, width, word = lines // tall, width // wide, "column of blocks"
    pointers, indices = matrix.indptr, matrix.indices
    _check_indices(f"{name}: indptr", pointers, np.iinfo(np.int64).max, "start")
    if pointers.shape != (lines + 1,):
        raise InvalidInput(
            f"{name}: indptr: expected {lines + 1} starts, got shape {pointers.shape}"
        )
    falls = np.flatnonzero(np.diff(pointers) < 0)
    if pointers[0] != 0 or falls.size:
        k = 0 if pointers[0] != 0 else int(falls[0]) + 1
        raise InvalidInput(
            f"{name}: indptr[{k}]: expected starts that begin with 0 and never fall, "
            f"got {pointers[k]}"
        )
    used = int(pointers[-1])
    if min(len(indices), len(matrix.data)) < used:
        raise InvalidInput(
            f"{name}: expected {used} indices and values as indptr says, got {len(indices)} "
            f"and {len(matrix.data)}"
        )
    _check_indices(f"{name}: indices", indices[:used], width, word)


def _check_values(name: str, values: object) -> None:
    if not isinstance(values, np.ndarray):
        raise InvalidInput(f"{name}: expected an array of values, got {shown(values)}")
    _check_kind(name, values)


def _check_indices(name: str, index: object, size: int, word: str) -> None:
    if not isinstance(index, np.ndarray) or index.ndim != 1 or index.dtype.kind not in "iu":
        raise InvalidInput(f"{name}: expected a list of whole numbers, got {shown(index)}")
    if len(index) and (index.min() < 0 or index.max() >= size):
        bad = np.flatnonzero((index < 0) | (index >= size))[0]
        raise InvalidInput(
            f"{name}[{bad}]: expected a {word} from 0 to {size - 1}, got {index[bad]}"
        )


def read_only(array: AnyArray) -> AnyArray:
    """The same array, which nobody can write to."""
    array.flags.writeable = False
    return array


def locked(matrix):
    """The same sparse matrix with read-only arrays, so that sharing it is safe."""
    for array in (matrix.data, matrix.indices, matrix.indptr):
        read_only(array)
    return matrix


def squarable(name: str, array: Array, largest: float = LARGEST) -> Array:
    """The same array, locked, of finite numbers whose squares are numbers, or as `largest`."""
    size = largest_entry(array.reshape(-1))
    if not size < math.inf:
        _finite(name, array)
    _squarable(name, size, largest)
    return read_only(array)


def _finite(name: str, array: Array) -> Array:
    bad = np.argwhere(~np.isfinite(array))
    if len(bad):
        where = ", ".join(str(k) for k in bad[0])
        raise InvalidInput(
            f"{name}[{where}]: expected a finite number, got {array[tuple(bad[0])]}"
        )
    array.flags.writeable = False
    return array


def _squarable(name: str, size: float, largest: float = LARGEST) -> None:
    """Refuse a largest entry so large or small that its square is no number any more."""
    if size > largest or 0 < size < 1 / largest:
        raise InvalidInput(
            f"{name}: its largest entry is {size:.1e}, which can not be squared; use units in "
            f"which it lies between {1 / largest:g} and {largest:g}"
        )
