"""An open file whose numbers are checked as they leave it; complaints name file and place."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import h5py
import numpy as np
from numpy.typing import NDArray

from ...core.errors import FileFormatError
from ...core.files import check_is_regular
from ...core.words import near_file

Array = NDArray[np.float64]
Index = NDArray[np.int64]
# all that h5py raises on damaged files; MemoryError: a shape that no machine holds
DAMAGE = (OSError, RuntimeError, KeyError, ValueError, TypeError, MemoryError, OverflowError)


def check_is_file(path: Path) -> None:
    """Raises FileFormatError for what is no HDF5 file, or can not be read."""
    check_is_regular(path)
    try:
        if path.is_dir():
            raise FileFormatError(f"{path}: expected an FCLib HDF5 file, this is a folder")
        if not path.exists():
            raise FileFormatError(f"{path}: no such file{near_file(Path(path))}")
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
class Source:
    """An open file; every value that leaves it has been checked."""

    path: Path
    file: h5py.File

    def error(self, where: str, message: str) -> FileFormatError:
        """A complaint about one place in the file."""
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
