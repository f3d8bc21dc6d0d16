"""Seconds at work: a clock that stands still while kernels are compiled, and deadlines on it.

Compilation happens once per machine and says nothing about a method, so it belongs to no time
that is reported and to no limit; `compiling()` says how long it took.  Numba announces with the
event "numba:compiler_lock" when a thread prepares a kernel, be it compiled or read from disk.

A limit that a user gives is one of the clock.  What has none is limited by operations, which
searches count, so that a busy or a slow machine comes to the same answer, only later.
"""

from __future__ import annotations

import math
import threading
import time
from dataclasses import dataclass, replace
from decimal import Decimal
from numbers import Real

from numba.core import event

from .errors import InvalidInput, TimeUp
from .interrupts import hold, release
from .onlookers import seconds_until_end
from .quick import made
from .telling import told


class _Compiling(threading.local, event.Listener):
    """Seconds that this thread has spent on preparing kernels; preparations nest."""

    depth: int = 0
    since: float = 0.0
    total: float = 0.0
    held: bool = False

    def on_start(self, event: event.Event) -> None:
        """Note when the outermost preparation begins."""
        if self.depth == 0:
            self.since = time.perf_counter()
            self.held = hold()  # the compiler may crash of Ctrl-C
        self.depth += 1

    def on_end(self, event: event.Event) -> None:
        """Add what the outermost preparation took."""
        self.depth -= 1
        if self.depth == 0:
            self.total += time.perf_counter() - self.since
            if self.held:
                release()


_compiling = _Compiling()
event.register("numba:compiler_lock", _compiling)


class _Compiles(threading.local, event.Listener):
    """Whether this thread compiles a kernel, not only loads it; compilations nest."""

    depth: int = 0

    def on_start(self, event: event.Event) -> None:
        """Tell those who asked when the outermost compilation begins."""
        self.depth += 1
        if self.depth == 1:
            for tell in list(told):
                tell()

    def on_end(self, event: event.Event) -> None:
        """Note the end."""
        self.depth -= 1


_compiles = _Compiles()
event.register("numba:compile", _compiles)


def compiles() -> bool:
    """Whether this thread is compiling right now."""
    return _compiles.depth > 0


def compiling() -> float:
    """Seconds that this thread has spent so far on compiling and loading kernels."""
    return _compiling.total


def now() -> float:
    """Seconds of this thread's clock, of any origin, without those of compiling kernels."""
    return time.perf_counter() - _compiling.total


RATE = 1e10  # operations that count as a second: dense linear algebra on one core of 2020


@dataclass(eq=False)
class Work:
    """Operations done so far, in seconds of a core that does RATE of them in one."""

    done: float = 0.0


@dataclass(frozen=True)
class Deadline:
    """A moment until which work may go on; infinite by default.

    moment: of `now()`, or of `work` where operations are counted: then what is found does not
    depend on how busy a machine is.  seconds: how long it was when it was set.
    """

    moment: float = math.inf
    work: Work | None = None
    seconds: float = math.inf

    @classmethod
    def after(cls, seconds: float | None) -> Deadline:
        """So many seconds from now by the clock; never without a number."""
        if seconds is None:
            return NEVER
        return made(cls, moment=now() + seconds, work=None, seconds=float(seconds))

    @classmethod
    def counted(cls, seconds: float) -> Deadline:
        """After as many operations as take about so many seconds."""
        return cls(seconds, Work(), seconds)

    @property
    def time(self) -> float:
        """What `moment` is compared with."""
        return now() if self.work is None else self.work.done

    @property
    def left(self) -> float:
        """Seconds that are left, 0 when it has passed."""
        return 0.0 if self.passed else self.moment - self.time

    @property
    def passed(self) -> bool:
        """True when no time is left, or an onlooker has asked the work to end."""
        return seconds_until_end() is not None or self.time >= self.moment

    def spend(self, operations: float) -> None:
        """Count what was done; the clock needs no telling."""
        if self.work is not None:
            self.work.done += operations / RATE

    def affords(self, operations: float) -> bool:
        """True where that many, which nothing can interrupt, should be done in time."""
        return operations <= RATE * self.left

    def pay(self, operations: float) -> None:
        """Spend what nothing can interrupt; raises TimeUp before where that takes too long."""
        if not self.affords(operations):
            self.check()
            raise TimeUp(f"stopped after {self}: the next step takes longer than is left")
        self.spend(operations)

    def check(self) -> None:
        """Raise TimeUp when no time is left."""
        if self.passed:
            raise TimeUp(f"stopped after {self}")

    def share(self, part: float) -> Deadline:
        """The deadline of a stage that may take this part of what is left."""
        return replace(self, moment=self.time + part * self.left)

    def before(self, operations: float) -> Deadline:
        """So much earlier that as many operations can follow."""
        return replace(self, moment=self.moment - operations / RATE)

    def within(self, seconds: float) -> Deadline:
        """This deadline, or one in so many seconds where that is earlier."""
        earlier = self.time + seconds
        return replace(self, moment=earlier, seconds=seconds) if earlier < self.moment else self

    def __str__(self) -> str:
        early = seconds_until_end()
        if early is not None:
            return f"{early:.3g} s by the user"
        return f"{self.seconds:g} s" if self.work is None else f"the work of {self.seconds:g} s"


def duration(seconds: float) -> str:
    """A duration in words, of two digits or whole seconds: never as a power of ten."""
    if seconds >= 99.5:
        return f"{seconds:.0f} s"
    return f"{Decimal(f'{seconds:.2g}'):f} s"


NEVER = Deadline()
TimeLimit = float | Deadline | None  # seconds of the clock on the wall, as in all `time_limit`


def deadline_of(time_limit: TimeLimit, budget: float = math.inf) -> Deadline:
    """The deadline that is given, or in seconds from now, else after the work of `budget`.

    Raises InvalidInput unless the limit is a number above zero; it may be infinite.
    """
    if isinstance(time_limit, Deadline):
        return time_limit
    if time_limit is None:
        return NEVER if budget == math.inf else Deadline.counted(budget)
    check_seconds(time_limit)
    return Deadline.after(time_limit)


def check_seconds(time_limit: float) -> None:
    """Raise InvalidInput unless a time limit is a number above zero; it may be infinite."""
    if not isinstance(time_limit, Real) or isinstance(time_limit, bool):
        raise InvalidInput(f"time_limit: expected a number, got {time_limit!r}")
    if not time_limit > 0:
        raise InvalidInput(f"time_limit: expected seconds > 0, got {time_limit}")
