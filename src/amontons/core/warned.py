"""What a result says of itself beside its numbers: warnings with a name."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Protocol


@dataclass(frozen=True)
class ResultWarning:
    """A reason to doubt a result that has converged.

    name: in words with hyphens, the same in every version, such as "sliding-beyond-pairs".
    message: one sentence with the measured number, and what to ask for instead.  contacts:
    those that it is about, in the order of the result; empty when it is about all or none.
    """

    name: str
    message: str
    contacts: tuple[int, ...] = ()

    def __str__(self) -> str:
        return f"warning: {self.message} [{self.name}]"

    @property
    def record(self) -> dict[str, Any]:
        """For JSON: name, message, contacts."""
        return {"name": self.name, "message": self.message, "contacts": list(self.contacts)}


class DoubtWarning(UserWarning):
    """The category under which `warn_of` issues the warnings of a result."""


class _Doubted(Protocol):
    @property
    def warnings(self) -> Sequence[ResultWarning]: ...


def warn_of(result: _Doubted) -> None:
    """Issue the warnings of a result as warnings of Python, of category `DoubtWarning`.

    Nothing does so by itself: a warning is part of its result, and whether it matters is for
    the caller to say.  With `warnings.simplefilter("error", am.DoubtWarning)` the first raises.
    """
    for doubt in result.warnings:
        warnings.warn(f"{doubt.message} [{doubt.name}]", DoubtWarning, stacklevel=2)
