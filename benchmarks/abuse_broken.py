"""Broken input and broken machines for `abuse.py`: each case in words, or rightly solved.

A family is a function from a random generator and an empty folder to what happened: "refused"
(an AmontonsError, or exit code 2 with words) or "answered".  `python abuse_broken.py FAMILY
FIRST COUNT SEED` runs some of a family in this process and prints a line for each, so that a
crash or a hang ends that process only, and counts.
"""

from __future__ import annotations

import json
import os
import resource
import signal
import subprocess
import sys
import tempfile
import warnings
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from machine import options
from scipy import sparse

import amontons as am
from amontons.mechanics.ready.gallery import box_tower, random_delassus

Random = np.random.Generator
SECONDS = 60.0  # for a case: a hang, not a slow machine
MEMORY = 6 * 2**30  # bytes of addresses of a process
LONGEST = 2000  # letters of a message
CASE = """[mesh]
box = [1, 1]
cells = 2
[material.default]
young = 100.0
poisson = 0.3
density = 1.0
[[fix]]
on = "top"
value = ["0.01*t", "-0.01"]
[[contact]]
slave = "bottom"
obstacle = { plane = { point = [0, 0], normal = [0, 1] } }
friction = { coulomb = 0.3 }
[evolution]
kind = "quasi-static"
step = 0.1
until = 0.2
"""


def corrupt_matrices(random: Random, folder: Path) -> str:
    """Sparse W whose index arrays, shapes or values lie."""
    W = sparse.csr_array(random_delassus(int(random.integers(99)), 3, 2).W)
    W = W.copy() if random.random() < 0.5 else W.tocsc()
    for _ in range(int(random.integers(1, 4))):
        name = random.choice(["indices", "indptr", "data"])
        array = getattr(W, name).copy()
        wrong = [99, -5, 2**31 - 1, -(2**31), 0, 10**6] if name != "data" else [np.nan, np.inf]
        array[random.integers(len(array))] = random.choice(wrong)
        if random.random() < 0.2:
            array = array[: int(random.integers(len(array)))]
        setattr(W, name, array)
    return _solved(am.FrictionProblem.from_delassus(W, -np.ones((3, 2)), [0.3] * 3))


def strange_arrays(random: Random, folder: Path) -> str:
    """Arguments of other kinds, shapes and sizes than arrays of numbers."""
    strange = (
        None, "text", b"12", [["1", "2"]], np.array([["a", "b"]]), 1j * np.ones((1, 2)), {},
        np.array([[np.datetime64("2020"), np.datetime64("2021")]]), np.zeros((0, 2)), [[]],
        np.ma.masked_array([[1.0, 2.0]], [[True, False]]), np.array([[object(), 1]]), 1e300,
        [[np.nan, 0]], [[np.inf, 0]], [[-1e308, 1e308]], [[1e-320, 0]], np.ones((2, 2, 2)), -1,
        sparse.dok_array((2, 2)), sparse.lil_array((2, 2)), sparse.coo_array((2, 2)), True,
        np.zeros((2, 2), bool), range(3), (x for x in (1, 2)), np.float16(3), 10**400,
    )  # fmt: skip
    given: dict[str, object] = {"W": np.eye(2), "q": [[-1.0, 0.2]], "mu": [0.3]}
    for name in random.choice(["W", "q", "mu"], int(random.integers(1, 3)), replace=False):
        given[name] = strange[int(random.integers(len(strange)))]
    return _solved(am.FrictionProblem.from_delassus(**given))  # type: ignore[arg-type]


def damaged_files(random: Random, folder: Path) -> str:
    """FCLib files with wrong or missing bytes, through every command that reads them."""
    path = folder / "p.hdf5"
    am.write_fclib(box_tower(2) if random.random() < 0.5 else random_delassus(1, 3, 3), path)
    text = bytearray(path.read_bytes())
    for _ in range(int(random.integers(1, 20))):
        text[random.integers(len(text))] = random.integers(256)
    path.write_bytes(text[: int(len(text) * random.choice([1.0, 1.0, random.random()]))])
    command = str(random.choice(["solve", "info", "convert", "enumerate", "uniqueness"]))
    limit = ["--time-limit", "2"]
    more = {"solve": [*limit, "-o", "out"], "convert": ["b.hdf5"], "enumerate": limit,
            "uniqueness": limit}  # fmt: skip
    return _command(folder, command, "p.hdf5", *more.get(command, []))


def damaged_cases(random: Random, folder: Path) -> str:
    """Case files with letters, words and numbers in the wrong places."""
    words = ["1e999", "nan", "-1", "{}", "[[[", '"x**x**x"', "\0", "ü" * 500, "a." * 500,
             "true", '"' + "9" * 5000 + '"', "1e300", "[]", '"__import__"', "inf", "0"]
    text = CASE
    for _ in range(int(random.integers(1, 4))):
        at = int(random.integers(len(text)))
        text = text[:at] + str(random.choice(words)) + text[at + int(random.integers(8)) :]
    (folder / "case.toml").write_text(text, encoding="utf-8")
    command = ["run"] if random.random() < 0.3 else ["solve", "--time-limit", "2"]
    return _command(folder, *command, "case.toml", "-o", "out")


