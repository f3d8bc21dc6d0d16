"""Arrays that nobody can write to stay so in copies and in other processes.

NumPy gives back every array of a pickle open for writing.  What holds arrays that are shared,
prepared from, or known to compiled functions as read-only (which are compiled for either kind)
is a `KeepsLocks`: its pickle says which of them were locked.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from scipy import sparse

STORED = ("data", "indices", "indptr")


class KeepsLocks:
    """Its arrays, also those in tuples, lists, dicts and sparse matrices, keep their locks."""

    __slots__ = ()

    def __getstate__(self) -> tuple[dict[str, Any], list[tuple]]:
        held = vars(self)
        found = [(key, *path) for key, value in held.items() for path in _locked_in(value)]
        return held, found

    def __setstate__(self, state: tuple[dict[str, Any], list[tuple]]) -> None:
        held, found = state
        vars(self).update(held)
        for path in found:
            value: Any = held
            for step in path:
                value = getattr(value, step[0]) if isinstance(step, tuple) else value[step]
            value.flags.writeable = False


def _locked_in(value: object) -> Iterator[tuple]:
    """Paths to the locked arrays of a value: keys, and names of attributes in tuples."""
    if isinstance(value, np.ndarray):
        if not value.flags.writeable:
            yield ()
    elif isinstance(value, dict):
        for key, part in value.items():
            yield from ((key, *path) for path in _locked_in(part))
    elif isinstance(value, (tuple, list)):
        for k, part in enumerate(value):
            yield from ((k, *path) for path in _locked_in(part))
    elif sparse.issparse(value):
        for name in STORED:
            part = getattr(value, name, None)
            if part is not None:
                yield from (((name,), *path) for path in _locked_in(part))
