"""Who is told when a kernel begins to compile; known without importing the compiler."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

told: list[Callable[[], None]] = []


@contextmanager
def telling(tell: Callable[[], None]) -> Iterator[None]:
    """Within the block, call this when compiling begins, not when a kernel is only loaded."""
    told.append(tell)
    try:
        yield
    finally:
        told.remove(tell)
