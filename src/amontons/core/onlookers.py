"""Who looks on while a search works, and may end it: every deadline asks them.

A search that looks at its deadline is seen and can be ended, with what it knows by then,
without knowing by whom.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field


@dataclass(eq=False)
class Onlooker:
    """look is called with the stage of the work, in words; ends says whether it has to end."""

    look: Callable[[str], None] | None = None
    ends: Callable[[], bool] | None = None
    began: float = field(default_factory=time.perf_counter)


_present: list[Onlooker] = []
_stage = ""


@contextmanager
def present(onlooker: Onlooker) -> Iterator[None]:
    """Within the block, this one looks on."""
    _present.append(onlooker)
    try:
        yield
    finally:
        _present.remove(onlooker)
        if not _present:
            say("")


def anybody_looks() -> bool:
    """True where the stage of the work is shown already."""
    return any(one.look is not None for one in _present)


def say(stage: str) -> None:
    """From now on the work is in this stage."""
    global _stage  # noqa: PLW0603  # one per process, as those who look on
    _stage = stage


def seconds_until_end() -> float | None:
    """Seconds after which somebody has asked the work to end, None where nobody has.

    Also shows the stage to all who look on, so that a search has nothing to call but its clock.
    """
    for one in _present:
        if one.look is not None:
            one.look(_stage)
    for one in _present:
        if one.ends is not None and one.ends():
            return time.perf_counter() - one.began
    return None
