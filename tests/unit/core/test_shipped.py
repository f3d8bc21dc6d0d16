"""Kernels that come with the package: used where they fit, and only there."""

import importlib.util
import json
import os
import shutil
import subprocess
import sys
import time
from contextlib import nullcontext
from pathlib import Path
from unittest.mock import Mock

import numba
import numpy as np
import pytest
from numba import types
from numba.core.registry import cpu_target

import amontons
from amontons.core import kept, shipped
from amontons.core.clock import compiles
from amontons.core.spelling import read, spelled
from amontons.core.telling import telling

PACKAGE = Path(amontons.__file__).parent
SIGNATURE = (types.float64, types.Array(types.float64, 1, "C"))
KERNEL = "amontons.solvers.sweeps.kernels"
CALL = f"""
import sys
import numpy as np
from amontons.core.shipped import shipped
from amontons.core.telling import telling
from {KERNEL} import _dot

began = []
with telling(lambda: began.append(1)):
    value = float(_dot(np.array([1.0, 2.0]), np.array([3.0, 4.0])))
print(value, "compiled" if began else "loaded", shipped().why_not, "numba.np.arrayobj" in sys.modules)
"""  # noqa: E501
WRITE = f"""
import sys
from pathlib import Path
from numba import types
from amontons.core.shipped import name_of, packed, processor, write
from {KERNEL} import _dot

signature = (types.Array(types.float64, 1, "C"),) * 2
_dot.compile(signature)
content = packed(_dot.overloads[signature])
write(Path(sys.argv[1]), {{name_of(_dot.py_func, signature): content}}, sorted(processor()))
"""


def scaled_sum(factor, values):
    total = 0.0
    for value in values:
        total += factor * value
    return total


@pytest.fixture(scope="module")
def packed():
    made = numba.njit(scaled_sum)
    made.compile(SIGNATURE)
    return shipped.packed(made.overloads[SIGNATURE])


@pytest.fixture
def file(tmp_path, packed):
    path = tmp_path / "kernels.bin"
    shipped.write(path, {"it": packed}, [])
    return path


def changed(path, **values):
    """Put other values into `made_for`, or in the head itself."""
    head, base = shipped._head(path)
    kernels = path.read_bytes()[base:]
    head["needs"] = values.pop("needs", head["needs"])
    head["made_for"].update(values)
    text = json.dumps(head).encode()
    path.write_bytes(shipped.START + len(text).to_bytes(8, "little") + text + kernels)


def test_what_was_written_is_loaded_and_called(file):
    result = shipped.Shipped(file).result("it", cpu_target.target_context)
    assert result.entry_point(2.0, np.array([1.0, 2.5])) == 7.0
    assert shipped.Shipped(file).result("another", cpu_target.target_context) is None


@pytest.mark.parametrize("what", ["python", "numba", "llvmlite", "system", "sources"])
def test_a_file_for_something_else_is_not_used(file, what):
    changed(file, **{what: "other"})
    found = shipped.Shipped(file)
    assert found.result("it", cpu_target.target_context) is None
    assert f"for {what} other" in found.why_not


def test_a_file_for_a_better_processor_is_not_used(file):
    changed(file, needs=["telepathy"])
    found = shipped.Shipped(file)
    assert found.why_not == "this processor lacks telepathy"
    assert not found.names


@pytest.mark.parametrize("content", [
    b"", b"x" * 100, shipped.START, shipped.START + b"\xff" * 8,
    shipped.START + b"\x02" + bytes(7) + b"[]",
])  # fmt: skip
def test_a_file_that_is_none_is_not_used(tmp_path, content):
    path = tmp_path / "kernels.bin"
    path.write_bytes(content)
    assert shipped.Shipped(path).why_not == "their file can not be read"
    assert shipped.Shipped(tmp_path / "absent").why_not == "none were installed"


@pytest.mark.parametrize("cut", [True, False])
def test_damage_is_noticed_and_said(file, cut, caplog):
    whole = bytearray(file.read_bytes())
    whole[-100] ^= 1
    file.write_bytes(whole[:-50] if cut else whole)
    found = shipped.Shipped(file)
    assert found.result("it", cpu_target.target_context) is None
    assert "damaged" in caplog.text and "compiled instead" in caplog.text
    assert found.why_not == "their file is damaged"


def itself(values):
    return values


def twice_the_sum(sums, factor, values):
    return 2.0 * sums(factor, values)


