"""A thousand random problems that a user might give by mistake or on purpose.

    python benchmarks/abuse.py [--problems 1000] [--seed 1] [--limit 2] [--output FOLDER]

Auto and one other solver in turn solve each; what comes back is checked without the package's
own judge, in the sum over all contacts and for each contact on its own scale.  As many again
have every contact in units of its own, and a tenth as many of each kind of broken input and
machine (`abuse_broken`).  Writes results/abuse.md and abuse.json, and lists every finding.
"""

from __future__ import annotations

import argparse
import json
import time
import warnings
from collections import Counter
from dataclasses import asdict, dataclass, field, fields
from pathlib import Path

import numpy as np
from abuse_broken import Broken, abuse_broken
from abuse_problems import (
    FAMILIES,
    RESCALED,
    Array,
    Case,
    draw,
    draw_rescaled,
    in_other_units,
    tangent_turn,
)
from numpy.typing import NDArray

import amontons as am
from amontons.app.api import solve_any_form
from amontons.core.errors import AmontonsError
from amontons.problem.friction import Form, FrictionProblem
from amontons.problem.law import Tresca
from amontons.problem.solution import FrictionSolution

NOTE = """\
`Auto` and one other solver in turn, options too, solve each problem to 1e-8 (1e-6 in single
precision); what comes back is checked without the package's own judge. Refused: the method does
not fit the problem and says so. A finding is an exception, a warning, a number that is not
finite, an answer called converged that is none or breaks a law, a change with units, order or
frames, a limit overrun, and a solvable problem that Auto leaves. Converged means an error
below the tolerance in the sum and below its root at every contact on its own scale.

In the second table the units of every contact are apart by up to 1e18 from those of others (W
becomes S W S): there a solvable problem that Auto leaves is no finding.
"""
BROKEN = """\
Index arrays of sparse matrices that lie, arguments that are no arrays of numbers, FCLib and
case files with wrong bytes, files that may not grow beyond a size drawn up to 80 kB, processes
that fork after a solve. A finding is a crash, a hang, an exception that is not ours, a warning,
a message of more than 2 000 letters, a temporary file that stays.
"""
MARGIN = 1.0  # seconds that one compiled call may take beyond the limit
ROUNDING = 1e-10  # relative difference of two evaluations of the same error
SCALES = (2.0**20, 2.0**-14)  # length and force: exact in binary, so is what they lead to
SOLVERS = {
    "gauss-seidel": am.GaussSeidel(),
    "gauss-seidel adaptive": am.GaussSeidel(batch=am.Batch.ADAPTIVE),
    "gauss-seidel anderson": am.GaussSeidel(anderson_depth=8, batch=10),
    "gauss-seidel relaxed": am.GaussSeidel(relaxation=1.4, batch=10),
    "gauss-seidel newton": am.GaussSeidel(local=am.LocalSolver.NEWTON, batch=10),
    "gauss-seidel projection": am.GaussSeidel(local=am.LocalSolver.PROJECTION, batch=10),
    "newton": am.SemismoothNewton(),
    "newton split goldstein": am.SemismoothNewton(
        rho_strategy=am.RhoStrategy.SPLIT, line_search=am.GoldsteinPrice()
    ),
    "newton jean-moreau": am.SemismoothNewton(
        am.JeanMoreau(), rho_strategy=am.RhoStrategy.SPLIT_CONDITION, line_search=am.Armijo()
    ),
    "newton natural-map": am.SemismoothNewton(
        am.NaturalMap(), rho_strategy=am.RhoStrategy.SPECTRAL
    ),
    "newton full-step": am.SemismoothNewton(
        rho_strategy=am.RhoStrategy.GLOBAL, line_search=am.FullStep()
    ),
    "newton whole": am.SemismoothNewton(linear=am.Direct()),
    "smoothing-newton": am.SmoothingNewton(),
    "proximal-point": am.ProximalPoint(),
    "compressed-delassus": am.CompressedDelassus(),
    "hybrid": am.Hybrid(),
}


# ------------------------------------------------------- the error, without the package
def norm(x: Array) -> float:
    """Euclidean norm that does not under- or overflow."""
    size = float(np.abs(x).max(initial=0.0))
    if not np.isfinite(size):
        return np.inf
    return size * float(np.sqrt(np.sum((x / size) ** 2))) if size > 0 else 0.0


