"""What sweeps and Newton steps cost here, beside the counted costs of `solvers/auto/state.py`.

    python benchmarks/costs.py [--seed 7] [--most 3e7]

The race of `Auto` goes by counted costs, nanoseconds of one core of which only ratios matter.
On the problems of `classes.py`, both lists, every operation is timed alone, one thread, CPU
time, the best of some runs, where it has come after some sweeps; steps that are counted to take
more than `most` nanoseconds are left out.  The constants are fitted to the logarithms: every
problem has the same weight whatever its size, and what was disturbed hardly any.  Prints each
constant as it is and as it is found, and quantiles (10, 50, 90 %) of counted over measured.
"""

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")

import argparse
import math
import time
from pathlib import Path

import numpy as np
from classes import classes, unseen
from scipy.optimize import least_squares

from amontons.solvers.auto import state as counted
from amontons.solvers.auto.state import State
from amontons.solvers.contract import Target
from amontons.solvers.newton.alternating import FIRST_SHIFT, Alternation
from amontons.solvers.newton.interior_point import InteriorPoint, Relaxation
from amontons.solvers.newton.smoothing import SmoothingNewton
from amontons.solvers.sweeps.kernels import Acceleration, sweep_data, watch_for
from amontons.solvers.sweeps.momentum import Momentum
from amontons.solvers.sweeps.shared import sweeps

HERE = Path(__file__).parent
SHARED = Path(os.environ.get("AMONTONS_SHARED", HERE.parents[1] / "shared"))
SWEPT = 60  # accelerated sweeps before anything is timed: contacts stick, slide and are open
RUNS = 3  # of each operation; the quickest counts
LEAST = 2e5  # nanoseconds that one run takes at least
STEPS = 8  # of Newton's kind in one run at most
DISTURBED = 0.2  # relative, from which a measurement counts less and less
# What costs are made of, by operation: constants by what they are multiplied with; besides,
# what is taken as measured, or counted with the constants of other operations.
MODELS = {
    "sweep": {"SWEEP_BLOCK": "sparse", "FULL_BLOCK": "full", "SWEEP_CONTACT": "contacts"},
    "momentum": {"MOMENTUM_CONTACT": "contacts"},
    "Anderson": {"HISTORY_CONTACT": "contacts"},
    "deep Anderson": {"DEEP_CONTACT": "contacts"},
    "Newton": {"PRODUCT": "products", "NEWTON_CONTACT": "contacts"},
    "relaxation": {"PRODUCT": "shared", "NEWTON_CONTACT": "contacts"},
    "Newton in turn": {
        "PRODUCT": "products", "NEWTON_CONTACT": "contacts", "LINEARISED": "one"
    },
}  # fmt: skip


def quickest(run):
    """Nanoseconds of one operation: run(count) makes so many of them and returns how many."""
    run(1)
    count, best = 1, math.inf
    for _ in range(RUNS):
        while True:
            began = time.process_time_ns()
            done = max(run(count), 1)
            spent = time.process_time_ns() - began
            if spent >= LEAST or done < count:
                break
            count *= 2
        best = min(best, spent / done)
    return best


def repeated(call):
    """The same as a run of `quickest`."""

    def run(count):
        for _ in range(count):
            call()
        return count

    return run


def sizes(state):
    """What costs are counted from: blocks by how they are stored, contacts, products."""
    problem = state.problem
    blocks = len(problem.blocks.indices)
    is_full = problem.blocks.rows is not problem.blocks.data
    out = {"blocks": blocks, "sparse": 0 if is_full else blocks, "one": 1,
           "full": blocks if is_full else 0, "contacts": problem.contacts}  # fmt: skip
    if state.is_coulomb:
        work = state.work
        out |= {"products": work.symbolic.products, "shared": work.sharing.products}
    return out


