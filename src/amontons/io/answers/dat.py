"""Tables of CalculiX, `.dat`: displacements that `*NODE PRINT` prints, with seven digits."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from ...core.errors import FileFormatError
from .frd import Block, _lines

DIGITS = 7
TITLE = re.compile(
    r"^\s*displacements \(vx,vy,vz\) for set (?P<set>\S+) and time\s+(?P<time>\S+)", re.I
)


def read_dat(path: Path) -> list[Block]:
    """Displacements, one block for each time, of all sets together; raises FileFormatError."""
    lines = _lines(path)
    found: dict[float, dict[int, list[float]]] = {}
    at = 0
    while at < len(lines):
        title = TITLE.match(lines[at])
        at += 1
        if title is None:
            continue
        time = float(title["time"])
        rows = found.setdefault(time, {})
        while at < len(lines) and not lines[at].strip():
            at += 1
        while at < len(lines) and lines[at].strip():
            label, values = _row(path, at, lines[at])
            rows[label] = values
            at += 1
    if not found:
        raise FileFormatError(
            f"{path}: holds no displacements; ask for them in the deck: *NODE PRINT, NSET=… "
            "with U, for a set of all nodes"
        )
    return [
        Block("DISP", time, 0, np.array(list(rows)), np.array(list(rows.values())))
        for time, rows in found.items()
    ]


def digits_of(path: Path) -> int:
    """How many digits its displacements are printed with: CalculiX gives 7, we all."""
    for line in _lines(path):
        words = line.split()
        if len(words) == 4 and words[0].isdigit():
            mantissas = [word.upper().split("E")[0] for word in words[1:]]
            return max(sum(c.isdigit() for c in mantissa) for mantissa in mantissas)
    return DIGITS


def _row(path: Path, at: int, line: str) -> tuple[int, list[float]]:
    words = line.split()
    if words[4:] == ["L"]:
        raise FileFormatError(
            f"{path}: line {at + 1}: node {words[0]} is printed along the local axes of its "
            "*TRANSFORM; ask for *NODE PRINT, GLOBAL=YES, or take the .frd"
        )
    try:
        label, values = int(words[0]), [float(word) for word in words[1:]]
    except ValueError:
        label, values = -1, []
    if len(values) != 3 or not np.isfinite(values).all():
        raise FileFormatError(
            f"{path}: line {at + 1}: expected a node and three finite displacements, got "
            f"{line.strip()!r}"
        )
    return label, values