def project(x: Array, mu: float) -> Array:
    """Nearest point of the cone |x_T| <= mu x_N, by its three cases."""
    normal, tangent = x[0], norm(x[1:])
    if tangent <= mu * normal:
        return x
    if mu * tangent <= -normal:
        return 0 * x
    along = (normal + mu * tangent) / (1 + mu**2)
    edge = np.concatenate([[1.0], mu * x[1:] / tangent]) if tangent > 0 else np.eye(len(x))[0]
    return along * edge


def contact_error(r: Array, u: Array, coefficient: float, tresca: bool, size: float) -> float:
    """|r - P(r - û / size)| size of one contact with |W_ii| = size > 0, unit of u."""
    x = r - u / size
    if tresca:
        p = np.concatenate([[max(x[0], 0)], x[1:]])
        length = norm(x[1:])
        p[1:] *= 1 if length <= coefficient else coefficient / length
    else:
        x[0] -= coefficient * norm(u[1:]) / size
        p = project(x, coefficient)
    return max(size * norm(r - p), -0.5 * u[0])


@dataclass(frozen=True, eq=False)
class Evidence:
    """What an answer is measured with: u, |W_ii| of each contact, their scale, other errors."""

    u: Array
    sizes: Array
    scale: float
    imbalance: float = 0.0


def evidence(problem: FrictionProblem, found: FrictionSolution) -> Evidence:
    """From dense matrices, formed here."""
    r, d, nc = found.r, problem.dimension, problem.contacts
    if problem.form is Form.DELASSUS:
        W, q = dense(problem.W), np.asarray(problem.q)
    else:
        M, H = dense(problem.M), dense(problem.H)
        if np.linalg.matrix_rank(M) < len(M):
            return balance(problem, found, M, H)
        W = H.T @ np.linalg.solve(M, H)
        q = (H.T @ np.linalg.solve(M, problem.f)).reshape(nc, d) + problem.w
    own = [W[d * i : d * i + d, d * i : d * i + d] for i in range(nc)]
    u = (W @ r.ravel()).reshape(nc, d) + q
    return Evidence(u, np.array([np.linalg.norm(A, 2) for A in own]), norm(q))


def balance(problem: FrictionProblem, found: FrictionSolution, M: Array, H: Array) -> Evidence:
    """M singular: equilibrium is part of the error, and the nodes' own stiffness the scale."""
    d, nc = problem.dimension, problem.contacts
    D = np.zeros_like(M)
    for k in range(0, len(M), d):
        D[k : k + d, k : k + d] = np.linalg.pinv(M[k : k + d, k : k + d])
    own = [H[:, d * i : d * i + d] for i in range(nc)]
    sizes = np.array([np.linalg.norm(A.T @ D @ A, 2) for A in own])
    residual = norm(M @ found.v - H @ found.r.ravel() - problem.f) / norm(problem.f)
    u = (H.T @ found.v).reshape(nc, d) + problem.w
    return Evidence(u, sizes, norm(problem.w), residual)


def dense(matrix) -> NDArray:
    return np.asarray(matrix.toarray() if hasattr(matrix, "toarray") else matrix)


def errors(problem: FrictionProblem, r: Array, e: Evidence) -> Array:
    """Error of each contact, unit of u; infinite where one that can not react does."""
    tresca = isinstance(problem.law, Tresca)
    out = np.zeros(len(r))
    for i, coefficient in enumerate(problem.law.coefficient):
        if e.sizes[i] > 0:
            out[i] = contact_error(r[i], e.u[i], coefficient, tresca, e.sizes[i])
        else:
            out[i] = np.inf if r[i].any() else max(-e.u[i, 0], 0.0)
    return out


def contactwise(problem: FrictionProblem, r: Array, e: Evidence) -> float:
    """Largest error of a contact beside |q_i| + sum of |W_ij| |r_j|; 0 where there is no W."""
    if problem.form is not Form.DELASSUS:
        return 0.0
    W, d = dense(problem.W), problem.dimension
    out = 0.0
    for i, error in enumerate(errors(problem, r, e)):
        rows = W[d * i : d * i + d]
        parts = [np.linalg.norm(rows[:, d * j : d * j + d], 2) * norm(r[j])
                 for j in np.flatnonzero(r.any(axis=1))]  # fmt: skip
        scale = norm(np.asarray(problem.q)[i]) + sum(parts)
        if error > 0:
            out = max(out, error / scale if scale > 0 else np.inf)
    return out


