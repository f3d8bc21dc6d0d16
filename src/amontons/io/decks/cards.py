"""Keyword decks, as CalculiX and Abaqus read them, cut into cards.

A card is a keyword line, "*SURFACE, NAME=S, TYPE=ELEMENT", which goes on while it ends in a
comma, and the data lines up to the next one.  Lines that begin with ** are remarks.  Capital
and small letters are the same, blanks in keywords do not count, and *INCLUDE puts in another
file, whose first lines may be data of the card before.  A file may be packed (.gz).
"""

from __future__ import annotations

import gzip
import hashlib
import itertools
import re
import warnings
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...core.errors import FileFormatError, shown
from ...core.files import check_is_regular

DEEPEST = 32  # files that include one another
LARGEST_FILE = 2**33  # bytes, unpacked
OPTION = re.compile(r'((?:[^,"]|"[^"]*")*)(?:,|$)')  # up to a comma outside of quotes
NUMERIC = re.compile(r"(^|,)[ \t]*[-+.]?\d[^=,\n]*(,|$)")  # a field that is a number
REMARK = re.compile(r"^[ \t]*\*\*.*\n?", re.MULTILINE)
NEWLINE, COMMA = b"\n,"
LONGEST = 80  # letters of a number with blanks
LARGEST = 2**53  # whole numbers below are told apart by 64 bits
PACKED = b"\x1f\x8b"


@dataclass(frozen=True)
class Piece:
    """Data lines as they stand in a file, the first of them with its number there."""

    file: Path
    start: int
    text: str

    @property
    def lines(self) -> list[str]:
        """The lines."""
        return self.text.split("\n")


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

    def table(self, width: int | None, kind: type = np.float64) -> NDArray[Any] | None:
        """Numbers (rows, width) of regular data lines, else None; for large tables.

        Regular: a row on each line, or on so many lines with as many numbers each as the ones
        before.  width None: lines of any length, (numbers, 1).  What is wrong with data is
        found line by line.  kind: of the numbers, float64 or int64.
        """
        text = "\n".join(piece.text for piece in self.pieces)
        if "*" in text:
            text = REMARK.sub("", text)
        text = text.strip()
        if not text or not text.isascii():
            return None
        if width is not None and not _is_even(text, width):
            return None
        text = text.replace(",\n", "\n").removesuffix(",").replace("\n", ",")
        found = _numbers(text, kind)
        if found is None and kind is np.float64:
            found = _numbers(text.upper().replace("D", "E"), kind)
        width = width or 1
        if found is None or len(found) % width:
            return None
        return found.reshape(-1, width)


def _is_even(text: str, width: int) -> bool:
    """Whether lines repeat the same numbers of fields, which make rows of `width`."""
    first: list[int] = []
    for line in text[: LONGEST * width].split("\n"):
        first.append(line.count(",") + (not line.endswith(",")))
        if sum(first) >= width:
            break
    if sum(first) != width:
        return False
    data = np.frombuffer(text.encode("ascii") + b"\n", dtype=np.uint8)
    ends = np.flatnonzero(data == NEWLINE)
    if len(ends) % len(first):
        return False
    before = np.searchsorted(np.flatnonzero(data == COMMA), ends)
    fields = np.diff(before, prepend=0) + (data[ends - 1] != COMMA)
    return bool((fields.reshape(-1, len(first)) == first).all())


def _numbers(text: str, kind: type) -> NDArray[Any] | None:
    """Numbers with commas between; None where anything else stands there."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        try:
            return np.fromstring(text, dtype=kind, sep=",")
        except (DeprecationWarning, ValueError):
            return None


def split(text: str) -> list[str]:
    """The fields of a line, commas in quotes are no separators."""
    if '"' not in text:
        return text.split(",")
    return [found.group(1) for found in OPTION.finditer(text)][:-1] or [text]


def number(text: str, row: Row, what: str) -> float:
    """A finite number as decks write it, 1.5D+3 too; an empty field is 0."""
    if not text:
        return 0.0
    if "_" in text or not text.isascii():  # Python reads 1_000 and digits of other scripts
        raise row.error(f"{what}: expected a number, got {shown(text)}")
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
    if abs(value) >= LARGEST:
        raise row.error(f"{what}: expected a number below 2^53, got {shown(text)}")
    return int(value)


def is_whole(text: str) -> bool:
    """True for the digits of a number >= 0 that is told apart from others."""
    return text.isascii() and text.isdigit() and int(text) < LARGEST


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
    text = _text(path, place)
    starts = [0, *_keywords(text), len(text)]
    _append(cards, path, 1, text[: starts[1]])
    number, last = 1, 0
    for begin, end in itertools.pairwise(starts[1:]):
        number += text.count("\n", last, begin)
        last = begin
        line, used = _joined(text, begin, end)
        card = _card(line, path, number)
        if card.keyword == "INCLUDE":
            _include(card, path, cards, (*within, resolved))
        else:
            cards.append(card)
        if used < end:
            after = number + text.count("\n", begin, used)
            _append(cards, path, after, text[used:end].removesuffix("\n"))


def _keywords(text: str) -> list[int]:
    """Where the lines with keywords begin."""
    found, at = [], text.find("*")
    while at >= 0:
        begin = text.rfind("\n", 0, at) + 1
        end = text.find("\n", at)
        if not text[begin:at].strip() and text[at + 1 : at + 2] != "*":
            found.append(begin)
        at = text.find("*", end) if end >= 0 else -1
    return found


def _joined(text: str, begin: int, stop: int) -> tuple[str, int]:
    """A keyword line with those up to `stop` that continue it, and where data begin."""
    end = text.find("\n", begin, stop)
    end = stop if end < 0 else end
    line = text[begin:end].strip()
    while line.endswith(",") and end < stop:
        after = text.find("\n", end + 1, stop)
        after = stop if after < 0 else after
        more = text[end + 1 : after].strip()
        if NUMERIC.search(more) and not more.startswith("**"):
            break  # no option is a number alone: the comma ends the line, as some write it
        end = after
        if not more.startswith("**"):
            line += more
            if not more:
                break
    return line.rstrip(","), min(end + 1, stop)


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


def _append(cards: list[Card], path: Path, start: int, text: str) -> None:
    """Give data lines to the last card."""
    if cards:
        if text:
            cards[-1].pieces.append(Piece(path, start, text))
        return
    for k, line in enumerate(text.split("\n")):
        if line.strip() and not line.lstrip().startswith("**"):
            raise FileFormatError(
                f"{path}:{start + k}: expected a keyword (*NODE, *HEADING, ...), got "
                f"{shown(line.strip())}"
            )


def _text(path: Path, place: str) -> str:
    """What is in a file, packed or not, lines ending as in Python."""
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
    text = text.removeprefix("\ufeff")
    return text if "\r" not in text else text.replace("\r\n", "\n").replace("\r", "\n")


def digest_of(cards: Sequence[Card]) -> str:
    """A hash of all cards but those of the mesh, which has its own."""
    whole = hashlib.sha256()
    for card in cards:
        whole.update(repr((card.keyword, sorted(card.options.items()))).encode())
        if card.keyword not in ("NODE", "ELEMENT"):
            for piece in card.pieces:
                whole.update(piece.text.encode())
    return whole.hexdigest()
