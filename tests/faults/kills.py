"""Runs that are cut and go on with --restart must end with the numbers of one that was not."""

from __future__ import annotations

import random
import shutil
import signal
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from faults import Kind
from whole import check_whole, left_over
from worker import Ended, Worker

from amontons.io.checkpoint import Checkpoint, load_checkpoint

CASE = """
[mesh]
box = [1, 1]
cells = 3
[material.default]
young = 100.0
poisson = 0.3
density = 1.0
[[fix]]
on = "top"
value = ["0.02*t", "-0.01-0.01*t"]
[[contact]]
slave = "bottom"
obstacle = { plane = { point = [0, 0], normal = [0, 1] } }
friction = { coulomb = 0.3 }
[evolution]
kind = "dynamic"
step = 0.02
until = 0.24
"""
SLOW = CASE.replace('kind = "dynamic"', 'kind = "quasi-static"').replace("density = 1.0", "")
EVERY = 2
OWN = "seconds"  # the column that differs from run to run


@dataclass
class Cut:
    """A run that was cut, once or more, and went on: where, how often, and what was wrong."""

    where: str
    cuts: int = 0
    wrong: list[str] = field(default_factory=list)


@dataclass(frozen=True)
class Runs:
    """A case, its run without a cut, and a worker that does others."""

    worker: Worker
    folder: Path
    arguments: tuple[str, ...]
    reference: Path
    seconds: float

    @classmethod
    def of(cls, worker: Worker, text: str, *settings: str, every: int = EVERY) -> Runs:
        """The reference is run twice: the first time loads or compiles what is needed."""
        (worker.folder / "case.toml").write_text(text)
        options = [part for setting in settings for part in ("--set", setting)]
        arguments = ("run", "case.toml", "--every", str(every), "--quiet", *options)
        for _ in range(2):
            shutil.rmtree(worker.folder / "reference", ignore_errors=True)
            ended = worker.run(*arguments, "-o", "reference")
            assert ended.code == 0, ended.said
        return cls(worker, worker.folder, arguments, worker.folder / "reference", ended.seconds)

    def calls(self, *only: str) -> int:
        """How many such calls one run makes."""
        self.cut_at(Cut("count"), 0, only, Kind.EXIT_BEFORE)
        return len(self.worker.calls())

    def cut_at(
        self, cut: Cut, at: int, only: Sequence[str], kind: Kind, number: int = 0
    ) -> Ended:
        """A run, begun anew, with a fault at a call in its folder."""
        shutil.rmtree(self.folder / "out", ignore_errors=True)
        ended = self.worker.run(
            *self.arguments, "-o", "out", folder=str(self.folder / "out"), kind=kind.value,
            at=at, only=list(only), number=number,
        )  # fmt: skip
        cut.cuts += ended.code != 0
        return ended

    def finish(self, cut: Cut, *, pictures: bool = True) -> Cut:
        """Go on to the end, from the beginning where there is no state; compare."""
        out = self.folder / "out"
        again = ["--restart"] if (out / "state.h5").exists() else []
        ended = self.worker.run(*self.arguments, "-o", "out", *again)
        if ended.code != 0:
            cut.wrong.append(f"--restart: {ended.said.strip()}")
        else:
            cut.wrong += differences(out, self.reference, pictures=pictures)
        return cut


def differences(out: Path, reference: Path, *, pictures: bool = True) -> list[str]:
    """What two folders of results do not have in common, but for the column of seconds."""
    ours, theirs = (load_checkpoint(folder / "state.h5") for folder in (out, reference))
    pairs = _pairs(ours, theirs)
    wrong = [f"state: {name}" for name, a, b in pairs if not np.array_equal(a, b)]
    ends = (folder.joinpath("steps.csv").read_text() for folder in (out, reference))
    if _without_seconds(next(ends)) != _without_seconds(next(ends)):
        wrong.append("steps.csv")
    wrong += [f"left: {name}" for name in left_over(out)]
    names = sorted(path.name for path in reference.iterdir())
    if pictures and sorted(path.name for path in out.iterdir()) != names:
        wrong.append("names of files")
    for name in names if pictures else []:
        same = name in ("state.h5", "steps.csv") or (
            (out / name).is_file()
            and (out / name).read_bytes() == (reference / name).read_bytes()
        )
        wrong += [] if same else [name]
    return wrong


