"""Run one solver of Siconos on one Delassus problem; needs the Python that carries Siconos.

    python siconos_worker.py PROBLEM.npz SOLVER TOLERANCE[,TOLERANCE...]

PROBLEM.npz holds data, indices, indptr of W (csr), q and mu.  For every tolerance one line of
JSON: the tolerance asked, info, the best time of the driver call in seconds, and r.
"""

import json
import os
import sys
import time

import numpy as np
import scipy.sparse as sp
import siconos.numerics as sn

MAX_ITERATIONS = 100_000


def options(name, tolerance):
    base = "NSGS" if name == "NSGS_UPK" else name
    so = sn.SolverOptions(getattr(sn, "SICONOS_FRICTION_3D_" + base))
    if name == "NSGS_UPK":
        inner = sn.SICONOS_FRICTION_3D_ONECONTACT_ProjectionOnConeWithLocalIteration
        sn.solver_options_update_internal(so, 0, inner)
    so.dparam[0] = tolerance
    so.iparam[0] = MAX_ITERATIONS
    return so


def run(problem, size, name, tolerance):
    r, u = np.zeros(size), np.zeros(size)
    so = options(name, tolerance)
    started = time.process_time()
    info = sn.fc3d_driver(problem, r, u, so)
    return time.process_time() - started, int(info), r


def main():
    path, name, tolerances = sys.argv[1], sys.argv[2], sys.argv[3].split(",")
    out = os.fdopen(os.dup(1), "w")
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)  # Siconos prints
    sn.numerics_set_verbose(0)
    data = np.load(path)
    size = len(data["q"])
    W = sp.csr_matrix((data["data"], data["indices"], data["indptr"]), shape=(size, size))
    columns = sp.csc_matrix(W)
    columns.indices = columns.indices.astype(np.int64)
    columns.indptr = columns.indptr.astype(np.int64)
    failed, matrix = sn.SBM_from_csparse(3, columns)
    if failed:
        raise SystemExit("SBM_from_csparse failed")
    problem = sn.FrictionContactProblem()
    problem.dimension, problem.numberOfContacts = 3, size // 3
    problem.M, problem.q, problem.mu = matrix, data["q"].copy(), data["mu"].copy()
    for text in tolerances:
        seconds, info, r = run(problem, size, name, float(text))
        for _ in range(int(np.clip(0.05 / max(seconds, 1e-9), 2, 49)) if seconds < 0.2 else 0):
            seconds = min(seconds, run(problem, size, name, float(text))[0])
        r = [float(x) if np.isfinite(x) else 0.0 for x in r]
        line = {"asked": float(text), "info": info, "seconds": seconds, "r": r}
        print(json.dumps(line), file=out, flush=True)


if __name__ == "__main__":
    main()
