"""Lines of a deck that is written: numbers, names and lists that both programs read whole."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence

WIDEST = 20  # letters of a number that CalculiX reads
PER_LINE = 8  # numbers of a list on one line, 16 are allowed
LONGEST = 60  # letters of a name, 80 are allowed


def value(number: float) -> str:
    """A number, to 14 digits where all of them would be cut off by the reader."""
    text = repr(float(number))
    return text if len(text) <= WIDEST else f"{number:.13e}"


def values(numbers: Iterable[float]) -> str:
    """Numbers with commas between."""
    return ", ".join(map(value, numbers))


def listed(numbers: Sequence[int]) -> list[str]:
    """Whole numbers, so many on a line; lines but the last end in a comma."""
    rows = [numbers[k : k + PER_LINE] for k in range(0, len(numbers), PER_LINE)]
    texts = [", ".join(map(str, row)) for row in rows]
    return [f"{text}," for text in texts[:-1]] + texts[-1:]


class Names:
    """Names of a deck: capital letters, digits and _, all different, one for each key."""

    def __init__(self) -> None:
        self._of: dict[object, str] = {}

    def __call__(self, key: object, wanted: str) -> str:
        """The name of a key, made from `wanted` when it is first asked for."""
        if key in self._of:
            return self._of[key]
        plain = re.sub(r"[^A-Z0-9]+", "_", wanted.upper()).strip("_")[:LONGEST]
        plain = plain if plain[:1].isalpha() else f"N_{plain}"
        name, k = plain, 2
        while name in self._of.values():
            name, k = f"{plain}_{k}", k + 1
        self._of[key] = name
        return name
