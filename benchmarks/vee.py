"""The V-shaped body: CPU seconds of the whole curve, beside GetFEM's continuation.

    python benchmarks/vee.py [--levels 1] [--growth 1,2,3,4] [--no-peer] [--save]

CPU seconds of one process each, from the mesh to the curve (assembly and W included).  GetFEM:
the program peers/getfem_vee.py of the folder AMONTONS_SHARED, by the system's python3.  growth:
event tracking on finer meshes: seconds per event, and the memory of the process.
"""

from __future__ import annotations

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")

import json
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import click
import numpy as np

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

from amontons.analysis.paths.following import Limits, track_both  # noqa: E402
from amontons.analysis.paths.parametrised import path_of  # noqa: E402
from amontons.analysis.paths.starting import exact_state  # noqa: E402
from amontons.core.files import replacing  # noqa: E402
from amontons.mechanics.ready.vee import vee  # noqa: E402
from benchmarks.machine import describe  # noqa: E402
from reproduce.ligursky2014.vee import METHODS, follow, mesh  # noqa: E402

OUT = ROOT / "benchmarks/results"
SHARED = Path(os.environ.get("AMONTONS_SHARED", ROOT.parent / "shared"))


def ours(level: int) -> dict[str, Any]:
    """CPU seconds of every method on one level, the second of two runs."""
    found: dict[str, Any] = {}
    for name, options in METHODS.items():
        for _ in range(2):
            began = time.process_time()
            branch = follow(level, options)
            cpu = time.process_time() - began
        found[name] = {"cpu": cpu, "points": len(branch),
                       "folds": [e.parameter for e in branch.folds]}  # fmt: skip
    return found


def peer(level: int) -> dict[str, Any] | None:
    """GetFEM's continuation on the same mesh."""
    script, points = SHARED / "peers/getfem_vee.py", SHARED / "reference/vee/vee_h0.03.npz"
    if not script.exists():
        return None
    with tempfile.TemporaryDirectory() as folder:
        target = Path(folder) / "curve.json"
        command = ["/usr/bin/python3", str(script), str(points), str(target), str(level)]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        if done.returncode:
            return None
        record = json.loads(target.read_text())
    return {"cpu": record["continuation_cpu_s"], "points": record["steps"],
            "folds": [f["gamma_by_u_t"] for f in record["folds"]]}  # fmt: skip


def growth(level: int) -> dict[str, Any]:
    """Event tracking on one level: parts of the work, events, memory of this process."""
    model = vee(mesh(level))
    began = time.process_time()
    path = path_of(model, "load", (0.0, 1.0))
    _ = path.start.condensed()
    ready = time.process_time()
    branch = track_both(path, exact_state(path, 0.0), 0.0, Limits((0.0, 1.0)))
    done = time.process_time()
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6
    return {"triangles": mesh(level).cell_count, "contacts": path.start.contacts,
            "events": len(branch.events), "assembly and W": ready - began,
            "tracking": done - ready, "per event": (done - ready) / len(branch.events),
            "GB": memory, "folds": [e.parameter for e in branch.folds]}  # fmt: skip


def page(record: dict[str, Any]) -> str:
    """The tables as Markdown."""
    lines = ["# V-shaped body: CPU seconds of the whole curve", "",
             "`python benchmarks/vee.py --save`", "",
             "; ".join(f"{k} {v}" for k, v in record["machine"].items()) + ".", ""]  # fmt: skip
    lines += ["| triangles | method | CPU s | points | times faster than GetFEM | folds |",
              "|---|---|---|---|---|---|"]  # fmt: skip
    for triangles, methods in record["methods"].items():
        other = methods.get("GetFEM")
        for name, run in methods.items():
            ratio = f"{other['cpu'] / run['cpu']:.0f}" if other and name != "GetFEM" else ""
            folds = ", ".join(f"{x:.10f}" for x in run["folds"])
            lines.append(f"| {triangles} | {name} | {run['cpu']:.3g} | {run['points']} "
                         f"| {ratio} | {folds} |")  # fmt: skip
    lines += ["", "Growth of event tracking:", "",
              "| triangles | contacts | events | assembly and W, s | tracking, s "
              "| ms per event | memory of the process, GB |",
              "|---|---|---|---|---|---|---|"]  # fmt: skip
    for run in record["growth"]:
        lines.append(f"| {run['triangles']} | {run['contacts']} | {run['events']} "
                     f"| {run['assembly and W']:.2f} | {run['tracking']:.3f} "
                     f"| {1e3 * run['per event']:.3f} | {run['GB']:.2f} |")  # fmt: skip
    if len(record["growth"]) > 1:
        size = np.log([run["contacts"] for run in record["growth"]])
        cost = np.log([run["per event"] for run in record["growth"]])
        slopes = np.diff(cost) / np.diff(size)
        lines += ["", "An event costs contacts^k from one row to the next, with k = "
                  + ", ".join(f"{k:.2f}" for k in slopes) + "."]  # fmt: skip
    return "\n".join([*lines, ""])


@click.command()
@click.option("--levels", default="1", show_default=True)
@click.option("--growth", "finer", default="1,2,3,4", show_default=True)
@click.option("--peer/--no-peer", "with_peer", default=True)
@click.option("--one", type=int, hidden=True, help="Growth on one level, as JSON.")
@click.option("--save", is_flag=True, help="Into benchmarks/results.")
def main(levels: str, finer: str, with_peer: bool, one: int | None, save: bool) -> None:
    """CPU seconds of the curve of the V-shaped body."""
    if one is not None:
        growth(1)  # compile
        click.echo(json.dumps(growth(one)))
        return
    record: dict[str, Any] = {"machine": describe(), "methods": {}, "growth": []}
    for level in (int(x) for x in levels.split(",")):
        found = ours(level)
        other = peer(level) if with_peer else None
        if other:
            found["GetFEM"] = other
        record["methods"][str(mesh(level).cell_count)] = found
    for level in (int(x) for x in finer.split(",")):
        command = [sys.executable, __file__, "--one", str(level)]  # each with its own memory
        done = subprocess.run(command, capture_output=True, text=True, check=True)
        record["growth"].append(json.loads(done.stdout.splitlines()[-1]))
    text = page(record)
    click.echo(text)
    if save:
        with replacing(OUT / "vee.json") as path:
            path.write_text(json.dumps(record) + "\n")
        with replacing(OUT / "vee.md") as path:
            path.write_text(text)


if __name__ == "__main__":
    main()
