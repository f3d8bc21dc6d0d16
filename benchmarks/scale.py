"""The whole `amontons solve` on ever finer cubes of hueeber2008: time and memory per unknown.

    python benchmarks/scale.py [--levels 3,4,5,6,7] [--folder FOLDER]
    python benchmarks/scale.py --levels 6,7,8

Each level is a process of its own, `amontons solve example:cube --set mesh.cells=N -o DIR`,
from start to files written; compiled code is warm.  Wall and CPU seconds and the largest
resident memory are those of this process; assembling, preparing and solving are what it reports
itself.  Memory per unknown is what it takes above a solve of 54 unknowns.
Levels that are not asked for stay as stored.  A level that would need more memory than is free,
by the bytes per unknown of the largest one before, is left out, and said.
Writes results/scale.md and results/scale.json beside this file.
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

from machine import describe

HERE = Path(__file__).parent


def run(level, folder):
    """One row."""
    out = folder / f"level{level}"
    command = [sys.executable, "-m", "amontons", "solve", "example:cube", "--set",
               f"mesh.cells={2**level}", "-o", str(out), "--quiet"]  # fmt: skip
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    started = time.perf_counter()
    process = subprocess.Popen(command)
    _, status, used = os.wait4(process.pid, 0)
    wall = time.perf_counter() - started
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    record = json.loads((out / "solution.json").read_text())
    cpu = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    written = sum(f.stat().st_size for f in out.iterdir()) / 1e6
    return {
        "level": level, "unknowns": record["unknowns"], "contacts": record["contacts"],
        "outcome": record["outcome"], "exit": os.waitstatus_to_exitcode(status),
        "wall": wall, "cpu": cpu, "seconds": record["seconds"], "peak_gb": used.ru_maxrss / 1e6,
        "written_mb": written,
    }  # fmt: skip


def stored():
    """Rows of former runs."""
    path = HERE / "results/scale.json"
    return json.loads(path.read_text())["rows"] if path.exists() else []


def expected_gb(level, rows, base):
    """Memory that a level takes as the largest smaller one does per unknown; 0: not known."""
    smaller = [row for row in rows if row["level"] < level]
    if not smaller:
        return 0.0
    per_unknown = (smaller[-1]["peak_gb"] - base) / smaller[-1]["unknowns"]
    return base + 3 * (2**level + 1) ** 2 * 2**level * per_unknown


def free_gb():
    """Memory that is free, infinite where this system does not say."""
    path = Path("/proc/meminfo")
    if not path.exists():
        return float("inf")
    lines = dict(line.split(":") for line in path.read_text().splitlines())
    return int(lines["MemAvailable"].split()[0]) / 1e6


def page(record):
    """The results as Markdown."""
    machine = "; ".join(f"{k} {v}" for k, v in record["machine"].items())
    text = " ".join(__doc__.split("\n\n")[2].split("Writes")[0].split())
    base = record["base_gb"]
    columns = ("level", "unknowns", "contacts", "outcome", "wall s", "CPU s", "assemble s",
               "set-up s", "solve s", "solve µs per unknown", "CPU µs per unknown", "peak GB",
               "bytes per unknown", "files MB")  # fmt: skip
    lines = ["# Whole solves of ever finer cubes", "",
             f"Regenerate: `python benchmarks/scale.py`.  {machine}.", "", text, "",
             f"| {' | '.join(columns)} |", "|" + "---|" * len(columns)]  # fmt: skip
    for row in record["rows"]:
        n, seconds = row["unknowns"], row["seconds"]
        per_unknown = 1e6 * seconds["solve"] / n, 1e6 * row["cpu"] / n
        lines.append(
            f"| {row['level']} | {n} | {row['contacts']['total']} | {row['outcome']} | "
            f"{row['wall']:.1f} | {row['cpu']:.1f} | {seconds['assemble']:.2f} | "
            f"{seconds['setup']:.2f} | {seconds['solve']:.2f} | {per_unknown[0]:.2f} | "
            f"{per_unknown[1]:.1f} | {row['peak_gb']:.2f} | "
            f"{1e9 * (row['peak_gb'] - base) / n:.0f} | {row['written_mb']:.0f} |"
        )
    return "\n".join(lines) + "\n"


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--levels", default="3,4,5,6,7")
    parser.add_argument("--folder", type=Path, help="for the results of the solves")
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as scratch:
        folder = given.folder or Path(scratch)
        run(1, folder)
        record = {"base_gb": run(1, folder)["peak_gb"], "rows": stored()}
        for level in map(int, given.levels.split(",")):
            kept = [row for row in record["rows"] if row["level"] != level]
            needed, free = expected_gb(level, kept, record["base_gb"]), free_gb()
            if needed > free:
                print(f"level {level} would need {needed:.1f} GB, {free:.1f} GB are free",
                      file=sys.stderr)  # fmt: skip
                continue
            record["rows"] = sorted([*kept, run(level, folder)], key=lambda row: row["level"])
            print(json.dumps(record["rows"]), file=sys.stderr, flush=True)
    record["machine"] = describe()
    (HERE / "results/scale.json").write_text(json.dumps(record, indent=1) + "\n")
    (HERE / "results/scale.md").write_text(page(record))
    print(page(record))


if __name__ == "__main__":
    main()
