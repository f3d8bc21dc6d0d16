"""Certificates of uniqueness as files, for `certificate_checker`, which shares no code.

A file holds W (nc d, nc d), q (nc, d), mu (nc,) of the Delassus form, the attributes format,
claim and sha256, and what proves the claim:

    every load   tau, sigma, alpha (nc,), f (nc, d - 1): multipliers of every contact
    this load    r0 (nc, d), statuses (nc,) there, patterns (k,) of statuses, V0 ... V(k-1):
                 their multipliers, distance: within which of r0 all solutions are, unit of r
    this load    r0, statuses (nc,), tau, sigma, eta (nc, d - 1), pinned: multipliers of every
                 contact about r0, distance
    all solutions, all branches   see `certificate_lists`, in 3D `certificate_curves`
"""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from ..analysis.certificates.contact_multipliers import ContactMultipliers, contact_multipliers
from ..analysis.certificates.load_multipliers import LoadMultipliers
from ..analysis.certificates.one_load.answer import LoadBranch, LoadCertificate, LoadOutcome
from ..analysis.certificates.one_load.certificate import certify_load
from ..analysis.certificates.status_pieces import friction_shape
from ..analysis.certificates.verdict import Uniqueness, Verdict
from ..analysis.paths.diagram import Diagram
from ..analysis.scaled import COPIES
from ..analysis.solutions.enumerate import Solutions
from ..analysis.solutions.interval_search import pieces_between
from ..core.clock import Deadline, TimeLimit, deadline_of
from ..core.errors import FileFormatError, InvalidInput, shown
from ..core.hdf5 import check_file
from ..linear.dense import dense
from ..problem.friction import FrictionProblem
from ..solvers.driver import drive
from .certificate_checker import Refused, check, digest, proves
from .certificate_checker.contacts import about
from .certificate_checker.patterns import tree
from .certificate_curves import curves_between
from .certificate_lists import all_branches_between, all_solutions_of
from .fclib.memory import write_hdf5

Array = NDArray[np.float64]
FORMAT = "amontons/certificate/1"
# what a file may make of the checker that is not a certificate, or is broken
BROKEN = (Refused, FileFormatError, OSError, KeyError, ValueError, TypeError, IndexError,
          RuntimeError, AttributeError, MemoryError, OverflowError, ZeroDivisionError)
ROOM = 1.1  # times what the checker finds here, for other processors
ABOVE = 1e-9  # relative, at which friction is proved to be safe
NEARLY = 1e-8  # of the load, velocities of a solution that count as none
SECONDS = 60.0  # whose work multipliers may take that the verdict did not need


def write_certificate(
    problem: FrictionProblem, verdict: Uniqueness | Solutions | Diagram,
    path: str | os.PathLike[str], *, end: FrictionProblem | None = None,
    time_limit: TimeLimit = None,
) -> str:  # fmt: skip
    """Write what proves a verdict on a Coulomb problem; the claim, as in the module.

    A complete list of `all_solutions` is proved as "all solutions", a diagram that is `whole`
    as "all branches" between problem and `end`, in 3D over friction too.  What the verdict did
    not need (few contacts are decided by all patterns) is looked for, with a time limit in
    seconds, by default the work of about a minute.  The global form is condensed.  Raises
    InvalidInput for a verdict that nothing of this kind proves, or that the checker does not
    accept, with the reason; nothing is written then.
    """
    deadline = deadline_of(time_limit, SECONDS)
    local = problem.condensed(deadline)
    W = np.ascontiguousarray(dense(local.W, COPIES))
    q, mu = local.free_velocity, np.array(problem.mu)
    if isinstance(verdict, Solutions):
        claim, arrays = "all solutions", _all_solutions(local, W, verdict, deadline)
    elif isinstance(verdict, Diagram):
        claim, arrays = "all branches", _all_branches(local, verdict, end, deadline)
    elif isinstance(verdict, Uniqueness):
        claim, arrays = _one_solution(local, W, verdict, deadline)
    else:
        raise InvalidInput(f"verdict: expected an answer of `uniqueness`, `all_solutions` or "
                           f"`diagram`, got {shown(verdict)}")  # fmt: skip
    data = {k: np.asarray(x) for k, x in {"W": W, "q": q, "mu": mu, **arrays}.items()}
    try:
        proves(claim, data)
    except (Refused, ValueError) as reason:  # it rounds more than the package
        raise InvalidInput(f"certificate: the checker does not accept it: {reason}") from reason

    def fill(file: h5py.File) -> None:
        # of fixed length: where a byte of HDF5's heap for others is wrong, it can crash
        file.attrs["format"], file.attrs["claim"] = np.bytes_(FORMAT), np.bytes_(claim)
        for name, values in data.items():
            file.create_dataset(name, data=values)
        file.attrs["sha256"] = np.bytes_(digest(file))

    write_hdf5(path, fill)
    return claim


def check_certificate(path: str | os.PathLike[str]) -> str:
    """What a certificate proves, in a sentence; raises InvalidInput where it proves nothing."""
    try:
        check_file(Path(path))
        return check(os.fspath(path))
    except BROKEN as reason:
        raise InvalidInput(f"{os.fspath(path)}: refused: {reason}") from reason


