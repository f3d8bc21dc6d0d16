"""Compiled functions, and the folder in which they are kept from one run to the next.

Numba would keep them beside the package: there they outlive it, so that a removed package can
still be imported, and where nobody may write it gives up.  Here they are kept in the user's
cache, or where NUMBA_CACHE_DIR says, else in a folder that goes when the process ends.

Numba takes what it has kept as valid while the file of a function is the same, whatever has
become of the functions that it calls.  So all kernels are kept under a digest of all of them.
"""

from __future__ import annotations

import atexit
import os
import shutil
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from functools import cache, cached_property
from pathlib import Path
from typing import Any

import numba
from numba.core import config
from numba.core.caching import FunctionCache, _Cache
from numba.core.dispatcher import Dispatcher
from numba.core.sigutils import normalize_signature

from . import clock
from .shipped import PACKAGE, name_of, shipped, sources
from .spelling import spelled

RECORD = os.environ.get("AMONTONS_RECORD_KERNELS", "")  # a file, see docs/startup.md
MARK = b"njit("  # in every file with kernels
ROOT = 0  # whose folders anybody may trust
PATIENCE = 30 * 24 * 3600.0  # seconds after which kernels of another version may go
Function = Callable[..., Any]


def njit(*, cache: bool = True, **options: Any) -> Callable[[Function], Function]:
    """`numba.njit` with the same options; its results come with the package, or are kept."""

    def decorate(function: Function) -> Function:
        made = numba.njit(**options)(function)
        if cache and isinstance(made, Dispatcher):  # numba can be switched off
            made._cache = Kept(function)
        return made

    return decorate


class Kept(_Cache):
    """Where numba looks for what it has compiled: first in the package, then in our folder."""

    def __init__(self, function: Function) -> None:
        self.function = function

    @cached_property
    def own(self) -> FunctionCache:
        """Numba's cache in our folder, made when it is asked for: most never are."""
        with _kept_in(_folder()):
            return FunctionCache(self.function)

    @property
    def cache_path(self) -> Any:
        """The folder in which new results are kept."""
        return self.own.cache_path

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """What was compiled for these types, None where nothing was."""
        types, _ = normalize_signature(sig)
        if RECORD and not clock.compiles():
            _record(self.function, types)
        found = shipped().result(name_of(self.function, types), target_context)
        return self.own.load_overload(sig, target_context) if found is None else found

    def save_overload(self, sig: Any, data: Any) -> None:
        """Keep a result where there is room for it; on a full disk it is compiled again."""
        with suppress(OSError):
            self.own.save_overload(sig, data)

    def enable(self) -> None:
        """Numba's switch, of which nothing here makes use."""

    disable = flush = enable


def _record(function: Function, types: Sequence[Any]) -> None:
    """Note that a function was called with these types, a line for each process and call."""
    with open(RECORD, "a", encoding="utf-8") as file:
        file.write(f"{function.__module__} {function.__qualname__} {spelled(types)}\n")


@contextmanager
def _kept_in(folder: str) -> Iterator[None]:
    """Numba asks where to keep a function when it meets the function, not when it compiles."""
    before = config.CACHE_DIR
    config.CACHE_DIR = folder
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
    """Sixteen letters that change with any file that holds kernels."""
    return sources(PACKAGE, MARK)
