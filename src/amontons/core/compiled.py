"""Compiled functions, and the folder in which they are kept from one run to the next.

Numba would keep them beside the package: there they outlive it, so that a removed package can
still be imported, and where nobody may write it gives up.  Here they are kept in the user's
cache, or where NUMBA_CACHE_DIR says, else in a folder that goes when the process ends.

Numba takes what it has kept as valid while the file of a function is the same, whatever has
become of the functions that it calls.  So all kernels are kept under a digest of all of them,
and of the constants that they may take from other files; in a process that has imported other
files than those which the digest was made of, nothing is read or kept.
"""

from __future__ import annotations

import atexit
import logging
import os
import shutil
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from functools import cache
from pathlib import Path
from typing import Any

import numba
from numba.core import config
from numba.core.errors import NumbaError
from numba.core.types import BooleanLiteral, IntegerLiteral, unliteral

from .source_digest import PACKAGE, Stamp, as_imported, imported, sources

MARKS = (b"njit(", b"numba.extending")  # one of them is in every file with parts of kernels
ROOT = 0  # whose folders anybody may trust
STRANGE = f"numba {numba.__version__} is not one that kernels in the package can be read with"
PATIENCE = 30 * 24 * 3600.0  # seconds after which kernels of another version may go
Function = Callable[..., Any]
logger = logging.getLogger(__name__)
_read: set[Stamp] = set()  # the files of the digest, as they were when it was made


def njit(*, cache: bool = True, **options: Any) -> Callable[[Function], Function]:
    """`numba.njit` with the same options; its results come with the package, or are kept."""

    def decorate(function: Function) -> Function:
        if str(function.__module__).partition(".")[0] == __name__.partition(".")[0]:
            imported(function.__code__.co_filename)
        kind = _kind() if cache else None
        made = numba.njit(**options)(function)
        if hasattr(made, "get_call_template"):
            _compile_once(made)
        if kind and hasattr(made, "_cache"):
            made._cache = kind(function, _in_our_folder)
        elif cache and hasattr(made, "enable_caching"):  # not where numba is switched off
            with _in_our_folder():
                made.enable_caching()
        return made

    return decorate


def _compile_once(made: Any) -> None:
    """Let kernels that call this one compile it for integers, not for a constant first.

    Of `count = 0` that grows later, numba takes the constant before it sees the integer: all
    kernels that count is given to would be compiled twice, with all that these call.
    """
    ask = made.get_call_template

    def get_call_template(args: Any, kws: Any) -> Any:
        plain = tuple(map(_plain, args)), {name: _plain(kind) for name, kind in kws.items()}
        if plain != (tuple(args), kws):
            with suppress(NumbaError):  # what needs the constant gets it
                return ask(*plain)
        return ask(args, kws)

    made.get_call_template = get_call_template


def _plain(kind: Any) -> Any:
    """The type of a constant; other types as they are."""
    return unliteral(kind) if isinstance(kind, IntegerLiteral | BooleanLiteral) else kind


@cache
def _kind() -> Any:
    """The class that finds kernels; None where parts of this numba have other names."""
    try:
        from .kept import Kept

        Kept(_kind, _in_our_folder)  # all that numba asks of a cache is there
    except (ImportError, AttributeError, TypeError) as reason:
        logger.warning("%s: %s", STRANGE, reason)
        return None
    return Kept


def why_compiling() -> str:
    """Why a kernel is compiled that could have come with the package."""
    if _kind() is None:
        return STRANGE
    from .shipped import shipped

    return shipped().why_not or "not all come with the package"


@contextmanager
def _in_our_folder() -> Iterator[None]:
    """Numba asks where to keep a function when it meets the function, not when it compiles."""
    before = config.CACHE_DIR
    config.CACHE_DIR = _folder()
    try:
        yield
    finally:
        config.CACHE_DIR = before


@cache
def _folder() -> str:
    """A folder that is there and can be written, of this user alone."""
    with suppress(OSError, RuntimeError):  # nobody may write there, or there is no home
        above = _preferred()
        _forget_old(above)
        return _made(above / f"kernels-{_digest()}")
    return _made_for_this_process()


def _preferred() -> Path:
    """What the user says, else the place for caches of this system."""
    if config.CACHE_DIR:
        return Path(config.CACHE_DIR) / "amontons"
    if sys.platform == "win32":
        return Path(os.environ.get("LOCALAPPDATA", Path.home())) / "amontons" / "cache"
    if sys.platform == "darwin":
        return Path.home() / "Library" / "Caches" / "amontons"
    given = os.environ.get("XDG_CACHE_HOME", "")
    return (Path(given) if os.path.isabs(given) else Path.home() / ".cache") / "amontons"


def _made(folder: Path) -> str:
    """The folder, made and tried; raises OSError where it can not be trusted or written.

    What is kept is code: a folder of another user would run it here.
    """
    folder.mkdir(parents=True, exist_ok=True, mode=0o700)
    if hasattr(os, "getuid") and folder.stat().st_uid not in (os.getuid(), ROOT):
        raise PermissionError(f"{folder}: belongs to another user")
    tempfile.TemporaryFile(dir=folder).close()
    os.utime(folder)  # in use
    return str(folder)


def _made_for_this_process() -> str:
    """A folder that is removed at the end."""
    folder, owner = tempfile.mkdtemp(prefix="amontons-"), os.getpid()

    def remove() -> None:
        if os.getpid() == owner:  # not a forked process, which has the same folder
            shutil.rmtree(folder, ignore_errors=True)

    atexit.register(remove)
    return folder


def _forget_old(above: Path) -> None:
    """Remove kernels of other versions that have not been used for long."""
    with suppress(OSError):
        for folder in above.glob("kernels-*"):
            if time.time() - folder.stat().st_mtime > PATIENCE:
                shutil.rmtree(folder, ignore_errors=True)


def _digest() -> str:
    """Sixteen letters that change with any file that holds kernels, and with constants."""
    return sources(PACKAGE, MARKS, _read)


def is_current() -> bool:
    """True where the kernels of this process are those of the sources that name its folder."""
    _folder()
    return as_imported(_read)
