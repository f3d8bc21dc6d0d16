"""Which solution a method finds: methods with values of their parameters, from many starts.

Where a problem has several solutions, the start, the method and its parameters decide between
them.  Each run is driven until the judge is content with its state, v and r in balance with
one another, and is then told by the solution that it has come to.  What has not converged is
no solution, whatever it looks like.

[Rey] V. Rey, C. R. Mécanique (2026), has such tables for four algorithms.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...core.clock import Deadline, now
from ...core.errors import InvalidInput, NotConverged, SingularOperator, UnsupportedForm
from ...core.faces import Shown
from .methods import Ended, Maker, RunLimits, Runs, methods_of
from .solutions import FAILED, OTHER, Atlas, KnownSolution
from .starts import Drawing, Start, Starts, drawn, size_of_displacements, size_of_reactions

SCHEMA = "amontons/basins/1"
ENDINGS = (OTHER, FAILED)


@dataclass(frozen=True)
class BasinRun:
    """One run: indices of its method and start, and what it found.

    found: the name of a solution, "other" for a state that the judge takes and that is none of
    the known, or "failed".  distance: of its last state to the nearest known solution, by the
    motion alone, relative as `within`; nearest: the name of that one.  A run can fail at no
    distance: its motion is that of a solution, and its reactions do not hold it.
    """

    method: int
    start: int
    found: str
    outcome: str
    error: float
    iterations: int
    seconds: float
    distance: float
    nearest: str = ""


@dataclass(frozen=True, eq=False, repr=False)
class Basins(Shown):
    """What `basins` found; complete: the solutions are all that there are, with proof.

    scale: energy, unit of sqrt(r u), that distances are relative to.
    missing: runs that were not made, the time being over or the user having stopped; reason
    and ended say why the list is complete or not, and why runs are missing.
    """

    solutions: tuple[KnownSolution, ...]
    methods: tuple[Runs, ...]
    starts: tuple[Start, ...]
    runs: tuple[BasinRun, ...]
    complete: bool
    reason: str
    tolerance: float
    within: float
    seed: int
    seconds: float
    scale: float = 1.0
    missing: int = 0
    ended: str = ""
    name: str = ""

    @property
    def finished(self) -> bool:
        """True when all runs were made."""
        return self.missing == 0

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the solutions, and of the endings without one that occur."""
        used = {run.found for run in self.runs}
        return (*(one.name for one in self.solutions), *(e for e in ENDINGS if e in used))

    def count(self, method: int | None = None, kind: str | None = None) -> dict[str, int]:
        """How many runs found what: of a method, by its index, or from one kind of start."""
        chosen = Counter(
            run.found for run in self.runs
            if method in (None, run.method) and kind in (None, self.starts[run.start].kind)
        )  # fmt: skip
        return {name: chosen[name] for name in self.names}

    @property
    def counts(self) -> dict[str, dict[str, int]]:
        """The same for every method, by its label."""
        return {m.label: self.count(k) for k, m in enumerate(self.methods)}

    def found(self, method: int, start: int) -> str:
        """What one run found; "" where it was not made."""
        return next(
            (run.found for run in self.runs if (run.method, run.start) == (method, start)), ""
        )

    def table(self) -> list[dict[str, Any]]:
        """One row per method and kind of start: method, parameters, start, runs, counts."""
        kinds = list(dict.fromkeys(start.kind for start in self.starts))
        rows = []
        for k, method in enumerate(self.methods):
            for kind in kinds:
                counts = self.count(k, kind)
                rows.append({"method": method.method, **method.parameters, "start": kind,
                             "runs": sum(counts.values()), **counts})  # fmt: skip
        return rows

    def record(self) -> dict[str, Any]:
        """What JSON files hold, schema amontons/basins/1, but for versions and title."""
        return {
            "schema": SCHEMA, "name": self.name, "tolerance": self.tolerance,
            "within": self.within, "scale": self.scale, "seed": self.seed,
            "complete": self.complete, "reason": self.reason,
            "solutions": [
                {"name": s.name, "pattern": s.pattern, "source": s.source, "error": s.error,
                 "energy": s.energy, "freedom": s.freedom, "r": s.r.tolist(),
                 "u": s.u.tolist()}
                for s in self.solutions
            ],
            "methods": [
                {"label": m.label, "method": m.method, "parameters": _plain(m.parameters)}
                for m in self.methods
            ],
            "starts": [{"kind": s.kind, "number": s.number} for s in self.starts],
            "runs": [dict(vars(run)) for run in self.runs],
            "counts": self.counts, "missing": self.missing, "ended": self.ended,
            "seconds": self.seconds,
        }  # fmt: skip

    def __str__(self) -> str:
        proof = "there is no other" if self.complete else "there may be others"
        count = f"{len(self.solutions)} solution" + ("s" if len(self.solutions) != 1 else "")
        lines = [f"{count}; {proof}: {self.reason}"]
        lines += [f"  {s.name}: {s.pattern}, error {s.error:.1e}, {s.source}"
                  for s in self.solutions]  # fmt: skip
        for label, counts in self.counts.items():
            words = ", ".join(f"{n} {name}" for name, n in counts.items() if n)
            lines.append(f"{label}: {words or 'no run'}")
        if self.missing:
            lines.append(f"{self.missing} runs are missing: {self.ended}")
        return "\n".join(lines)


