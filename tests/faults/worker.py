"""A process that has imported all and forks a child for every command that it is told.

A child begins in milliseconds; nothing is factorised before the fork, which would start threads
that a child does not have.  Commands are lines of JSON on stdin: arguments, folder, and maybe
faults; answers, lines on stdout: exit code and seconds.
"""

from __future__ import annotations

import importlib
import json
import os
import signal
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

HERE = Path(__file__).resolve().parent
CALLS = ".calls"
COMPILING = "compiling"


@dataclass(frozen=True)
class Ended:
    """How a child ended: exit code, or minus the signal; seconds; all that it printed."""

    code: int
    seconds: float
    said: str


class Worker:
    """Starts commands of amontons, each in a process of its own."""

    def __init__(self, folder: Path, **environment: str) -> None:
        self.folder = folder
        self.said = folder / "said"
        self.process = subprocess.Popen(
            [sys.executable, str(HERE / "worker.py"), str(self.said)], cwd=folder, text=True,
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, env={**os.environ, **environment},
        )  # fmt: skip
        self._answer()

    def __enter__(self) -> Worker:
        return self

    def __exit__(self, *_: object) -> None:
        self.process.stdin.close()
        self.process.wait()
        self.process.stdout.close()

    def run(self, *arguments: object, **faults: Any) -> Ended:
        """Do a command; faults: the fields of `Faults`, kind by its value."""
        return self._done({"arguments": [str(a) for a in arguments], "faults": faults})

    def interrupted(self, stage: str, call: int, *arguments: object) -> Ended:
        """Do a command, with Ctrl-C at a call of a function MODULE:NAME, or of COMPILING."""
        return self._done({"arguments": [str(a) for a in arguments], "faults": {},
                           "stage": stage, "call": call})  # fmt: skip

    def calls(self) -> list[str]:
        """Names of the calls that the last command with faults made, if it came to its end."""
        return json.loads(Path(f"{self.said}{CALLS}").read_text())

    def cut(self, after: float, number: int, *arguments: object) -> Ended:
        """Do a command, and send it a signal after some seconds if it still runs then."""
        return self._done({"arguments": [str(a) for a in arguments], "faults": {},
                           "after": after, "number": number})  # fmt: skip

    def _done(self, command: dict[str, Any]) -> Ended:
        self.process.stdin.write(json.dumps(command) + "\n")
        self.process.stdin.flush()
        answer = self._answer()
        return Ended(answer["code"], answer["seconds"], self.said.read_text(errors="replace"))

    def _answer(self) -> dict[str, Any]:
        line = self.process.stdout.readline()
        assert line, "the worker has ended"
        return json.loads(line)


def _serve(said: str) -> None:
    for name in ("app.cli.run", "io.fclib", "io.plots"):
        importlib.import_module(f"amontons.{name}")
    from amontons.mechanics.ready.gallery import one_contact_2d
    from amontons.solvers.driver import drive

    drive(one_contact_2d())  # loads compiled code
    print(json.dumps({}), flush=True)
    for line in sys.stdin:
        command = json.loads(line)
        began = time.perf_counter()
        child = os.fork()
        if child == 0:
            _work(command, said)
        code = _waited(child, began, command)
        print(json.dumps({"code": code, "seconds": time.perf_counter() - began}), flush=True)


def _waited(child: int, began: float, command: dict[str, Any]) -> int:
    """The exit code of a child, or minus the signal that ended it."""
    while "after" in command:
        found, status = os.waitpid(child, os.WNOHANG)
        if found:
            return os.waitstatus_to_exitcode(status)
        left = began + command["after"] - time.perf_counter()
        if left <= 0:
            os.kill(child, command["number"])
            break
        time.sleep(min(left, 1e-3))
    return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])


def _work(command: dict[str, Any], said: str) -> None:
    """Do a command as a process of its own does it, and end."""
    os.setpgid(0, 0)
    signal.signal(signal.SIGINT, signal.default_int_handler)  # ignored in the background
    place = os.open(said, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o666)
    for stream in (1, 2):
        os.dup2(place, stream)
    os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
    code = 1
    try:
        _command(command, said)
    except SystemExit as end:
        code = end.code if isinstance(end.code, int) else int(end.code is not None)
    except BaseException:
        import traceback

        traceback.print_exc()
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(code & 255)


def _command(command: dict[str, Any], said: str) -> None:
    from amontons.app.cli import main

    if "stage" in command:
        _interrupt_at(command["stage"], command["call"])
    if not command["faults"]:
        main(args=command["arguments"])
        return
    from faults import Faults, Kind

    plan = command["faults"]
    plan["folder"], plan["kind"] = Path(plan["folder"]), Kind(plan["kind"])
    with Faults(**plan).injected() as faults:
        try:
            main(args=command["arguments"])
        finally:
            Path(said + CALLS).write_text(json.dumps(faults.calls))


def _interrupt_at(stage: str, call: int) -> None:
    """Ctrl-C when a function, MODULE:NAME, is called for the so manieth time, or COMPILING."""
    count = 0

    def interrupt() -> None:
        nonlocal count
        count += 1
        if count == call:
            os.kill(os.getpid(), signal.SIGINT)

    if stage == COMPILING:
        from numba.core import event

        class Listener(event.Listener):
            def on_start(self, event: object) -> None:
                interrupt()

            def on_end(self, event: object) -> None:
                pass

        event.register("numba:compiler_lock", Listener())
        return
    place, _, name = stage.partition(":")
    owner: Any = importlib.import_module(place)
    *outer, name = name.split(".")
    for part in outer:
        owner = getattr(owner, part)
    whole = getattr(owner, name)

    def interrupted(*arguments: Any, **named: Any) -> Any:
        interrupt()
        return whole(*arguments, **named)

    setattr(owner, name, interrupted)


if __name__ == "__main__":
    _serve(sys.argv[1])
