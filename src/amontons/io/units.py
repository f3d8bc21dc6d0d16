"""What the user calls the units: numbers are taken as they are, whatever they measure in."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ..core.errors import InvalidInput, shown

UNIT_NAMES = ("length", "force", "time")
PLAIN = {("mm", "N"): "MPa", ("m", "N"): "Pa", ("m", "kN"): "kPa", ("m", "MN"): "MPa"}


@dataclass(frozen=True)
class Units:
    """What the user calls the units; empty where nobody has said."""

    length: str = ""
    force: str = ""
    time: str = ""

    @classmethod
    def of(cls, given: object) -> Units:
        """Those of a text "mm,N,s", of a sequence, or of a dict by name, also in part.

        Raises InvalidInput for anything else.
        """
        if given is None or isinstance(given, Units):
            return given or cls()
        if isinstance(given, str):
            given = [word.strip() for word in given.split(",")]
        if isinstance(given, dict):
            wrong = [key for key in given if key not in UNIT_NAMES]
            values = list(given.values())
            pairs = {} if wrong else given
        else:
            values = list(given) if isinstance(given, Sequence) else [given]
            wrong = values[len(UNIT_NAMES) :]
            pairs = dict(zip(UNIT_NAMES, values, strict=False))
        if wrong or not all(isinstance(value, str) for value in values):
            raise InvalidInput(
                "units: expected up to three names, length, force, time, such as 'mm,N,s' or "
                f"{{'length': 'mm', 'force': 'N'}}, got {shown(given)}"
            )
        return cls(**{str(key): str(value) for key, value in pairs.items()})

    @property
    def stress(self) -> str:
        """Of force per area."""
        if not (self.length and self.force):
            return ""
        return PLAIN.get((self.length, self.force), f"{self.force}/{self.length}²")

    @property
    def named(self) -> dict[str, str]:
        """By the names that the page uses."""
        return {"length": self.length, "force": self.force, "time": self.time,
                "stress": self.stress}  # fmt: skip
