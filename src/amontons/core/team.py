"""Threads that help a caller with the parts of its work, and that it never waits for to begin.

A caller lays its parts open (`Region`), calls helpers, and takes part after part itself until
none is left.  Then it waits for those parts alone that a helper is at.  So a helper that comes
late, as on a busy machine, costs nothing, and neither callers at the same time nor a call out
of a part can wait for each other.

Helpers sleep on one queue of calls, and look for parts whenever they have taken one from it.  A
region has a seat for each helper that it asked for, so that it has no more threads than that.
Helpers know it by a weak reference: one that comes late keeps nothing of the caller's.  They
are started where open regions together want more than there are, and stay until the interpreter
ends; callers who do that at the same moment may start one too many each.

Ctrl-C can come between any two steps of the main thread, so whatever is shared changes by
single steps that nothing comes between (`put`, `add`, `setdefault`, `pop`, the last reference),
and a region is closed by steps that can be done again.
"""

from __future__ import annotations

import atexit
import os
from _thread import LockType, allocate_lock
from collections.abc import Callable, Sequence
from queue import SimpleQueue
from threading import Thread
from typing import Any
from weakref import ref

MOST = 256  # helpers
FAREWELL = 1.0  # s to wait for a helper at the end that seems to be idle
Part = Any


class Region:
    """work(part) for some parts, each done once, by whoever takes it first.

    helpers: threads that may help at most, each in a seat of its own; taken: who has a part,
    of which `setdefault` is one step that nothing comes between; ended: the error of a part
    that has been done, or None; bells: locks that ring then; closed: no part is
    being done, nor will be.
    """

    def __init__(
        self, work: Callable[[Part], None], parts: Sequence[Part], helpers: int
    ) -> None:
        self.work, self.parts, self.helpers = work, parts, helpers
        self.seats = [None] * helpers
        self.taken: dict[int, object] = {}
        self.ended: dict[int, BaseException | None] = {}
        self.bells = [_locked() for _ in parts]
        self.closed = False

    def take(self, by: object, first: int) -> None:
        """Do what nobody has taken, from part `first` on; an interrupt ends that."""
        count = len(self.parts)
        for k in (*range(first, count), *range(first)):
            if self.taken.setdefault(k, by) is by and not self._done(k):
                return

    def _done(self, k: int) -> bool:
        """Do part k and say so; False where something other than an error has ended it."""
        error: BaseException | None = None
        try:
            self.work(self.parts[k])
        except BaseException as raised:  # noqa: BLE001  # the caller raises it
            error = raised
        self.ended[k] = error
        self.bells[k].release()
        return error is None or isinstance(error, Exception)

    def close(self) -> None:
        """Wait for what helpers do, let them have no more; nothing where that has been done.

        Ctrl-C, however often, waits as well, as helpers work on arrays of the caller, and is
        raised then.  Only if it comes again in the instant when it is put off, it is raised at
        once, and `close` is to be called again.
        """
        pressed: BaseException | None = None
        while not self.closed:
            try:
                self._wait()
            except BaseException as raised:  # noqa: BLE001  # raised below
                pressed = raised
        if pressed is not None:
            raise pressed

    def _wait(self) -> None:
        for k, bell in enumerate(self.bells):
            if self.taken.setdefault(k, self) is not self:  # the caller's own are over
                while k not in self.ended:
                    bell.acquire()
        self.closed = True

    def errors(self) -> list[BaseException]:
        """What parts have raised, in their order, but interrupts and exits before errors."""
        in_order = map(self.ended.get, range(len(self.parts)))
        found = [error for error in in_order if error is not None]
        found.sort(key=lambda error: isinstance(error, Exception))
        return found


class _Team:
    """The helpers of this process, the calls to them, and the regions that these are for."""

    def __init__(self) -> None:
        self.calls: SimpleQueue[None] = SimpleQueue()
        self.open: set[ref[Region]] = set()  # of closed ones too, while somebody has them
        self.helpers: set[_Helper] = set()
        self.ended = False

    def call(self, region: Region) -> None:
        """Have helpers come, of which some are started where open regions want more."""
        self.open.add(ref(region, self.open.discard))
        for _ in range(region.helpers):
            if self.calls.qsize() < len(self.helpers):  # else all are about to look
                self.calls.put(None)
        wanted = min(sum([each.helpers for each in self.regions()]), MOST)
        while len(self.helpers) < wanted and not self.ended:
            helper = _Helper(self, len(self.helpers) + 1)
            try:
                helper.thread.start()
            except RuntimeError:  # the system gives no more: callers do without
                return
            self.helpers.add(helper)

    def regions(self) -> list[Region]:
        """Those that are open."""
        found = []
        for known in list(self.open):
            region = known()
            if region is not None and not region.closed:
                found.append(region)
        return found

    def end(self) -> None:
        """Let idle helpers end; others end when their part does, or with the process."""
        self.ended = True
        helpers = list(self.helpers)
        for _ in helpers:
            self.calls.put(None)
        for helper in helpers:
            if not helper.busy:
                helper.thread.join(FAREWELL)


class _Helper:
    """A thread that takes parts of the regions that it is called to; number: from 1 on."""

    def __init__(self, team: _Team, number: int) -> None:
        self.team, self.number, self.busy = team, number, False
        self.thread = Thread(target=self._live, name=f"amontons_{number}", daemon=True)

    def _live(self) -> None:
        self.team.helpers.add(self)  # its starter may have been interrupted before that
        while not self.team.ended:
            self.busy = True
            self._help()
            self.busy = False
            self.team.calls.get()

    def _help(self) -> None:
        """Its own part first, so that a core has the same rows again and again."""
        for region in self.team.regions():
            try:
                region.seats.pop()
            except IndexError:
                continue
            region.take(object(), self.number % len(region.parts))


def _locked() -> LockType:
    lock = allocate_lock()
    lock.acquire()
    return lock


_team = _Team()


def together(work: Callable[[Part], None], parts: Sequence[Part], threads: int) -> None:
    """work(part) for all of two or more parts, by so many threads, of which this is one.

    Raises the first error when all parts have ended, what is no `Exception` before others.
    Ctrl-C leaves parts that nobody has begun with, and waits for the others.
    """
    region = Region(work, parts, min(len(parts), threads) - 1)
    try:
        try:
            try:
                _team.call(region)
                region.take(region, 0)
            finally:
                region.close()
        finally:
            if not region.closed:  # Ctrl-C came before `close` could put it off
                region.close()
    finally:
        if not region.closed:  # and again
            region.close()
    for error in region.errors():
        raise error


def _after_fork() -> None:
    """Threads have not survived; a forked process starts its own."""
    global _team  # noqa: PLW0603  # one for each process
    _team = _Team()


atexit.register(lambda: _team.end())
if hasattr(os, "register_at_fork"):  # not on Windows, which can not fork
    os.register_at_fork(after_in_child=_after_fork)
