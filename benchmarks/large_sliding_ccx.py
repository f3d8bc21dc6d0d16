"""The cases of `large_sliding` as decks of CalculiX, and what it says of them.

2D cases are one layer of C3D8 whose nodes keep their z.  Its neo-Hookean energy splits off the
volume, G/2 (J^-2/3 tr C - 3) + K/2 (J - 1)^2: the same moduli at small strains, a little other
forces at large ones.  Contact is TYPE=SURFACE TO SURFACE with a linear pressure-overclosure of
`STIFF` times the softer modulus over a facet's length; increments are automatic, none longer
than one load step of the case.
"""

import os
import resource
import subprocess
from pathlib import Path

import numpy as np
from large_sliding_models import POISSON, corners, penetration

STIFF = 50.0
FACE = {(0, 1, 2, 3): 1, (4, 5, 6, 7): 2, (0, 1, 4, 5): 3, (1, 2, 5, 6): 4, (2, 3, 6, 7): 5,
        (0, 3, 4, 7): 6}  # fmt: skip


def cells_of(mesh):
    """(points (n, 3), hexahedra (c, 8)) of a mesh of quadrilaterals or hexahedra."""
    (block,) = mesh.cells
    if mesh.points.shape[1] == 3:
        return mesh.points, block.nodes
    n = len(mesh.points)
    layers = [np.c_[mesh.points, np.full(n, z)] for z in (0.0, 1.0)]
    return np.concatenate(layers), np.concatenate([block.nodes, block.nodes + n], axis=1)


def nodes_on(mesh, name):
    """Numbers (from 0) of the nodes of a surface in `cells_of`."""
    nodes = np.unique(corners(mesh, name))
    return nodes if mesh.points.shape[1] == 3 else np.r_[nodes, nodes + len(mesh.points)]


def faces_on(mesh, name):
    """(cell, face number of CalculiX) of every facet of a surface."""
    _, cells = cells_of(mesh)
    there = np.zeros(cells.max() + 1, dtype=bool)
    there[nodes_on(mesh, name)] = True
    found = []
    for number, hit in enumerate(there[cells]):
        slots = tuple(int(k) for k in np.flatnonzero(hit))
        if slots in FACE:
            found.append((number, FACE[slots]))
    return found


def listed(numbers):
    """Lines of up to 12 numbers."""
    numbers = list(numbers)
    return [", ".join(map(str, numbers[k : k + 12])) for k in range(0, len(numbers), 12)]


def deck(case, swap):
    """Lines of the deck."""
    lines, start, first = ["*HEADING", "two bodies that slide"], [0, 0], 1
    plane = case.lower.points.shape[1] == 2
    sets = {}
    for k, (mesh, name) in enumerate(((case.lower, "LOWER"), (case.upper, "UPPER"))):
        points, cells = cells_of(mesh)
        lines.append("*NODE, NSET=NALL")
        lines += [f"{start[0] + i + 1}, " + ", ".join(f"{value:.11e}" for value in p)
                  for i, p in enumerate(points)]  # fmt: skip
        lines.append(f"*ELEMENT, TYPE=C3D8, ELSET={name}")
        lines += [f"{start[1] + i + 1}, " + ", ".join(str(start[0] + j + 1) for j in cell)
                  for i, cell in enumerate(cells)]  # fmt: skip
        held = "bottom" if k == 0 else "top"
        sets[name] = [int(start[0] + i + 1) for i in nodes_on(mesh, held)]
        side = "top" if k == 0 else "bottom"
        lines.append(f"*SURFACE, NAME=S{name}, TYPE=ELEMENT")
        lines += [f"{start[1] + cell + 1}, S{face}" for cell, face in faces_on(mesh, side)]
        G = case.moduli[k] / (2 * (1 + POISSON))
        K = case.moduli[k] / (3 * (1 - 2 * POISSON))
        lines += [f"*MATERIAL, NAME=M{name}", "*HYPERELASTIC, NEO HOOKE",
                  f"{G / 2:.12e}, {2 / K:.12e}",
                  f"*SOLID SECTION, ELSET={name}, MATERIAL=M{name}"]  # fmt: skip
        start = [start[0] + len(points), start[1] + len(cells)]
        first = start[0]
    for name, nodes in sets.items():
        lines += [f"*NSET, NSET=N{name}", *listed(nodes)]
    return lines + contact(case, swap) + step(case, plane, first)


