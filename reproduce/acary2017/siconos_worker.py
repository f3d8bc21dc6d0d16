"""Run one solver of Siconos on one problem; needs the Python that carries Siconos.

    python siconos_worker.py PROBLEM.npz SOLVER TOLERANCE[,TOLERANCE...]

PROBLEM.npz holds mu (nc,), the warm start r0, u0 (nc 3,) and, for a SOLVER of the Delassus form
(NSGS, NSN_AC, ...), W in csr and q; for one of the global form (GLOBAL_NSN_AC, ...) M and H in
csc, f, w and v0.  For every tolerance one line of JSON: the tolerance asked, info, processor
seconds of the driver call (best of several where it is short), iterations, and r.

NLS_AC, NLS_JM and NLS_NM are Newton's methods without line search; NLS_HYBRID is NLS_AC after
100 iterations of NSGS, whose time it counts.
"""

import json
import os
import sys
import time

import numpy as np
import scipy.sparse as sp
import siconos.numerics as sn

MAX_ITERATIONS = 100_000
HYBRID_SWEEPS = 100
NLS = {"NLS_AC": "NSN_AC", "NLS_JM": "NSN_AC", "NLS_NM": "NSN_NM", "NLS_HYBRID": "NSN_AC"}
REPEATED = 0.5  # seconds below which a call is repeated


def columns(data, name, shape):
    """A sparse matrix as Siconos reads it: 64-bit indices."""
    kind = sp.csc_matrix if name in "MH" else sp.csr_matrix
    parts = (data[f"{name}_data"], data[f"{name}_indices"], data[f"{name}_indptr"])
    matrix = sp.csc_matrix(kind(parts, shape=shape))
    matrix.sort_indices()
    matrix.indices = matrix.indices.astype(np.int64)
    matrix.indptr = matrix.indptr.astype(np.int64)
    return matrix


def options(name, tolerance):
    """SolverOptions of a name; NSGS_UPK is NSGS with projections for one contact."""
    base = "NSGS" if name == "NSGS_UPK" else NLS.get(name, name)
    family = base.replace("GLOBAL_", "GLOBAL_FRICTION_3D_", 1)
    family = family if base.startswith("GLOBAL_") else f"FRICTION_3D_{base}"
    so = sn.SolverOptions(getattr(sn, f"SICONOS_{family}"))
    if name == "NSGS_UPK":
        inner = sn.SICONOS_FRICTION_3D_ONECONTACT_ProjectionOnConeWithLocalIteration
        sn.solver_options_update_internal(so, 0, inner)
    if name in NLS:
        so.iparam[sn.SICONOS_FRICTION_3D_NSN_LINESEARCH] = (
            sn.SICONOS_FRICTION_3D_NSN_LINESEARCH_NO
        )
    if name == "NLS_JM":
        so.iparam[sn.SICONOS_FRICTION_3D_NSN_FORMULATION] = (
            sn.SICONOS_FRICTION_3D_NSN_FORMULATION_JEANMOREAU_STD
        )
    so.dparam[0] = tolerance
    so.iparam[0] = MAX_ITERATIONS
    return so


def local_problem(data, size, hybrid=False):
    """FrictionContactProblem with W in blocks, and what runs it."""
    failed, matrix = sn.SBM_from_csparse(3, columns(data, "W", (size, size)))
    if failed:
        raise SystemExit("SBM_from_csparse failed")
    problem = sn.FrictionContactProblem()
    problem.dimension, problem.numberOfContacts = 3, size // 3
    problem.M, problem.q, problem.mu = matrix, data["q"].copy(), data["mu"].copy()

    def run(so):
        r, u = data["r0"].copy(), data["u0"].copy()
        began, before = time.process_time(), 0
        if hybrid:
            first = options("NSGS", 1e-300)
            first.iparam[0] = before = HYBRID_SWEEPS
            sn.fc3d_driver(problem, r, u, first)
        info = sn.fc3d_driver(problem, r, u, so)
        return time.process_time() - began, info, r, before + int(so.iparam[1])

    return run


def global_problem(data, size):
    """What runs the GlobalFrictionContactProblem; made anew, because solvers keep factors."""
    n = len(data["f"])
    M, H = columns(data, "M", (n, n)), columns(data, "H", (n, size))

    def run(so):
        problem = sn.GlobalFrictionContactProblem()
        problem.dimension, problem.numberOfContacts = 3, size // 3
        problem.M, problem.H = M, H
        problem.q, problem.b, problem.mu = data["f"].copy(), data["w"].copy(), data["mu"].copy()
        r, u, v = data["r0"].copy(), data["u0"].copy(), data["v0"].copy()
        began = time.process_time()
        info = sn.gfc3d_driver(problem, r, u, v, so)
        return time.process_time() - began, info, r, int(so.iparam[1])

    return run


def main():
    """Print a line for every tolerance."""
    path, name, tolerances = sys.argv[1], sys.argv[2], sys.argv[3].split(",")
    out = os.fdopen(os.dup(1), "w")
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)  # Siconos prints
    sn.numerics_set_verbose(0)
    data = dict(np.load(path))
    size = data["r0"].size
    if name.startswith("GLOBAL_"):
        run = global_problem(data, size)
    else:
        run = local_problem(data, size, name == "NLS_HYBRID")
    print(json.dumps({"ready": True}), file=out, flush=True)
    for text in tolerances:
        seconds, info, r, iterations = run(options(name, float(text)))
        for _ in range(2 if seconds < REPEATED else 0):
            seconds = min(seconds, run(options(name, float(text)))[0])
        r = [float(x) if np.isfinite(x) else 0.0 for x in r]
        line = {"asked": float(text), "info": int(info), "seconds": seconds,
                "iterations": iterations, "r": r}  # fmt: skip
        print(json.dumps(line), file=out, flush=True)


if __name__ == "__main__":
    main()
