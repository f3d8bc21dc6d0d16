"""Where kernels are kept: never in the package, and without any place only for one process."""

import ast
import os
import subprocess
import sys
from contextlib import contextmanager
from pathlib import Path

import numba
import numpy as np
import pytest
from numba.core.registry import cpu_target

import amontons
from amontons.core import compiled, source_digest
from amontons.core.kept import Kept

PACKAGE = Path(amontons.__file__).parent
CALL = """
import numpy as np
from amontons.core import compiled
from amontons.solvers.sweeps.mixing import _dot
_dot(np.ones(2, np.float32), np.ones(2, np.float32))  # never comes with the package
print(compiled._folder())
"""


def kept(tmp_path, code=CALL, **variables):
    """The folder of a fresh process, and what is in it when the process has ended."""
    known = {k: v for k, v in os.environ.items()
             if k not in ("NUMBA_CACHE_DIR", "XDG_CACHE_HOME")}  # fmt: skip
    scratch = tmp_path / "scratch"
    scratch.mkdir(exist_ok=True)
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True,
        env={**known, "TMPDIR": str(scratch), **{k: str(v) for k, v in variables.items()}},
    )  # fmt: skip
    assert done.stderr == ""
    assert not list(scratch.iterdir())
    folder = Path(done.stdout.strip())
    return folder, list(folder.rglob("*.nbi")) if folder.exists() else []


def test_kernels_are_kept_in_the_cache_of_the_user_and_not_in_the_package(tmp_path):
    before = set(PACKAGE.rglob("*.nb?"))
    folder, files = kept(tmp_path, HOME=tmp_path, XDG_CACHE_HOME="not/absolute")
    if sys.platform == "linux":
        assert folder.parent == tmp_path / ".cache" / "amontons"
    assert files
    assert set(PACKAGE.rglob("*.nb?")) == before


@pytest.mark.parametrize("name", ["NUMBA_CACHE_DIR", "XDG_CACHE_HOME"])
def test_the_user_says_where(tmp_path, name):
    if name == "XDG_CACHE_HOME" and sys.platform != "linux":
        pytest.skip("a variable of Linux")
    folder, files = kept(tmp_path, **{name: tmp_path / "there"})
    assert (tmp_path / "there") in folder.parents
    assert files


@pytest.mark.parametrize("variables", [
    {"HOME": "/dev/null"}, {"NUMBA_CACHE_DIR": "/dev/null/x"}, {"XDG_CACHE_HOME": "/dev/null"},
])  # fmt: skip
def test_without_a_place_kernels_last_as_long_as_their_process(tmp_path, variables):
    folder, files = kept(tmp_path, **variables)
    assert not files
    assert not folder.exists()
    assert folder.parent == tmp_path / "scratch"


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork on this system")
def test_a_forked_process_leaves_the_kernels_of_its_parent(tmp_path):
    code = CALL.replace("print(", """
import os, sys
if os.fork() == 0:
    sys.exit()
os.wait()
assert os.path.isdir(compiled._folder())
print(""")  # fmt: skip
    kept(tmp_path, code, HOME="/dev/null")


def test_folders_of_other_users_are_not_trusted(tmp_path, monkeypatch):
    if not hasattr(os, "getuid"):
        pytest.skip("no users of that kind")
    monkeypatch.setattr(os, "getuid", lambda: tmp_path.stat().st_uid + 1)
    monkeypatch.setattr(compiled, "ROOT", -1)
    with pytest.raises(PermissionError, match="another user"):
        compiled._made(tmp_path / "kernels")


def test_a_change_of_any_kernel_makes_a_new_folder(tmp_path, monkeypatch):
    monkeypatch.setattr(compiled, "PACKAGE", tmp_path)
    first, second = tmp_path / "a.py", tmp_path / "b.py"
    first.write_text("@njit(cache=True)\ndef f(): g()\n")
    second.write_text("@njit(cache=True)\ndef g(): 1\n")
    before = compiled._digest()
    third = tmp_path / "c.py"
    third.write_text("no kernels here")
    assert compiled._digest() == before
    third.write_text("class Status:\n    FREE, STICK = 0, 1\n")  # which kernels may hold
    assert compiled._digest() != before
    third.unlink()
    second.write_text("@njit(cache=True)\ndef g(): 2\n")
    assert compiled._digest() != before


def taken_by_kernels(path):
    """Names that kernels of a file take from others, with the files."""
    tree, known = ast.parse(path.read_bytes()), {}
    for node in tree.body:
        if isinstance(node, ast.ImportFrom) and node.level:
            file = path.parents[node.level - 1].joinpath(*(node.module or "").split("."))
            file = file / "__init__.py" if file.is_dir() else file.with_suffix(".py")
            known |= {a.asname or a.name: (file, a.name.encode()) for a in node.names}
    for node in tree.body:
        if isinstance(node, ast.FunctionDef) and any(
            "njit" in ast.unparse(decorator) for decorator in node.decorator_list
        ):
            names = {n.id for n in ast.walk(node) if isinstance(n, ast.Name)}
            yield from (known[name] for name in names & set(known))


def test_what_kernels_take_from_files_without_kernels_is_in_the_digest():
    checked = 0
    for path in PACKAGE.rglob("*.py"):
        for file, name in taken_by_kernels(path) if marked(path.read_bytes()) else ():
            text = file.read_bytes()
            if not marked(text):
                lines = source_digest.CONSTANT.findall(text)
                assert any(name in line.split(b"=")[0] for line in lines), (path, name)
                checked += 1
    assert checked > 10


def marked(text):
    return any(mark in text for mark in compiled.MARKS)


