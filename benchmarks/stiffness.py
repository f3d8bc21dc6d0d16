"""Assembly on boxes of all cells: the stiffness, and the tangent and forces of neo-Hooke.

    python benchmarks/stiffness.py [UNKNOWNS [KIND ORDER]]

CPU seconds of one call after a first on a small mesh, and the memory that its highest point
takes beyond what was held before (Linux), each in a process of its own; the least of three.
By default about 100 000 unknowns, half of them for the tangent.  Prints a table.
"""

import json
import subprocess
import sys
import time
from pathlib import Path

from machine import options

import amontons as am
from amontons.mechanics.elements import stiffness
from amontons.mechanics.elements.hyperelasticity import HyperelasticBody, NeoHookean
from amontons.mechanics.meshes import second_order

KINDS = [(kind, order) for kind in ("tri", "quad", "tet", "hex") for order in (1, 2)]
TIMES = 3


def mesh_of(kind, order, unknowns):
    """A unit box with about so many unknowns."""
    dim = 2 if kind in ("tri", "quad") else 3
    cells = round(((unknowns / dim) ** (1 / dim) - 1) / order)
    mesh = am.box((1,) * dim, max(cells, 1), kind)
    return second_order(mesh) if order == 2 else mesh


def highest():
    """The largest memory held since `forget`, in MB."""
    lines = Path("/proc/self/status").read_text().splitlines()
    return next(int(x.split()[1]) / 1024 for x in lines if x.startswith("VmHWM"))


def forget():
    """Begin to look for the highest memory anew."""
    Path("/proc/self/clear_refs").write_text("5")


def measured(call):
    """(CPU seconds, extra MB) of one call."""
    forget()
    before, started = highest(), time.process_time()
    kept = call()
    seconds = time.process_time() - started
    memory = highest() - before
    del kept
    return seconds, memory


def row(kind, order, unknowns):
    """What one process measures: [unknowns, seconds, MB, seconds of set-up, of tangent, MB]."""
    law, rubber = am.LinearElastic(200, 0.3), NeoHookean(200, 0.3)
    small = mesh_of(kind, order, 100)
    stiffness(small, law), HyperelasticBody(small, rubber).tangent(0 * small.points)
    mesh = mesh_of(kind, order, unknowns)
    out = [mesh.points.size, *measured(lambda: stiffness(mesh, law))]
    mesh = mesh_of(kind, order, unknowns / 2)
    u = mesh.points @ (0.1 * mesh.points[:1].T) + 0.01 * mesh.points**2
    body = HyperelasticBody(mesh, rubber)
    seconds, memory = measured(lambda: body.tangent(u))
    setup, held = measured(lambda: HyperelasticBody(mesh, rubber))
    return [*out, setup, seconds, memory + held]


def main():
    parser = options(__doc__)
    parser.add_argument("unknowns", nargs="?", type=float, default=1e5)
    parser.add_argument("kind", nargs="?", choices=sorted({kind for kind, _ in KINDS}))
    parser.add_argument("order", nargs="?", type=int, choices=(1, 2), default=1)
    asked = parser.parse_args()
    unknowns = asked.unknowns
    kinds = [(asked.kind, asked.order)] if asked.kind else KINDS
    print("| cells | unknowns | stiffness, s | MB | tangent: set-up, s | step, s | MB |")
    print("|---|---|---|---|---|---|---|", flush=True)
    for kind, order in kinds:
        command = [sys.executable, __file__, "--row", kind, str(order), str(unknowns)]
        runs = [
            json.loads(subprocess.run(command, check=True, capture_output=True).stdout)
            for _ in range(TIMES)
        ]
        least = [min(column) for column in zip(*runs, strict=True)]
        numbers = f"{least[0]} | {least[1]:.2f} | {least[2]:.0f} | {least[3]:.2f}"
        print(f"| {kind} {order} | {numbers} | {least[4]:.2f} | {least[5]:.0f} |", flush=True)


if __name__ == "__main__":
    if sys.argv[1:2] == ["--row"]:
        print(json.dumps(row(sys.argv[2], int(sys.argv[3]), float(sys.argv[4]))))
    else:
        main()
