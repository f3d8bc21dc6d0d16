"""Keyword decks, as CalculiX and Abaqus read them, cut into cards.

A card is a keyword line, "*SURFACE, NAME=S, TYPE=ELEMENT", which goes on while it ends in a
comma, and the data lines up to the next one.  Lines that begin with ** are remarks.  Capital
and small letters are the same, blanks in keywords do not count, and *INCLUDE puts in another
file, whose first lines may be data of the card before.  A file may be packed (.gz).
"""

from __future__ import annotations

import gzip
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ...core.errors import FileFormatError, shown
from ...core.files import check_is_regular

DEEPEST = 32  # files that include one another
LARGEST_FILE = 2**33  # bytes, unpacked
OPTION = re.compile(r'((?:[^,"]|"[^"]*")*)(?:,|$)')  # up to a comma outside of quotes
GAP = re.compile(r",[ \t]*,")  # a field that is left out
PACKED = b"\x1f\x8b"


@dataclass(frozen=True, slots=True)
class Piece:
    """Data lines as they stand in a file, the first of them with its number there."""

    file: Path
    start: int
    lines: Sequence[str]


@dataclass(frozen=True)
class Row:
    """One data line in fields, without blanks around them, and where it stands."""

    file: Path
    number: int
    fields: list[str]

    def error(self, text: str) -> FileFormatError:
        """What is wrong with this line."""
        return FileFormatError(f"{self.file}:{self.number}: {text}")


