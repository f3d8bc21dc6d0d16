"""Start-up of the command line: `--help`, and a small solve with and without cached kernels.

    python benchmarks/startup.py FCLIB_FILE

Each figure is the wall time of a whole fresh process, the median of five (one without cache).
Writes results/startup.md beside this file.
"""

import os
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from machine import describe

HERE = Path(__file__).parent
COMMAND = [sys.executable, "-m", "amontons"]


def seconds(arguments, cache):
    """Wall time of one fresh process."""
    environment = {**os.environ, "NUMBA_CACHE_DIR": cache}
    started = time.perf_counter()
    subprocess.run([*COMMAND, *arguments], env=environment, check=True, capture_output=True)
    return time.perf_counter() - started


def main():
    with tempfile.TemporaryDirectory() as folder:
        cache = str(Path(folder) / "cache")
        solve = ["solve", sys.argv[1], "-o", str(Path(folder) / "out"), "--quiet"]
        help_ = statistics.median(seconds(["--help"], cache) for _ in range(5))
        first = seconds(solve, cache)
        warm = statistics.median(seconds(solve, cache) for _ in range(5))
    machine = "; ".join(f"{k} {v}" for k, v in describe().items())
    text = (
        "# Start-up of the command line\n\n"
        "Regenerate: `python benchmarks/startup.py FCLIB_FILE`.\n\n"
        f"{machine}.\n\n| command | seconds |\n|---|---|\n"
        f"| `amontons --help` | {help_:.2f} |\n"
        f"| `amontons solve {Path(sys.argv[1]).name}`, kernels cached | {warm:.2f} |\n"
        f"| the same, nothing compiled yet | {first:.1f} |\n"
    )
    (HERE / "results").mkdir(exist_ok=True)
    (HERE / "results/startup.md").write_text(text)
    print(text)


if __name__ == "__main__":
    main()
