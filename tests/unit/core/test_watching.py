"""A number that is looked at before a thread falls asleep: seen when it changes."""

import itertools
import time

import pytest

from amontons.core import watching
from amontons.core.watching import Number


@pytest.fixture
def looks(monkeypatch):
    """Somebody looks here, and nobody else wants the core."""
    if not watching._looks():
        pytest.skip("this system does not tell who is put off a core")
    monkeypatch.setattr(watching, "_times_put_off", lambda: 0)


@pytest.mark.usefixtures("looks")
def test_a_change_is_seen_and_others_are_told():
    number, others = Number(), Number()
    known, told = number.now(), others.now()
    assert not number.differs(known, tells=others)  # it ends though nothing changes
    assert others.now() != told
    number.change()
    assert number.differs(known)


@pytest.mark.usefixtures("looks")
def test_numbers_never_come_again():
    number, seen = Number(), set()
    for _ in range(5):
        seen.add(number.now())
        number.change()
    assert len(seen) == 5


@pytest.mark.usefixtures("looks")
def test_a_core_that_others_want_is_left_alone(monkeypatch):
    number, others, times = Number(), Number(), itertools.count()
    monkeypatch.setattr(watching, "_times_put_off", lambda: next(times))
    number.differs(number.now())
    assert number.quiet_from > time.monotonic()
    number.change()
    told = others.now()
    monkeypatch.setattr(watching, "_look", None)  # is not called
    assert not number.differs(0, tells=others)
    assert others.now() != told


def test_where_nobody_looks(monkeypatch):
    monkeypatch.setattr(watching, "_looks", lambda: 0)
    number, others = Number(), Number()
    number.change()
    told = others.now()
    assert not number.differs(0, tells=others)
    assert others.now() != told