@dataclass(frozen=True)
class Card:
    """A keyword with its options and data.

    keyword: in capitals without blanks, as SURFACEINTERACTION; options: name in capitals ->
    value as written, "" for a word alone.
    """

    keyword: str
    options: dict[str, str]
    file: Path
    number: int
    written: str
    pieces: list[Piece] = field(default_factory=list)

    def __str__(self) -> str:
        return f"*{self.written}"

    def error(self, text: str) -> FileFormatError:
        """What is wrong with this card."""
        return FileFormatError(f"{self.file}:{self.number}: {self}: {text}")

    def name(self, option: str) -> str:
        """A name that an option gives, in capitals; FileFormatError if it is not there."""
        value = self.label(option)
        if value is None:
            raise self.error(f"{option}: missing, expected a name")
        return value

    def label(self, option: str) -> str | None:
        """A name that an option may give, in capitals, None without one."""
        value = self.options.get(option)
        return None if not value else value.upper()

    def rows(self) -> Iterator[Row]:
        """The data lines in fields; remarks and empty lines are left out."""
        for piece in self.pieces:
            for k, line in enumerate(piece.lines):
                text = line.strip()
                if text and not text.startswith("**"):
                    fields = [part.strip() for part in split(text)]
                    if len(fields) > 1 and not fields[-1]:
                        del fields[-1]  # a comma at the end
                    yield Row(piece.file, piece.start + k, fields)

    def table(self, width: int | None) -> NDArray[np.float64] | None:
        """Numbers (rows, width) if every line has so many numbers, else None; for large tables.

        width None: lines of any length, (numbers, 1).  What is wrong with data is found line
        by line.
        """
        lines = [line for piece in self.pieces for line in piece.lines]
        lines = [text for line in lines if (text := line.strip()) and text[:2] != "**"]
        text = "\n".join(lines)
        if GAP.search(text):
            return None
        if width is not None and any(
            line.count(",") - line.endswith(",") != width - 1 for line in lines
        ):
            return None
        words = text.replace(",", " ").split()
        width = width or 1
        if not words or len(words) != width * (len(words) // width):
            return None
        try:
            numbers = np.array(words, dtype=np.float64)
        except ValueError:
            return None
        return numbers.reshape(-1, width)


def split(text: str) -> list[str]:
    """The fields of a line, commas in quotes are no separators."""
    if '"' not in text:
        return text.split(",")
    return [found.group(1) for found in OPTION.finditer(text)][:-1] or [text]


def number(text: str, row: Row, what: str) -> float:
    """A finite number as decks write it, 1.5D+3 too; an empty field is 0."""
    if not text:
        return 0.0
    try:
        value = float(text)
    except ValueError:
        try:
            value = float(text.upper().replace("D", "E"))
        except ValueError:
            raise row.error(f"{what}: expected a number, got {shown(text)}") from None
    if not np.isfinite(value):
        raise row.error(f"{what}: expected a finite number, got {shown(text)}")
    return value


def whole(text: str, row: Row, what: str) -> int:
    """A whole number, 12. too."""
    value = number(text, row, what)
    if not text or value != int(value):
        raise row.error(f"{what}: expected a whole number, got {shown(text)}")
    return int(value)


def read_cards(path: Path) -> list[Card]:
    """The cards of a deck and of all that it includes.

    Raises FileFormatError that names file and line for files that are not there, include
    themselves, or hold something before the first keyword.
    """
    cards: list[Card] = []
    _read(path, cards, (), "")
    if not cards:
        raise FileFormatError(f"{path}: expected a deck of keywords (*NODE, ...), found none")
    return cards


def _read(path: Path, cards: list[Card], within: tuple[Path, ...], place: str) -> None:
    resolved = path.resolve()
    if resolved in within:
        raise FileFormatError(f"{place}: {path} includes itself")
    if len(within) >= DEEPEST:
        raise FileFormatError(f"{place}: more than {DEEPEST} files include one another")
    lines = _lines(path, place)
    starts = [k for k, line in enumerate(lines) if _is_keyword(line)]
    first = starts[0] if starts else len(lines)
    _append(cards, path, 0, lines[:first])
    k = 0
    while k < len(starts):
        at = starts[k]
        text, used = _joined(lines, at)
        card = _card(text, path, at + 1)
        while k + 1 < len(starts) and starts[k + 1] < at + used:
            k += 1
        end = starts[k + 1] if k + 1 < len(starts) else len(lines)
        if card.keyword == "INCLUDE":
            _include(card, path, cards, (*within, resolved))
        else:
            cards.append(card)
        _append(cards, path, at + used, lines[at + used : end])
        k += 1


def _is_keyword(line: str) -> bool:
    text = line.lstrip()
    return text.startswith("*") and not text.startswith("**")


def _joined(lines: Sequence[str], at: int) -> tuple[str, int]:
    """A keyword line with those that continue it, and how many they are."""
    text, used = lines[at].strip(), 1
    while text.endswith(",") and at + used < len(lines):
        more = lines[at + used].strip()
        if _is_keyword(more):
            break
        used += 1
        if not more.startswith("**"):
            text += more
            if not more:
                break
    return text.rstrip(","), used


def _card(text: str, path: Path, at: int) -> Card:
    first, *rest = split(text[1:])
    written = " ".join(first.split()).upper()
    keyword = written.replace(" ", "")
    if not keyword:
        raise FileFormatError(f"{path}:{at}: expected a keyword after *, got {shown(text)}")
    options: dict[str, str] = {}
    for part in rest:
        name, _, value = part.partition("=")
        key = " ".join(name.split()).upper().replace(" ", "")
        if key:
            options[key] = " ".join(value.split()).strip('"').strip()
    return Card(keyword, options, path, at, written)


def _include(card: Card, path: Path, cards: list[Card], within: tuple[Path, ...]) -> None:
    name = card.options.get("INPUT")
    if not name:
        raise card.error("INPUT: missing, expected the name of a file")
    _read(path.parent / name, cards, within, f"{path}:{card.number}: {card}")


def _append(cards: list[Card], path: Path, start: int, lines: Sequence[str]) -> None:
    """Give data lines to the last card."""
    if cards:
        cards[-1].pieces.append(Piece(path, start + 1, lines))
        return
    for k, line in enumerate(lines):
        if line.strip() and not line.lstrip().startswith("**"):
            raise FileFormatError(
                f"{path}:{start + k + 1}: expected a keyword (*NODE, *HEADING, ...), got "
                f"{shown(line.strip())}"
            )


def _lines(path: Path, place: str) -> list[str]:
    """The lines of a file, packed or not."""
    before = f"{place}: " if place else ""
    if not path.exists():
        raise FileFormatError(f"{before}{path}: no such file")
    check_is_regular(path)
    try:
        with path.open("rb") as file:
            packed = file.read(2) == PACKED
        with gzip.open(path) if packed else path.open("rb") as file:
            data = file.read(LARGEST_FILE + 1)
    except (OSError, EOFError, gzip.BadGzipFile) as reason:
        raise FileFormatError(f"{before}{path}: can not be read: {reason}") from None
    if len(data) > LARGEST_FILE:
        raise FileFormatError(f"{before}{path}: more than {LARGEST_FILE} bytes")
    try:
        text = data.decode("utf-8")
    except UnicodeDecodeError:
        text = data.decode("latin-1")  # remarks and names of old programs
    if "\0" in text:
        raise FileFormatError(f"{before}{path}: expected text, this is a binary file")
    return text.removeprefix("\ufeff").replace("\r\n", "\n").replace("\r", "\n").split("\n")
