"""HDF5 files made in memory: the library can crash when it writes to a full disk."""

from __future__ import annotations

import os
import secrets
from collections.abc import Callable

import h5py

from ...core.files import put, replacing


def write_hdf5(path: str | os.PathLike[str], fill: Callable[[h5py.File], None]) -> None:
    """Write the HDF5 file that `fill` fills, complete or not at all."""
    with replacing(path) as temporary:
        put(temporary, hdf5_bytes(fill))


def hdf5_bytes(fill: Callable[[h5py.File], None]) -> bytes:
    """The bytes of the HDF5 file that `fill` fills."""
    name = secrets.token_hex(8)  # of no file, but no two that are open may share it
    with h5py.File(name, "w", driver="core", backing_store=False) as file:
        fill(file)
        file.flush()
        return file.id.get_file_image()
