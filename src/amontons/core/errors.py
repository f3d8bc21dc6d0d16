"""Exceptions that a user meets; each message names what was expected and what was found."""

from __future__ import annotations

from typing import Any

LONGEST = 1000  # letters of a message; what a user gave may be longer than any screen
LONGEST_VALUE = 120  # letters of one value in it


class AmontonsError(Exception):
    """Root of all errors raised on purpose by amontons; a message has an end, always."""

    def __init__(self, message: object = "") -> None:
        super().__init__(clipped(str(message), LONGEST))


def clipped(text: str, longest: int) -> str:
    """The text, or its beginning and end with the number of letters left out between them."""
    if len(text) <= longest:
        return text
    tail = longest // 4
    head = longest - tail - 40
    return f"{text[:head]} … ({len(text) - head - tail} letters) … {text[len(text) - tail :]}"


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
