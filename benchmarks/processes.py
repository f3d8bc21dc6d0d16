"""Several processes of MPI against one, and against one without PETSc: time, memory, messages.

    python benchmarks/processes.py --cells 32 64 --kinds hex tet --processes 1 2 4

needs the extra `distributed` and mpirun, see docs/distributed.md.  A row is the cube of
`examples/distributed.py` with so many cells an edge.  Waiting processes yield their core; on a
machine with other load look at the CPU seconds, which contain less of the waiting.  The page is
written after every row; with --resume its rows are kept and only missing ones run.
Tetrahedra with a million unknowns:

    python benchmarks/processes.py --cells 32 48 69 --kinds tet --processes 1 2 4 --resume

of which every run ends after --seconds, or when a process asks for more than --megabytes.
"""

import argparse
import json
import os
import re
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from machine import describe

import amontons as am

PAGE = Path(__file__).parent / "results" / "processes.md"
MPI = {"OMPI_MCA_mpi_yield_when_idle": "1", "OMPI_ALLOW_RUN_AS_ROOT": "1",
       "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1", "OMP_NUM_THREADS": "1"}  # fmt: skip
COLUMNS = ("kind", "cells an edge", "unknowns", "contacts", "processes", "wall s", "CPU s each",
           "peak MB each", "Newton steps", "linear iterations", "coarse matrices made",
           "messages each", "their MB each", "sums over all", "load")  # fmt: skip


WORDS = (
    "The cube of examples/distributed.py to 1e-8, making the mesh included. Peaks are of whole "
    "processes: some 230 MB of each are Python and its libraries. Messages and sums contain "
    "those of a small solve before; without PETSc the same solve has run before. Load: "
    "processes that want a core, before each run."
)


def model(kind, cells):
    """The cube of examples/distributed.py, any number of cells an edge."""
    block = am.Body(am.box((1, 1, 1), cells=cells, kind=kind), am.LinearElastic(200, 0.3))
    return am.Model(
        [block],
        supports=[am.Fix("top", lambda x: (0, 0.2, 0.06 - 0.15 * x[0]))],
        contacts=[am.Contact("bottom", am.Plane(normal=(0, 0, 1)), mu=1.0)],
    )


def used(started):
    """Wall and CPU seconds since, and the peak of memory in MB."""
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    return time.perf_counter() - started[0], time.process_time() - started[1], peak


def alone(kind, cells, tolerance):
    """One process without PETSc."""
    am.solve(model(kind, cells), tolerance=tolerance)  # compiles what this size needs
    started = time.perf_counter(), time.process_time()
    solution = am.solve(model(kind, cells), tolerance=tolerance)
    wall, cpu, peak = used(started)
    problem = solution.problem
    return {
        "unknowns": problem.unknowns, "contacts": problem.contacts, "wall": wall, "cpu": [cpu],
        "peak": [peak], "resultant": solution.fields.resultant.tolist(), "steps": "",
        "iterations": "", "rebuilt": "",
    }  # fmt: skip


def together(kind, cells, tolerance):
    """One of the processes; the first one returns what all have used."""
    am.distributed(lambda: model(kind, 6), tolerance=tolerance)  # compiles
    from mpi4py import MPI

    MPI.COMM_WORLD.barrier()
    started = time.perf_counter(), time.process_time()
    solution = am.distributed(lambda: model(kind, cells), tolerance=tolerance)
    every = MPI.COMM_WORLD.gather(used(started))
    if every is None:
        return None
    wall, cpu, peak = np.array(every).T
    return {
        "unknowns": solution.share.starts[-1].item() * 3, "wall": wall.max(),
        "cpu": cpu.tolist(), "contacts": solution.share.all_contacts, "peak": peak.tolist(),
        "resultant": solution.resultant.tolist(), "steps": solution.steps,
        "iterations": solution.iterations, "rebuilt": solution.rebuilt,
    }  # fmt: skip


