"""Auto beside the best of its own methods in hindsight, on classes of cone problems.

    python benchmarks/race.py [--seed 7] [--cap 3] [--traces FILE] [--kept] [--tune COUNT]
    python benchmarks/race.py --unseen [...]

The problems are those of `classes.py`; --unseen takes those by which no constant was chosen but
those of plateaus and of what waits, `Entry.again`, `Entry.trial` and `Entry.waits` in the table
of `solvers/auto/portfolio.py`, WINDOW and LULL in `race.py` there, and these at seeds 3, 7, 12
and 31.  Every track of the table in `solvers/auto/portfolio.py`
runs alone on each of them for at most `cap` CPU seconds, those of Newton's kind from 60
accelerated sweeps, as in the race; the *oracle* is the fastest of them.  Auto is a whole solve,
judge and bookkeeping included, for at most `cap` or PATIENCE times the oracle; like a track it
is asked for the error in the sum.  CPU seconds, one thread, blocks and diagonal prepared; what
a method makes of them itself, as a symbolic factor, counts on both sides.

--tune COUNT draws so many constants of the race at random and simulates it on the recorded
traces, where tracks do not exchange reactions: the best for all classes, and for all but one,
which is then scored with them.
Writes results/race.md beside this file, or results/race_unseen.md.
"""

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")

import argparse
import copy
import gc
import math
import pickle
import random
import time
from collections import defaultdict
from pathlib import Path

import numpy as np
from classes import classes, unseen
from machine import describe

import amontons as am
from amontons.solvers.auto import race as rules
from amontons.solvers.auto.portfolio import TRACKS
from amontons.solvers.auto.race import Track
from amontons.solvers.auto.state import State
from amontons.solvers.contract import Target
from amontons.solvers.sweeps.kernels import Acceleration, watch_for

HERE = Path(__file__).parent
SHARED = Path(os.environ.get("AMONTONS_SHARED", HERE.parents[1] / "shared"))
TOLERANCES = (1e-3, 1e-6, 1e-8)
SWEPT = 60  # accelerated sweeps before a method of Newton's kind
RUNS = 3  # of what takes less than BRIEF seconds; the best counts
BRIEF = 0.1
PATIENCE = 10.0  # times the oracle that Auto may take
UNSOLVED = 100.0  # ratio of what is not solved though a track solves it
ALONE = tuple(entry for entry in TRACKS if entry.name != "restarts")


COLUMNS = ("| problems | solves | geometric mean | 90 % | worst |", "|---|---|---|---|---|")
HEAD = """# Auto beside the best of its methods in hindsight

Regenerate: `{command}`.

{machine}

CPU time of a whole solve by Auto over that of the fastest of its own tracks alone (the oracle),
which no judge and no bookkeeping slows down, to the same error in the sum.  {unsolved:g}: not
solved in {patience:g} times that.
"""
TRACKED = """
Each track alone, over the oracle; and the race without it, simulated, over the race with all.

| track | solves | geometric mean | 90 % | worst | best of all in | unsolved | without it |
|---|---|---|---|---|---|---|---|"""

CROSSED = """
Simulated on the traces: with the constants of the race, with the best of {count} random draws
about them, and on each class with those that are the best on all others.

| problems | solves | geometric mean | 90 % | worst |
|---|---|---|---|---|"""


# ------------------------------------------------------------------------------ traces
def prepared(problem):
    """It, with all that is made before a solve: blocks, diagonal, norms."""
    _ = problem.kernel_data, problem.q_norm, problem.blocks.eliminated
    return problem


def trace(problem, entry, cap):
    """What a track does alone: first error, CPU seconds before it, and after each chunk.

    Rows of CPU seconds, cost in ns by operations, best error, the error from which its rate is
    told, and the cost at which that began; None where it does not run.
    """
    problem = prepared(problem.fresh())
    state = State(problem, Target(1e-8), np.zeros((problem.contacts, 3)))
    if not entry.when(state):
        return None
    before = 0.0
    if entry.needs is not None:
        began = time.process_time()
        memory = Acceleration(state.data, state.start, 10)
        memory.sweep(SWEPT, watch_for(0.0))
        before = time.process_time() - began
        state.offer(memory.r.copy(), SWEPT, "")
        state.swept, state.swept_error = state.r, state.error
        state.first_error = min(state.error, state.first_error)
    track, rows, seconds = Track(entry, state), [], 0.0
    gc.disable()
    while seconds < cap and (not rows or rows[-1][2] > 0.9e-8):
        began = time.process_time()
        found = track.advance()
        seconds += time.process_time() - began
        if found is None:
            break
        path = track.path[-1][1] / problem.q_norm
        rows.append((seconds, track.cost, track.errors[-1] / problem.q_norm, path,
                     track.path[0][0]))  # fmt: skip
    gc.enable()
    first = track.errors[0] / problem.q_norm if track.errors else 1.0
    return first, np.array(rows).reshape(-1, 5), before