@pytest.fixture
def shipped_as(monkeypatch, tmp_path):
    """A kernel that came with the package for such types alone."""

    def made(function, signature):
        compiled = numba.njit(function)
        compiled.compile(signature)
        path, name = tmp_path / "kernels.bin", shipped.name_of(function, signature)
        shipped.write(path, {name: shipped.packed(compiled.overloads[signature])}, [])
        found = shipped.Shipped(path)
        monkeypatch.setattr(kept, "shipped", lambda: found)
        kernel = numba.njit(function)
        kernel._cache = kept.Kept(function, nullcontext)
        kernel._cache.own = Mock(load_overload=Mock(return_value=None))
        return kernel

    return made


def compilations(function, *arguments):
    """What a call returns, and how often it compiled something."""
    seen = []
    with telling(lambda: seen.append(1)):
        return function(*arguments), len(seen)


def test_arrays_open_for_writing_are_taken_by_a_kernel_that_only_reads(shipped_as):
    locked = types.Array(types.float64, 1, "C", readonly=True)
    kernel = shipped_as(scaled_sum, (types.float64, locked))
    values = np.array([1.0, 2.5])
    for _ in range(2):
        assert compilations(kernel, 2.0, values) == (7.0, 0)
        values.flags.writeable = False
        assert compilations(kernel, 2.0, values) == (7.0, 0)
        values = values.copy()
    assert compilations(kernel, 2.0, values[::-1]) == (7.0, 1)  # another layout
    outer = numba.njit(twice_the_sum)
    for _ in range(2):  # called by another kernel
        assert compilations(outer, kernel, 2.0, values)[0] == 14.0
        values.flags.writeable = False


def test_locked_arrays_are_not_given_to_a_kernel_that_may_write(shipped_as):
    kernel = shipped_as(scaled_sum, SIGNATURE)
    values = np.array([1.0, 2.5])
    assert compilations(kernel, 2.0, values) == (7.0, 0)
    values.flags.writeable = False
    assert compilations(kernel, 2.0, values) == (7.0, 1)


def test_an_array_that_is_handed_back_stays_open_for_writing(shipped_as):
    kernel = shipped_as(itself, (types.Array(types.float64, 1, "C", readonly=True),))
    assert kernel(np.ones(2)).flags.writeable


def test_why_building_failed_is_known(tmp_path):
    text = json.dumps({"why_not": "building failed: no room"}).encode()
    (tmp_path / "k").write_bytes(shipped.START + len(text).to_bytes(8, "little") + text)
    assert shipped.Shipped(tmp_path / "k").why_not == "building failed: no room"


def test_sources_are_known_by_their_content(tmp_path):
    (tmp_path / "a").mkdir()
    path = tmp_path / "a/b.py"
    path.write_text("MU = 1\n")
    before = shipped.sources(tmp_path)
    os.utime(path, (0, 0))
    path.write_bytes(b"MU = 1\r\n")
    assert shipped.sources(tmp_path) == before
    path.write_text("MU = 2\n")
    assert shipped.sources(tmp_path) != before


def test_types_are_spelled_and_read_back():
    from amontons.solvers.sweeps.kernels import Sweep

    array = types.Array(types.int32, 2, "A", readonly=True)
    named = types.NamedTuple((array, types.float64), Sweep)
    for kinds in (
        (types.int64, types.boolean, types.none, array),
        (types.UniTuple(types.float64, 3), types.Tuple((types.int8, array))),
        (types.Omitted(1.5), types.Omitted(None), types.Array(types.uint64, 1, "C")),
        (types.Array(types.float64, 1, "F", aligned=False), named),
    ):
        assert read(spelled(kinds)) == kinds


def test_every_recorded_signature_is_one_of_a_kernel_that_is_there():
    """Otherwise: python packaging/record.py --anew."""
    from importlib import import_module
    from inspect import signature

    path = Path(__file__).parents[3] / "packaging/signatures.txt"
    lines = path.read_text().splitlines()
    assert len(lines) > 40
    for line in lines:
        module, name, kinds = line.split(" ", 2)
        kernel = getattr(import_module(module), name)
        assert len(read(kinds)) == len(signature(kernel.py_func).parameters), line


def test_those_who_ask_are_told_when_compiling_begins():
    kernel, seen = numba.njit(lambda x: x + 1), []  # kept nowhere
    with telling(lambda: seen.append(compiles())):
        kernel(1)
        kernel(2)
    kernel(1.0)
    assert seen == [True]
    assert not compiles()


