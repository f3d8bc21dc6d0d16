"""What is prepared once for all that share it, such as a factor for all loads of a body.

What was made stands under the function that made it, so that its type is known, together with
the objects it was made of.  Threads wait for what another one is making.
"""

from __future__ import annotations

from collections.abc import Callable
from operator import is_
from threading import RLock
from typing import Any, ParamSpec, TypeVar

T = TypeVar("T")
P = ParamSpec("P")


class Prepared:
    """What functions have made of some objects; a copy sent to another process starts empty."""

    def __init__(self) -> None:
        self._made: dict[Callable[..., Any], tuple[tuple, Any]] = {}
        self._lock = RLock()

    def __reduce__(self) -> tuple:
        return Prepared, ()

    def copied(self) -> Prepared:
        """What is there now, for who goes on with other sources."""
        other = Prepared()
        with self._lock:
            other._made = dict(self._made)
        return other

    def once(
        self, make: Callable[P, T], sources: tuple, *arguments: P.args, **named: P.kwargs
    ) -> T:
        """make(*arguments), made once for all that share this and hold the same sources.

        make: a function of a module or class, which depends on nothing beside the sources.
        """
        entry = self._made.get(make)
        if entry is not None and all(map(is_, entry[0], sources)):
            return entry[1]  # without the lock: entries are replaced, never changed
        with self._lock:
            entry = self._made.get(make)
            if entry is None or not all(map(is_, entry[0], sources)):
                entry = self._made[make] = (sources, make(*arguments, **named))
            return entry[1]

    def put(self, make: Callable[..., T], sources: tuple, value: T) -> None:
        """Let `once` give a value that is there already."""
        with self._lock:
            self._made[make] = (sources, value)