@dataclass(frozen=True)
class StudyOptions:
    """What `basins` takes, checked."""

    draws: int
    seed: int
    tolerance: float
    within: float
    max_iterations: int | None
    run_limit: float | None
    reaction_size: float | None
    displacement_size: float | None

    def __post_init__(self) -> None:
        for name in ("draws", "seed", "max_iterations"):
            value, least = getattr(self, name), 0 if name == "seed" else 1
            whole = isinstance(value, int) and not isinstance(value, bool)
            if not (value is None and name == "max_iterations") and not (
                whole and value is not None and value >= least
            ):
                raise InvalidInput(f"{name}: expected a whole number >= {least}, got {value!r}")
        for name in ("tolerance", "within"):
            value = getattr(self, name)
            if not (_is_number(value) and 0 < value < 1):
                raise InvalidInput(f"{name}: expected a number between 0 and 1, got {value!r}")
        for name in ("run_limit", "reaction_size", "displacement_size"):
            value = getattr(self, name)
            if value is not None and not (_is_number(value) and 0 < value < 1e100):
                raise InvalidInput(f"{name}: expected a number > 0, got {value!r}")


def study(
    atlas: Atlas, methods: Any, parameters: Any, starts: Starts | None, options: StudyOptions,
    deadline: Deadline, callback: Callable[[int, int], None] | None = None,
    makers: Mapping[str, Maker] | None = None,
) -> Basins:  # fmt: skip
    """All runs, method by method; callback(done, all) after each."""
    began, problem = now(), atlas.problem
    variants = methods_of(methods, parameters, makers)
    chosen = drawn(starts, options.draws, _drawing(atlas, options))
    runs: list[BasinRun] = []
    ended = ""
    every = len(variants) * len(chosen)
    for m, method in enumerate(variants):
        for s, start in enumerate(chosen):
            if deadline.passed:
                ended = f"the time is over: {deadline}"
                break
            run, stopped = _one(atlas, method, start, m, s, options, deadline)
            if stopped:
                ended = "stopped by the user"
                break
            if run is None:
                continue  # cut by the end of the time: it says nothing of the method
            runs.append(run)
            if callback is not None:
                callback(len(runs), every)
        if ended:
            break
    if len(runs) < every and not ended:
        ended = f"the time is over: {deadline}"
    return Basins(
        tuple(atlas.known), tuple(variants), tuple(chosen), tuple(runs), atlas.complete,
        atlas.reason, options.tolerance, options.within, options.seed, now() - began,
        atlas.scale, every - len(runs), ended, problem.name,
    )  # fmt: skip


def _drawing(atlas: Atlas, options: StudyOptions) -> Drawing:
    problem, known = atlas.problem, tuple(atlas.known)
    return Drawing(
        problem, known, options.reaction_size or size_of_reactions(problem, known),
        options.displacement_size or size_of_displacements(problem, known), options.seed,
    )  # fmt: skip


def _one(
    atlas: Atlas, method: Runs, start: Start, m: int, s: int, options: StudyOptions,
    deadline: Deadline,
) -> tuple[BasinRun | None, bool]:  # fmt: skip
    """One run, None where the time of all ended it; and whether the user has stopped it."""
    began = now()
    own = deadline if options.run_limit is None else deadline.within(options.run_limit)
    limits = RunLimits(options.tolerance, options.max_iterations, own)
    try:
        ended = method.run(atlas.problem, start.iterate, limits)
    except (UnsupportedForm, SingularOperator, InvalidInput) as reason:
        raise type(reason)(f"{method.label}: {reason}") from reason
    except NotConverged as reason:
        raise InvalidInput(f"{method.label}: expected an end, it raised: {reason}") from reason
    if ended.by_user:
        return None, True
    if ended.outcome == "time_limit" and deadline.passed:
        return None, False
    far, nearest = _nearest(atlas, ended)
    name = FAILED
    if ended.converged:
        within = method.within or options.within
        name, far = atlas.tell(
            ended.r, ended.v, ended.pattern, within, deadline, options.tolerance
        )
    return BasinRun(m, s, name, ended.outcome, ended.error, ended.iterations, now() - began,
                    far, nearest), False  # fmt: skip


def _nearest(atlas: Atlas, ended: Ended) -> tuple[float, str]:
    """Distance and name of the nearest solution; infinite where there is none."""
    states = [part for part in (ended.r, ended.v) if part is not None]
    if not states or not all(np.isfinite(part).all() for part in states):
        return np.inf, ""
    with np.errstate(over="ignore", invalid="ignore"):
        far = atlas.distances(ended.r, ended.v)
    if not len(far) or not np.isfinite(far).all():
        return np.inf, ""
    k = int(np.argmin(far))
    return float(far[k]), atlas.known[k].name


def _plain(parameters: Any) -> dict[str, Any]:
    """Values as JSON can hold them."""
    return {
        key: value if isinstance(value, int | float | str | bool | None) else
        str(getattr(value, "value", value))
        for key, value in parameters.items()
    }  # fmt: skip


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float | np.number) and not isinstance(value, bool)


def check_callback(callback: Any) -> None:
    """Raise InvalidInput for what can not be called."""
    if callback is not None and not callable(callback):
        raise InvalidInput(f"callback: expected a function, got {callback!r}")
