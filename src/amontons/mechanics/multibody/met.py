"""Contacts and joints as a step has met them."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .joints import Hung
from .meeting import Meetings
from .rows import Rows

Array = NDArray[np.float64]
Index = NDArray[np.int64]


class Met(NamedTuple):
    """Contacts that were found, with their keys, and what they make with the joints."""

    found: Meetings
    keys: Index  # (nc, 3) slave, master, feature
    rows: Rows
    apart: Array  # (k, 3) sides of joints
    hung: Hung | None  # how contacts hang on joints, where they do
    deepest: float  # largest overlap or distance of the sides of a joint

    def only(self, kept: NDArray[np.bool_]) -> Met:
        """The same without the contacts that are not kept, (nc,)."""
        rows = np.concatenate([kept, np.ones(len(self.rows.slave) - len(kept), dtype=bool)])
        found: list[Any] = [a[kept] for a in self.found]
        those: list[Any] = [a[rows] for a in self.rows]
        hung = None if self.hung is None else self.hung.only(kept)
        return self._replace(
            found=Meetings(*found), keys=self.keys[kept], rows=Rows(*those), hung=hung
        )

    @property
    def loose(self) -> NDArray[np.bool_]:
        """Contacts whose normals joints do not decide, (nc,)."""
        return np.ones(len(self.keys), dtype=bool) if self.hung is None else self.hung.loose
