"""Certificates as files: all accepted by the separate checker, forged bytes found.

    python benchmarks/certificate_files.py [--certificates 1000] [--forgeries 10000]

Random problems of two to six contacts in 2D and 3D, in turn, in 3D one to three where lists and
branches are asked: every load and one load; all solutions of a load and all branches between
two loads, in 3D also where friction changes.  Where lists and branches are asked for, W couples
normals with tangents, so that several solutions are likely.  Each forgery changes one byte of
one of the files at random; one counts as accepted where the checker still agrees while W, q,
mu, r0, the claim or anything else that the hash covers is another.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from multiprocessing import get_context
from pathlib import Path

import h5py
import numpy as np
from machine import describe

import amontons as am
from amontons.core.clock import deadline_of
from amontons.io import certificate_checker as checker

REFUSED, HARMLESS, WRONG, CRASHED = "refused", "harmless", "wrong", "crashed"
RESULTS = Path(__file__).parent / "results"
CURVED = 3  # contacts in 3D of which lists and branches are asked, at most
LISTS, LOADS, FRICTION = (0, 1), (2, 5), (9,)  # seeds modulo 16 of these kinds
PROCESSES = 2
LIMIT = 20  # seconds of a search, counted in operations: the same on every machine


def problem_of(seed: int) -> am.FrictionProblem:
    """2D and 3D in turn; little friction for every load, more for this load or several."""
    random = np.random.default_rng(seed)
    d, nc = 2 + seed % 2, int(random.integers(2, 7))
    listed = seed % 16 in LISTS + LOADS + FRICTION
    if d == 3 and listed:
        nc = int(random.integers(1, CURVED + 1))
    A = random.standard_normal((nc * d, nc * d))
    W = A @ A.T / (nc * d) + 0.1 * np.eye(nc * d)
    if listed:
        own = np.eye(d)
        own[0, 1] = own[1, 0] = random.uniform(0.7, 0.95)
        W = np.kron(np.eye(nc), own) + 0.05 * A @ A.T / (nc * d)
    W *= 10.0 ** random.uniform(-6, 6)
    q = random.standard_normal((nc, d)) - np.eye(d)[0] * (not listed)
    most = {0: 1.5, 3: 0.4}.get(seed % 4, 0.08)
    mu = random.uniform(1.0, 3.0, nc) if listed else random.uniform(0, most, nc)
    return am.FrictionProblem.from_delassus(W, q, mu)


def write(problem: am.FrictionProblem, seed: int, path: Path) -> str:
    """The claim of a certificate of a problem, and of what it is."""
    kind, shape = seed % 16, (problem.contacts, problem.dimension)
    if kind in LISTS:
        found = am.all_solutions(problem, time_limit=deadline_of(None, LIMIT))
        many = "several" if len(found.solutions) > 1 else "one"
        return am.write_certificate(problem, found, path) + f", {many}"
    if kind in LOADS + FRICTION:
        random = np.random.default_rng(seed)
        factor = random.uniform(0.5, 1.5) if kind in FRICTION else 1.0
        assert problem.W is not None  # of problems made from one
        end = am.FrictionProblem.from_delassus(
            problem.W, random.standard_normal(shape), factor * np.array(problem.mu)
        )
        found = am.diagram(end, base=problem, time_limit=deadline_of(None, LIMIT))
        claim = am.write_certificate(problem, found, path, end=end)
        claim += " of load and friction" if kind in FRICTION else " of a load"
        return claim + (", loops" if any(branch.closed for branch in found) else "")
    verdict = am.uniqueness(problem, time_limit=deadline_of(None, LIMIT))
    return am.write_certificate(problem, verdict, path)


def made(path: Path) -> tuple[str, float | None]:
    """(what was written for the seed that a file is named after, CPU seconds of its check)."""
    seed = int(path.stem)
    problem = problem_of(seed)
    try:
        claim = write(problem, seed, path)
    except am.InvalidInput as reason:
        print(seed, str(reason)[:150], flush=True)
        return f"{problem.dimension}D without a certificate", None
    began = time.process_time()
    am.check_certificate(path)  # raises where it is refused
    return f"{problem.dimension}D {claim}", time.process_time() - began


def main() -> None:
    """Write, check, forge, and a page of what came out."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--certificates", type=int, default=1000)
    parser.add_argument("--forgeries", type=int, default=10000)
    asked = parser.parse_args()
    count: Counter[str] = Counter()
    seconds: list[float] = []
    files: list[Path] = []
    pool = ProcessPoolExecutor(PROCESSES, get_context("spawn"))
    with tempfile.TemporaryDirectory() as folder, pool:
        seed = 0
        while (lacking := asked.certificates - len(files)) > 0:
            paths = [Path(folder) / f"{seed + k}.h5" for k in range(lacking)]
            for path, (claim, spent) in zip(paths, pool.map(made, paths), strict=True):
                count[claim] += 1
                if spent is not None:
                    seconds.append(spent)
                    files.append(path)
                if sum(count.values()) % 50 == 0:
                    print(len(files), dict(count), flush=True)
            seed += lacking
        told = forge(files, asked.forgeries, Path(folder) / "forged.h5")
    rows = "\n".join(f"| {name} | {number} |" for name, number in sorted(count.items()))
    where = describe()
    page = f"""# Certificates as files

`python benchmarks/certificate_files.py --certificates {asked.certificates} --forgeries
{asked.forgeries}`, {where['cpu']}, Python {where['python']}.

{len(files)} certificates of random problems were accepted by the separate checker
(`amontons.io.certificate_checker`), none refused; one takes {np.median(seconds) * 1e3:.1f} ms
(median), {max(seconds) * 1e3:.0f} ms at most.

| kind | number |
|---|---|
{rows}

Of {asked.forgeries} single bytes changed at random {told[REFUSED]} were refused,
{told[HARMLESS]} changed nothing that the certificate says (unused bytes of the file), the HDF5
library crashed on {told[CRASHED]}, and **{told[WRONG]} changed it unseen**.
"""
    (RESULTS / "certificate_files.md").write_text(page, encoding="utf-8")
    print(page)


def forge(files: list[Path], number: int, forged: Path) -> Counter[str]:
    """What becomes of changed bytes: REFUSED, HARMLESS, WRONG, or HDF5 CRASHED on them."""
    random, count, pool = np.random.default_rng(0), Counter[str](), None
    for _ in range(number):
        path = files[random.integers(len(files))]
        data = bytearray(path.read_bytes())
        data[random.integers(len(data))] ^= int(random.integers(1, 256))
        forged.write_bytes(data)
        pool = pool or ProcessPoolExecutor(1, get_context("spawn"))
        try:
            count[pool.submit(looked_at, path, forged).result()] += 1
        except BrokenProcessPool:
            count[CRASHED], pool = count[CRASHED] + 1, None
    if pool is not None:
        pool.shutdown()
    return count


def looked_at(path: Path, forged: Path) -> str:
    """What the checker makes of a forged file, in a process of its own."""
    try:
        am.check_certificate(forged)
    except am.InvalidInput:
        return REFUSED
    with h5py.File(path) as right, h5py.File(forged) as other:
        return HARMLESS if checker.digest(right) == checker.digest(other) else WRONG


if __name__ == "__main__":
    main()
