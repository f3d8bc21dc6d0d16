"""Runs in time that are killed, and what --restart makes of them.

    python benchmarks/kills.py [KILLS]

A run is cut right before and right after every rename that it makes (the process ends there,
as in a power cut between two files), and killed by SIGKILL at moments of even chance over its
whole length, with a chance of 0.4 again while it goes on. Then it goes on to its end. Wrong:
a state that differs in one bit from that of a run which was not cut, a row of the table but
for its column `seconds`, a VTK file, a list of pictures, a file that is not whole under its
name at the moment of the cut, a temporary file that stays. Only runs that were really cut
count.

Writes results/kills.md beside this file. `python -m pytest tests/faults -m slow_faults` does
the same, and write errors, signals and full disks at every call.
"""

import sys
import tempfile
from pathlib import Path

from machine import describe, options

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent / "tests" / "faults"))

from kills import CASE, SLOW, Runs, at_every_call, at_random  # noqa: E402
from worker import Worker  # noqa: E402

WALL = (HERE.parent / "examples" / "wall" / "wall.toml").read_text()
SMALL = ("wall.cells=[2,1,1]", "evolution.step=1e-3", "evolution.until=0.02")
CASES = {  # text, settings, steps from picture to picture, part of the kills
    "block, dynamic, 12 steps": (CASE, (), 2, 1.0),
    "block, quasi-static, 12 steps": (SLOW, (), 2, 0.3),
    "wall of 14 bodies, dynamic, 20 steps": (WALL, SMALL, 5, 0.2),
}
SEED = 2026


def row(name, kind, cuts):
    """A line of the table; what was wrong goes to stderr."""
    cuts = list(cuts)
    wrong = [cut for cut in cuts if cut.wrong]
    for cut in wrong:
        print(name, cut, file=sys.stderr)
    line = f"| {name} | {kind} | {len(cuts)} | {sum(c.cuts for c in cuts)} | {len(wrong)} |"
    print(line, flush=True)
    return line


def main():
    parser = options(__doc__)
    parser.add_argument("kills", nargs="?", type=int, default=100, help="SIGKILLs, about")
    kills = parser.parse_args().kills
    lines = []
    for name, (text, settings, every, part) in CASES.items():
        with tempfile.TemporaryDirectory() as folder, Worker(Path(folder)) as worker:
            runs = Runs.of(worker, text, *settings, every=every)
            lines.append(row(name, "every rename", at_every_call(runs, ("replace",))))
            lines.append(row(name, "SIGKILL", at_random(runs, round(part * kills), SEED)))
    machine = "; ".join(f"{k} {v}" for k, v in describe().items())
    about = " ".join(__doc__.split("\n\n")[2].split())
    (HERE / "results" / "kills.md").write_text(
        f"# Runs that are killed\n\nRegenerate: `python benchmarks/kills.py`.  {machine}.\n\n"
        f"{about}\n\n| run | cut | runs | cuts | wrong |\n|---|---|---|---|---|\n"
        + "\n".join(lines)
        + "\n"
    )


if __name__ == "__main__":
    main()