def test_files_of_intrinsics_are_read_whole(tmp_path):
    """They are parts of kernels though they hold none."""
    path = tmp_path / "products.py"
    digests, first = [], "from numba.extending import intrinsic\n"
    for body in ("1", "2"):
        path.write_text(f"{first}def product(): return {body}\n")
        digests.append(source_digest.sources(tmp_path, compiled.MARKS))
    assert digests[0] != digests[1]


def test_a_file_that_changed_after_its_import_is_noticed(tmp_path, monkeypatch):
    monkeypatch.setattr(source_digest, "_imported", {})
    path, read = tmp_path / "a.py", set()
    path.write_text("@njit(cache=True)\ndef f(): 1\n")
    source_digest.imported(str(path))
    source_digest.imported("<string>")  # is in no file
    source_digest.sources(tmp_path, read=read)
    assert source_digest.as_imported(read)
    path.write_text("@njit(cache=True)\ndef f(): 22\n")
    read.clear()
    source_digest.sources(tmp_path, read=read)
    assert not source_digest.as_imported(read)


def twice(x):
    return 2 * x


@pytest.fixture
def results(tmp_path, monkeypatch):
    """Results of a function for two types, and what makes caches of it in one folder."""
    from numba.core import config

    monkeypatch.setattr(source_digest, "_imported", {})  # whatever is edited meanwhile

    made = numba.njit(twice)
    for kind in (numba.float64, numba.int64):
        made.compile((kind,))

    @contextmanager
    def folder():
        before, config.CACHE_DIR = config.CACHE_DIR, str(tmp_path)
        yield
        config.CACHE_DIR = before

    return made.overloads, lambda: Kept(twice, folder)


def test_two_processes_that_keep_results_at_once_have_files_of_their_own(
    tmp_path, results, monkeypatch
):
    """Else the index of one could name what the other has written, for other types."""
    for kinds, result in results[0].items():
        cache = results[1]()
        monkeypatch.setattr(cache.own._cache_file, "_load_index", dict)  # nothing seen so far
        cache.save_overload(kinds, result)
    assert len(list(tmp_path.rglob("*.nbc"))) == 2


@pytest.mark.parametrize("suffix", ["nbi", "nbc"])
def test_what_was_kept_and_is_damaged_is_compiled_and_kept_again(
    tmp_path, results, suffix, caplog
):
    (kinds, result), *_ = results[0].items()
    results[1]().save_overload(kinds, result)
    (file,) = tmp_path.rglob(f"*.{suffix}")
    file.write_bytes(b"")
    cache = results[1]()
    assert cache.load_overload(kinds, cpu_target.target_context) is None
    assert "compiled instead" in caplog.text
    cache.save_overload(kinds, result)
    files = results[1]().own._cache_file
    assert [files._load_data(name) for name in files._load_index().values()]


def test_in_a_process_of_other_sources_nothing_is_read_or_kept(tmp_path, results, monkeypatch):
    (kinds, result), *_ = results[0].items()
    results[1]().save_overload(kinds, result)
    monkeypatch.setattr(source_digest, "_imported", {"a.py": ("a.py", 0, 0)})
    assert results[1]().load_overload(kinds, cpu_target.target_context) is None
    results[1]().own.flush()
    results[1]().save_overload(kinds, result)
    assert not results[1]().own._cache_file._load_index()


def test_kernels_that_nobody_uses_go_after_a_while(tmp_path):
    old, new = tmp_path / "kernels-old", tmp_path / "kernels-new"
    for folder in (old, new):
        folder.mkdir()
    os.utime(old, (0, 0))
    compiled._forget_old(tmp_path)
    assert not old.exists()
    assert new.exists()


def test_numba_itself_is_left_as_it_was():
    from numba.core import config

    before = config.CACHE_DIR
    compiled.njit(cache=True)(lambda x: x)
    assert before == config.CACHE_DIR


@pytest.mark.parametrize("change", [
    "import numba.core.caching as part; del part._Cache",
    "import numba.core.runtime.nrt as part; del part.rtsys",
])  # fmt: skip
def test_kernels_work_and_are_kept_with_a_numba_whose_parts_have_other_names(tmp_path, change):
    code = f"""
import logging, sys
logging.basicConfig(stream=sys.stdout, format="%(message)s")
{change}
from amontons.core.compiled import njit, why_compiling
@njit(error_model="numpy")
def twice(x):
    return 2 * x
assert twice(2.0) == 4.0
print(why_compiling(), sum(twice.stats.cache_misses.values()), twice.stats.cache_path, sep="|")
"""
    script = tmp_path / "kernel.py"
    script.write_text(code)
    variables = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path / "there")}
    done = subprocess.run([sys.executable, str(script)], capture_output=True, text=True,
                          check=True, env=variables)  # fmt: skip
    *said, last = done.stdout.splitlines()
    why, misses, folder = last.split("|")
    assert "can be read with" in why and why in said[0]
    assert int(misses) == 1
    assert list(Path(folder).glob("kernel*.nbi"))
    assert str(tmp_path / "there") in folder
    assert done.stderr == ""


def test_what_counts_from_0_is_given_to_kernels_that_are_compiled_once():
    @compiled.njit(cache=False)
    def more(count, by):
        return count + by

    @compiled.njit(cache=False)
    def counted(n):
        count = 0
        for k in range(n):
            count = more(count, k)
        return count

    assert counted(4) == 6
    assert len(more.signatures) == 1


def test_kernels_that_need_a_constant_get_it():
    @compiled.njit(cache=False)
    def part(pair, k):
        return pair[k]

    @compiled.njit(cache=False)
    def second(x):
        return part((1, x), 1)

    assert (second(np.ones(2)) == 1).all()
