"""The critical friction: listed values, bounds on finer triangles, and 500 random problems.

    python benchmarks/critical_friction.py [--limit 60] [--contacts 15,25,50] [--random 500]
                                           [--space 500] [--levels 2,3,4,5]

Seconds are those of the processor; --limit is the work of so many seconds, counted in
operations, so that bounds do not depend on what else a machine does.  Every load at a friction
is decided by `am.uniqueness` of problems without load, which only bounds for every load can.
Random problems have up to four
contacts, any definite W and any shape of friction; the truth is every determinant by numpy, and
every proof and witness goes through the checker of the tests, which shares no code with the
package.  Proofs by multipliers are asked for 2 % below the critical friction without
enumerating more than one contact, and must be refused 2 % above it.  In 3D, up to three
contacts, nothing is exact: the lower bound must not be above the upper one, whose witness is
checked with W alone.

Writes results/critical_friction.md beside this file.
"""

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")

import argparse
import sys
import time
from pathlib import Path

import numpy as np
from machine import describe

import amontons as am
from amontons.analysis.certificates import friction_branching
from amontons.analysis.certificates.contact_multipliers import contact_multipliers
from amontons.analysis.certificates.critical_friction import critical_friction as bounds
from amontons.analysis.certificates.determinant_search import POSITIVE
from amontons.analysis.certificates.friction_branching import Branching
from amontons.analysis.certificates.status_pieces import Pieces
from amontons.core.clock import NEVER, Deadline
from amontons.mechanics.ready.hild import hild_triangle

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE.parent / "tests" / "unit"))
from uniqueness_checker import check_proof, check_witness, smallest_determinant  # noqa: E402

LISTED = [2.2, 1.9324, 1.8517, 2.0263, 1.7949, 1.7287, 1.5792, 1.5488, 1.4672, 1.4403, 1.3766]


def listed():
    """Rows of the triangles with listed thresholds."""
    am.critical_friction(hild_triangle(2))  # compiles
    for n, value in enumerate(LISTED, 1):
        problem = hild_triangle(n).assemble().condensed()
        began = time.process_time()
        found = am.critical_friction(problem)
        spent = time.process_time() - began
        p_matrix = "" if found.p_matrix is None else f"{found.p_matrix:.4f}"
        full = f"{found.full_contact:.4f}"
        both = f"{found.lower:.6f} | {found.upper:.6f} | {p_matrix} | {full}"
        yield f"| {n} | {value} | {both} | {found.witness.pattern} | {spent:.2f} |"


def finer(sizes, limit):
    """Rows of larger triangles."""
    for n in sizes:
        problem = hild_triangle(n).assemble().condensed()
        began = time.process_time()
        found = am.critical_friction(problem, time_limit=Deadline.counted(limit))
        spent = time.process_time() - began
        both = f"{found.lower:.4f} | {found.upper:.4f} | {found.lower / found.upper:.3f}"
        yield f"| {n} | {both} | {len(found.proof)} | {spent:.1f} |"


def random_problem(seed):
    """Any definite W, strongly or weakly coupled, in any unit."""
    random = np.random.default_rng(seed)
    nc = int(random.integers(1, 5))
    A = random.standard_normal((2 * nc, 2 * nc))
    W = A @ A.T / nc + np.diag(random.uniform(0.01, 3, 2 * nc)) * 10 ** random.uniform(-2, 0.5)
    mu = random.uniform(0.1, 2.0, nc)
    mu[random.random(nc) < 0.15] = 0.0
    W *= 10 ** random.uniform(-4, 4)
    return am.FrictionProblem.from_delassus(W, random.standard_normal((nc, 2)), mu)