def of_sweeps(state, memory):
    """{operation: nanoseconds} of sweeps that go on from a memory."""
    never, data, r = watch_for(0.0), sweep_data(state.problem), memory.r.copy()
    deep, quick = Acceleration(state.data, r, 30), Momentum(data, r)
    return {
        "sweep": quickest(lambda n: sweeps(data, r.copy(), n, never)),
        "momentum": quickest(lambda n: quick.sweep(n, never)[0]),
        "Anderson": quickest(lambda n: memory.sweep(n, never)[0]),
        "deep Anderson": quickest(lambda n: deep.sweep(n, never)[0]),
    }


def of_steps(state, r):
    """{operation: nanoseconds} of steps of Newton's kind from r, (nc, 3)."""
    problem, error = state.problem, state.judge(r)
    smooth, shift = SmoothingNewton(), InteriorPoint().shift
    sigma, slip = 100 * error / math.sqrt(problem.contacts), np.zeros(problem.contacts)
    way = Alternation(problem, r, error)

    def steps(n):
        n = min(n, STEPS)
        return abs(state.work.newton(r.copy(), sigma, smooth, goal=0.0, steps=n)[0])

    return {
        "Newton": quickest(steps),
        "relaxation": quickest(
            lambda n: Relaxation.of(state.work, slip, shift).advance(0.0, min(n, STEPS))
        ),
        "Newton in turn": quickest(repeated(lambda: way._step(r, FIRST_SHIFT))),
    }


def measured(problem, most):
    """Sizes of a problem and nanoseconds of all operations."""
    _ = problem.kernel_data, problem.q_norm, problem.blocks.eliminated
    state = State(problem, Target(1e-8), np.zeros((problem.contacts, 3)))
    memory = Acceleration(state.data, state.start, 10)
    memory.sweep(SWEPT, watch_for(0.0))
    r = memory.r.copy()
    row = sizes(state) | of_sweeps(state, memory)
    return row | of_steps(state, r) if state.is_coulomb and state.step_cost < most else row


def besides(row, operation):
    """Nanoseconds of an operation that its constants have no part in."""
    if operation in ("momentum", "Anderson", "deep Anderson"):
        return row["sweep"]
    return 0.0 if operation == "sweep" else 2 * counted.SWEEP_BLOCK * row["blocks"]


def fitted(columns, given, times):
    """x > 0 so that columns (n, k) x + given is near to times (n,)."""
    start = np.zeros(columns.shape[1])

    def off(logarithms):
        return np.log((columns @ np.exp(logarithms) + given) / times)

    return np.exp(least_squares(off, start, loss="soft_l1", f_scale=DISTURBED).x)


def spread(costs, times):
    """Quantiles of counted over measured."""
    return "/".join(f"{x:.2f}" for x in np.quantile(costs / times, (0.1, 0.5, 0.9)))


def told(rows):
    """Print constants, as they are and as they are found."""
    print(f"{'operation':16s} {'constant':18s} {'as it is':>9s} {'found':>9s}")
    for operation, model in MODELS.items():
        there = [row for row in rows if operation in row]
        times = np.array([row[operation] for row in there])
        given = np.array([besides(row, operation) for row in there])
        columns = np.array([[row[size] for size in model.values()] for row in there], float)
        now = np.array([getattr(counted, name) for name in model])
        new = fitted(columns, given, times)
        for name, old, found in zip(model, now, new, strict=True):
            print(f"{operation:16s} {name:18s} {old:9.3g} {found:9.3g}")
        print(f"{'':16s} of {len(there)} problems, counted over measured: "
              f"{spread(columns @ now + given, times)}, "
              f"fitted {spread(columns @ new + given, times)}")  # fmt: skip


def main():
    """Time all problems and print."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--folder", type=Path, default=SHARED / "data/fclib")
    parser.add_argument("--seed", type=int, default=7)
    parser.add_argument("--most", type=float, default=3e7)
    chosen = parser.parse_args()
    made = [*classes(chosen.folder, chosen.seed), *unseen(chosen.seed)]
    problems = [condensed for *_, p in made if (condensed := p.condensed()).contacts >= 20]
    measured(problems[0], chosen.most)  # compiles
    told([measured(problem, chosen.most) for problem in problems])


if __name__ == "__main__":
    main()
