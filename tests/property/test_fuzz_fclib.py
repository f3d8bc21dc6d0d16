"""A damaged FCLib file gives AmontonsError or a sound problem: no other error, no NaN."""

import io
import itertools

import h5py
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from amontons.core.errors import AmontonsError
from amontons.io.fclib import read_fclib, write_fclib
from amontons.mechanics.ready.gallery import box_tower, random_delassus

FUZZ = settings(
    max_examples=150, deadline=None, derandomize=True,
    suppress_health_check=[HealthCheck.function_scoped_fixture],
)  # fmt: skip
COUNT = itertools.count()


@pytest.fixture(scope="module")
def originals(tmp_path_factory):
    """Bytes of a small global and a small local file."""
    folder = tmp_path_factory.mktemp("fuzz")
    found = []
    for problem in (box_tower(1), random_delassus(1, 3, 2)):
        write_fclib(problem, folder / "a.hdf5")
        found.append((folder / "a.hdf5").read_bytes())
    return found


def read_or_refuse(path):
    """True when the file was read; everything in it is then finite."""
    try:
        problem = read_fclib(path)
    except AmontonsError as error:
        assert str(path) in str(error)  # noqa: PT017
        assert len(str(error)) < 600  # noqa: PT017
        return False
    finally:
        path.unlink()
    for array in (problem.f, problem.w, problem.q, problem.mu):
        assert array is None or np.isfinite(array).all()
    for matrix in (problem.M, problem.H, problem.W):
        assert matrix is None or np.isfinite(matrix.data).all()
    assert (problem.mu >= 0).all()
    return True


@FUZZ
@given(which=st.integers(0, 1), data=st.data())
def test_flipped_bytes(originals, tmp_path, which, data):
    content = bytearray(originals[which])
    for _ in range(data.draw(st.integers(1, 6))):
        content[data.draw(st.integers(0, len(content) - 1))] = data.draw(st.integers(0, 255))
    path = tmp_path / f"{next(COUNT)}.hdf5"
    path.write_bytes(content)
    read_or_refuse(path)


@FUZZ
@given(which=st.integers(0, 1), share=st.floats(0, 1))
def test_truncated(originals, tmp_path, which, share):
    content = originals[which]
    path = tmp_path / f"{next(COUNT)}.hdf5"
    path.write_bytes(content[: int(share * (len(content) - 1))])
    assert not read_or_refuse(path)


def names_in(content):
    found = []
    with h5py.File(io.BytesIO(content)) as file:
        file.visit(found.append)
    return found


VALUES = st.one_of(
    st.integers(-(2**40), 2**40).map(lambda k: np.array([k])),
    st.lists(st.integers(-3, 40), max_size=14).map(lambda k: np.array(k, np.int32)),
    st.lists(st.floats(), max_size=14).map(lambda x: np.array(x, float)),
    st.sampled_from([
        np.zeros((2, 3)), np.zeros(0), np.array(3), np.array([b"text"]), np.array([1j]),
        np.array([True]), np.zeros((1, 1), np.int8), np.float32([1.5, 2.5]), np.array(2.0),
        np.zeros(3, [("a", int), ("b", float)]), h5py.Empty("f8"), np.uint64([2**64 - 1]),
    ]),
)  # fmt: skip


@FUZZ
@given(which=st.integers(0, 1), data=st.data())
def test_replaced_or_dropped_parts(originals, tmp_path, which, data):
    path = tmp_path / f"{next(COUNT)}.hdf5"
    path.write_bytes(originals[which])
    name = data.draw(st.sampled_from(names_in(originals[which])))
    action = data.draw(st.sampled_from(["drop", "value", "group", "link", "huge"]))
    with h5py.File(path, "a") as file:
        del file[name]
        if action == "value":
            file[name] = data.draw(VALUES)
        elif action == "group":
            file.create_group(name)
        elif action == "link":
            file[name] = h5py.SoftLink(data.draw(st.sampled_from(["/nowhere", "/", name])))
        elif action == "huge":
            file.create_dataset(name, shape=(2**50,), dtype="f8", chunks=(1024,))
    read_or_refuse(path)
