"""The clock of reported times: it stands still while kernels compile; deadlines on it."""

import math
import time

from numba import njit

from amontons.core.clock import NEVER, Deadline, compiling, now


def test_compiling_is_booked_apart():
    @njit
    def kernel(x):
        return 2 * x + 1

    before, began, wall = compiling(), now(), time.perf_counter()
    kernel(1.0)
    wall = time.perf_counter() - wall
    spent = compiling() - before
    assert spent > 0.5 * wall
    assert math.isclose(now() - began, wall - spent, abs_tol=0.01)
    kernel(2.0)
    assert compiling() - before == spent


def test_deadline():
    assert NEVER.left == math.inf and not NEVER.passed
    assert Deadline.after(None) == NEVER
    gone = Deadline.after(0.0)
    assert gone.passed and gone.left == 0.0
    later = Deadline.after(100.0)
    assert 99 < later.left <= 100 and not later.passed
    assert 49 < later.share(0.5).left <= 50
    assert later.within(1000.0) == later
    assert 9 < later.within(10.0).left <= 10
    assert 9 < NEVER.within(10.0).left <= 10
    assert NEVER.share(0.5).left == math.inf
