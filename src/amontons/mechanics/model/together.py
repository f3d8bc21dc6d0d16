"""Errors on several processes of MPI: raised on all of them, or all of them end."""

from __future__ import annotations

import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, TypeVar

from ...core.errors import AmontonsError

T = TypeVar("T")


class OnAll(Exception):
    """An error that all processes know of, though it happened on one."""

    def __init__(self, reason: Exception) -> None:
        self.reason = reason
        super().__init__(str(reason))


@contextmanager
def ended_together(comm: Any) -> Iterator[None]:
    """End all processes when this one alone fails, as the others would wait for it for ever."""
    try:
        yield
    except OnAll as known:
        raise known.reason from None
    except AmontonsError:  # of sums that all have alike
        raise
    except BaseException:
        if comm.size > 1:
            traceback.print_exc()
            comm.Abort(1)
        raise


def together(comm: Any, work: Callable[[], T]) -> T:
    """What `work` returns here; raises OnAll where it fails on any process, on all of them."""
    error, out = None, None
    try:
        out = work()
    except Exception as reason:
        error = reason
    errors = [e for e in comm.allgather(error) if e is not None]
    if errors:
        raise OnAll(errors[0])
    return out  # type: ignore[return-value]  # work has returned it
