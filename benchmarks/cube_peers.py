"""The Coulomb cube against CalculiX and GetFEM, in one run.

    python benchmarks/cube_peers.py [--peers ../shared/peers] [--level 4]

CPU seconds, one thread.  CalculiX (`ccx`, node to surface with a penalty, and LINMORTAR): its
whole process.  GetFEM: its solve alone, the model assembled before, generalised Newton with
MUMPS.  Ours: the solve from the model to statuses and tractions, assembly and the judge
included; and the whole `amontons solve`, from process start to files and figures written.

Writes results/cube_peers.json and results/cube_peers.md beside this file.
"""

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")

import argparse
import json
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from cube import cube
from machine import describe

import amontons as am

HERE = Path(__file__).parent
PENALTY = "1e6"  # of CalculiX, as stiff as it takes to find all contacts
REPEATS = 3


def ours(level):
    """CPU seconds from the model to its solution, best of some, and the counts."""
    best, solution = float("inf"), None
    for _ in range(REPEATS + 1):  # the first one compiles
        model = cube(level)
        used = time.process_time()
        solution = am.solve(model, tolerance=1e-8)
        best = min(best, time.process_time() - used)
    counts = solution.counts
    return {
        "name": "amontons, solve(model)", "seconds": best,
        "contact": counts["stick"] + counts["slip"], "slip": counts["slip"],
        "iterations": solution.convergence.iterations,
    }  # fmt: skip


def whole_process(level, folder):
    """CPU seconds of the command line, files and figures included."""
    cells = f"mesh.cells={2**level}"
    command = [sys.executable, "-m", "amontons", "solve", "example:cube", "--set", cells,
               "-o", str(folder), "--quiet"]  # fmt: skip
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    seconds = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    found = json.loads((folder / "solution.json").read_text())
    counts = found["contacts"]
    return {
        "name": "amontons, whole command", "seconds": seconds,
        "contact": counts["stick"] + counts["slip"], "slip": counts["slip"],
        "iterations": found["iterations"],
    }  # fmt: skip


def calculix(level, peers, folder):
    """CalculiX by its script: node to surface and LINMORTAR."""
    cases = [f"{level}:C3D8:{kind}:1:{PENALTY}" for kind in ("n2f", "linmortar")]
    out = folder / "calculix.json"
    subprocess.run(
        [sys.executable, str(peers / "calculix_cube.py"), str(out), str(folder), *cases],
        check=True, stdout=subprocess.DEVNULL,
    )  # fmt: skip
    names = {"n2f": "CalculiX, node to surface", "linmortar": "CalculiX, LINMORTAR"}
    return [
        {"name": names[case.split(":")[2]], "seconds": run["cpu_s"],
         "contact": run.get("contact"), "slip": run.get("slip_by_stress"),
         "iterations": run["iterations_all"]}
        for case, run in json.loads(out.read_text())["cases"].items()
    ]  # fmt: skip


def getfem(level, peers, folder, python):
    """GetFEM by its script, with the Python that carries it."""
    out = folder / "getfem.json"
    subprocess.run(
        [python, str(peers / "getfem_cube.py"), str(out), str(level)],
        check=True, stdout=subprocess.DEVNULL,
    )  # fmt: skip
    run = json.loads(out.read_text())[f"level{level}"]["coulomb"]
    return {
        "name": "GetFEM, solve", "seconds": run["cpu_s"], "contact": run["contact"],
        "slip": run["slip_in_contact"], "iterations": run["tries"][-1]["iterations"],
    }  # fmt: skip


def table(record):
    """The result as a Markdown page."""
    lines = [
        "# The Coulomb cube beside CalculiX and GetFEM", "",
        "Regenerate: `python benchmarks/cube_peers.py`.", "",
        "; ".join(f"{k} {v}" for k, v in record["machine"].items()) + "; one thread.", "",
        f"Level {record['level']}: {2 ** record['level']} cells an edge, friction 1, one load "
        "step, CPU seconds. CalculiX: its whole process; GetFEM: the solve of the assembled "
        "model.", "",
        "| | CPU s | in contact | slipping | iterations | times solve(model) | times command |",
        "|---|---|---|---|---|---|---|",
    ]  # fmt: skip
    solve, command = (row["seconds"] for row in record["rows"][:2])
    for row in record["rows"]:
        lines.append(
            f"| {row['name']} | {row['seconds']:.3g} | {row['contact']} | {row['slip']} | "
            f"{row['iterations']} | {row['seconds'] / solve:.3g} | "
            f"{row['seconds'] / command:.2g} |"
        )
    return "\n".join(lines) + "\n"


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    shared = Path(os.environ.get("AMONTONS_SHARED", "../shared"))
    parser.add_argument("--peers", type=Path, default=shared / "peers", help="their scripts")
    parser.add_argument("--python", default="/usr/bin/python3", help="Python that has GetFEM")
    parser.add_argument("--level", type=int, default=4)
    options = parser.parse_args()
    level, peers = options.level, options.peers.resolve()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        rows = [ours(level)]
        whole_process(level, folder / "first")  # compiled code warm
        rows.append(whole_process(level, folder / "cube"))
        rows += calculix(level, peers, folder)
        rows.append(getfem(level, peers, folder, options.python))
    record = {"machine": describe(), "level": level, "rows": rows}
    (HERE / "results/cube_peers.json").write_text(json.dumps(record, indent=1) + "\n")
    (HERE / "results/cube_peers.md").write_text(table(record))
    print(table(record))


if __name__ == "__main__":
    main()
