"""Writing files so that a reader never meets half of one, also after a power cut.

HDF5 files and figures are made in memory, and `put` writes their bytes: on a full disk those
libraries crash, or do not say why they failed.
"""

from __future__ import annotations

import errno
import os
import re
import secrets
import shutil
import stat
import tempfile
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import BinaryIO

from .errors import FileFormatError, NotWritten

STREAMS = ("/dev/", "/proc/")  # /dev/stdout may lead to a plain file that is open elsewhere
DESCRIPTORS = {"/dev/stdout": 1, "/dev/stderr": 2}  # these keep their place in such a file
BINARY = getattr(os, "O_BINARY", 0)  # where lines would end in another way
NO_SYNC = (errno.EINVAL, errno.ENOTSUP, errno.ENOSYS)  # of file systems without it
AT_ONCE = 1 << 24  # bytes that are copied from file to file
KEPT = 20  # letters of a name that its temporary file keeps
PART = re.compile(r"\.(?P<stem>.{1,20})-[0-9a-f]{8}(?P<suffix>(\.[^.]*)?)")


def write_bytes(path: str | os.PathLike[str], data: bytes) -> None:
    """Write a file, complete or not at all; raises like `replacing`."""
    with replacing(path) as temporary:
        put(temporary, data)


def put(path: Path, data: bytes) -> None:
    """Fill a new file, such as that of `replacing`, which gives errors their words."""
    _put(path, [data])


def put_from(path: Path, file: BinaryIO) -> None:
    """The same with all that a file holds, which is read some at a time."""
    file.seek(0)
    _put(path, iter(lambda: file.read(AT_ONCE), b""))


def _put(path: Path, parts: Iterable[bytes]) -> None:
    place = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_TRUNC | BINARY, 0o666)
    try:
        for part in parts:
            left = memoryview(part)
            while left:
                left = left[os.write(place, left) :]
    finally:
        os.close(place)


@contextmanager
def replacing(path: str | os.PathLike[str]) -> Iterator[Path]:
    """A temporary path beside `path`, renamed onto it when the block ends without an error.

    The suffix is kept, because writers choose their format by it.  The bytes are on the disk
    before the name is.  A symbolic link stays, what it points to is replaced; a device or a
    pipe stays too, and gets the bytes.  Raises NotWritten, which says why, when the folder does
    not exist, can not be written or is full; what was there before then stays.
    """
    shown = Path(path)
    try:
        if shown.is_dir():
            raise NotWritten(f"{shown}: expected the name of a file, this is a folder")
        with _filled(shown) if is_stream(shown) else _renamed(shown) as temporary:
            yield temporary
    except OSError as reason:
        raise NotWritten(f"{shown}: can not be written: {_why(reason, shown)}") from None


def _why(reason: OSError, path: Path) -> str:
    """The reason in words; a folder that is missing is named, maybe that behind a link."""
    folder = Path(os.path.realpath(path)).parent
    if isinstance(reason, FileNotFoundError) and not folder.exists():
        return f"the folder {folder if path.is_symlink() else path.parent} does not exist"
    return reason.strerror or str(reason) or type(reason).__name__


def make_folder(folder: Path) -> list[Path]:
    """Make a folder with those above it; returns the new ones, from below.

    Raises NotWritten where that fails; nothing half made stays.
    """
    new = [part for part in (folder, *folder.parents) if not os.path.exists(part)]
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as reason:
        remove_empty(new)
        broken = next((p for p in (folder, *folder.parents) if _leads_nowhere(p)), None)
        why = reason.strerror or str(reason)
        if broken is not None:
            why = f"{broken} is a symbolic link to {os.readlink(broken)}, which does not exist"
        raise NotWritten(f"{folder}: can not be made: {why}") from None
    return new


def _leads_nowhere(path: Path) -> bool:
    """True for a symbolic link to what does not exist."""
    return os.path.islink(path) and not os.path.exists(path)


def remove_parts(folder: Path, names: Iterable[re.Pattern[str]]) -> None:
    """Remove temporary files that a process which was killed left of files with such names.

    Only where nobody else writes such files into the folder.
    """
    for path in folder.iterdir():
        left = PART.fullmatch(path.name)
        name = "" if left is None else f"{left['stem']}{left['suffix']}"
        if any(pattern.fullmatch(name) for pattern in names):
            with suppress(OSError):
                path.unlink()


@contextmanager
def made(folder: Path) -> Iterator[None]:
    """The folder, made with those above it; new ones that are empty go when the block fails."""
    new = make_folder(folder)
    try:
        yield
    except BaseException:
        remove_empty(new)
        raise


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
        raise NotWritten(f"{path}: can not be written: symbolic links in a circle")
    name = f".{target.stem[:KEPT]}-{secrets.token_hex(4)}{target.suffix}"
    temporary = target.with_name(name)
    try:
        yield temporary
        _sync(temporary)
        os.replace(temporary, target)
        _sync(target.parent)
    finally:
        with suppress(OSError):
            temporary.unlink(missing_ok=True)


def _sync(path: Path) -> None:
    """Wait until a file, or the names in a folder, are on the disk, if the system can."""
    is_folder = path.is_dir()
    if is_folder and os.name == "nt":
        return
    try:
        place = os.open(path, os.O_RDONLY if is_folder else os.O_RDWR | BINARY)
    except PermissionError:
        if is_folder:  # it may be written and not listed
            return
        raise
    try:
        os.fsync(place)
    except OSError as reason:
        if reason.errno not in NO_SYNC:
            raise
    finally:
        os.close(place)


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
