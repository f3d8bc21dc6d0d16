"""Exceptions that a user meets; each message names what was expected and what was found.

An error may carry the address of its culprit, ("contacts", 0, "mu"), which a reader of files
turns into the words of its format.  Nothing is ever decided by the words of a message.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

Address = tuple[str | int, ...]

LONGEST = 1000  # letters of a message; what a user gave may be longer than any screen
LONGEST_VALUE = 120  # letters of one value in it


class AmontonsError(Exception):
    """Root of all errors raised on purpose by amontons; a message has an end, always.

    at: the address of what is wrong, () where nobody knows.  name: what messages call it in
    front of the text, by default the address in words; "" where the text itself says it.
    text: the message without that name, for who names the place in other words.
    """

    def __init__(self, text: object = "", at: Address = (), name: str | None = None) -> None:
        before = dotted(at) if name is None else name
        super().__init__(clipped(f"{before}: {text}" if before else str(text), LONGEST))
        self.text = clipped(str(text), LONGEST)
        self.at = at


def dotted(at: Address) -> str:
    """An address in words: ("contacts", 0, "mu") is contacts[0].mu."""
    words = (f"[{part}]" if isinstance(part, int) else f".{part}" for part in at)
    return "".join(words).removeprefix(".")


@contextmanager
def within(*place: str | int) -> Iterator[None]:
    """Put a place before the address of errors that leave the block; () adds nothing."""
    try:
        yield
    except AmontonsError as error:
        error.at = (*place, *error.at)
        raise


def clipped(text: str, longest: int) -> str:
    """The text, or its beginning and end with the number of letters left out between them."""
    if len(text) <= longest:
        return text
    tail = longest // 4
    head = longest - tail - 40
    return f"{text[:head]} … ({len(text) - head - tail} letters) … {text[len(text) - tail :]}"


def number_hint(value: object) -> str:
    """The end of a message about a text in the place of a number: what to write instead."""
    text = value.strip() if isinstance(value, str) else ""
    match = re.match(r"([-+]?\d+(?:[.,]\d*)?(?:[eE][-+]?\d+)?)\s*(.*)$", text)
    if not match:
        return ""
    digits, rest = match[1].replace(",", "."), match[2]
    if rest == "%":
        return f"; write {float(digits) / 100:g} for {text}"
    if rest:
        return "; write a number without quotes, units by choice: N, m, Pa or N, mm, MPa"
    return f"; write {digits}" + (", with a point" if "," in text else ", without quotes")


def shown(value: object) -> str:
    """A value as messages show it: as Python writes it, with an end."""
    try:
        return clipped(repr(value), LONGEST_VALUE)
    except (ValueError, RecursionError):  # thousands of digits, lists in lists in lists
        return f"a value of type {type(value).__name__} that is too long to be shown"


class InvalidInput(AmontonsError, ValueError):
    """An argument has the wrong shape, sign or value: "argument: expected …, got …"."""


class NotWritten(InvalidInput):
    """A file or folder can not be written: names it and says why, such as a full disk."""


class UnsupportedForm(AmontonsError, TypeError):
    """The solver needs the other form of the problem; the message names those that fit."""


class UnsupportedLaw(UnsupportedForm):
    """A solver or a question is not made for the friction law; the message says for which."""


class SingularOperator(AmontonsError, ArithmeticError):
    """The stiffness can not be inverted: the message says which body or block is not held."""


class InvertedCells(AmontonsError, ArithmeticError):
    """A deformation turns cells inside out: no stress is defined; take smaller steps."""


class TimeUp(AmontonsError, RuntimeError):
    """The time limit has passed before there was anything to return."""


class FileFormatError(AmontonsError, ValueError):
    """A file does not hold what its format asks for: names file, place and expectation."""


class MissingDependency(AmontonsError, ImportError):
    """An optional package is not installed: names the extra that installs it."""


class NotConverged(AmontonsError, RuntimeError):
    """The solve missed its tolerance; `.solution` holds the best iterate and the record."""

    def __init__(self, message: str, solution: Any) -> None:
        super().__init__(message)
        self.solution = solution

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (str(self), self.solution)


class Interrupted(NotConverged, KeyboardInterrupt):
    """Ctrl-C during a solve; `.solution` holds the best iterate so far."""