def contact(case, swap):
    """Interaction and pair."""
    size = np.ptp(case.lower.points[:, 0]) / (len(corners(case.lower, "top")) or 1)
    if case.lower.points.shape[1] == 3:
        size = np.sqrt(np.prod(np.ptp(case.lower.points, axis=0)[:2])
                       / len(corners(case.lower, "top")))  # fmt: skip
    stiffness = STIFF * min(case.moduli) / size
    sides = ("SUPPER", "SLOWER")[:: -1 if swap else 1]
    return ["*SURFACE INTERACTION, NAME=SI",
            "*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR", f"{stiffness:.6e}",
            "*FRICTION", f"{case.mu}, {stiffness / 10:.6e}",
            "*CONTACT PAIR, INTERACTION=SI, TYPE=SURFACE TO SURFACE",
            ", ".join(sides)]  # fmt: skip


def step(case, plane, nodes):
    """Amplitudes and the one step, whose time counts load steps."""
    times = [0, case.presses, *([case.steps] if case.drags else [])]
    lines = []
    for name, c in (("AX", 0), ("AD", -1)):
        table = [f"{t}, {case.top(t)[c]:.12e}" for t in times]
        lines += [f"*AMPLITUDE, NAME={name}", *table]
    height, across = ("2", "3") if plane else ("3", "2")
    lines += ["*BOUNDARY", "NLOWER, 1, 3, 0.", f"NUPPER, {across}, {across}, 0."]
    if plane:
        lines.append("NALL, 3, 3, 0.")
    return [*lines, "*STEP, NLGEOM, INC=100000", "*STATIC", f"1., {case.steps}., 1e-6, 1.",
            "*BOUNDARY, AMPLITUDE=AX", "NUPPER, 1, 1, 1.",
            "*BOUNDARY, AMPLITUDE=AD", f"NUPPER, {height}, {height}, 1.",
            "*NODE PRINT, NSET=NUPPER, TOTALS=ONLY", "RF",
            "*NODE PRINT, NSET=NALL", "U", "*END STEP", ""]  # fmt: skip


def blocks(text, head):
    """(time, rows) of every table of a .dat file whose title begins so."""
    found, rows = [], None
    for line in text.splitlines():
        words = line.split()
        if "time" in words:
            rows = [] if line.strip().startswith(head) else None
            if rows is not None:
                found.append((float(words[-1]), rows))
        elif rows is not None and words:
            rows.append([float(word) for word in words])
    return found


def solved(case, folder, swap=False, limit=600):
    """Run CalculiX; load steps, Newton steps, seconds, penetration and forces by step."""
    path = Path(folder) / "case"
    path.with_suffix(".inp").write_text("\n".join(deck(case, swap)))
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    try:
        subprocess.run(["ccx", "case"], cwd=folder, capture_output=True, timeout=limit,
                       check=False, env={**os.environ, "OMP_NUM_THREADS": "1"})  # fmt: skip
    except subprocess.TimeoutExpired:
        pass
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    text = path.with_suffix(".dat").read_text()
    counted = [line for line in path.with_suffix(".cvg").read_text().splitlines()
               if line.split() and line.split()[0].isdigit()]  # fmt: skip
    d = case.lower.points.shape[1]
    first, second = (len(mesh.points) for mesh in (case.lower, case.upper))
    worst, forces = 0.0, []
    for _, rows in blocks(text, "displacements"):
        moved = np.array(rows)[:, 1 : d + 1]
        start = first * (2 if d == 2 else 1)
        both = [case.lower.points + moved[:first],
                case.upper.points + moved[start : start + second]]  # fmt: skip
        worst = max(worst, penetration(case, both))
    for time, rows in blocks(text, "total force"):
        forces.append([time, rows[-1][0], rows[-1][1 if d == 2 else 2]])
    seconds = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    done = forces[-1][0] if forces else 0.0
    return {"steps": len(forces), "newton": len(counted), "seconds": seconds,
            "penetration": worst, "forces": forces, "reached": done / case.steps}  # fmt: skip
