"""A disk that fails: the calls that touch a folder are counted, and one of them goes wrong.

Python's own `open` for writing goes through the same calls, so that files which libraries write
are seen as well.
"""

from __future__ import annotations

import builtins
import errno
import io
import math
import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from enum import Enum
from pathlib import Path
from typing import Any

EXIT = 77  # code of a process that a fault has ended
OF_PATHS = ("open", "mkdir", "replace", "unlink", "rmdir")
FLAGS = {"w": os.O_WRONLY | os.O_CREAT | os.O_TRUNC,
         "wb": os.O_WRONLY | os.O_CREAT | os.O_TRUNC, "r+b": os.O_RDWR}  # fmt: skip
OF_FILES = ("write", "pwrite", "ftruncate", "fsync", "close")


class Kind(Enum):
    """What happens at the chosen call."""

    ERROR = "error"  # it fails with `number`, an errno
    EXIT_BEFORE = "exit before"
    EXIT_AFTER = "exit after"
    SIGNAL = "signal"  # the process gets the signal `number` and goes on


@dataclass
class Faults:
    """The calls in a folder; the one numbered `at` (from 1) goes wrong, the rest is done.

    only: names of calls that count, all by default; room: bytes that can be written before the
    disk is full.
    """

    folder: Path
    kind: Kind = Kind.ERROR
    at: int = 0
    number: int = errno.ENOSPC
    only: tuple[str, ...] = ()
    room: float = math.inf
    calls: list[str] = field(default_factory=list)
    written: int = 0  # bytes, also those written over others
    _open: set[int] = field(default_factory=set)

    @contextmanager
    def injected(self) -> Iterator[Faults]:
        """The system's calls, watched."""
        before = {name: getattr(os, name) for name in (*OF_PATHS, *OF_FILES)}
        plain = builtins.open  # also io.open, which pathlib calls
        for name in OF_PATHS:
            setattr(os, name, self._watched(name, before[name], self._is_inside))
        for name in OF_FILES:
            setattr(os, name, self._watched(name, before[name], self._open.__contains__))
        builtins.open = io.open = self._opener(plain)
        try:
            yield self
        finally:
            builtins.open = io.open = plain
            for name, call in before.items():
                setattr(os, name, call)

    def _is_inside(self, path: Any) -> bool:
        try:
            return Path(os.path.abspath(os.fspath(path))).is_relative_to(self.folder)
        except TypeError:  # a descriptor
            return False

    def _watched(self, name: str, call: Callable, is_ours: Callable) -> Callable:
        def watched(first: Any, *rest: Any, **named: Any) -> Any:
            if not is_ours(first):
                return call(first, *rest, **named)
            hit = self._counted(name)
            if hit and self.kind is Kind.EXIT_BEFORE:
                os._exit(EXIT)
            if hit and self.kind is Kind.SIGNAL:
                os.kill(os.getpid(), self.number)
            if hit and self.kind is Kind.ERROR:
                if name == "close":  # the descriptor is gone all the same
                    self._open.discard(first)
                    call(first)
                raise OSError(self.number, os.strerror(self.number))
            if name == "write":
                rest = (self._fitting(rest[0]),)
            try:
                done = call(first, *rest, **named)
            finally:
                if hit and self.kind is Kind.EXIT_AFTER:  # also after one that failed by itself
                    os._exit(EXIT)
            if name == "open":
                self._open.add(done)
            if name == "close":
                self._open.discard(first)
            return done

        return watched

    def _counted(self, name: str) -> bool:
        if self.only and name not in self.only:
            return False
        self.calls.append(name)
        return len(self.calls) == self.at

    def _fitting(self, data: Any) -> Any:
        """As much of the data as there is room for."""
        size = len(data)
        if size and self.room <= 0:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        part = data[: int(min(size, self.room))]
        self.room -= len(part)
        self.written += len(part)
        return part

    def _opener(self, plain: Callable) -> Callable:
        def opener(file: Any, mode: str = "r", *rest: Any, **named: Any) -> Any:
            if mode not in FLAGS or not self._is_inside(file):
                return plain(file, mode, *rest, **named)
            raw = _Raw(os.open(file, FLAGS[mode], 0o666), "r+b" if "+" in mode else "wb")
            if "+" in mode:
                return io.BufferedRandom(raw)
            buffered = io.BufferedWriter(raw)
            return buffered if mode == "wb" else io.TextIOWrapper(buffered, encoding="utf-8")

        return opener


class _Raw(io.FileIO):
    """A file that writes and closes by the calls of `os`, looked up every time."""

    def __init__(self, place: int, mode: str) -> None:
        super().__init__(place, mode, closefd=False)
        self.place = place

    def write(self, data: Any) -> int:
        return os.write(self.place, bytes(data))

    def close(self) -> None:
        if not self.closed:
            super().close()
            os.close(self.place)
