"""Certificates of uniqueness as files, for `certificate_checker`, which shares no code.

A file holds W (nc d, nc d), q (nc, d), mu (nc,) of the Delassus form, the attributes format,
claim and sha256, and what proves the claim:

    every load   tau, sigma, alpha (nc,), f (nc, d - 1): multipliers of every contact
    this load    r0 (nc, d), patterns (k,) of statuses, V0 ... V(k-1): their multipliers,
                 distance: within which of r0 all solutions are, unit of r
    this load    r0, statuses (nc,), tau, sigma, eta (nc, d - 1), pinned: multipliers of every
                 contact about r0, distance
"""

from __future__ import annotations

import os
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
from ..analysis.scaled import COPIES
from ..core.clock import TimeLimit, deadline_of
from ..core.errors import FileFormatError, InvalidInput
from ..core.hdf5 import check_file
from ..linear.dense import dense
from ..problem.friction import FrictionProblem
from ..solvers.driver import drive
from .certificate_checker import Refused, about, check, digest
from .fclib.memory import write_hdf5

Array = NDArray[np.float64]
FORMAT = "amontons/certificate/1"
# what a file may make of the checker that is not a certificate, or is broken
BROKEN = (Refused, FileFormatError, OSError, KeyError, ValueError, TypeError, IndexError,
          RuntimeError, AttributeError, MemoryError, OverflowError, ZeroDivisionError)
ROOM = 1.1  # times what the checker finds here, for other processors
GENEROUS = 100.0  # times the distance of a certificate: what the checker may find
ABOVE = 1e-9  # relative, at which friction is proved to be safe
SECONDS = 60.0  # whose work multipliers may take that the verdict did not need


def write_certificate(
    problem: FrictionProblem, verdict: Uniqueness, path: str | os.PathLike[str], *,
    time_limit: TimeLimit = None,
) -> str:  # fmt: skip
    """Write what proves a verdict on a Coulomb problem; the claim, "every load" or "this load".

    Multipliers that the verdict did not need (few contacts are decided by all patterns) are
    looked for, with a time limit in seconds, by default the work of about a minute.  The global
    form is condensed.  Raises InvalidInput for a verdict that nothing of this kind proves, with
    the reason; nothing is written then.
    """
    deadline = deadline_of(time_limit, SECONDS)
    local = problem.condensed(deadline)
    W = np.ascontiguousarray(dense(local.W, COPIES))
    q, mu = local.free_velocity, np.array(problem.mu)
    claim, arrays = "every load", None
    if verdict.verdict is Verdict.UNIQUE_EVERY_LOAD:
        arrays = _every_load(W, mu, verdict, deadline)
    if arrays is None and verdict.verdict in (
        Verdict.UNIQUE_EVERY_LOAD, Verdict.UNIQUE_THIS_LOAD
    ):  # fmt: skip
        claim, arrays = "this load", _this_load(local, verdict, deadline)
    if arrays is None:
        raise InvalidInput(
            f"certificate: expected a verdict of uniqueness that multipliers prove, got "
            f"{verdict.verdict.value!r}; lists, regions of 3D solutions and motions alone have "
            "no file format yet"
        )

    def fill(file: h5py.File) -> None:
        file.attrs["format"], file.attrs["claim"] = FORMAT, claim
        for name, values in {"W": W, "q": q, "mu": mu, **arrays}.items():
            file.create_dataset(name, data=values)
        file.attrs["sha256"] = digest(file)

    write_hdf5(path, fill)
    return claim


def check_certificate(path: str | os.PathLike[str]) -> str:
    """What a certificate proves, in a sentence; raises InvalidInput where it proves nothing."""
    try:
        check_file(Path(path))
        return check(os.fspath(path))
    except BROKEN as reason:
        raise InvalidInput(f"{os.fspath(path)}: refused: {reason}") from reason


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
    size = float(np.abs(found.r0).max(initial=0.0))
    return {
        "r0": found.r0, "distance": _room(local, found, size),
        "patterns": np.array([one.pattern for one in branches], dtype="S"),
        **{f"V{k}": one.multipliers for k, one in enumerate(branches)},
    }  # fmt: skip


def _of_contacts(local: FrictionProblem, by: LoadMultipliers) -> Any:
    """Multipliers of every contact about a solution, None where a contact does not react."""
    if not np.linalg.norm(dense(local.W).reshape(local.contacts, -1), axis=1).all():
        return None
    arrays = {"r0": by.r0, "tau": by.tau, "sigma": by.sigma, "eta": by.eta,
              "pinned": by.pinned.astype(np.int8)}  # fmt: skip
    given = {k: v for k, v in arrays.items() if k != "r0"} | {"pinned": by.pinned}
    W, q, mu = dense(local.W), local.free_velocity, np.array(local.mu)
    try:
        far = about(W, q, mu, by.r0, list(by.statuses), **given)
    except Refused:  # it rounds more than the package
        return None
    return {**arrays, "statuses": np.array(list(by.statuses), dtype="S"),
            "distance": ROOM * far}  # fmt: skip


def _room(local: FrictionProblem, found: LoadCertificate, size: float) -> float:
    """The distance of a certificate in the unit of r; the checker counts more generously."""
    rho = local.rho[local.rho > 0]
    load = float(np.abs(local.free_velocity).max(initial=0.0) * rho.max(initial=0.0))
    return GENEROUS * found.distance * max(size, load)

