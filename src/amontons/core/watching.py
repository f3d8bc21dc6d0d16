"""Looking at a number that another thread changes, for an instant, before falling asleep.

To wake a thread takes 40 µs, as long as many a loop that is shared.  So who waits for a number
looks at it first, in compiled code, which leaves the interpreter to others.  That takes a core,
and a core that somebody else wants is left alone: who has been put off one while it looked
sleeps at once for a while.  Where the system does not tell that (all but Linux), nobody looks.
"""

from __future__ import annotations

import time
from functools import cache
from itertools import count

import numpy as np
from llvmlite import ir
from numba import config, types
from numba.extending import intrinsic
from numpy.typing import NDArray

from .compiled import njit

try:
    import resource
except ImportError:  # Windows
    resource = None

INSTANT = 200e-6  # s that a number is looked at
MOMENT = 6e-6  # s after it has changed: who has changed it needs the interpreter first
RESPITE = 0.05  # s without looking when somebody else wants the core
SAMPLE = 20_000  # looks of which the time is taken


class Number:
    """A number that changes, and what threads wait for."""

    def __init__(self) -> None:
        self._next = count(1)
        self.value = np.zeros(1, dtype=np.int64)
        self.quiet_from = 0.0  # s, of `time.monotonic`: before that, cores are wanted

    def now(self) -> int:
        """The number, to be asked for before one looks whether what one waits for is there."""
        return int(self.value[0])

    def change(self) -> None:
        """Let those who look see that there is something."""
        self.value[0] = next(self._next)

    def differs(self, known: int, tells: Number | None = None) -> bool:
        """Look for an instant whether it is another than `known`.

        tells: a number that changes as soon as others can have the interpreter.
        """
        looks = _looks() if time.monotonic() >= self.quiet_from else 0
        if not looks:
            if tells is not None:
                tells.change()
            return False
        before = _times_put_off()
        told, new = (_nobody, 0) if tells is None else (tells.value, next(tells._next))
        moment = int(looks * MOMENT / INSTANT)
        changed = _look(self.value, known, told, new, looks, moment)
        if _times_put_off() != before:
            self.quiet_from = time.monotonic() + RESPITE
        return bool(changed)


_nobody: NDArray[np.int64] = np.zeros(1, dtype=np.int64)


def _times_put_off() -> int:
    """How often this thread had to leave a core to others so far."""
    assert resource is not None
    return resource.getrusage(resource.RUSAGE_THREAD).ru_nivcsw  # type: ignore[attr-defined]


@cache
def _looks() -> int:
    """How many looks an instant has; 0 where nobody looks."""
    if not hasattr(resource, "RUSAGE_THREAD") or config.DISABLE_JIT:
        return 0
    number = np.zeros(1, dtype=np.int64)
    took = []
    for _ in range(4):  # the first one compiles
        started = time.perf_counter()
        _look(number, 0, number, 0, SAMPLE, 0)
        took.append(time.perf_counter() - started)
    return int(INSTANT * SAMPLE / min(took[1:]))


@intrinsic
def _fresh(typing_context, array):  # noqa: ARG001
    """array[0] as it is in memory now: a plain load is done once for a whole loop."""

    def generate(context, builder, signature, arguments):
        value = context.make_array(signature.args[0])(context, builder, arguments[0])
        return builder.load_atomic(value.data, "acquire", 8)

    return types.int64(array), generate


@intrinsic
def _put(typing_context, array, number):  # noqa: ARG001
    """array[0] = number, after all that has been written before."""

    def generate(context, builder, signature, arguments):
        value = context.make_array(signature.args[0])(context, builder, arguments[0])
        builder.store_atomic(arguments[1], value.data, "release", 8)
        return ir.Constant(ir.IntType(64), 0)

    return types.int64(array, types.int64), generate


@njit(nogil=True)
def _look(value, known, told, new, looks, moment):  # noqa: PLR0913
    """1 where value has changed within so many looks, a moment later; told becomes new."""
    _put(told, new)
    for _ in range(looks):
        if _fresh(value) != known:
            for _ in range(moment):
                _fresh(value)
            return 1
    return 0