def _one_solution(
    local: FrictionProblem, W: Array, verdict: Uniqueness, deadline: Any
) -> tuple[str, Any]:
    """(claim, arrays) of a verdict that there is one solution."""
    every = verdict.verdict is Verdict.UNIQUE_EVERY_LOAD
    arrays = _every_load(W, np.array(local.mu), verdict, deadline) if every else None
    if arrays is not None:
        return "every load", arrays
    if every or verdict.verdict is Verdict.UNIQUE_THIS_LOAD:
        arrays = _this_load(local, verdict, deadline)
    if arrays is None:
        raise InvalidInput(
            f"certificate: expected a verdict of uniqueness that multipliers prove, got "
            f"{verdict.verdict.value!r}; a 3D solution by regions, and a motion alone, have no "
            "format yet; lists are written from all_solutions, branches from diagram"
        )
    return "this load", arrays


def _all_solutions(
    local: FrictionProblem, W: Array, found: Solutions, deadline: Deadline
) -> Any:
    if local.dimension == 2:
        return all_solutions_of(local, found, deadline)
    if not found.complete:
        raise InvalidInput(f"certificate: expected a complete list, got {found.reason}")
    q, mu = local.free_velocity, np.array(local.mu)
    arrays = curves_between((q, mu), None, W, deadline)
    if len(arrays["r"]) != len(found.solutions):
        raise InvalidInput(f"certificate: {len(arrays['r'])} solutions can be told apart, the "
                           f"list has {len(found.solutions)}")  # fmt: skip
    return arrays


def _all_branches(
    local: FrictionProblem, diagram: Diagram, end: FrictionProblem | None, deadline: Deadline
) -> Any:
    if diagram.whole is None or end is None:
        what = "a diagram that is whole" if end else "end=, the problem at the other load"
        raise InvalidInput(f"certificate: expected {what}; {diagram.reason}")
    last = end.condensed(deadline)
    if local.dimension == 3:
        W, other = (np.array(dense(one.W, COPIES)) for one in (local, last))
        if not np.array_equal(W, other):
            raise InvalidInput("certificate: expected the same W at both ends")
        ends = ((one.free_velocity, np.array(one.mu)) for one in (local, last))
        return curves_between(next(ends), next(ends), W, deadline)
    found = pieces_between(local, last, deadline)
    return all_branches_between(local, last, found, deadline)


def _every_load(W: Array, mu: Array, verdict: Uniqueness, deadline: Any) -> Any:
    """Multipliers at the friction of the problem, None where there are none."""
    friction = float(mu.max(initial=0.0))
    by = None if verdict.critical is None else verdict.critical.multipliers
    d = len(W) // max(len(mu), 1)
    reacts = np.linalg.norm(W.reshape(len(mu), d, -1), axis=(1, 2)) > 0
    if not reacts.all():
        return None
    if by is None or not by.t >= friction:
        by = contact_multipliers(W, friction_shape(mu), deadline,
                                 wanted=friction * (1 + ABOVE))  # fmt: skip
    if not (isinstance(by, ContactMultipliers) and by.t >= friction):
        return None
    return {"tau": by.tau, "sigma": by.sigma, "alpha": by.alpha, "f": by.f}


def _this_load(local: FrictionProblem, verdict: Uniqueness, deadline: Any) -> Any:
    """What proves it: multipliers of every contact, or 2D branches; None without either."""
    found = verdict.certificate
    if found is None:  # few contacts are decided by lists
        solution = verdict.solution or drive(local, tolerance=1e-10, time_limit=deadline)
        found = certify_load(local, solution, time_limit=deadline)
    if not isinstance(found, LoadCertificate) or found.outcome is not LoadOutcome.CERTIFIED:
        return None
    if found.multipliers is not None and found.multipliers.proved:
        return _of_contacts(local, found.multipliers)
    if local.dimension != 2:
        return None
    branches = [one for one in found.branches if isinstance(one, LoadBranch)]
    arrays = {
        "r0": found.r0, "statuses": _statuses(local, found.r0),
        "patterns": np.array([one.pattern for one in branches], dtype="S"),
        **{f"V{k}": one.multipliers for k, one in enumerate(branches)},
    }  # fmt: skip
    return _with_distance(local, tree, arrays)


def _statuses(local: FrictionProblem, r0: Array) -> Any:
    """A letter of every contact of a 2D solution, for `certificate_checker.numbers`."""
    mu, u = np.array(local.mu), np.array(local.velocity(r0)[0])
    small = NEARLY * float(np.abs(local.free_velocity).max(initial=0.0))
    letters = []
    for i, (normal, tangent) in enumerate(r0):
        limit = mu[i] * normal
        if normal == 0:
            letters.append("f" if u[i, 0] > small else "g")
        elif mu[i] == 0 or abs(u[i, 1]) > small:
            letters.append("l")
        elif abs(tangent) >= limit * (1 - 1e-9):
            letters.append("+" if tangent > 0 else "-")
        else:
            letters.append("s")
    return np.array(letters, dtype="S")


def _of_contacts(local: FrictionProblem, by: LoadMultipliers) -> Any:
    """Multipliers of every contact about a solution, None where a contact does not react."""
    if not np.linalg.norm(dense(local.W).reshape(local.contacts, -1), axis=1).all():
        return None
    arrays = {
        "r0": by.r0, "statuses": np.array(list(by.statuses), dtype="S"), "tau": by.tau,
        "sigma": by.sigma, "eta": by.eta, "pinned": by.pinned.astype(np.int8),
    }  # fmt: skip
    return _with_distance(local, about, arrays)


def _with_distance(local: FrictionProblem, proof: Callable[..., float], arrays: Any) -> Any:
    """With how near solutions are, None where the checker rounds more than the package."""
    try:
        far = proof(dense(local.W), local.free_velocity, np.array(local.mu), **arrays)
    except Refused:
        return None
    return {**arrays, "distance": ROOM * far}