def crossing(found, tolerance):
    """CPU seconds until the error is below the tolerance, the sweeps before counted.

    Infinite where these sweeps are there already: they are another method.
    """
    if found is None or found[0] <= tolerance:
        return math.inf
    below = np.flatnonzero(found[1][:, 2] <= tolerance)
    return float(found[1][below[0], 0]) + found[2] if below.size else math.inf


def solved(problem, tolerance, cap):
    """CPU seconds of Auto, infinite where it does not converge; what ended it; error."""
    best = (math.inf, "", math.inf)
    for _ in range(RUNS + 1):
        fresh = prepared(problem.fresh())
        began = time.process_time()

        def late(step, iterate, began=began):
            return time.process_time() - began > cap

        found = am.drive(
            fresh, tolerance=tolerance, contact_tolerance=math.inf, callback=late
        )  # fmt: skip
        seconds = time.process_time() - began
        if found.convergence.compiling > 0:  # its first time
            continue
        if not found.converged:
            return math.inf, found.convergence.detail, found.convergence.error
        best = min(best, (seconds, found.convergence.detail, found.convergence.error))
        if seconds > BRIEF:
            break
    return best


def record(problems, cap, path):
    """Traces of all tracks and times of Auto on all problems, kept in a file as they come."""
    out = []
    for kind, name, given in problems:
        problem = given.condensed()
        if problem.contacts < 20:
            continue
        prepared(problem)
        if not out:  # compile
            for entry in ALONE:
                trace(problem, entry, 0.1)
            solved(problem, 1e-8, 1.0)
        state = State(problem, Target(1e-8), np.zeros((problem.contacts, 3)))
        row = {"kind": kind, "name": name, "contacts": problem.contacts, "traces": {},
               "needs": {}, "trials": {}, "waits": {}, "stacked": {}}  # fmt: skip
        fastest = math.inf
        for entry in ALONE:
            most = min(cap, max(0.2, 8 * fastest))
            found = trace(problem, entry, most)
            if found is not None and found[1].size and found[1][-1, 0] < BRIEF:
                again = trace(problem, entry, most)
                found = min(found, again, key=lambda t: t[1][-1, 0])
            row["traces"][entry.name] = found
            fastest = min(fastest, crossing(found, 1e-8))
            if found is not None and entry.needs is not None:
                row["needs"][entry.name] = entry.needs(state)
            if found is not None and entry.waits is not None:
                row["waits"][entry.name] = entry.waits(state)
            if found is not None and entry.trial is not None:
                row["trials"][entry.name] = entry.trial(state)
            if found is not None and entry.stacked and state.is_stacked:
                each = state.relaxation_cost + rules.CALL
                row["stacked"][entry.name] = entry.stacked * each
        row["auto"] = {}
        for t in TOLERANCES:
            best = oracle(row, t)[0]
            most = max(cap, PATIENCE * best) if best < math.inf else cap
            row["auto"][t] = solved(problem, t, most)
        out.append(row)
        path.write_bytes(pickle.dumps(out))
        print(kind, name, problem.contacts, *(
            f"{row['auto'][t][0]:.2g}/{oracle(row, t)[0]:.2g}" for t in TOLERANCES
        ), oracle(row, 1e-8)[1], "|", row["auto"][1e-8][1], flush=True)  # fmt: skip
    return out


def oracle(row, tolerance, names=None):
    """CPU seconds of the fastest track, and its name."""
    times = [(crossing(found, tolerance), name) for name, found in row["traces"].items()
             if names is None or name in names]  # fmt: skip
    return min(times, default=(math.inf, ""))