def relative(problem: FrictionProblem, r: Array, e: Evidence) -> float:
    """The error that decides."""
    total = norm(errors(problem, r, e))
    if e.scale == 0:
        return 0.0 if total == 0 and not r.any() else np.inf
    return max(total / e.scale, e.imbalance)


# ---------------------------------------------------------------------------- the checks
@dataclass
class Run:
    """One solve of one problem."""

    number: int
    family: str
    solver: str
    contacts: int
    dimension: int
    solvable: bool | None
    outcome: str
    error: float = np.inf
    seconds: float = 0.0
    findings: list[str] = field(default_factory=list)


def attempt(
    case: Case, solver, limit: float, iterations: int | None = None
) -> FrictionSolution:
    """A solve in the form that the solver takes; every warning is an error."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        return solve_any_form(
            case.problem, solver, tolerance=case.tolerance, time_limit=limit,
            max_iterations=iterations, callback=lambda step, iterate: None,
        )  # fmt: skip


def abuse(
    number: int, family: str, case: Case, name: str, *, limit: float,
    iterations: int | None = None, must: bool = True,
) -> Run:  # fmt: skip
    """Solve and check; nothing is raised.  must: Auto has to solve what can be solved."""
    p = case.problem
    run = Run(number, family, name, p.contacts, p.dimension, case.solvable, "refused")
    solver = SOLVERS.get(name)
    began = time.perf_counter()
    try:
        found = attempt(case, solver, limit, iterations)
    except AmontonsError as reason:  # a sentence for the user, such as the wrong law
        run.seconds = time.perf_counter() - began
        if name == "auto":
            run.findings.append(f"refused: {reason}")
        return run
    except Exception as reason:  # noqa: BLE001  that is what is looked for
        run.findings.append(f"{type(reason).__name__}: {reason}")
        run.outcome = "raised"
        return run
    run.seconds = time.perf_counter() - began
    run.outcome = found.convergence.outcome.name.lower()
    if run.seconds - found.convergence.compiling > limit + MARGIN:
        run.findings.append(f"took {run.seconds:.1f} s with a limit of {limit} s")
    run.findings += faults(case, found)
    if np.isfinite(found.r).all():
        run.error = relative(p, found.r, evidence(p, found))
    if must and name == "auto" and case.solvable and not found.converged:
        run.findings.append(f"not solved: {run.outcome}, error {run.error:.1e}")
    return run


def faults(case: Case, found: FrictionSolution) -> list[str]:
    """What is wrong with an answer, whatever its outcome."""
    p, r = case.problem, found.r
    arrays = [r, found.u] + ([found.v] if found.v is not None else [])
    if not all(np.isfinite(a).all() for a in arrays):
        return ["not finite"]
    e = evidence(p, found)
    each, error, reported = errors(p, r, e), relative(p, r, e), found.convergence.error
    out = []
    blur = np.finfo(float).eps * norm(r * e.sizes[:, None])  # in the velocities of huge r
    blur = 10 * blur / e.scale if e.scale > 0 else 0.0
    if abs(error - reported) > 1e-3 * max(error, reported) + 0.1 * case.tolerance + blur:
        out.append(f"error {reported:.3e} reported, {error:.3e} found")
    record = found.convergence
    weak = record.contact_error is not None and record.contact_error > record.contact_tolerance
    if found.converged != (reported <= case.tolerance and not weak):
        out.append("outcome and error disagree")
    if not found.converged:
        return out
    single = contactwise(p, r, e)
    if single > case.tolerance**0.5 * (1 + 1e-3) + ROUNDING:
        out.append(f"called converged with a contact at {single:.1e} of its own scale")
    if error > case.tolerance * (1 + 1e-3) + ROUNDING:
        out.append(f"called converged at {error:.1e}")
    if case.solvable is False:
        out.append("solved a problem without solution")
    return out + broken_laws(p, r, e, each)


def broken_laws(p: FrictionProblem, r: Array, e: Evidence, each: Array) -> list[str]:
    """Laws of contact and friction, to what the error of each contact allows."""
    able = e.sizes > 0
    rho = np.where(able, 1 / np.where(able, e.sizes, 1), 0.0)
    force, speed = np.linalg.norm(r, axis=1), np.linalg.norm(e.u, axis=1)
    bound = p.law.bound(r)
    friction = 1 + (0 if isinstance(p.law, Tresca) else p.law.coefficient)
    slack = each + 1e-12 * (e.scale + force * e.sizes)
    excess = np.linalg.norm(r[:, 1:], axis=1) - bound
    power = (r[:, 1:] * e.u[:, 1:]).sum(axis=1)
    gap = np.abs(r[:, 0] * e.u[:, 0])
    allowed = 4 * friction**2 * slack * (force + rho * (slack + speed))
    found = {
        "tension": -r[:, 0] > rho * slack,
        "friction beyond its bound": excess > 2 * friction * rho * slack,
        "penetration": -e.u[:, 0] > 2 * slack,
        "contact without complementarity": gap > allowed,
        "friction that drives": power > allowed,
    }
    return [f"{name} at contact {np.argmax(bad)}" for name, bad in found.items() if bad.any()]


def equivariance(case: Case, limit: float, iterations: int | None = None) -> list[str]:
    """In units apart by powers of two Auto must do the same, digit by digit.

    Where W is singular reactions are not unique, and a rounding can lead to others:
    under-relaxed sweeps take those of open contacts below the smallest normal number.
    """
    if case.problem.form is not Form.DELASSUS:
        return []
    other = in_other_units(case, *SCALES)
    a = attempt(case, None, limit, iterations)
    b = attempt(other, None, limit, iterations)
    if "TIME_LIMIT" in (a.convergence.outcome.name, b.convergence.outcome.name):
        return []
    if a.convergence.outcome is not b.convergence.outcome:
        return [
            f"{a.convergence.outcome.name} becomes {b.convergence.outcome.name} in other units"
        ]
    if np.linalg.matrix_rank(dense(case.problem.W)) < a.r.size:
        return []
    apart = norm(b.r / SCALES[1] - a.r) / max(norm(a.r), np.finfo(float).tiny)
    return [f"reactions change by {apart:.1e} with the units"] if apart > 1e-9 else []


def order(case: Case, random: np.random.Generator) -> list[str]:
    """The error depends neither on the order of contacts nor on their tangents."""
    p = case.problem
    if p.form is not Form.DELASSUS or case.known is None:
        return []
    nc, d = p.contacts, p.dimension
    turn = random.permutation(nc)
    T = np.zeros((nc * d, nc * d))  # new contact i is the old one turn[i] in another frame
    for i, j in enumerate(turn):
        T[d * i : d * i + d, d * j : d * j + d] = tangent_turn(random, d)
    r = case.known * random.uniform(0.9, 1.1, (nc, 1))
    other = FrictionProblem.from_delassus(
        T @ dense(p.W) @ T.T, T @ np.ravel(p.q), p.law.at(turn)
    )
    a, b = p.error(r), other.error((T @ r.ravel()).reshape(nc, d))
    same = abs(a - b) <= 1e-9 * a + 1e-13
    return [] if same else [f"error {a:.3e} becomes {b:.3e} in another order and frame"]


def abuse_all(
    problems: int, seed: int, *, limit: float, iterations: int | None = None,
    iterations_of_others: int | None = None,
) -> list[Run]:  # fmt: skip
    """All runs; every solver takes its turn in each family."""
    names, runs = list(SOLVERS), []
    for number in range(problems):
        family, case = draw(seed, number)
        turn = number // len(FAMILIES) + number % len(FAMILIES)
        auto = abuse(number, family, case, "auto", limit=limit, iterations=iterations)
        auto.findings += order(case, np.random.default_rng([seed, number, 1]))
        if auto.outcome == "converged":
            auto.findings += equivariance(case, limit, iterations)
        other = abuse(number, family, case, names[turn % len(names)], limit=limit,
                      iterations=iterations_of_others)  # fmt: skip
        runs += [auto, other]
    return runs


def abuse_rescaled(
    problems: int, seed: int, *, limit: float, iterations: int | None = None
) -> list[Run]:
    """Runs on problems whose contacts have units of their own."""
    names, runs = list(SOLVERS), []
    for number in range(problems):
        family, case = draw_rescaled(seed, number)
        other = names[(number // len(RESCALED) + number) % len(names)]
        runs += [
            abuse(number, family, case, name, limit=limit, iterations=iterations, must=False)
            for name in ("auto", other)
        ]
    return runs


# ---------------------------------------------------------------------------- the report
def table(runs: list[Run]) -> list[str]:
    """One line per family."""
    lines = [
        "| family | problems | solvable | Auto solved | Auto else | worst error | slowest | "
        "others solved | others else |",
        "|---|---|---|---|---|---|---|---|---|",
    ]
    for family in dict.fromkeys(run.family for run in runs):
        mine = [run for run in runs if run.family == family]
        auto = [run for run in mine if run.solver == "auto"]
        rest = [run for run in mine if run.solver != "auto"]
        good = [run for run in auto if run.outcome == "converged"]
        solvable = sum(run.solvable is True for run in auto)
        worst = max((run.error for run in good), default=np.nan)
        slowest = max(run.seconds for run in auto)
        solved = sum(run.outcome == "converged" for run in rest)
        lines.append(
            f"| {family} | {len(auto)} | {solvable} | {len(good)} | {unsolved(auto)} | "
            f"{worst:.1e} | {slowest:.2g} s | {solved} of {len(rest)} | {unsolved(rest)} |"
        )
    return lines


def unsolved(runs: list[Run]) -> str:
    """Outcomes other than converged, counted."""
    count = Counter(run.outcome for run in runs if run.outcome != "converged")
    return ", ".join(f"{n} {name.replace('_', ' ')}" for name, n in count.most_common()) or "-"


def table_of_broken(broken: list[Broken]) -> list[str]:
    """One line per family of broken input."""
    lines = ["| broken | cases | refused in words | answered | findings |"]
    lines.append("|---|---|---|---|---|")
    for each in broken:
        counts = [each.counts.get(name, 0) for name in ("refused", "answered", "finding")]
        cells = map(str, (sum(counts), *counts))
        lines.append(f"| {each.family} | " + " | ".join(cells) + " |")
    return lines


def report(
    runs: list[Run], rescaled: list[Run], broken: list[Broken], command: str
) -> str:
    """The page."""
    from machine import describe

    machine = "; ".join(f"{key} {value}" for key, value in describe().items())
    lines = ["# A thousand unkind problems", "", f"Regenerate: `{command}`.", ""]
    lines += [f"{machine}; one thread.", "", NOTE]
    lines += table(runs)
    lines += ["", "## Every contact in units of its own", ""]
    lines += table(rescaled)
    lines += ["", "## Broken input and broken machines", "", BROKEN]
    lines += table_of_broken(broken)
    found = [(run, text) for run in runs + rescaled for text in run.findings]
    others = [text for each in broken for text in each.findings]
    lines += ["", f"## Findings: {len(found) + len(others)}", ""]
    lines += [f"- {text}" for text in others]
    lines += [f"- {run.number} {run.family}, {run.contacts} contacts in {run.dimension}D, "
              f"{run.solver}: {text}" for run, text in found]  # fmt: skip
    return "\n".join(lines) + "\n"


def _short(value: object) -> object:
    """Three digits of a number; null for infinity, which JSON has not."""
    if isinstance(value, float):
        return float(f"{value:.2e}") if np.isfinite(value) else None
    return value


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--problems", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--limit", type=float, default=2.0, help="seconds for each solve")
    parser.add_argument("--output", type=Path, default=Path(__file__).parent / "results")
    options = parser.parse_args()
    for name in (None, *SOLVERS.values()):  # compile before anything is timed
        for number in range(len(FAMILIES)):
            try:
                attempt(draw(0, number)[1], name, 60.0, 3)
            except AmontonsError:
                pass
    runs = abuse_all(options.problems, options.seed, limit=options.limit)
    rescaled = abuse_rescaled(options.problems, options.seed, limit=options.limit)
    broken = abuse_broken(options.problems // 10, options.seed)
    page = report(runs, rescaled, broken,
                  f"python benchmarks/abuse.py --problems {options.problems} "
                  f"--seed {options.seed} --limit {options.limit:g}")  # fmt: skip
    options.output.mkdir(parents=True, exist_ok=True)
    (options.output / "abuse.md").write_text(page)
    rows = [[_short(value) for value in asdict(run).values()] for run in runs + rescaled]
    lines = ",\n".join(json.dumps(row) for row in rows)
    columns = json.dumps([f.name for f in fields(Run)])
    (options.output / "abuse.json").write_text(
        f'{{"columns": {columns}, "rows": [\n{lines}\n]}}\n'
    )
    print(page)


if __name__ == "__main__":
    main()
