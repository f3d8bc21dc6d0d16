"""Solvers of Siconos on Delassus problems; needs the Python that carries Siconos.

Every line of the input asks for one, in a process of its own, which may be killed:

    PROBLEM.npz SOLVER TOLERANCE[,TOLERANCE...]

PROBLEM.npz holds data, indices, indptr of W (csr), q and mu.  The answer are lines of JSON:
the process; for every tolerance the one asked, info, the best times of the driver call and of
making the problem of arrays, in seconds, and r; process null at the end.
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


def as_columns(data):
    """W with indices of the type that Siconos takes."""
    size = len(data["q"])
    arrays = data["data"], data["indices"], data["indptr"]
    columns = sp.csc_matrix(sp.csr_matrix(arrays, shape=(size, size)))
    columns.indices = columns.indices.astype(np.int64)
    columns.indptr = columns.indptr.astype(np.int64)
    return columns


def made(data):
    """The problem of Siconos from arrays of the csc form, and CPU seconds of that."""
    q, mu, columns = data["q"], data["mu"], as_columns(data)
    size = len(q)
    began = time.process_time()
    failed, matrix = sn.SBM_from_csparse(3, columns)
    if failed:
        raise SystemExit("SBM_from_csparse failed")
    problem = sn.FrictionContactProblem()
    problem.dimension, problem.numberOfContacts = 3, size // 3
    problem.M, problem.q, problem.mu = matrix, q.copy(), mu.copy()
    return problem, time.process_time() - began


def solve(path, name, tolerances, out):
    """One line of JSON for every tolerance."""
    data = np.load(path)
    problem, conversion = made(data)
    for _ in range(int(np.clip(0.05 / max(conversion, 1e-9), 2, 19))):
        conversion = min(conversion, made(data)[1])
    size = len(data["q"])
    for text in tolerances.split(","):
        seconds, info, r = run(problem, size, name, float(text))
        for _ in range(int(np.clip(0.05 / max(seconds, 1e-9), 2, 49)) if seconds < 0.2 else 0):
            seconds = min(seconds, run(problem, size, name, float(text))[0])
        r = [float(x) if np.isfinite(x) else 0.0 for x in r]
        line = {"asked": float(text), "info": info, "seconds": seconds,
                "conversion": conversion, "r": r}  # fmt: skip
        print(json.dumps(line), file=out, flush=True)


def main():
    out = os.fdopen(os.dup(1), "w")
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)  # Siconos prints
    sn.numerics_set_verbose(0)
    for line in sys.stdin:
        path, name, tolerances = line.split()
        child = os.fork()
        if not child:
            solve(path, name, tolerances, out)
            os._exit(0)
        print(json.dumps({"process": child}), file=out, flush=True)
        os.waitpid(child, 0)
        print('\n{"process": null}', file=out, flush=True)  # a killed one leaves half a line


if __name__ == "__main__":
    main()