# ------------------------------------------------------------------------------ simulation
CONSTANTS = {
    "window": rules.WINDOW, "first": rules.FIRST_CHUNKS, "grace": rules.GRACE,
    "shares": {e.name: e.share for e in ALONE},
    "optimisms": {e.name: e.optimism for e in ALONE},
    "needs": {e.name: 1.0 for e in ALONE if e.needs is not None},
    "near": rules.NEAR, "nears": {e.name: e.near for e in ALONE if e.near},
    "agains": {e.name: e.again for e in ALONE if e.trial is not None},
}  # fmt: skip
LAST = {e.name for e in ALONE if e.last}


def fallen(first, rows):
    """Cost at which what the rate is told from last fell, for each row of a trace."""
    out, mark, since = [], (0.0, first), 0.0
    for _, cost, _, path, begun in rows:
        if begun != since:
            mark, since = (cost, path), begun
        if path < rules.FALL * mark[1]:
            mark = cost, path
        out.append(mark[0])
    return out


class Replay:
    """A track that goes through its trace."""

    def __init__(self, found):
        self.first, self.rows, _ = found
        self.at = 0
        self.foreseen = math.inf  # the least cost at which it has promised the goal
        self.falls = fallen(self.first, self.rows)

    @property
    def cost(self):
        """Nanoseconds so far."""
        return self.rows[self.at - 1, 1] if self.at else 0.0

    @property
    def seconds(self):
        """CPU seconds so far."""
        return self.rows[self.at - 1, 0] if self.at else 0.0

    @property
    def error(self):
        """Best error so far."""
        return self.rows[self.at - 1, 2] if self.at else self.first

    def rate(self, goal, window, first):
        """Cost to the goal at the rate of the last part."""
        path, begun = self.rows[self.at - 1, 3:] if self.at else (self.first, 0.0)
        if self.at < first + np.searchsorted(self.rows[:, 1], begun):
            return math.inf
        since = self.cost - window * (self.cost - begun)
        k = int(np.searchsorted(self.rows[: self.at, 1], since, "right")) - 1
        cost, error = (self.rows[k, 1], self.rows[k, 3]) if k >= 0 else (0.0, self.first)
        if not path < error:
            return math.inf
        rest = math.log(max(path / goal, 1.0))
        return rest * (self.cost - cost) / math.log(error / path)

    @property
    def lull(self):
        """Cost since what its rate is told from last fell by a part of it."""
        return self.cost - self.falls[self.at - 1] if self.at else 0.0

    def soon(self, goal):
        """Cost to the goal at the rate of the last chunk, see `rules.Track.soon`."""
        start = [0.0, 0.0, self.first]
        (_, before, higher), (_, cost, error) = [start, *self.rows[: self.at, :3]][-2:]
        fall = higher / error if self.at > 1 else (higher / error) ** rules.LATER
        rest = math.log(max(error / goal, 1.0)) * (cost - before)
        return rest / math.log(fall) if fall > 1.0 else math.inf

    def promise(self, goal, c):
        """Cost to the goal at its rate, more where it has broken promises."""
        rest = self.rate(goal, c["window"], c["first"])
        self.foreseen = min(self.foreseen, self.cost + rest)
        rest *= max(1.0, self.cost / (c["grace"] * self.foreseen))
        return max(rest, rules.LULL * self.lull)