@pytest.fixture(scope="module")
def installed(tmp_path_factory):
    """A copy of the package with a file of one kernel."""
    above = tmp_path_factory.mktemp("site")
    ignored = shutil.ignore_patterns("__pycache__", "kernels.bin")
    shutil.copytree(PACKAGE, above / "amontons", ignore=ignored)
    run(above, WRITE, above / "amontons/kernels.bin", NUMBA_CACHE_DIR=above / "built")
    return above


def run(site, code, *arguments, **variables):
    """What a fresh process prints that imports the package from there."""
    known = {k: v for k, v in os.environ.items() if k != "XDG_CACHE_HOME"}
    more = {"PYTHONPATH": site, "PYTHONDONTWRITEBYTECODE": 1, **variables}
    done = subprocess.run(
        [sys.executable, "-c", code, *map(str, arguments)], text=True, capture_output=True,
        check=True, env={**known, **{k: str(v) for k, v in more.items()}},
    )  # fmt: skip
    assert done.stderr == ""
    return done.stdout.strip()


def test_nothing_compiles_and_numba_is_not_prepared_for_it(installed, tmp_path):
    place = tmp_path / "cache"
    assert run(installed, CALL, NUMBA_CACHE_DIR=place) == "11.0 loaded  False"
    assert not place.exists()


def test_a_package_that_is_only_read_needs_no_home(installed, tmp_path):
    for path in installed.rglob("*"):
        path.chmod(0o555 if path.is_dir() else 0o444)
    nowhere = {"HOME": "/dev/null", "NUMBA_CACHE_DIR": "/dev/null/x", "TMPDIR": tmp_path}
    said = run(installed, CALL, **nowhere)
    for path in installed.rglob("*"):
        path.chmod(0o755 if path.is_dir() else 0o644)
    assert said == "11.0 loaded  False"
    assert not list(tmp_path.iterdir())


def test_kernels_of_changed_sources_are_stale(installed, tmp_path):
    site = tmp_path / "site"
    shutil.copytree(installed, site, ignore=shutil.ignore_patterns("built"))
    path = site / "amontons/solvers/sweeps/kernels.py"
    text = path.read_text()
    begin = text.index("def _dot(")
    end = text.index("\n\n", begin)
    head = text[begin : text.index(":", begin) + 1]
    path.write_text(text[:begin] + head + "\n    return -1.0\n" + text[end:])
    said = run(site, CALL, NUMBA_CACHE_DIR=tmp_path / "cache")
    assert said.startswith("-1.0 compiled they are for sources")


@pytest.mark.skipif(bool(shipped.shipped().why_not), reason="this package came without kernels")
@pytest.mark.parametrize("example", ["cube", "brake", "hertz"])
def test_the_first_solve_of_an_example_compiles_nothing(example, tmp_path):
    """Otherwise: python packaging/record.py."""
    code = f"""
from amontons.app.cli import main
from amontons.core.telling import told

told.append(lambda: print("compiles"))
main(["solve", "example:{example}", "-o", "out", "--quiet"], standalone_mode=False)
"""
    done = subprocess.run(
        [sys.executable, "-P", "-c", code], capture_output=True, text=True, cwd=tmp_path,
        env={**os.environ, "NUMBA_CACHE_DIR": str(tmp_path / "cache")},
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert "compiles" not in done.stdout


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="looks into /proc")
def test_a_build_that_takes_too_long_leaves_no_process(tmp_path):
    """Those that the compiling had started went on for as long as it takes."""
    pytest.importorskip("hatchling")
    spec = importlib.util.spec_from_file_location(
        "hook", Path(__file__).parents[3] / "packaging/hook.py"
    )
    hook = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(hook)
    note, limit = tmp_path / "number", 0.25
    while not (note.exists() and note.read_text()):  # a busy machine has not begun by then
        limit *= 2
        with pytest.raises(subprocess.TimeoutExpired):
            hook.finished(["sh", "-c", f"sleep 600 & echo $! > {note}; wait"], limit)
    state = Path(f"/proc/{note.read_text().strip()}/stat")
    until = time.monotonic() + 60
    while goes_on(state) and time.monotonic() < until:
        time.sleep(0.01)
    assert not goes_on(state)


def goes_on(state):
    """Whether a process is there, and not dead yet to be asked by its parent."""
    try:
        return state.read_text().rpartition(")")[2].split()[0] not in "ZX"
    except OSError:
        return False
