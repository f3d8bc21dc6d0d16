"""Writing files so that a reader never meets half of one."""

from __future__ import annotations

import os
import secrets
import shutil
import stat
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from .errors import FileFormatError, InvalidInput

STREAMS = ("/dev/", "/proc/")  # /dev/stdout may lead to a plain file that is open elsewhere
DESCRIPTORS = {"/dev/stdout": 1, "/dev/stderr": 2}  # these keep their place in such a file


@contextmanager
def replacing(path: str | os.PathLike[str]) -> Iterator[Path]:
    """A temporary path beside `path`, renamed onto it when the block ends without an error.

    The suffix is kept, because writers choose their format by it.  A symbolic link stays, what
    it points to is replaced; a device or a pipe stays too, and gets the bytes.  Raises
    InvalidInput when the folder does not exist or can not be written.
    """
    shown = Path(path)
    try:
        if shown.is_dir():
            raise InvalidInput(f"{shown}: expected the name of a file, this is a folder")
        with _filled(shown) if is_stream(shown) else _renamed(shown) as temporary:
            yield temporary
    except OSError as reason:
        raise InvalidInput(
            f"{shown}: can not be written: {reason.strerror or reason}"
        ) from None


def make_folder(folder: Path) -> list[Path]:
    """Make a folder with those above it; returns the new ones, from below.

    Raises InvalidInput where that fails; nothing half made stays.
    """
    new = [part for part in (folder, *folder.parents) if not os.path.exists(part)]
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as reason:
        remove_empty(new)
        raise InvalidInput(f"{folder}: can not be made: {reason.strerror}") from None
    return new


def remove_empty(folders: list[Path]) -> None:
    """Remove folders that hold nothing, those from below first."""
    for folder in folders:
        with suppress(OSError):
            folder.rmdir()


def is_stream(path: Path) -> bool:
    """True for what exists and is written into, not replaced: devices, pipes, /dev/stdout."""
    if not path.exists():
        return False
    return not stat.S_ISREG(path.stat().st_mode) or str(path.absolute()).startswith(STREAMS)


def check_is_regular(path: Path) -> None:
    """Raise FileFormatError for a pipe or a device, on which reading may never end.

    What is missing or a folder passes: whoever opens it knows better what to say.
    """
    try:
        mode = path.stat().st_mode
    except (OSError, ValueError):
        return
    if not (stat.S_ISREG(mode) or stat.S_ISDIR(mode)):
        raise FileFormatError(
            f"{path}: not a regular file; save what it gives to a file first"
        )


@contextmanager
def _renamed(path: Path) -> Iterator[Path]:
    """A path beside the file that `path` leads to, renamed onto that file at the end."""
    target = Path(os.path.realpath(path))
    if target.is_symlink():
        raise InvalidInput(f"{path}: can not be written: symbolic links in a circle")
    name = f".{target.stem[:20]}-{secrets.token_hex(4)}{target.suffix}"
    temporary = target.with_name(name)
    try:
        yield temporary
        os.replace(temporary, target)
    finally:
        temporary.unlink(missing_ok=True)


@contextmanager
def _filled(path: Path) -> Iterator[Path]:
    """A path in a folder of its own, its bytes appended to a device or pipe at the end.

    Not written to the device at once: HDF5 and figures go back and forth in their file.
    """
    with tempfile.TemporaryDirectory() as folder:
        temporary = Path(folder) / f"file{path.suffix}"
        yield temporary
        known = DESCRIPTORS.get(str(path))
        place = path if known is None else os.dup(known)
        with temporary.open("rb") as source, open(place, "ab") as target:
            shutil.copyfileobj(source, target)