def simulated(row, goal, c):
    """CPU seconds of the race on the traces, infinite where no track gets there."""
    tracks = {n: Replay(f) for n, f in row["traces"].items()
              if f is not None and len(f[1]) and f[0] > goal}  # fmt: skip
    total, lead = 0.0, next(iter(row["traces"]))
    fall = [(0.0, max((t.first for t in tracks.values()), default=1.0))]

    def spare():
        kinds = {n: -1 if n in row["needs"] else 1 for n in tracks if n not in LAST}
        return sum(kind * tracks[n].cost for n, kind in kinds.items())

    def rest(name, mean):
        track = tracks[name]
        if name in row["needs"]:
            needed = row["needs"][name] * c["needs"][name]
            if name in LAST:
                return needed if track.cost < c["shares"][name] * total else math.inf
            if track.cost < needed:
                waits = not track.at and spare() < row["waits"].get(name, -math.inf)
                return math.inf if waits else needed - track.cost
        promise = track.promise(goal, c)
        likely = c["nears"].get(name, 0.0) * mean
        if track.cost < likely:
            promise = min(promise, likely - track.cost)
        if name in row["trials"]:
            promise = min(promise, c["agains"][name] * max(track.cost, row["trials"][name]))
        unknown = track.cost < c["shares"][name] * total
        return min(promise, c["optimisms"][name] * total) if unknown else promise

    while tracks:
        left = [n for n, t in tracks.items() if t.at < len(t.rows)]
        if not left:
            return math.inf
        first = min(c["first"], 1) if row["stacked"] else c["first"]
        quick = row["stacked"].items()
        second = [n for n, most in quick if n in left and tracks[n].cost < most]
        if lead in left and tracks[lead].at < first:
            name = lead
        elif second:
            needed = row["stacked"][second[0]] - tracks[second[0]].cost
            sooner = lead in left and tracks[lead].soon(goal) < needed
            name = lead if sooner else second[0]
        else:
            mean = rules.whole_way(fall, goal, c["near"])
            rests = {n: rest(n, mean) for n in left}
            name = min(left, key=rests.get)
            if rests[name] == math.inf:
                name = min(left, key=lambda n: tracks[n].cost)
        track = tracks[name]
        before = track.cost
        track.at += 1
        total += track.cost - before
        if track.error < fall[-1][1]:
            fall.append((total, track.error))
        if track.error <= goal:
            return sum(t.seconds for t in tracks.values())
    return math.inf


def ratios(rows, c):
    """Simulated race over the oracle, for all problems and tolerances that a track solves."""
    out = []
    for row in rows:
        for tolerance in TOLERANCES:
            best = oracle(row, tolerance)[0]
            if best < math.inf:
                out.append(min(simulated(row, tolerance, c) / best, UNSOLVED))
    return np.array(out)


def mean(values):
    """Geometric mean."""
    return float(np.exp(np.mean(np.log(values))))


GRID = {
    "window": (0.5, 0.6, 0.7, 0.8, 0.9), "first": (1, 2, 3, 4),
    "grace": (1.0, 1.2, 1.5, 2.0, 4.0),
    "shares": (0.0, 0.02, 0.05, 0.1, 0.15, 0.2, 0.3), "optimisms": (0.1, 0.3, 1.0, 3.0, 10.0),
    "needs": (0.3, 0.5, 0.7, 1.0, 1.5, 2.0), "near": (1.0, 1.2, 1.5, 2.0),
    "nears": (0.0, 1.0, 1.5, 2.0, 3.0), "agains": (2.0, 3.0, 5.0, 8.0, math.inf),
}  # fmt: skip


def draws(count, seed=1):
    """The constants of the race, and others: of each about a third are drawn from the grid."""
    out, random_ = [CONSTANTS], random.Random(seed)
    while len(out) < count:
        c = copy.deepcopy(CONSTANTS)
        for key, values in GRID.items():
            for name in [None] if not isinstance(c[key], dict) else c[key]:
                if random_.random() > 0.3:
                    continue
                if name is None:
                    c[key] = random_.choice(values)
                else:
                    c[key][name] = random_.choice(values)
        out.append(c)
    return out


def best_of(found, chosen):
    """The draw that is best on chosen columns of found: the mean, and a little the worst."""
    scores = [mean(row) * (1 + 0.006 * row.max()) for row in found[:, chosen]]
    return int(np.argmin(scores))


# ------------------------------------------------------------------------------ the page
def line(name, values, *more):
    """A row: number, geometric mean, 90 % quantile, worst."""
    return (f"| {name} | {len(values)} | {mean(values):.2f} | {np.quantile(values, 0.9):.1f} "
            f"| {max(values):.1f} |" + "".join(f" {m} |" for m in more))  # fmt: skip


def measured(rows):
    """Ratios of Auto to the oracle by class and by tolerance."""
    by = defaultdict(list)
    for row in rows:
        for t in TOLERANCES:
            best = oracle(row, t)[0]
            if best < math.inf:
                ratio = min(row["auto"][t][0] / best, UNSOLVED)
                for key in (row["kind"], f"all, to {t:g}", "all"):
                    by[key].append(ratio)
    return by


