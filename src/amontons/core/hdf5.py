"""What is checked of an HDF5 file before anything is read of it.

A file can lead elsewhere, through links, raw data outside or virtual data sets: to any file of
the machine, or to a pipe on which reading never ends.  And a few bytes can unpack to more than
any memory holds.  Files that amontons reads hold their data themselves, and not too much of it.
"""

from __future__ import annotations

import math
import os
import zlib
from collections.abc import Iterator
from pathlib import Path

import h5py
from h5py import h5a, h5d, h5g, h5l, h5o, h5s, h5t, h5z

from .errors import FileFormatError

FREE = 2**28  # bytes that a file of any size may unpack to
RATIO = 100  # bytes that each stored byte may add to that; matrices of large files have ten
MOST = 2**34  # bytes that no file may exceed
TEXT = 2**20  # bytes of one text
ATTRIBUTES = 2**24  # bytes of all attributes of one object
NUMBER = 8  # bytes of a number in memory, whatever it takes in the file
DEFLATED = 1032  # bytes that one deflated byte can unpack to
LZF = 32000  # code of the filter that comes with h5py
KNOWN = (h5z.FILTER_DEFLATE, h5z.FILTER_SHUFFLE, h5z.FILTER_FLETCHER32, h5z.FILTER_SZIP,
         h5z.FILTER_NBIT, h5z.FILTER_SCALEOFFSET, LZF)  # fmt: skip
LINKS = {h5l.TYPE_SOFT: "a soft link", h5l.TYPE_EXTERNAL: "a link to another file"}


SIGNATURE = b"\x89HDF\r\n\x1a\n"


def check_file(path: Path) -> None:
    """The same of a file that another package will open; no HDF5 file passes."""
    with path.open("rb") as head:
        if head.read(len(SIGNATURE)) != SIGNATURE:
            return
    with h5py.File(path, "r") as file:
        check_contained(path, file)


def check_contained(path: Path, file: h5py.File) -> None:
    """Raise FileFormatError for a file that leads elsewhere, or unpacks to too much."""
    left = allowed = _allowed(path)
    for where, node in _objects(path, file):
        if isinstance(node, h5d.DatasetID):
            left -= _checked_bytes(path, where, node, allowed)
        if left < 0:
            raise _error(
                path, where, f"unpacks to more than {allowed / 2**20:.0f} MiB, which is more "
                f"than a file of {path.stat().st_size} bytes may hold"
            )  # fmt: skip
        _check_attributes(path, where, node)


def _allowed(path: Path) -> int:
    """Bytes that a file may unpack to; a hole in a sparse file is no stored byte."""
    found = path.stat()
    stored = min(found.st_size, getattr(found, "st_blocks", math.inf) * 512)
    return int(min(MOST, FREE + RATIO * stored))


def _objects(path: Path, file: h5py.File) -> Iterator[tuple[str, h5g.GroupID | h5d.DatasetID]]:
    """Place and object of all groups, each once, and of all data sets, once for each name."""
    root = h5o.open(file.id, b"/")
    known, waiting = {_address(root)}, [("", root)]
    while waiting:
        above, group = waiting.pop()
        yield above or "/", group
        for name in group:
            where = f"{above}/{os.fsdecode(name)}"
            kind = group.links.get_info(name).type
            if kind != h5l.TYPE_HARD:
                link = LINKS.get(kind, "a link of an unknown kind")
                raise _error(path, where, f"expected data in this file, got {link}")
            node = h5o.open(group, name)
            if isinstance(node, h5g.GroupID):
                if _address(node) not in known:
                    known.add(_address(node))
                    waiting.append((where, node))
            elif isinstance(node, h5d.DatasetID):
                yield where, node


def _address(group: h5g.GroupID) -> object:
    """What tells a group from all others of its file."""
    return h5o.get_info(group).addr


def _checked_bytes(path: Path, where: str, node: h5d.DatasetID, allowed: int) -> int:
    """Bytes in memory of a data set, stored in this file and unpacked as it says."""
    plan, kind = node.get_create_plist(), node.get_type()
    if plan.get_layout() == h5d.VIRTUAL:
        raise _error(path, where, "expected data in this file, got a virtual data set")
    if plan.get_external_count():
        name = os.fsdecode(plan.get_external(0)[0])
        raise _error(path, where, f"expected data in this file, got raw data in {name!r}")
    if isinstance(kind, h5t.TypeStringID) and kind.get_size() > TEXT:
        raise _error(
            path, where, f"expected texts of at most {TEXT} bytes, got {kind.get_size()}"
        )
    space = node.get_space()
    count = math.prod(space.shape) if space.get_simple_extent_type() == h5s.SIMPLE else 1
    size = count * (kind.get_size() + NUMBER)
    if plan.get_layout() == h5d.CHUNKED:
        chunk = math.prod(plan.get_chunk()) * kind.get_size()
        size += chunk
        if size <= allowed:
            _check_filters(path, where, node, chunk, allowed)
    return size


def _check_filters(
    path: Path, where: str, node: h5d.DatasetID, chunk: int, allowed: int
) -> None:
    """Raise FileFormatError for chunks that may unpack to more than they have entries.

    The library unpacks all of a deflated stream, however long it is.
    """
    plan = node.get_create_plist()
    codes = [plan.get_filter(k)[0] for k in range(plan.get_nfilters())]
    unknown = [code for code in codes if code not in KNOWN]
    if unknown:
        raise _error(path, where, f"packed by filter {unknown[0]}, which is not known")
    if h5z.FILTER_DEFLATE not in codes or node.get_storage_size() * DEFLATED <= allowed:
        return
    after = codes[codes.index(h5z.FILTER_DEFLATE) + 1 :]
    if set(after) - {h5z.FILTER_FLETCHER32}:
        raise _error(path, where, "packed twice: expected one filter that packs")
    for k in range(node.get_num_chunks()):
        stored = node.get_chunk_info(k)
        if stored.size * DEFLATED > allowed:
            raw = node.read_direct_chunk(stored.chunk_offset)[1]
            stream = zlib.decompressobj()
            if len(stream.decompress(raw, chunk + 1)) > chunk or not stream.eof:
                raise _error(path, where, "a chunk unpacks to more than its entries")


def _check_attributes(path: Path, where: str, node: h5g.GroupID | h5d.DatasetID) -> None:
    size = 0
    for k in range(h5a.get_num_attrs(node)):
        attribute = h5a.open(node, index=k)
        count = math.prod(attribute.shape) if attribute.shape is not None else 0
        size += max(attribute.get_storage_size(), count * attribute.get_type().get_size())
    if size > ATTRIBUTES:
        raise _error(
            path, where, f"expected attributes of at most {ATTRIBUTES} bytes, got {size}"
        )


def _error(path: Path, where: str, message: str) -> FileFormatError:
    return FileFormatError(f"{path}: {where}: {message}")