def _pairs(ours: Checkpoint, theirs: Checkpoint) -> Iterator[tuple[str, Any, Any]]:
    """Parts of two checkpoints, by name; floats as their bits."""
    for name in ("index", "time", "displacement", "velocity", "force", "slip", "slid", "path",
                 "friction_work"):  # fmt: skip
        parts = [np.asarray(getattr(c.state, name)) for c in (ours, theirs)]
        yield name, *(part.reshape(-1).view(np.uint8) for part in parts)
    yield "case", ours.case == theirs.case, True
    yield "record", ours.record == theirs.record, True
    for name in ours.table.dtype.names or ():
        if name != OWN:
            parts = [np.ascontiguousarray(c.table[name]) for c in (ours, theirs)]
            yield f"table, {name}", *(part.view(np.uint8) for part in parts)


def _without_seconds(text: str) -> list[list[str]]:
    rows = [line.split(",") for line in text.splitlines()]
    at = rows[0].index(OWN)
    return [row[:at] + row[at + 1 :] for row in rows]


def at_every_call(runs: Runs, only: Sequence[str], stride: int = 1) -> Iterator[Cut]:
    """Cut right before and right after every call of some names, or every so many of them."""
    count = runs.calls(*only)
    for kind in (Kind.EXIT_BEFORE, Kind.EXIT_AFTER):
        for at in range(1 + (kind is Kind.EXIT_AFTER) * (stride // 2), count + 1, stride):
            cut = Cut(f"{kind.value} {'/'.join(only) or 'call'} {at} of {count}")
            runs.cut_at(cut, at, only, kind)
            _check_targets(runs.folder / "out", cut)
            yield runs.finish(cut)


def at_random(runs: Runs, count: int, seed: int, again: float = 0.4) -> Iterator[Cut]:
    """SIGKILL at moments of even chance over a run, and with some chance while it goes on.

    Only runs that were really cut count.
    """
    chance = random.Random(seed)
    found = 0
    while found < count:
        shutil.rmtree(runs.folder / "out", ignore_errors=True)
        cut = Cut(f"kill {found + 1}")
        while True:
            more = ["--restart"] if (runs.folder / "out" / "state.h5").exists() else []
            ended = runs.worker.cut(
                chance.uniform(0, runs.seconds), signal.SIGKILL, *runs.arguments, "-o", "out",
                *more,
            )  # fmt: skip
            if ended.code != -signal.SIGKILL:
                break
            cut.cuts += 1
            _check_targets(runs.folder / "out", cut)
            if chance.random() > again:
                break
        if cut.cuts:
            found += 1
            yield runs.finish(cut)


def by_signals(runs: Runs, number: int, code: int, calls: Iterable[int]) -> Iterator[Cut]:
    """A signal at some calls; the run must end with the code, its state safe."""
    for at in calls:
        cut = Cut(f"{signal.Signals(number).name} at call {at}")
        ended = runs.cut_at(cut, at, (), Kind.SIGNAL, number)
        yield _after_signal(runs, cut, ended, code)


def by_interrupts(runs: Runs, stages: Iterable[tuple[str, int]]) -> Iterator[Cut]:
    """Ctrl-C at calls of functions, or while code is compiled."""
    for stage, call in stages:
        cut = Cut(f"Ctrl-C at {stage}, call {call}")
        shutil.rmtree(runs.folder / "out", ignore_errors=True)
        ended = runs.worker.interrupted(stage, call, *runs.arguments, "-o", "out")
        cut.cuts += ended.code != 0
        yield _after_signal(runs, cut, ended, 130)


def _after_signal(runs: Runs, cut: Cut, ended: Ended, code: int) -> Cut:
    if ended.code != code:
        cut.wrong.append(f"exit code {ended.code}: {ended.said.strip()}")
    if "Traceback" in ended.said or "ignored" in ended.said:
        cut.wrong.append(ended.said.strip())
    out = runs.folder / "out"
    cut.wrong += [f"left: {name}" for name in left_over(out)]
    _check_targets(out, cut)
    return runs.finish(cut, pictures=False)  # one more where it was stopped


def _check_targets(out: Path, cut: Cut) -> None:
    """Files that have their name are whole, wherever the run was cut."""
    for path in out.rglob("*") if out.is_dir() else ():
        if path.is_file() and not path.name.startswith("."):
            try:
                check_whole(path)
            except (OSError, ValueError, SyntaxError, AssertionError) as reason:
                cut.wrong.append(f"{path.name} is not whole: {reason}")
