"""Where a compiled function is looked for, by parts of numba that are not public."""

from __future__ import annotations

import logging
import os
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager, suppress
from copy import copy
from functools import cached_property
from typing import Any
from uuid import uuid4

from numba.core.caching import FunctionCache, _Cache
from numba.core.sigutils import normalize_signature

from . import clock
from .compiled import is_current
from .shipped import name_of, shipped
from .spelling import spelled

RECORD = os.environ.get("AMONTONS_RECORD_KERNELS", "")  # a file, see docs/startup.md
Function = Callable[..., Any]
InFolder = Callable[[], AbstractContextManager[None]]
NUMBER = ".{number:d}"  # where numba puts a number into the name of a file
logger = logging.getLogger(__name__)


class Kept(_Cache):
    """Where numba looks for what it has compiled: first in the package, then in our folder."""

    def __init__(self, function: Function, in_folder: InFolder) -> None:
        self.function, self.in_folder = function, in_folder

    @cached_property
    def own(self) -> FunctionCache:
        """Numba's cache in our folder, made when it is asked for: most never are."""
        with self.in_folder():
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
        name = name_of(self.function, types)
        found = shipped().result(name, target_context)
        if found is None and (other := shipped().that_writes_less(name)):
            found = _taking(types, shipped().result(other, target_context))
        return self._from_folder(sig, target_context) if found is None else found

    def _from_folder(self, sig: Any, target_context: Any) -> Any:
        if not is_current():
            return None
        own = self.own
        try:
            return own.load_overload(sig, target_context)
        except Exception as error:  # a file cut short by a crash, or damaged: numba reads on
            logger.warning("%s: %s: %s; it is compiled instead", own.cache_path,
                           self.function.__qualname__, error)  # fmt: skip
            with suppress(OSError):
                own.flush()
            return None

    def save_overload(self, sig: Any, data: Any) -> None:
        """Keep a result where there is room for it; on a full disk it is compiled again."""
        if is_current():
            with suppress(OSError):
                _name_apart(self.own)
                self.own.save_overload(sig, data)

    def enable(self) -> None:
        """Numba's switch, of which nothing here makes use."""

    disable = flush = enable


def _taking(types: Sequence[Any], found: Any) -> Any:
    """A result for arrays that it only reads, as one for the same arrays open for writing.

    To the machine code both are the same.  None where a result hands such an array back, as it
    would be locked.
    """
    if found is None or "readonly" in str(found.signature.return_type):
        return None
    described = copy(found.fndesc)  # by which other kernels call it
    described.argtypes = tuple(types)
    signature = found.signature.replace(args=described.argtypes)
    return found._replace(signature=signature, fndesc=described)


def _name_apart(cache: FunctionCache) -> None:
    """Let the next result go to a file of its own.

    Numba numbers the files of a function: two processes that compile it for different types at
    the same time could write to one, and the index then name it for the wrong types.
    """
    files = getattr(cache, "_cache_file", None)
    stem, number, _ = str(getattr(files, "_data_name_pattern", "")).partition(NUMBER)
    if files is not None and number:
        files._data_name_pattern = f"{stem}{NUMBER}.{uuid4().hex[:16]}.nbc"


def _record(function: Function, types: Sequence[Any]) -> None:
    """Note that a function was called with these types, a line for each process and call."""
    with open(RECORD, "a", encoding="utf-8") as file:
        file.write(f"{function.__module__} {function.__qualname__} {spelled(types)}\n")