def wrong(problem):
    """What is wrong with the answers on a small problem: an empty list."""
    faults = []
    W, mu = problem.W, problem.mu
    shape = mu / mu.max() if mu.max() > 0 else np.ones_like(mu)
    found = am.critical_friction(problem)
    if smallest_determinant(W, found.lower * shape) <= 0:
        faults.append("lower bound is not safe")
    if np.isinf(found.upper):
        if smallest_determinant(W, 0.99e4 * shape) <= 0:
            faults.append("a singular piece was missed")
        return faults
    if smallest_determinant(W, found.upper * (1 + 1e-5) * shape) >= 0:
        faults.append("upper bound is not singular")
    if not check_witness(W, shape, found.witness, found.upper):
        faults.append("witness refused")
    if found.lower < found.upper * (1 - 1e-3):
        faults.append("bounds are apart")
    pieces = Pieces.of(problem)
    safe, unsafe = (Branching(pieces, part * found.upper, NEVER) for part in (0.98, 1.02))
    scaled = pieces.W, pieces.shape
    if safe.run() != POSITIVE or not check_proof(scaled[0], safe.t * scaled[1], safe.leaves):
        faults.append("no proof below")
    if unsafe.run() == POSITIVE:
        faults.append("proof above")
    return faults


def of_bodies(levels, limit):
    """Rows of examples in the plane, and of the cube: every load, W given."""
    for name in ("hertz", "slab"):
        target = am.read_case(f"example:{name}").target
        yield row_of(f"`example:{name}`", target.assemble().condensed(), limit)
    for level in levels:
        steel = am.LinearElastic(young=200, poisson=0.3)
        block = am.Body(am.box((1, 1, 1), cells=2**level), steel)
        model = am.Model([block], supports=[am.Fix("top", (0, 0, 0))],
                         contacts=[am.Contact("bottom", am.Plane(normal=(0, 0, 1)), mu=0.3)])
        yield row_of(f"cube, {2**level} cells", model.assemble().condensed(), limit)


def row_of(name, local, limit):
    """Bounds, and the verdict without a load at mu 0.3."""
    still = am.FrictionProblem.from_delassus(
        local.W, np.zeros(local.free_velocity.shape), np.full(local.contacts, 0.3)
    )
    began = time.process_time()
    found = am.critical_friction(still, time_limit=Deadline.counted(limit))
    spent = time.process_time() - began
    began = time.process_time()
    by = bounds(still, first=0.3 * (1 + 1e-6), brief=True)
    proved = time.process_time() - began if by.lower > 0.3 else None
    began = time.process_time()
    verdict = am.uniqueness(still).verdict.value
    asked = time.process_time() - began
    alone = "no" if proved is None else f"{proved:.1f}"
    return (f"| {name} | {still.contacts} | {found.lower:.4f} | {found.upper:.4f} | "
            f"{spent:.1f} | {alone} | {verdict} | {asked:.1f} |")  # fmt: skip


def random_in_space(seed):
    """Up to three contacts in 3D, any definite W, in any unit."""
    random = np.random.default_rng(seed)
    nc = int(random.integers(1, 4))
    A = random.standard_normal((3 * nc, 3 * nc))
    W = A @ A.T / nc + np.diag(random.uniform(0.01, 3, 3 * nc)) * 10 ** random.uniform(-2, 0.5)
    mu = random.uniform(0.1, 2.0, nc)
    W *= 10 ** random.uniform(-4, 4)
    return am.FrictionProblem.from_delassus(W, random.standard_normal((nc, 3)), mu)


def space_faults(seed):
    """(faults of the bounds, lower over upper where both are finite)."""
    problem = random_in_space(seed)
    found = am.critical_friction(problem, time_limit=20)
    faults = []
    if found.lower > found.upper:
        faults.append("the lower bound is above the upper one")
    witness = found.witness
    if witness is not None and not witness_holds(problem.W, witness):
        faults.append("witness refused")
    finite = np.isfinite(found.upper) and found.lower > 0
    return faults, found.lower / found.upper if finite else None


def witness_holds(W, witness):
    """r != 0; zero where free, on its line where it slips; W r = 0 where it must be."""
    r = witness.null_vector
    u, size = W @ r.ravel(), np.abs(W) @ np.abs(r).ravel()
    off = np.abs(u / np.where(size > 0, size, 1.0)).reshape(r.shape)
    return bool(np.abs(r).max() > 0) and all(
        misses(letter, r[i], u[3 * i : 3 * i + 3] / (size[3 * i : 3 * i + 3].max() or 1.0),
               off[i], witness.directions[i], witness.coefficients[i]) < 1e-6
        for i, letter in enumerate(witness.pattern)
    )  # fmt: skip


