"""What is made once: under its function, of its sources, also by threads and after pickling."""

import pickle
import time
from concurrent.futures import ThreadPoolExecutor

import pytest

from amontons.core.prepared import Prepared

CALLS = []


def made(value):
    """A new list each time."""
    CALLS.append(value)
    time.sleep(0.01)
    return [value]


def failing():
    """Nothing."""
    raise ValueError("not today")


@pytest.fixture(autouse=True)
def _no_calls():
    CALLS.clear()


def test_it_is_made_once_for_the_same_sources():
    prepared, a, b = Prepared(), [1], [1]
    first = prepared.once(made, (a,), 1)
    assert prepared.once(made, (a,), 2) is first
    assert prepared.once(made, (b,), 3) == [3]  # equal is not the same
    assert CALLS == [1, 3]


def test_what_is_put_is_not_made():
    prepared, value = Prepared(), [7]
    prepared.put(made, (), value)
    assert prepared.once(made, (), 1) is value
    assert not CALLS


def test_a_failure_is_not_kept():
    prepared = Prepared()
    for _ in range(2):
        with pytest.raises(ValueError, match="not today"):
            prepared.once(failing, ())


def test_threads_wait_for_each_other():
    prepared = Prepared()
    with ThreadPoolExecutor(4) as pool:
        found = list(pool.map(lambda k: prepared.once(made, (), k), range(4)))
    assert len(CALLS) == 1
    assert all(one is found[0] for one in found)


def test_a_copy_starts_empty():
    prepared = Prepared()
    prepared.once(made, (), 1)
    assert pickle.loads(pickle.dumps(prepared)).once(made, (), 2) == [2]
