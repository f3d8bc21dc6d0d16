"""Ctrl-C where it does no harm.

Python raises KeyboardInterrupt wherever it happens to be.  In the middle of an import it comes
out as any other error, in a destructor it is printed and lost, and numba's compiler can crash
of it.  There the signal is sent again a moment later, until it meets a better place.
"""

from __future__ import annotations

import _signal  # type: ignore  # those of `signal` make enums of all numbers: 10 µs each, in every solve
import signal
import sys
import threading
from collections.abc import Callable
from functools import partial
from types import FrameType

SIGINT = int(signal.SIGINT)
AGAIN = 0.05  # seconds until the signal is sent again
BUSY = ("importlib", "numba", "llvmlite", "weakref", "_weakrefset")  # packages, and modules


def watch() -> None:
    """Let Ctrl-C wait for a better place from now on, for a program of our own."""
    _take(partial(_handle, sys._getframe(1)))


class Watching:
    """The same within a block, unless the program has a handler of its own.

    later: only from `begin` on, for what is mostly over before a signal could come; setting a
    handler takes as long as some solves.
    """

    def __init__(self, *, later: bool = False) -> None:
        self.ours, self.later = False, later

    def __enter__(self) -> Watching:
        if not self.later:
            self._begin(sys._getframe(1))
        return self

    def begin(self) -> None:
        """Watch from now on."""
        if not self.ours:
            self._begin(sys._getframe(1))

    def _begin(self, root: FrameType) -> None:
        self.ours = _take(partial(_handle, root))

    def __exit__(self, *error: object) -> None:
        if self.ours:
            release()


def hold() -> bool:
    """Let Ctrl-C wait until `release`; False where it is nothing to us or already watched."""
    return _take(again)


def release() -> None:
    """Ctrl-C as Python has it."""
    _signal.signal(SIGINT, signal.default_int_handler)


def _take(handler: Callable[[int, FrameType | None], None]) -> bool:
    """Set a handler where a program leaves Ctrl-C to Python, in its main thread; else False."""
    if threading.get_ident() != threading.main_thread().ident:
        return False
    if _signal.getsignal(SIGINT) is not signal.default_int_handler:
        return False
    _signal.signal(SIGINT, handler)
    return True


def _handle(root: FrameType, number: int, frame: FrameType | None) -> None:
    if not is_busy(frame, root):
        raise KeyboardInterrupt
    again(number)


def again(number: int, frame: FrameType | None = None) -> None:
    """Send the signal once more in a moment."""
    timer = threading.Timer(AGAIN, signal.raise_signal, (number,))
    timer.daemon = True
    timer.start()


def is_busy(frame: FrameType | None, root: FrameType | None = None) -> bool:
    """True where an exception would do harm, see above; what has called `root` is no matter."""
    while frame is not None and frame is not root:
        name = frame.f_globals.get("__name__") or ""
        if name.partition(".")[0] in BUSY or frame.f_code.co_name == "__del__":
            return True
        frame = frame.f_back
    return False
