"""Seconds at work: a clock that stands still while kernels are compiled, and deadlines on it.

Compilation happens once per machine and says nothing about a method, so it belongs to no time
that is reported and to no limit; `compiling()` says how long it took.  Numba announces with the
event "numba:compiler_lock" when a thread prepares a kernel, be it compiled or read from disk.
"""

from __future__ import annotations

import math
import threading
import time
from dataclasses import dataclass

from numba.core import event


class _Compiling(threading.local, event.Listener):
    """Seconds that this thread has spent on preparing kernels; preparations nest."""

    depth: int = 0
    since: float = 0.0
    total: float = 0.0

    def on_start(self, event: event.Event) -> None:
        """Note when the outermost preparation begins."""
        if self.depth == 0:
            self.since = time.perf_counter()
        self.depth += 1

    def on_end(self, event: event.Event) -> None:
        """Add what the outermost preparation took."""
        self.depth -= 1
        if self.depth == 0:
            self.total += time.perf_counter() - self.since


_compiling = _Compiling()
event.register("numba:compiler_lock", _compiling)


def compiling() -> float:
    """Seconds that this thread has spent so far on compiling and loading kernels."""
    return _compiling.total


def now() -> float:
    """Seconds of this thread's clock, of any origin, without those of compiling kernels."""
    return time.perf_counter() - _compiling.total


@dataclass(frozen=True)
class Deadline:
    """A moment of `now()` until which work may go on; infinite by default."""

    moment: float = math.inf

    @classmethod
    def after(cls, seconds: float | None) -> Deadline:
        """So many seconds from now; never without a number."""
        return cls(math.inf if seconds is None else now() + seconds)

    @property
    def left(self) -> float:
        """Seconds that are left, 0 when it has passed."""
        return max(self.moment - now(), 0.0)

    @property
    def passed(self) -> bool:
        """True when no time is left."""
        return now() >= self.moment

    def share(self, part: float) -> Deadline:
        """The deadline of a stage that may take this part of what is left."""
        return Deadline(now() + part * self.left)

    def within(self, seconds: float) -> Deadline:
        """This deadline, or one in so many seconds where that is earlier."""
        return Deadline(min(self.moment, now() + seconds))


NEVER = Deadline()