def misses(letter, r, u, off, t, m):
    """By how much one contact misses its piece, relative."""
    across, scale = np.array([-t[1], t[0]]), np.abs(r).max() or 1.0
    if letter in "fs":
        return np.abs(r).max() if letter == "f" else off.max()
    along = max(off[0], abs(t @ r[1:] + m * r[0]) / scale)
    return max(along, abs(across @ r[1:]) / scale if letter == "l" else abs(across @ u[1:]))


def contact_ratio(problem):
    """Bound by multipliers of every contact over the exact critical friction, or None."""
    found = am.critical_friction(problem)
    if not np.isfinite(found.upper) or found.lower < found.upper * (1 - 1e-3):
        return None
    pieces = Pieces.of(problem)
    return contact_multipliers(pieces.W, pieces.shape).t / found.upper


def main():
    """All tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--limit", type=float, default=60.0)
    parser.add_argument("--contacts", default="15,25,50")
    parser.add_argument("--random", type=int, default=500)
    parser.add_argument("--space", type=int, default=500)
    parser.add_argument("--levels", default="2,3,4,5")
    options = parser.parse_args()
    levels = [int(n) for n in options.levels.split(",") if n]
    sizes = [int(n) for n in options.contacts.split(",") if n]
    flags = "".join(f" {flag}" for flag in sys.argv[1:])
    command = f"`python benchmarks/critical_friction.py{flags}`, {describe()}"
    lines = ["# Critical friction", "", command, "",
             "Structured triangles of `example:hild`, against the listed values.", "",
             "| contacts | listed | lower | upper | P-matrix | full contact | witness | s |",
             "|---|---|---|---|---|---|---|---|", *listed(), ""]  # fmt: skip
    lines += [f"Finer ones, with the work of at most {options.limit:g} s each.", "",
              "| contacts | lower | upper | ratio | groups of patterns | s |",
              "|---|---|---|---|---|---|", *finer(sizes, options.limit), ""]  # fmt: skip
    friction_branching.ENUMERATED = 1
    faults = [(seed, wrong(random_problem(seed))) for seed in range(options.random)]
    bad = [f"{seed}: {', '.join(what)}" for seed, what in faults if what]
    lines.append(f"{options.random} random problems, {len(bad)} with a fault.")
    lines += [f"- {line}" for line in bad]
    ratios = [contact_ratio(random_problem(seed)) for seed in range(options.random)]
    ratios = [x for x in ratios if x is not None]
    if ratios:
        lines += ["", "Multipliers of every contact alone, over the exact critical friction of "
                  f"{len(ratios)} of them: median {np.median(ratios):.3f}, at most "
                  f"{max(ratios):.6f}. Bounds of `am.critical_friction` are within 1e-3."]
    lines += ["", "## Bodies", "", "Every load, W given, with the work of at most "
              f"{options.limit:g} s; until mu 0.3 alone is proved; `am.uniqueness` at mu "
              "0.3.", "",
              "| body | contacts | lower | upper | s | mu 0.3 proved, s | verdict at mu 0.3 | "
              "s |", "|---|---|---|---|---|---|---|---|", *of_bodies(levels, options.limit),
              "", "## Random problems in 3D", ""]  # fmt: skip
    space = [(seed, *space_faults(seed)) for seed in range(options.space)]
    bad = [f"{seed}: {', '.join(what)}" for seed, what, _ in space if what]
    both = [x for _, _, x in space if x is not None]
    if both:
        lines.append(f"{options.space} random problems of up to three contacts, {len(bad)} "
                     f"with a fault; lower over upper of {len(both)}: median "
                     f"{np.median(both):.3f}, at most {max(both):.6f}.")
    lines += [f"- {line}" for line in bad]
    text = "\n".join(lines) + "\n"
    print(text)
    (HERE / "results" / "critical_friction.md").write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
