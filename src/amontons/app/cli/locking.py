"""A folder of results belongs to one writer at a time."""

from __future__ import annotations

import errno
import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import click

from ...core.errors import NotWritten

try:
    import fcntl
except ImportError:  # no such locks on this system
    fcntl = None

NAME = ".lock"
TAKEN = (errno.EAGAIN, errno.EACCES)  # somebody else has it
LONGEST = 20  # digits of a process


@contextmanager
def locked(folder: Path) -> Iterator[None]:
    """Hold the lock of a folder; raises NotWritten while another process holds it.

    The system gives the lock back when its process ends in whatever way: the file that one
    which was killed leaves says nothing.  Where a file system has no locks, a line on stderr
    says that nobody watches.
    """
    path = folder / NAME
    try:
        place = _taken(path)
    except OSError as reason:
        raise NotWritten(f"{path}: can not be written: {reason.strerror or reason}") from None
    try:
        yield
    finally:
        if place is not None:
            with suppress(OSError):
                path.unlink(missing_ok=True)  # before others can have it
            with suppress(OSError):
                os.close(place)


def _taken(path: Path) -> int | None:
    """The open file that holds the lock, None where there are no locks."""
    while fcntl is not None:
        place = os.open(path, os.O_RDWR | os.O_CREAT, 0o666)
        try:
            fcntl.flock(place, fcntl.LOCK_EX | fcntl.LOCK_NB)
            if _is_still(path, place):
                _say_who(place)
                return place
            os.close(place)  # its last owner removed it meanwhile: take the next
        except OSError as reason:
            who = _who(place)
            with suppress(OSError):
                os.close(place)
            if reason.errno in TAKEN:
                raise NotWritten(
                    f"{path.parent}: in use by another `amontons run`{who}; wait for its end, "
                    "or write elsewhere with -o"
                ) from None
            with suppress(OSError):
                path.unlink()
            break
    click.echo(
        f"{path.parent}: can not be locked here; take care that only one `amontons run` "
        "writes to it", err=True,
    )  # fmt: skip
    return None


def _is_still(path: Path, place: int) -> bool:
    """True where the path leads to the file that is open."""
    try:
        return os.path.samestat(os.stat(path), os.fstat(place))
    except FileNotFoundError:
        return False


def _say_who(place: int) -> None:
    """Write the process into the lock, for messages only: a full disk does no harm."""
    with suppress(OSError):
        os.ftruncate(place, 0)
        os.pwrite(place, str(os.getpid()).encode(), 0)


def _who(place: int) -> str:
    """The process that holds the lock, in words, empty where it can not be read."""
    with suppress(OSError):
        text = os.pread(place, LONGEST, 0).decode("ascii", "replace")
        if text.isdigit():
            return f", process {text}"
    return ""
