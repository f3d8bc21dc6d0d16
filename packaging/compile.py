"""Compile the functions of `signatures.txt` into one file, in several processes.

    python packaging/compile.py FILE [SOURCES]

Run by `hook.py` when a wheel is built.  They are compiled for this processor, or for the one
that AMONTONS_BASELINE names: `x86-64-v3` or `generic`.  What does not compile is left out and
said; at last everything is loaded once, and an error raised where that fails.
"""

import gc
import importlib
import os
import subprocess
import sys
import tempfile
import time
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from operator import attrgetter
from pathlib import Path

HERE = Path(__file__).resolve().parent
LIST = HERE / "signatures.txt"
BASELINES = {  # features that the compiler may use, beside those of every processor of the kind
    "x86-64-v3": "avx avx2 bmi bmi2 cx16 f16c fma lzcnt movbe popcnt sahf "
    "sse3 sse4.1 sse4.2 ssse3 xsave",
    "generic": "",
}
PROCESSES = 8  # at most; each takes some 400 MB


def begin(sources, above):
    """What a process sets before it imports numba."""
    sys.path.insert(0, sources)
    os.environ["NUMBA_CACHE_DIR"] = tempfile.mkdtemp(dir=above)  # loaded ones do not pack
    os.environ.pop("AMONTONS_RECORD_KERNELS", None)
    gc.set_threshold(20_000, 10, 10)  # searching for cycles took a tenth of the time
    level = os.environ.get("AMONTONS_BASELINE", "")
    if level:
        os.environ.update(NUMBA_CPU_NAME=level, NUMBA_CPU_FEATURES="")


def of_module(lines):
    """The functions of one module as {name: bytes}, and what went wrong."""
    from amontons.core.shipped import name_of, packed
    from amontons.core.spelling import read

    found, wrong = {}, []
    for line in lines:
        module, name, types = line.split(" ", 2)
        try:
            function = attrgetter(name)(importlib.import_module(module))
            arguments = read(types)
            function.compile(arguments)
            result = function.overloads[arguments]
            if not result.library.has_dynamic_globals:  # such hold addresses of this process
                found[name_of(function.py_func, arguments)] = packed(result)
        except Exception as error:  # it is then compiled where it is used
            wrong.append(f"{module}.{name}: {type(error).__name__}: {str(error)[:200]}")
    return found, wrong


def load(path):
    """Load all of a file, as users will; raises ValueError where some can not be loaded."""
    from numba.core.registry import cpu_target

    from amontons.core.shipped import Shipped

    shipped = Shipped(Path(path))
    if shipped.why_not:
        raise ValueError(shipped.why_not)
    for name in list(shipped.names):
        if shipped.result(name, cpu_target.target_context) is None:
            raise ValueError(f"{name} can not be loaded")


def compile_all(path, sources, above):
    """Compile, write and try the file."""
    began = time.perf_counter()
    modules = {}
    for line in LIST.read_text(encoding="utf-8").splitlines():
        modules.setdefault(line.split(" ", 1)[0], []).append(line)
    kernels = {}
    count = min(os.cpu_count() or 1, PROCESSES)
    with ProcessPoolExecutor(
        count, get_context("spawn"), initializer=begin, initargs=(sources, above)
    ) as pool:
        longest_first = sorted(modules.values(), key=len, reverse=True)
        for found, wrong in pool.map(of_module, longest_first):
            kernels.update(found)
            for text in wrong:
                print(f"not compiled: {text}", file=sys.stderr)
    if not kernels:
        raise ValueError("no function could be compiled")
    begin(sources, above)
    from amontons.core.shipped import processor, write

    level = os.environ.get("AMONTONS_BASELINE", "")
    write(Path(path), kernels, BASELINES[level].split() if level else sorted(processor()))
    size = Path(path).stat().st_size / 1e6
    taken = time.perf_counter() - began
    print(f"{len(kernels)} functions, {size:.1f} MB, {taken:.0f} s in {count} processes")


def main():
    """Compile, or load with --load."""
    path = sys.argv[1]
    sources = sys.argv[2] if len(sys.argv) > 2 else str(HERE.parent / "src")
    with tempfile.TemporaryDirectory() as above:
        if "--load" in sys.argv:
            begin(sources, above)
            load(path)
            return
        compile_all(path, sources, above)
        subprocess.run([sys.executable, __file__, path, sources, "--load"], check=True)


if __name__ == "__main__":
    main()
