"""Arrays of a page as one compressed block of text, to which its JSON refers by place.

The same arrays give the same text.  Numbers that are only looked at may be rounded to 16 bits.
"""

from __future__ import annotations

import base64
import zlib
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

FULL = 32767  # largest step of a number in 16 bits
ALIGNED = 4  # bytes at which arrays begin, as browsers want it


@dataclass
class Packer:
    """A block that grows; `small` rounds floats to 16 bits of the largest in their array."""

    small: bool = False
    _parts: list[bytes] = field(default_factory=list)
    _size: int = 0

    def indices(self, values: ArrayLike) -> dict[str, Any]:
        """Whole numbers >= 0, of any shape, row by row."""
        array = np.asarray(values)
        wide = array.max(initial=0) > 0xFFFF
        return self._put(array.astype("<u4" if wide else "<u2"), "u4" if wide else "u2")

    def signs(self, values: ArrayLike) -> dict[str, Any]:
        """Small whole numbers with a sign, such as statuses."""
        return self._put(np.asarray(values).astype("<i2"), "i2")

    def floats(self, values: ArrayLike, *, small: bool | None = None) -> dict[str, Any]:
        """Real numbers; what is not finite counts as 0."""
        array = np.nan_to_num(np.asarray(values, dtype=float), nan=0.0, posinf=0.0, neginf=0.0)
        largest = float(np.abs(array).max(initial=0.0))
        if self.small if small is None else small:
            step = largest / FULL if largest else 1.0
            return {**self._put(np.rint(array / step).astype("<i2"), "i2"), "step": step}
        with np.errstate(over="ignore", under="ignore"):
            unit = 1.0 if 1e-30 < largest < 1e30 or not largest else largest
            return {**self._put((array / unit).astype("<f4"), "f4"), "step": unit}

    def _put(self, array: NDArray[Any], kind: str) -> dict[str, Any]:
        data = np.ascontiguousarray(array).tobytes()
        place = {"at": self._size, "n": int(array.size), "type": kind}
        data += bytes(-len(data) % ALIGNED)
        self._parts.append(data)
        self._size += len(data)
        return place

    @property
    def text(self) -> str:
        """The block, deflated, in base 64."""
        return base64.b64encode(zlib.compress(b"".join(self._parts), 9)).decode("ascii")
