"""Compiled functions where what was compiled can not be kept."""

import errno
import math

import pytest
from faults import Faults

from amontons.core import compiled, source_digest


@pytest.mark.parametrize("number", [errno.ENOSPC, errno.EIO, errno.EACCES])
@pytest.mark.parametrize("call", ["open", "write", "replace", None])
def test_a_function_that_can_not_be_kept_works(call, number, tmp_path, monkeypatch):
    monkeypatch.setattr(compiled, "_folder", lambda: str(tmp_path))
    monkeypatch.setattr(source_digest, "_imported", {})  # no digest was made of what tests use

    @compiled.njit(cache=True)
    def twice(x):
        return 2 * x

    full = call is None
    faults = Faults(tmp_path, at=0 if full else 1, number=number, only=() if full else (call,),
                    room=0 if full else math.inf)  # fmt: skip
    with faults.injected():
        assert twice(2.0) == 4.0
    assert faults.calls
    assert not list(tmp_path.rglob("*.tmp.*"))