def full_disks(random: Random, folder: Path) -> str:
    """Commands that may write files of some kilobytes only."""
    am.write_fclib(box_tower(20), folder / "p.hdf5")
    (folder / "case.toml").write_text(CASE)
    command = [["convert", "p.hdf5", "b.hdf5"], ["solve", "p.hdf5", "-o", "out"],
               ["run", "case.toml", "-o", "out"]][int(random.integers(3))]  # fmt: skip
    return _command(folder, *command, most=int(random.integers(0, 80_000)))


def forks(random: Random, folder: Path) -> str:
    """A process that forks after a solve, and solves in the child."""
    n = int(random.integers(100, 400))
    chain = [[-1.0] * (n - 1), [2.0] * n, [-1.0] * (n - 1)]
    M = sparse.diags_array(chain, offsets=[-1, 0, 1]).tocsc()
    problem = am.FrictionProblem.from_global(
        M, np.eye(n, 2), np.full(n, -0.01), np.zeros((1, 2)), [0.3]
    )
    r = am.solve(problem).r
    child = os.fork()
    if child == 0:
        again = am.solve(problem.with_mu(0.3)).r
        os._exit(0 if np.allclose(r, again) else 7)
    code = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    if code:
        raise RuntimeError(f"the child ended with {code}")
    return "answered"


FAMILIES: dict[str, Callable[[Random, Path], str]] = {
    family.__name__.replace("_", " "): family
    for family in (
        corrupt_matrices, strange_arrays, damaged_files, damaged_cases, full_disks, forks
    )
}


def _solved(problem: am.FrictionProblem) -> str:
    found = am.solve(problem, time_limit=2, check=False)
    if found.converged and not np.isfinite(found.r).all():
        raise RuntimeError("called converged with numbers that are not finite")
    return "answered"


def _command(folder: Path, *arguments: str, most: int | None = None) -> str:
    """A command in a child that forks from here; exit code and words are checked."""
    words = folder / "words"
    child = os.fork()
    if child == 0:
        _child(folder, arguments, words, most)
    code = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    text = words.read_text(errors="replace")
    if code not in (0, 1, 2) or "Traceback" in text or "Warning:" in text:
        raise RuntimeError(f"exit {code}: {text[-300:]}")
    if len(text) > LONGEST + 40 * 120 * (code != 2):
        raise RuntimeError(f"{len(text)} letters of words")
    left = [path.name for path in folder.rglob(".*") if path.is_file()]
    if left:
        raise RuntimeError(f"temporary files stay: {left}")
    return "refused" if code == 2 else "answered"


def _child(folder: Path, arguments: tuple[str, ...], words: Path, most: int | None) -> None:
    from amontons.app.cli import main

    os.chdir(folder)
    place = os.open(words, os.O_WRONLY | os.O_CREAT)
    os.dup2(place, 1), os.dup2(place, 2)
    if most is not None:
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        resource.setrlimit(resource.RLIMIT_FSIZE, (most, most))
    code = 99
    try:
        main(list(arguments))
        code = 0
    except SystemExit as reason:
        code = reason.code if isinstance(reason.code, int) else 98
    finally:
        for stream in (sys.stdout, sys.stderr):
            try:
                stream.flush()
            except OSError:
                pass
        os._exit(code)


@dataclass
class Broken:
    """What came of a family: cases by what happened, and findings."""

    family: str
    counts: dict[str, int] = field(default_factory=dict)
    findings: list[str] = field(default_factory=list)

    def note(self, number: int, what: str) -> None:
        """Count a case; anything but a refusal in words or an answer is a finding."""
        kind = what if what in ("refused", "answered") else "finding"
        self.counts[kind] = self.counts.get(kind, 0) + 1
        if kind == "finding":
            self.findings.append(f"{number} {self.family}: {what}")


def abuse_broken(count: int, seed: int) -> list[Broken]:
    """`count` cases of every family, in processes that may crash or hang."""
    return [_abused(family, count, seed) for family in FAMILIES]


def _abused(family: str, count: int, seed: int) -> Broken:
    out, number = Broken(family), 0
    while number < count:
        command = [sys.executable, __file__, family, str(number), str(count), str(seed)]
        process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
        assert process.stdout is not None
        for line in process.stdout:
            out.note(number, json.loads(line))
            number += 1
        if process.wait() != 0 or number < count:
            out.note(number, f"the process ended with {process.returncode}")
            number += 1
    return out


def main() -> None:
    parser = options(__doc__)
    parser.add_argument("family", choices=FAMILIES)
    for name in ("first", "count", "seed"):
        parser.add_argument(name, type=int)
    asked = parser.parse_args()
    family, first, count, seed = asked.family, asked.first, asked.count, asked.seed
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    warnings.simplefilter("error")
    for number in range(first, count):
        random = np.random.default_rng([seed, number, list(FAMILIES).index(family)])
        signal.alarm(int(SECONDS))  # ends this process; the parent counts it
        with tempfile.TemporaryDirectory() as folder:
            try:
                what = FAMILIES[family](random, Path(folder))
            except am.AmontonsError as reason:
                text = str(reason)
                what = "refused" if len(text) <= LONGEST else f"{len(text)} letters of words"
            except Exception as reason:  # noqa: BLE001  that is what is looked for
                what = f"{type(reason).__name__}: {reason}"
        signal.alarm(0)
        print(json.dumps(what), flush=True)


if __name__ == "__main__":
    main()