def page(rows, machine, command, tuning):
    """The whole page."""
    by = measured(rows)
    out = [HEAD.format(command=command, machine=machine, unsolved=UNSOLVED,
                       patience=PATIENCE), *COLUMNS]
    out += [line(key, values) for key, values in by.items()]
    out += [TRACKED]
    whole = ratios(rows, CONSTANTS)
    for entry in ALONE:
        values = []
        for row in rows:
            for t in TOLERANCES:
                best = oracle(row, t)[0]
                if best < math.inf:
                    own = crossing(row["traces"].get(entry.name), t)
                    values.append(min(own / best, UNSOLVED))
        less = [{**row, "traces": {n: f for n, f in row["traces"].items() if n != entry.name}}
                for row in rows]  # fmt: skip
        without = [
            min(simulated(cut, t, CONSTANTS) / oracle(row, t)[0], UNSOLVED)
            for row, cut in zip(rows, less, strict=True) for t in TOLERANCES
            if oracle(row, t)[0] < math.inf
        ]  # fmt: skip
        best, lost = sum(v < 1.02 for v in values), sum(v >= UNSOLVED for v in values)
        worth = f"{mean(without) / mean(whole):.2f}"
        out.append(line(entry.name, values, best, lost, worth))
    out += tuning
    out += ["\nCPU milliseconds, Auto / oracle (its track).\n",
            "| problem | contacts | " + " | ".join(f"{t:g}" for t in TOLERANCES) + " |",
            "|---|---|" + "---|" * len(TOLERANCES)]  # fmt: skip
    for row in rows:
        cells = []
        for t in TOLERANCES:
            seconds, _, error = row["auto"][t]
            own = f"{1e3 * seconds:.3g}" if seconds < math.inf else f"(error {error:.1e})"
            best, name = oracle(row, t)
            theirs = f"{1e3 * best:.3g} ({name})" if best < math.inf else "-"
            cells.append(f"{own} / {theirs}")
        out.append(f"| {row['name']} | {row['contacts']} | " + " | ".join(cells) + " |")
    return "\n".join(out) + "\n"


def crossed(rows, count):
    """Lines of the page: the race simulated with constants found without a class."""
    tried = draws(count)
    found = np.array([ratios(rows, c) for c in tried])
    kinds = np.array([row["kind"] for row in rows for t in TOLERANCES
                      if oracle(row, t)[0] < math.inf])  # fmt: skip
    best = best_of(found, np.full(len(kinds), True))
    print(tried[best])
    out = [CROSSED.format(count=count), line("all, as they are", found[0]),
           line("all, the best draw", found[best])]  # fmt: skip
    left_out = []
    for kind in dict.fromkeys(kinds.tolist()):
        k = best_of(found, kinds != kind)
        own = found[k, kinds == kind]
        out.append(line(f"{kind}, left out", own))
        left_out += list(own)
    return [*out, line("all, left out", left_out)]


def main():
    """Record, or take what was recorded; write the page."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--folder", type=Path, default=SHARED / "data/fclib")
    parser.add_argument("--seed", type=int, default=7)
    parser.add_argument("--cap", type=float, default=3.0)
    parser.add_argument("--unseen", action="store_true")
    parser.add_argument("--traces", type=Path)
    parser.add_argument("--kept", action="store_true", help="take the traces of the last run")
    parser.add_argument("--tune", type=int, default=0, metavar="COUNT")
    chosen = parser.parse_args()
    name = "race_unseen" if chosen.unseen else "race"
    traces = chosen.traces or HERE / f"results/{name}.pickle"
    problems = unseen(chosen.seed) if chosen.unseen else classes(chosen.folder, chosen.seed)
    if chosen.kept:
        rows = pickle.loads(traces.read_bytes())
    else:
        rows = record(problems, chosen.cap, traces)
    command = f"python benchmarks/race.py --seed {chosen.seed} --cap {chosen.cap:g}"
    command += " --unseen" if chosen.unseen else ""
    command += f" --tune {chosen.tune}" if chosen.tune else ""
    machine = "; ".join(f"{k} {v}" for k, v in describe().items())
    text = page(rows, machine, command, crossed(rows, chosen.tune) if chosen.tune else [])
    (HERE / f"results/{name}.md").write_text(text)


if __name__ == "__main__":
    main()
