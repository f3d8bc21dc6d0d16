"""Certificates as files: all accepted by the separate checker, forged bytes found.

    python benchmarks/certificate_files.py [--certificates 1000] [--forgeries 10000]

Random problems of two to six contacts in 2D and 3D: every load and one load; in 2D all
solutions where there are several, and all branches between two loads; in 3D of up to three
contacts all solutions of a load, and over load and friction.  Each forgery
changes one byte of one of the files at random; one counts as accepted where the checker still
agrees while W, q, mu, r0, the claim or anything else that the hash covers is another.
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
from amontons.analysis.certificates.verdict import Verdict
from amontons.io import certificate_checker as checker

REFUSED, HARMLESS, WRONG, CRASHED = "refused", "harmless", "wrong", "crashed"
RESULTS = Path(__file__).parent / "results"
CURVED, CURVES = 3, (0, 4, 8)  # contacts in 3D, and seeds: a list, then all branches


def problem_of(seed: int) -> am.FrictionProblem:
    """2D and 3D in turn; little friction for every load, more for this load or several."""
    random = np.random.default_rng(seed)
    d, nc = 2 + seed % 2, int(random.integers(2, 7))
    A = random.standard_normal((nc * d, nc * d))
    W = A @ A.T / (nc * d) + 0.1 * np.eye(nc * d)
    W *= 10.0 ** random.uniform(-6, 6)
    q = random.standard_normal((nc, d)) - np.eye(d)[0]
    most = {0: 4.0 if seed % 8 == 0 else 1.5, 3: 0.4}.get(seed % 4, 0.08)
    mu = random.uniform(0, most, nc)
    return am.FrictionProblem.from_delassus(W, q, mu)


def write(problem: am.FrictionProblem, seed: int, path: Path) -> str:
    """The claim of a certificate of a problem."""
    if problem.dimension == 2 and seed % 16 == 1:
        q = np.random.default_rng(seed).standard_normal((problem.contacts, 2))
        end = am.FrictionProblem.from_delassus(problem.W, q, problem.mu)
        return am.write_certificate(problem, am.diagram(end, base=problem), path, end=end)
    if problem.dimension == 3 and problem.contacts <= CURVED and seed % 16 in CURVES:
        q = np.random.default_rng(seed).standard_normal((problem.contacts, 3))
        end = am.FrictionProblem.from_delassus(problem.W, q, np.array(problem.mu) * 1.2)
        if seed % 16 == CURVES[0]:
            return am.write_certificate(problem, am.all_solutions(problem), path)
        return am.write_certificate(problem, am.diagram(end, base=problem), path, end=end)
    verdict = am.uniqueness(problem, time_limit=20)
    if problem.dimension == 2 and verdict.verdict is Verdict.NOT_UNIQUE:
        return am.write_certificate(problem, am.all_solutions(problem, time_limit=20), path)
    return am.write_certificate(problem, verdict, path)


def main() -> None:
    """Write, check, forge, and a page of what came out."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--certificates", type=int, default=1000)
    parser.add_argument("--forgeries", type=int, default=10000)
    asked = parser.parse_args()
    count: Counter[str] = Counter()
    seconds, files, seed = [], [], 0
    with tempfile.TemporaryDirectory() as folder:
        while len(files) < asked.certificates:
            problem, seed = problem_of(seed), seed + 1
            path = Path(folder) / f"{seed}.h5"
            try:
                claim = write(problem, seed, path)
            except am.InvalidInput:
                count["without a certificate"] += 1
                continue
            began = time.process_time()
            am.check_certificate(path)  # raises where it is refused
            seconds.append(time.process_time() - began)
            count[f"{problem.dimension}D {claim}"] += 1
            files.append(path)
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
