"""Standard streams that are closed, full, or read by nobody: work goes on, the end tells."""

from __future__ import annotations

import errno
import io
import os
import sys
from typing import Any


class Unfailing(io.RawIOBase):
    """Writes into a file descriptor as long as that goes; `reason` is why it no longer does."""

    def __init__(self, number: int) -> None:
        super().__init__()
        self.file = io.FileIO(number, "w", closefd=False)
        self.reason: OSError | None = None

    def writable(self) -> bool:
        """Always."""
        return True

    def fileno(self) -> int:
        """The descriptor."""
        return self.file.fileno()

    def isatty(self) -> bool:
        """True for a terminal."""
        return self.file.isatty()

    def write(self, data: Any) -> int:
        """The number of bytes written, or let go."""
        try:
            if self.reason is None:
                return self.file.write(data)
        except OSError as reason:
            self.reason = reason
        return len(data)


def open_missing() -> None:
    """Let closed streams lead nowhere, and make printing unable to fail.

    A closed one would else be the next file that is opened.  Letters that the encoding does not
    have are replaced.
    """
    for number, name, mode in ((0, "stdin", "r"), (1, "stdout", "w"), (2, "stderr", "w")):
        try:
            os.fstat(number)
        except OSError:
            os.open(os.devnull, os.O_RDWR)  # takes the smallest number, which is this one
        stream = getattr(sys, name)
        if stream is None:
            setattr(sys, name, open(os.devnull, mode, encoding="utf-8"))
        elif number and stream is getattr(sys, f"__{name}__"):
            setattr(sys, name, _unfailing(stream))


def _unfailing(stream: Any) -> io.TextIOWrapper:
    raw = Unfailing(stream.fileno())
    return io.TextIOWrapper(
        io.BufferedWriter(raw), encoding=stream.encoding, errors="replace",
        line_buffering=stream.line_buffering or raw.isatty(),
    )  # fmt: skip


def printed() -> str | None:
    """Why not all that was printed has been written; None too where the reader has left."""
    sys.stdout.flush()
    raw = getattr(getattr(sys.stdout, "buffer", None), "raw", None)
    reason = raw.reason if isinstance(raw, Unfailing) else None
    if reason is None or reason.errno == errno.EPIPE:  # such as `| head`: it has seen enough
        return None
    return reason.strerror or str(reason)
