"""Ctrl-C and SIGTERM in a run: they break into computing, and wait while files are written."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Any

from ...core.interrupts import again, is_busy
from ...core.onlookers import Onlooker, present

SIGNALS = {signal.SIGINT: "Interrupted", signal.SIGTERM: "Terminated"}
BY_SIGNAL = 128  # plus its number: the exit code of a process that a signal has ended


class Stopping:
    """Holds the handlers of both signals while its block runs.

    A signal raises KeyboardInterrupt within `breaking`, and only there; where that would do
    harm or be lost, in imports and compilers, it waits (`core.interrupts`), and elsewhere
    `received` remembers it.  impatient: a second signal raises it anywhere.  A signal that the
    process was started to ignore, as shells do for commands in the background, is still
    ignored.
    """

    def __init__(self, *, impatient: bool = False) -> None:
        self.impatient = impatient
        self.received: signal.Signals | None = None
        self._breakable = False
        self._before: dict[signal.Signals, Any] = {}

    def __enter__(self) -> Stopping:
        if threading.current_thread() is threading.main_thread():  # others can not set handlers
            heard = [n for n in SIGNALS if signal.getsignal(n) is not signal.SIG_IGN]
            self._before = {number: signal.signal(number, self._take) for number in heard}
        return self

    def __exit__(self, *_: object) -> None:
        for number, handler in self._before.items():
            signal.signal(number, handler)

    @property
    def code(self) -> int:
        """The exit code that says which signal it was."""
        return BY_SIGNAL + (self.received or signal.SIGINT)

    @property
    def word(self) -> str:
        """What has happened, in a word."""
        return SIGNALS[self.received or signal.SIGINT]

    @contextmanager
    def breaking(self) -> Iterator[None]:
        """Signals raise KeyboardInterrupt here, also one that came before."""
        try:
            self._breakable = True
            if self.received is not None:
                raise KeyboardInterrupt
            yield
        finally:
            self._breakable = False

    def _take(self, number: int, frame: FrameType | None) -> None:
        breakable = self._breakable or (self.impatient and self.received is not None)
        self.received = self.received or signal.Signals(number)
        if breakable and is_busy(frame):
            again(number)
        elif breakable:
            raise KeyboardInterrupt


@contextmanager
def ending_early() -> Iterator[Stopping]:
    """The first signal ends a search with what it knows, a second one breaks into it."""
    with Stopping(impatient=True) as stop:
        with present(Onlooker(ends=lambda: stop.received is not None)):
            yield stop
