"""Checked access to the tables of a TOML file: every complaint names file, key and value."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

from ...core.arrays import LARGEST
from ...core.errors import Address, FileFormatError, InvalidInput, dotted, number_hint, shown
from ...core.words import nearest

LONGEST_TEXT = 500  # letters of a name or a title; expressions have a limit of their own


@dataclass(frozen=True)
class Table:
    """One table of a file; `where` is its dotted path, "" for the file itself."""

    file: str
    where: str
    data: dict[str, Any]

    def error(self, key: str, message: str) -> FileFormatError:
        """A complaint about one key, or about the table itself when key is ""."""
        path = ".".join(part for part in (self.where, key) if part)
        return FileFormatError(": ".join(part for part in (self.file, path, message) if part))

    @contextmanager
    def blamed(
        self, key: str = "", words: Callable[[Address], str] | None = None
    ) -> Iterator[None]:
        """Turn what the layers below refuse into a complaint about a key, and what is in it.

        words: the key in this table of an address, which then takes the place of `key`.
        """
        try:
            yield
        except InvalidInput as error:
            path = ".".join(part for part in (key, dotted(error.at)) if part)
            path = path if words is None else words(error.at) or key
            raise self.error(path, error.text) from error

    def only(self, *known: str) -> None:
        """Raise for the first key that is not known, naming the nearest."""
        for key in self.data:
            if key not in known:
                raise self.error(key, f"unknown key{nearest(key, known)}")

    def need(self, key: str, expected: str) -> Any:
        """The value of a key that must be there."""
        if key not in self.data:
            raise self.error(key, f"missing, expected {expected}")
        return self.data[key]

    def text(self, key: str, default: str | None = None) -> str:
        """A text, not empty."""
        value = self.need(key, "a text") if default is None else self.data.get(key, default)
        if isinstance(value, str) and len(value) > LONGEST_TEXT:
            raise self.error(
                key, f"expected a text of at most {LONGEST_TEXT} letters, got {len(value)}"
            )
        if not isinstance(value, str) or not (value.strip() or value == default):
            raise self.error(key, f"expected a text, got {shown(value)}")
        return value

    def texts(self, key: str) -> tuple[str, ...]:
        """Several texts, at least one, none of them empty."""
        value = self.need(key, "a list of texts")
        texts = isinstance(value, list) and all(isinstance(v, str) and v.strip() for v in value)
        if not texts or not value:
            raise self.error(key, f"expected a list of texts, got {shown(value)}")
        return tuple(value)

    def choice(self, key: str, known: Sequence[str], default: str | None = None) -> str:
        """One of several words."""
        value = self.text(key, default)
        if value not in known:
            raise self.error(key, f"unknown value '{value}'{nearest(value, known)}")
        return value

    def number(self, key: str, default: float | None = None) -> float:
        """A finite number."""
        value = self.need(key, "a number") if default is None else self.data.get(key, default)
        return self.as_number(key, value)

    def whole(self, key: str, default: int | None = None, *, minimum: int = 1) -> int | None:
        """A whole number >= minimum, or None where it may be missing."""
        value = self.data.get(key, default)
        if value is None:
            return None
        if not isinstance(value, int) or isinstance(value, bool) or value < minimum:
            raise self.error(key, f"expected a whole number >= {minimum}, got {shown(value)}")
        return value

    def as_number(self, key: str, value: Any) -> float:
        """A finite number, or a complaint about `key`."""
        if not isinstance(value, int | float) or isinstance(value, bool):
            hint = number_hint(value)
            raise self.error(key, f"expected a number, got {shown(value)}{hint}")
        try:
            number = float(value)
        except OverflowError:
            number = math.inf
        if not math.isfinite(number):
            raise self.error(key, f"expected a finite number, got {shown(value)}")
        if abs(number) > LARGEST:
            raise self.error(key, f"expected a number up to {LARGEST:g}, got {shown(value)}")
        return number

    def numbers(self, key: str, counts: Sequence[int]) -> list[float]:
        """A list of finite numbers of one of the given lengths."""
        wanted = f"{' or '.join(map(str, counts))} numbers"
        values = self.need(key, f"a list of {wanted}")
        if not isinstance(values, list) or len(values) not in counts:
            raise self.error(key, f"expected a list of {wanted}, got {shown(values)}")
        return [self.as_number(f"{key}[{k}]", value) for k, value in enumerate(values)]

    def table(self, key: str) -> Table:
        """A table within this one."""
        return self.as_table(key, self.need(key, "a table"))

    def as_table(self, key: str, value: Any, expected: str = "a table") -> Table:
        """A value that must be a table; `expected` says of what."""
        path = ".".join(part for part in (self.where, key) if part)
        if not isinstance(value, dict):
            raise self.error(key, f"expected {expected}, got {shown(value)}")
        return Table(self.file, path, value)

    def tables(self, key: str) -> list[Table]:
        """An array of tables, empty where the key is missing; written [[key]]."""
        values = self.data.get(key, [])
        if not isinstance(values, list):
            raise self.error(key, f"expected an array of tables, written [[{key}]]")
        return [self.as_table(f"{key}[{k}]", value) for k, value in enumerate(values)]
