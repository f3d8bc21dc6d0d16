"""Helpers that take parts: each part once, none is waited for to begin, nothing is kept."""

import gc
import subprocess
import sys
import threading
import time
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
    monkeypatch.setattr(fresh, "call", lambda region: None)


def wait_until(true):
    """Raise where that takes too long."""
    end = time.monotonic() + SECONDS
    while not true():
        assert time.monotonic() < end
        time.sleep(0.001)


def at_rest(fresh):
    """Are there helpers, and none that looks for parts?"""
    helpers = list(fresh.helpers)
    return bool(helpers) and fresh.calls.empty() and not any(each.busy for each in helpers)


def test_every_part_once_and_few_helpers(fresh):
    for _ in range(300):
        done = []
        together(done.append, range(7), 3)
        assert sorted(done) == list(range(7))
        assert not fresh.regions()
    assert 1 <= len(fresh.helpers) <= 2


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
    assert not fresh.helpers


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
    assert not fresh.regions()


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


@pytest.mark.parametrize("presses", [1, 5])
def test_interrupts_while_waiting(presses):
    """They come when the caller has done its own part; the other one still ends first."""
    region = team.Region(lambda part: None, [0], 0)
    region.taken[0] = "helper"

    class Bell:
        """Pressed some times, then the part has ended."""

        def __init__(self):
            self.left = presses

        def acquire(self):
            self.left -= 1
            if self.left >= 0:
                raise KeyboardInterrupt
            region.ended[0] = ValueError("late")

    region.bells = [Bell()]
    with pytest.raises(KeyboardInterrupt):
        region.close()
    assert region.closed
    region.close()  # raised once


@pytest.mark.usefixtures("alone")
@pytest.mark.parametrize("presses", [1, 2])
def test_interrupt_before_close_can_put_it_off(monkeypatch, presses):
    regions, close = [], team.Region.close

    def pressed(region):
        regions.append(region)
        if len(regions) <= presses:
            raise KeyboardInterrupt
        close(region)

    monkeypatch.setattr(team.Region, "close", pressed)
    with pytest.raises(KeyboardInterrupt):
        together(lambda part: None, [0, 1], 2)
    assert regions[-1].closed


@pytest.mark.usefixtures("alone")
def test_interrupt_comes_before_errors(monkeypatch):
    """Though the part that it has ended is not the first one."""

    def work(part):
        raise KeyboardInterrupt if part else ValueError

    with pytest.raises(KeyboardInterrupt):
        together(work, [0, 1], 2)


def test_interrupt_at_any_step(fresh):
    """Nothing runs after the call, nothing stays open, and no helper is lost.

    A tracer raises at one bytecode of the module after the other: more than the system does.
    """

    def work(part):
        nonlocal late
        late |= call.is_set()

    def trace(frame, event, _):
        nonlocal left
        if frame.f_code.co_filename != team.__file__:
            return None
        frame.f_trace_lines, frame.f_trace_opcodes = False, True
        if event == "opcode":
            left -= 1
            if left == 0:
                raise KeyboardInterrupt
        return trace

    late, call, before, step = False, threading.Event(), sys.gettrace(), 0
    together(work, range(3), 3)
    while True:
        step += 1
        left = step
        call.clear()
        sys.settrace(trace)
        try:
            together(work, range(3), 3)
        except KeyboardInterrupt:
            pass
        finally:
            sys.settrace(before)
        call.set()
        assert not fresh.regions()
        if left > 0:
            break
    assert step > 100
    assert not late
    wait_until(lambda: at_rest(fresh))
    all_three = threading.Barrier(3, timeout=SECONDS)
    together(lambda part: all_three.wait(), range(3), 3)
    assert len(fresh.helpers) <= 4


def test_interrupt_while_helpers_start(fresh, monkeypatch):
    """The helper that has been started is there all the same."""
    start = threading.Thread.start

    def pressed(thread):
        start(thread)
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr(threading.Thread, "start", pressed)
        with pytest.raises(KeyboardInterrupt):
            together(lambda part: None, [0, 1], 2)
    wait_until(lambda: at_rest(fresh))
    both = threading.Barrier(2, timeout=SECONDS)
    together(lambda part: both.wait(), [0, 1], 2)
    assert len(fresh.helpers) == 1


def test_no_call_has_more_threads_than_it_asked_for(fresh):
    """Two helpers are there for another one."""
    three = threading.Barrier(3, timeout=SECONDS)
    together(lambda part: three.wait(), range(3), 3)
    wait_until(lambda: at_rest(fresh))
    first = team.Region(lambda part: None, range(2), 1)
    fresh.call(first)
    by = set()

    def work(part):
        by.add(threading.get_ident())
        time.sleep(0.002)

    for _ in range(10):
        by.clear()
        region = team.Region(work, range(8), 1)
        fresh.call(region)
        for _ in fresh.helpers:
            fresh.calls.put(None)
        region.take(region, 0)
        region.close()
        assert len(by) <= 2
    first.close()


def test_a_helper_that_falls_asleep_sees_what_is_opened_then(fresh, monkeypatch):
    """It has looked and found nothing, and is not idle yet when the next call comes."""
    both = threading.Barrier(2, timeout=SECONDS)
    together(lambda part: both.wait(), [0, 1], 2)
    wait_until(lambda: at_rest(fresh))
    looked, opened, look = threading.Event(), threading.Event(), team._Helper._help

    def late(helper):
        look(helper)
        looked.set()
        assert opened.wait(SECONDS)

    monkeypatch.setattr(team._Helper, "_help", late)
    fresh.calls.put(None)
    assert looked.wait(SECONDS)
    region = team.Region(lambda part: both.wait(), [0, 1], 1)
    fresh.call(region)
    opened.set()
    region.take(region, 0)
    region.close()
    assert not region.errors()
    assert len(fresh.helpers) == 1


def test_nothing_of_a_call_is_kept(fresh):
    class Thing:
        """Something large."""

    def call():
        thing, both = Thing(), threading.Barrier(2, timeout=SECONDS)
        together(lambda part: (thing, both.wait()), [0, 1], 2)
        return weakref.ref(thing)

    known = call()
    wait_until(lambda: at_rest(fresh))  # the helper has rung, and is about to forget
    gc.collect()
    assert known() is None


def test_helpers_end(fresh):
    both = threading.Barrier(2, timeout=SECONDS)
    together(lambda part: both.wait(), [0, 1], 2)
    wait_until(lambda: at_rest(fresh))
    (helper,) = fresh.helpers
    fresh.end()
    assert not helper.thread.is_alive()
    done = []
    together(done.append, [0, 1], 2)  # no helper is started any more
    assert done == [0, 1]


def test_interpreter_ends_while_helpers_are_busy():
    """In an hour-long part, and a caller too."""
    text = """
import threading, time
from amontons.core.team import together
both = threading.Barrier(3)
def work(part):
    both.wait()
    time.sleep(3600)
threading.Thread(target=together, args=(work, [0, 1], 2), daemon=True).start()
both.wait()
"""
    done = subprocess.run(
        [sys.executable, "-c", text], timeout=SECONDS, capture_output=True, check=False
    )
    assert (done.returncode, done.stderr) == (0, b"")
