"""The one alphabet of contact statuses, in Python and in compiled kernels."""

from __future__ import annotations

from enum import IntEnum


class ContactStatus(IntEnum):
    """State of one contact; the numbers are those in files."""

    OPEN = 0
    SLIP = 1
    STICK = 2


OPEN, SLIP, STICK = (int(status) for status in ContactStatus)  # as kernels take them

__all__ = ["OPEN", "SLIP", "STICK", "ContactStatus"]
