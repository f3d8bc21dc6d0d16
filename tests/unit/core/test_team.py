"""Helpers that take parts: each part once, none is waited for to begin, nothing is kept."""

import gc
import threading
import weakref
from concurrent.futures import ThreadPoolExecutor

import pytest

from amontons.core import team
from amontons.core.team import together

SECONDS = 20  # a deadlock, not a slow machine


@pytest.fixture(autouse=True)
def fresh(monkeypatch):
    """Helpers of this test alone."""
    mine = team._Team()
    monkeypatch.setattr(team, "_team", mine)
    yield mine
    mine.end()


@pytest.fixture
def alone(fresh, monkeypatch):
    """No helper ever comes."""
    monkeypatch.setattr(fresh, "wake", lambda count: None)


def test_every_part_once_and_few_helpers(fresh):
    for _ in range(300):
        done = []
        together(done.append, range(7), 3)
        assert sorted(done) == list(range(7))
        assert not fresh.open
    assert 1 <= fresh.count <= 2


def test_helpers_do_help():
    """Two parts that wait for each other."""
    both = threading.Barrier(2, timeout=SECONDS)
    together(lambda part: both.wait(), [0, 1], 2)


@pytest.mark.usefixtures("alone")
def test_a_helper_that_does_not_come_is_not_waited_for():
    done = []
    together(done.append, [3, 1, 2], 3)
    assert done == [3, 1, 2]


def test_no_more_threads(fresh, monkeypatch):
    def start(self):
        raise RuntimeError("can't start new thread")

    monkeypatch.setattr(threading.Thread, "start", start)
    done = []
    together(done.append, [0, 1], 2)
    assert done == [0, 1]
    assert fresh.count == 0


def test_parts_that_call_out_and_many_callers(fresh):
    """More calls at once than helpers, and calls inside of parts: all end."""

    def outer(part):
        inner = []
        together(inner.append, range(3), 3)
        assert sorted(inner) == [0, 1, 2]
        found.append(part)

    found = []
    with ThreadPoolExecutor(4) as pool:
        calls = [pool.submit(together, outer, range(5), 3) for _ in range(20)]
        for call in calls:
            call.result(timeout=SECONDS)
    assert sorted(found) == sorted(list(range(5)) * 20)
    assert not fresh.open


def test_errors_come_when_all_parts_have_ended():
    done = []

    def fail(part):
        done.append(part)
        if part:
            raise ValueError(f"part {part}")

    with pytest.raises(ValueError, match="part 1"):
        together(fail, [0, 1, 2, 3], 2)
    assert sorted(done) == [0, 1, 2, 3]


def test_interrupt_waits_for_the_other_part():
    at_work, released, done = threading.Event(), threading.Event(), []

    def work(part):
        if threading.current_thread() is not threading.main_thread():
            at_work.set()
            released.wait(SECONDS)
            done.append(part)
        else:
            assert at_work.wait(SECONDS)
            threading.Timer(0.05, released.set).start()
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        together(work, [0, 1], 2)
    assert done == [1]


@pytest.mark.usefixtures("alone")
def test_interrupt_leaves_parts_that_nobody_has_begun():
    done = []

    def work(part):
        done.append(part)
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        together(work, [0, 1], 2)
    assert done == [0]


def test_interrupt_while_waiting():
    """It comes when the caller has done its own part; the other one still ends first."""
    region = team.Region(lambda part: None, [0, 1], 1)
    region.take(region, 0)
    other = team.Region(lambda part: None, [0], 0)
    other.take(object(), 0)

    class Bell:
        """Pressed once, then the part has ended."""

        def __init__(self):
            self.pressed = 0

        def acquire(self):
            self.pressed += 1
            if self.pressed == 1:
                other.ended.clear()
                raise KeyboardInterrupt
            other.ended[0] = ValueError("late")

    other.bells, other.ended = [Bell()], {}
    errors = other.close()
    assert [type(error) for error in errors] == [KeyboardInterrupt, ValueError]


def test_nothing_of_a_call_is_kept(fresh):
    class Thing:
        """Something large."""

    def call():
        thing, both = Thing(), threading.Barrier(2, timeout=SECONDS)
        together(lambda part: (thing, both.wait()), [0, 1], 2)
        return weakref.ref(thing)

    known = call()
    while not fresh.idle:  # the helper has rung, and is about to forget
        pass
    gc.collect()
    assert known() is None


def test_helpers_end(fresh):
    both = threading.Barrier(2, timeout=SECONDS)
    together(lambda part: both.wait(), [0, 1], 2)
    while not fresh.idle:
        pass
    helper = fresh.idle[0]
    fresh.end()
    assert not helper.thread.is_alive()
    done = []
    together(done.append, [0, 1], 2)  # no helper is started any more
    assert done == [0, 1]
