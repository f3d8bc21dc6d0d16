"""Is a model loaded at all?  Without a load everything is zero, and solved at once."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from ...core.warned import ResultWarning
from .fields import ContactFields
from .timing import is_timed

if TYPE_CHECKING:
    from .model import Model


def no_load(model: Model, fields: ContactFields) -> list[ResultWarning]:
    """A warning where nothing moves, and no value given to a load or support can.

    Tractions, pressures, body forces, supports that move and overlaps (gap < 0) are loads.
    Values that depend on time may be loads at another time, and are not judged.
    """
    if fields.force.any() or any(moved.any() for moved in fields.displacement):
        return []
    values = [part.value for part in (*model.supports, *model.loads)]
    if model.load_factor == 0:
        return [_warning("its load factor is 0")]
    if any(_may_load(value) for value in values):
        return []
    return [
        _warning(
            "it has no traction, pressure, body force, support that moves, or overlap; add a "
            "Traction, Pressure or BodyForce, or a Fix whose value is not 0"
        )
    ]


def _warning(reason: str) -> ResultWarning:
    return ResultWarning(
        "no-load",
        f"nothing moves in this model: {reason}",
    )


def _may_load(value: Any) -> bool:
    """True for a value that depends on time, or a number that is not zero.

    Functions of position were zero where it counts, as nothing moves.
    """
    if isinstance(value, list | tuple):
        return any(_may_load(entry) for entry in value)
    if hasattr(value, "tolist"):
        return _may_load(value.tolist())
    return is_timed(value) or (not callable(value) and value is not None and value != 0)
