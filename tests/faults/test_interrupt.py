"""Ctrl-C at every stage: while modules are imported and kernels compiled, too."""

import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest

import amontons as am
from amontons.app.cli.stopping import Stopping
from amontons.core import interrupts
from amontons.mechanics.ready.gallery import random_delassus

SECONDS = 120  # a hang, not a slow machine
ENDS = (0, 1, 130, -signal.SIGINT)  # -SIGINT: Python itself, before or after our own code
pytestmark = pytest.mark.skipif(os.name != "posix", reason="signals of another kind")


@pytest.fixture(autouse=True)
def as_in_the_foreground():
    """Ctrl-C as Python has it: a test run in the background is started with it ignored."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


def interrupted(command, moment, folder, **variables):
    """Exit code and errors of a command that gets Ctrl-C so many seconds after its start."""
    process = subprocess.Popen(
        [sys.executable, *command], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        cwd=folder, env={**os.environ, **variables},
    )  # fmt: skip
    wait_for_imports(process)
    time.sleep(moment)
    process.send_signal(signal.SIGINT)
    said = process.communicate(timeout=SECONDS)[1]
    return process.returncode, said


def wait_for_imports(process):
    """Until NumPy is there: before, it is Python's own start that is interrupted."""
    maps = Path(f"/proc/{process.pid}/maps")
    while maps.exists() and process.poll() is None and "numpy" not in maps.read_text():
        time.sleep(0.01)


def check(end, said, folder):
    assert end in ENDS, said
    assert "Traceback" not in said
    assert "ignored" not in said
    assert not [path for path in folder.rglob(".*") if path.name != ".lock"]


SOLVE = "-m amontons solve example:cube --set mesh.cells=8 --quiet -o out".split()
RUN = "-m amontons run example:release --quiet -o out".split()
COLD = "-m amontons solve example:hild --quiet -o out".split()


@pytest.mark.parametrize("moment", [0.0, 0.3, 1.7])
def test_a_solve_ends_in_words(tmp_path, moment):
    check(*interrupted(SOLVE, moment, tmp_path), tmp_path)


def test_a_compilation_ends_in_words(tmp_path):
    check(*interrupted(SOLVE, 3.0, tmp_path, NUMBA_CACHE_DIR=str(tmp_path / "k")), tmp_path)


@pytest.mark.slow_faults
@pytest.mark.parametrize("command", [SOLVE, RUN], ids=["solve", "run"])
@pytest.mark.parametrize("moment", [0.25 * k for k in range(24)])
def test_every_stage(tmp_path, command, moment):
    check(*interrupted(command, moment, tmp_path), tmp_path)


@pytest.mark.slow_faults
@pytest.mark.parametrize("moment", range(1, 25))
def test_every_stage_of_compilation(tmp_path, moment):
    end, said = interrupted(COLD, moment, tmp_path, NUMBA_CACHE_DIR=str(tmp_path / "k"))
    check(end, said, tmp_path)


def signalled(code, after=0.2):
    """What a process prints whose main thread runs `code` under `Watching`."""
    text = f"""
import signal, sys, threading, time
from amontons.core.interrupts import Watching
threading.Timer({after}, signal.raise_signal, (signal.SIGINT,)).start()
began = time.perf_counter()
try:
    with Watching():
{code}
except KeyboardInterrupt:
    print("at", "late" if time.perf_counter() - began > 1 else "once")
"""
    done = subprocess.run([sys.executable, "-c", text], capture_output=True, text=True,
                          timeout=SECONDS)  # fmt: skip
    assert done.stderr == ""
    return done.stdout.strip()


LOOP = "end = time.perf_counter() + 1.5\n{0}while time.perf_counter() < end: pass\n"


def test_ordinary_code_is_interrupted_at_once():
    assert signalled("        " + LOOP.format("        ")) == "at once"


def test_destructors_come_to_their_end():
    code = f"""
        class Slow:
            def __del__(self):
                {LOOP.format("                ")}
        Slow()
        time.sleep(2)
"""
    assert signalled(code) == "at late"


def test_imports_come_to_their_end(tmp_path):
    (tmp_path / "slow.py").write_text("import time\n" + LOOP.format(""))
    code = f"""
        sys.path.insert(0, {str(tmp_path)!r})
        import slow
        time.sleep(2)
"""
    assert signalled(code) == "at late"


def test_a_program_that_is_itself_imported_can_be_interrupted(tmp_path):
    text = f"""
import sys, time
from amontons.core.interrupts import Watching
with Watching():
    {LOOP.format("    ")}
    print("not interrupted")
"""
    (tmp_path / "whole.py").write_text(text)
    code = f"""
        pass
    sys.path.insert(0, {str(tmp_path)!r})
    import whole
"""
    assert signalled(code, after=0.5).startswith("at ")


def test_handlers_of_others_are_left_alone():
    ours = signal.getsignal(signal.SIGINT)
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        with interrupts.Watching():
            assert signal.getsignal(signal.SIGINT) is signal.SIG_IGN
    finally:
        signal.signal(signal.SIGINT, ours)
    with interrupts.Watching():
        pass
    assert signal.getsignal(signal.SIGINT) is ours


def test_other_threads_solve_without_signals():
    found = []
    thread = threading.Thread(target=lambda: found.append(am.solve(random_delassus(1, 3, 2))))
    thread.start()
    thread.join()
    assert found[0].converged


def test_what_a_shell_ignores_stays_ignored():
    """Commands in the background are started with Ctrl-C ignored."""
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        with Stopping() as stopping, stopping.breaking():
            signal.raise_signal(signal.SIGINT)
        assert stopping.received is None
        assert signal.getsignal(signal.SIGINT) is signal.SIG_IGN
    finally:
        signal.signal(signal.SIGINT, before)


def test_the_compiler_is_not_interrupted():
    """Outside of a solve too: its end is waited for, then Ctrl-C comes as ever."""
    from numba.core import event

    ended = []

    def compiled():
        with event.trigger_event("numba:compiler_lock"):
            signal.raise_signal(signal.SIGINT)
            time.sleep(0.01)
            ended.append("compiling")
        time.sleep(1)
        ended.append("all")

    with pytest.raises(KeyboardInterrupt):
        compiled()
    assert ended == ["compiling"]
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
