"""The clock of reported times: it stands still while kernels compile; deadlines on it."""

import math
import time

from numba import njit

from amontons.core.clock import NEVER, Deadline, compiling, duration, now


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


def test_durations_are_told_without_powers_of_ten():
    words = {0.0: "0 s", 3e-5: "0.00003 s", 0.25: "0.25 s", 9.96: "10 s", 99.4: "99 s",
             120.0: "120 s", 2e6: "2000000 s"}  # fmt: skip
    assert {seconds: duration(seconds) for seconds in words} == words
