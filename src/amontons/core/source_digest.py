"""A digest of the sources of the package, by which compiled kernels are known to be stale."""

from __future__ import annotations

import hashlib
import os
import re
from contextlib import suppress
from pathlib import Path

PACKAGE = Path(__file__).resolve().parents[1]
# Lines by which constants get values: kernels hold those of files without kernels, too.
CONSTANT = re.compile(rb"^ *[A-Z][A-Z0-9_]+(?:, *[A-Z][A-Z0-9_]+)*(?: *:[^=\n]*)? *= .*$", re.M)
Stamp = tuple[str, int, int]  # name, time of the last change, size
_imported: dict[str, Stamp] = {}  # files of kernels when they were imported, by their paths


def sources(
    package: Path = PACKAGE, marks: tuple[bytes, ...] = (b"",), read: set[Stamp] | None = None
) -> str:
    """Sixteen letters that change with any file of the package that has one of the marks in it.

    And with what looks like a constant in any other one.  read: is told what was read.
    """
    found, above = hashlib.sha256(), str(package)
    paths = [os.path.join(folder, name) for folder, _, names in os.walk(above)
             for name in names if name.endswith(".py")]  # fmt: skip
    for path in sorted(paths):  # without pathlib, which takes longer than reading
        with open(path, "rb") as file:
            if read is not None:
                read.add(_stamp(path, os.fstat(file.fileno())))
            text = file.read().replace(b"\r\n", b"\n")
        if not any(mark in text for mark in marks):
            text = b"\n".join(CONSTANT.findall(text))
        if text:
            name = os.path.relpath(path, above).replace(os.sep, "/")
            found.update(f"{name} {len(text)} ".encode())
            found.update(text)
    return found.hexdigest()[:16]


def imported(path: str) -> None:
    """Note what a file is like of which a function was just defined."""
    if path not in _imported:
        with suppress(OSError):  # of what is in no file nothing is kept
            _imported[path] = _stamp(path, os.stat(path))


def as_imported(read: set[Stamp]) -> bool:
    """True where the files read for a digest are those whose functions this process has.

    Not where a package is changed, by an update or a merge, while a process begins.
    """
    return read.issuperset(_imported.values())


def _stamp(path: str, known: os.stat_result) -> Stamp:
    return os.path.basename(path), known.st_mtime_ns, known.st_size
