"""What was freed goes back to the system.

The C library keeps freed blocks for later ones, also when much was freed once and for all: what
a whole mesh has needed on the process that cut it, blocks of a matrix that PETSc holds by now.
"""

from __future__ import annotations

import ctypes
import sys


def trim() -> None:
    """Let the C library return the pages that nothing lives on; nothing where it can not."""
    if sys.platform == "linux":
        release = getattr(ctypes.CDLL(None), "malloc_trim", None)  # glibc alone has it
        if release is not None:
            release(ctypes.c_size_t(0))