def measured(kind, cells, processes, given):
    """A row: what one run has used; processes: None for one without PETSc."""
    load = os.getloadavg()[0]
    with tempfile.TemporaryDirectory() as folder:
        log, answer = Path(folder) / "log", Path(folder) / "answer"
        mine = [sys.executable, __file__, "--worker", kind, str(cells), str(answer)]
        mine += ["--tolerance", str(given.tolerance), "--megabytes", str(given.megabytes)]
        env = {**os.environ, **MPI, "PETSC_OPTIONS": f"-log_view :{log}"}
        command = [*mine, "--alone"] if processes is None else [
            "mpirun", "--oversubscribe", "-n", str(processes), *mine]  # fmt: skip
        done = subprocess.run(command, env=env, capture_output=True, text=True,
                              timeout=given.seconds)  # fmt: skip
        if done.returncode or not answer.exists():
            raise RuntimeError(done.stdout + done.stderr)
        found = json.loads(answer.read_text())  # mpirun and PETSc print what they like
        text = log.read_text() if log.exists() else ""
    names = ("MPI Msg Count", "MPI Msg Len \\(bytes\\)", "MPI Reductions")
    numbers = [re.search(rf"^{name}:\s+(\S+)", text, re.MULTILINE) for name in names]
    counts = ["" if n is None else float(n[1]) for n in numbers]
    return found, counts, load


def row(kind, cells, processes, result):
    """A line of the table."""
    found, (messages, size, sums), load = result
    each = [" ".join(f"{x:.{digits}f}" for x in found[key])
            for key, digits in (("cpu", 1), ("peak", 0))]  # fmt: skip
    megabytes = f"{size / 1e6:.1f}" if size != "" else ""
    return (
        f"| {kind} | {cells} | {found['unknowns']} | {found['contacts']} | "
        f"{processes or 'without PETSc'} | {found['wall']:.1f} | {each[0]} | {each[1]} | "
        f"{found['steps']} | {found['iterations']} | {found['rebuilt']} | "
        f"{messages if messages == '' else int(messages)} | {megabytes} | "
        f"{sums if sums == '' else int(sums)} | {load:.1f} |"
    )


def main():
    """The table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cells", type=int, nargs="+", default=[32])
    parser.add_argument("--kinds", nargs="+", default=["hex", "tet"])
    parser.add_argument("--processes", type=int, nargs="+", default=[1, 2, 4])
    parser.add_argument("--tolerance", type=float, default=1e-8)
    parser.add_argument("--seconds", type=float, default=3600.0)
    parser.add_argument("--megabytes", type=int, default=16_000, help="of one process")
    parser.add_argument("--resume", action="store_true")
    parser.add_argument("--worker", nargs=3, metavar=("KIND", "CELLS", "ANSWER"))
    parser.add_argument("--alone", action="store_true")
    given = parser.parse_args()
    if given.worker:
        kind, cells = given.worker[0], int(given.worker[1])
        most = given.megabytes * 2**20
        resource.setrlimit(resource.RLIMIT_DATA, (most, most))
        found = (alone if given.alone else together)(kind, cells, given.tolerance)
        if found is not None:
            Path(given.worker[2]).write_text(json.dumps(found))
        return
    known = kept_rows() if given.resume else {}
    for kind in given.kinds:
        for cells in given.cells:
            for processes in (None, *given.processes):
                key = kind, str(cells), str(processes or "without PETSc")
                if key in known:
                    continue
                try:
                    line = row(kind, cells, processes, measured(kind, cells, processes, given))
                except (RuntimeError, subprocess.TimeoutExpired) as ended:
                    print(f"{key}: {ended}", file=sys.stderr, flush=True)
                    continue
                known[key] = line
                print(line, flush=True)
                write_page(known.values())


def kept_rows():
    """Rows of the page by kind, cells and processes."""
    lines = PAGE.read_text().splitlines() if PAGE.exists() else []
    cells = [[part.strip() for part in line.split("|")[1:-1]] for line in lines]
    return {
        (part[0], part[1], part[4]): line for part, line in zip(cells, lines, strict=True)
        if len(part) == len(COLUMNS) and part[0] in ("hex", "tet")
    }  # fmt: skip


def write_page(rows):
    """The page of these rows."""
    command = "python benchmarks/processes.py " + " ".join(sys.argv[1:])
    machine = ", ".join(f"{name} {value}" for name, value in describe().items())
    table = "\n".join(["| " + " | ".join(COLUMNS) + " |", "|" + "---|" * len(COLUMNS), *rows])
    text = f"# Processes\n\nRegenerate: `{command}`.  {machine}.\n\n{WORDS}\n\n{table}"
    PAGE.write_text(text + "\n")


if __name__ == "__main__":
    main()
