"""Results of CalculiX, `.frd` as text: nodes, and values at them for every time that is there.

Numbers stand in columns and may touch each other: -1, a node in 10 columns, values in 12 each
with six digits.  A file may end early, hold several steps, and blocks that nobody asked for.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import cached_property, partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ...core.errors import FileFormatError
from ...core.files import check_is_regular

Array = NDArray[np.float64]
Index = NDArray[np.int64]
HEAD, WIDTH = 13, 12  # columns before the values of a node, and of each value
SHORT = 8  # columns before the values where nodes have five digits
DIGITS = 6
MOST = 6  # values in one line
MODEL, NODES, ELEMENTS = "    1C", "    2C", "    3C"
RESULT, NAME = "  100C", " -4"
PROGRAM, CALCULIX = "    1UPGM", "CalculiX"
BINARY = ("2", "3")
NO_LABELS = np.zeros(0, dtype=np.int64)


@dataclass(frozen=True, eq=False)
class Block:
    """Values of one name at one time: labels (n,), values (n, components)."""

    name: str
    time: float
    step: int
    labels: Index
    values: Array


@dataclass(eq=False)
class Results:
    """Nodes with points (n, 3), blocks in their order, nodes of elements, who wrote it."""

    path: Path
    labels: Index
    points: Array
    blocks: list[Block] = field(default_factory=list)
    program: str = ""
    of_elements: Callable[[], dict[int, list[int]]] = dict

    @cached_property
    def elements(self) -> dict[int, list[int]]:
        """Nodes of every element by its number, read when they are asked for."""
        return self.of_elements()

    def named(self, name: str) -> list[Block]:
        """All blocks of a name; raises FileFormatError that tells what there is without one."""
        found = [block for block in self.blocks if block.name == name]
        if not found:
            names = dict.fromkeys(block.name for block in self.blocks)
            known = ", ".join(names) or "no results"
            raise FileFormatError(
                f"{self.path}: holds no displacements (block {name}), but {known}; ask for "
                "them in the deck: *NODE FILE with U"
            )
        return found


def read_frd(path: Path, only: str | None = None) -> Results:
    """Read a file; raises FileFormatError with the line of what can not be read.

    only: the name of blocks that are read, by default all; others are there without values.
    """
    lines = _lines(path)
    if not any(line.startswith(MODEL) for line in lines[:3]):
        raise FileFormatError(
            f"{path}: expected results of CalculiX (.frd), whose first line begins with 1C"
        )
    found: Results | None = None
    at, time, step, program = 0, 0.0, 0, ""
    blocks: list[Block] = []
    while at < len(lines):
        line = lines[at]
        if line.startswith(NODES):
            _check_text(path, at, line)
            at, labels, points = _table(path, lines, at + 1, 3)
            found = Results(path, labels, points, blocks, program=program)
        elif line.startswith(ELEMENTS) and found is not None:
            found.of_elements = partial(_elements, path, lines, at + 1)
            at = _end(lines, at) + 1
        elif line.startswith(PROGRAM):
            program, at = line[len(PROGRAM) :].strip(), at + 1
        elif line.startswith("    1PSTEP"):
            step, at = _whole(line[48:60]), at + 1
        elif line.startswith(RESULT):
            _check_text(path, at, line)
            time, at = _number(path, at, line[12:24]), at + 1
        elif line.startswith(NAME):
            name, count = line[5:13].strip(), max(_whole(line[13:18]), 1)
            start, used = _components(lines, at + 1)
            if only in (None, name):
                at, labels, values = _table(path, lines, start, min(count, used))
            else:
                at, labels, values = _end(lines, start) + 1, NO_LABELS, np.zeros((0, count))
            blocks.append(Block(name, time, step, labels, values))
        else:
            at += 1
    if found is None or not len(found.labels):
        raise FileFormatError(
            f"{path}: holds no nodes; a run that stops at once leaves such a file"
        )
    return found


def _lines(path: Path) -> list[str]:
    check_is_regular(path)
    try:
        return path.read_text(encoding="latin-1").splitlines()
    except OSError as reason:
        raise FileFormatError(f"{path}: can not be read: {reason.strerror}") from None


def _check_text(path: Path, at: int, line: str) -> None:
    if line.rstrip()[-1:] in BINARY and len(line.rstrip()) > 70:
        raise FileFormatError(
            f"{path}: line {at + 1}: a binary file; write it as text (no OUTPUT=BINARY)"
        )


def _components(lines: list[str], at: int) -> tuple[int, int]:
    """Where the values begin, and how many components are printed, not made of others."""
    used = 0
    while at < len(lines) and lines[at].startswith(" -5"):
        made = lines[at][33:38].strip()
        used += made != "1"
        at += 1
    return at, max(used, 1)


def _end(lines: list[str], at: int) -> int:
    """The next line -3, or the end of the file."""
    try:
        return lines.index(" -3", at)
    except ValueError:
        rest = (k for k in range(at, len(lines)) if lines[k].startswith(" -3"))
        return next(rest, len(lines))


def _elements(path: Path, lines: list[str], at: int) -> dict[int, list[int]]:
    """The nodes of every element, by its number."""
    found: dict[int, list[int]] = {}
    label = 0
    for number in range(at, _end(lines, at)):
        line = lines[number]
        try:
            if line.startswith(" -1"):
                label = int(line[3:13])
                found[label] = []
            else:
                ends = range(3, len(line.rstrip()), 10)
                found[label] += [int(line[k : k + 10]) for k in ends]
        except (ValueError, KeyError):
            raise FileFormatError(
                f"{path}: line {number + 1}: expected an element or its nodes, got "
                f"{line[:40]!r}"
            ) from None
    return found


def _table(path: Path, lines: list[str], at: int, width: int) -> tuple[int, Index, Array]:
    """Rows up to -3: the line after it, labels (n,), values (n, width)."""
    end = _end(lines, at)
    rows = lines[at:end]
    marks = {row[:3] for row in rows}
    if marks - {" -1", " -2"}:
        bad = next(k for k, row in enumerate(rows) if row[:3] not in (" -1", " -2"))
        raise FileFormatError(
            f"{path}: line {at + bad + 1}: expected a node (-1) or the end (-3), got "
            f"{rows[bad][:30]!r}; is the file cut off?"
        )
    if end == len(lines):
        raise FileFormatError(f"{path}: ends within a table that begins at line {at + 1}")
    if " -2" in marks:
        rows = list(_joined(rows))
    labels, values = _columns(path, at, rows, width)
    return end + 1, labels, values


def _joined(rows: list[str]) -> Iterator[str]:
    """Rows with those that go on (-2) appended."""
    whole = ""
    for row in rows:
        if row.startswith(" -1"):
            if whole:
                yield whole
            whole = row.ljust(HEAD + MOST * WIDTH)
        else:
            whole += row[HEAD:]
    if whole:
        yield whole


def _characters(rows: list[str], size: int) -> NDArray[np.bytes_]:
    """The first characters of all rows, (n, size)."""
    lengths = set(map(len, rows))
    if len(lengths) == 1 and min(lengths) >= size:  # as programs write them: no copy of each
        flat = np.frombuffer("".join(rows).encode("latin-1"), dtype="S1")
        return flat.reshape(len(rows), -1)[:, :size]
    text = np.array([row[:size].ljust(size) for row in rows], dtype=f"S{size}")
    return text.view("S1").reshape(len(rows), size)


def _columns(path: Path, at: int, rows: list[str], width: int) -> tuple[Index, Array]:
    """Labels and values by their columns."""
    head = SHORT if rows and len(rows[0].rstrip()) <= SHORT + width * WIDTH else HEAD
    if not rows:
        return NO_LABELS, np.zeros((0, width))
    size = head + width * WIDTH
    cut = _characters(rows, size)
    try:
        labels = np.ascontiguousarray(cut[:, 3:head]).view(f"S{head - 3}").astype(np.int64)
        values = np.ascontiguousarray(cut[:, head:]).view(f"S{WIDTH}").astype(np.float64)
    except ValueError:
        raise _bad_row(path, at, rows, head, width) from None
    values = values.reshape(len(rows), width)
    bad = np.flatnonzero(~np.isfinite(values).all(axis=1))
    if bad.size:
        raise FileFormatError(
            f"{path}: node {labels.ravel()[bad[0]]} (line {at + int(bad[0]) + 1}): "
            f"{bad.size} rows hold what is no finite number, such as "
            f"{rows[bad[0]][head:size].strip()!r}"
        )
    return labels.ravel(), values


def _bad_row(path: Path, at: int, rows: list[str], head: int, width: int) -> FileFormatError:
    """The first row whose columns are no numbers."""
    for k, row in enumerate(rows):
        try:
            int(row[3:head])
            for c in range(width):
                float(row[head + c * WIDTH : head + (c + 1) * WIDTH])
        except ValueError:
            return FileFormatError(
                f"{path}: line {at + k + 1}: expected a node and {width} numbers of {WIDTH} "
                f"columns, got {row.strip()!r}"
            )
    return FileFormatError(f"{path}: line {at + 1}: expected numbers")


def _whole(text: str) -> int:
    return int(text) if text.strip().isdigit() else 0


def _number(path: Path, at: int, text: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise FileFormatError(
            f"{path}: line {at + 1}: expected a time, got {text.strip()!r}"
        ) from None
