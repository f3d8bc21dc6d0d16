"""What a result says of itself beside its numbers: warnings with a name."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any


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
