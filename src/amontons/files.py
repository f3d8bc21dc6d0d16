"""Writing files so that a reader never meets half of one."""

from __future__ import annotations

import os
import secrets
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from .errors import InvalidInput


@contextmanager
def replacing(path: str | os.PathLike[str]) -> Iterator[Path]:
    """A temporary path beside `path`, renamed onto it when the block ends without an error.

    The suffix is kept, because writers choose their format by it.  Raises InvalidInput when
    the folder does not exist or can not be written.
    """
    target = Path(path)
    if target.is_dir():
        raise InvalidInput(f"{target}: expected the name of a file, this is a folder")
    temporary = target.with_name(f".{target.stem}-{secrets.token_hex(4)}{target.suffix}")
    try:
        yield temporary
        os.replace(temporary, target)
    except OSError as reason:
        raise InvalidInput(
            f"{target}: can not be written: {reason.strerror or reason}"
        ) from None
    finally:
        temporary.unlink(missing_ok=True)
