"""A setting of `large_sliding` as a deck of CalculiX, and what it says of it.

2D cases are one layer of C3D8 whose nodes keep their z.  Its neo-Hookean energy splits off the
volume, `split_off_volume`.  Contact is TYPE=SURFACE TO SURFACE with a linear
pressure-overclosure of `STIFF` times the softer modulus over a facet's length, a tenth of it
along the surface; increments are automatic, none longer than one load step of the case.
"""

import os
from pathlib import Path

import numpy as np
from large_sliding_peers import limited

STIFF, STICK = 50.0, 0.1
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


def faces_on(mesh, facets):
    """(cell, face number of CalculiX) of every facet (f, a) of a surface."""
    _, cells = cells_of(mesh)
    n = len(mesh.points)
    there = np.zeros(2 * n, dtype=bool)
    there[np.unique(facets)] = True
    if mesh.points.shape[1] == 2:
        there[n:] = there[:n]
    wanted, found = {frozenset(f) for f in facets.tolist()}, []
    for number in np.flatnonzero(there[cells].sum(axis=1) >= 4):
        for slots, face in FACE.items():
            nodes = frozenset((cells[number, list(slots)] % n).tolist())
            if nodes in wanted:
                found.append((number, face))
    return found


def listed(numbers):
    """Lines of up to 12 numbers."""
    numbers = list(numbers)
    return [", ".join(map(str, numbers[k : k + 12])) for k in range(0, len(numbers), 12)]


def deck(given, factor=1.0, stick=STICK):
    """Lines of the deck; factor: on the stiffness of contact, stick: along over across it."""
    lines, starts = ["*HEADING", "two bodies that slide"], [[0, 0]]
    for k, (mesh, _) in enumerate(given.bodies):
        points, cells = cells_of(mesh)
        node, cell = starts[-1]
        lines.append("*NODE, NSET=NALL")
        lines += [f"{node + i + 1}, " + ", ".join(f"{value:.11e}" for value in p)
                  for i, p in enumerate(points)]  # fmt: skip
        lines.append(f"*ELEMENT, TYPE=C3D8, ELSET=B{k}")
        lines += [f"{cell + i + 1}, " + ", ".join(str(node + j + 1) for j in nodes)
                  for i, nodes in enumerate(cells)]  # fmt: skip
        shear, bulk = given.moduli(k)
        lines += [f"*MATERIAL, NAME=M{k}", "*HYPERELASTIC, NEO HOOKE",
                  f"{shear / 2:.12e}, {2 / bulk:.12e}",
                  f"*SOLID SECTION, ELSET=B{k}, MATERIAL=M{k}"]  # fmt: skip
        starts.append([node + len(points), cell + len(cells)])
    for name, (k, facets) in zip(("SLAVE", "MASTER"), given.sides, strict=True):
        lines.append(f"*SURFACE, NAME={name}, TYPE=ELEMENT")
        lines += [f"{starts[k][1] + cell + 1}, S{face}"
                  for cell, face in faces_on(given.bodies[k][0], facets)]  # fmt: skip
    stiffness = factor * STIFF * min(young for _, young in given.bodies) / given.facet
    lines += ["*SURFACE INTERACTION, NAME=SI",
              "*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR", f"{stiffness:.6e}"]  # fmt: skip
    if given.mu:
        lines += ["*FRICTION", f"{given.mu}, {stick * stiffness:.6e}"]
    lines += ["*CONTACT PAIR, INTERACTION=SI, TYPE=SURFACE TO SURFACE", "SLAVE, MASTER"]
    return lines + step(given, [node for node, _ in starts])


def twins(given, body, nodes, first):
    """Numbers (n, 1 or 2) in the deck of nodes (n,) of a body."""
    out = [first[body] + np.asarray(nodes) + 1]
    if given.dim == 2:
        out.append(out[0] + len(given.bodies[body][0].points))
    return np.stack(out, axis=1)


def step(given, first):
    """Supports, the way of the driven nodes, and the one step, whose time counts load steps."""
    fixed, amplitudes, moved = [], [], []
    for body, nodes, components in given.supports:
        numbers = twins(given, body, nodes, first).ravel()
        fixed += [f"{n}, {c + 1}, {c + 1}, 0." for n in numbers for c in components]
    body, nodes, ways = given.driven
    names = {}
    for k, numbers in enumerate(twins(given, body, nodes, first)):
        for c in range(given.dim):
            table = ways[:, k, c]
            key = table.tobytes()
            if key not in names:
                names[key] = f"A{len(names)}"
                amplitudes.append(f"*AMPLITUDE, NAME={names[key]}")
                amplitudes += [f"{t}, {value:.12e}" for t, value in enumerate(table)]
            for n in numbers:
                moved += [f"*BOUNDARY, AMPLITUDE={names[key]}", f"{n}, {c + 1}, {c + 1}, 1."]
    if given.dim == 2:
        fixed.append("NALL, 3, 3, 0.")
    driven = listed(twins(given, body, nodes, first).ravel().tolist())
    return [*amplitudes, "*NSET, NSET=NDRIVEN", *driven, "*BOUNDARY", *fixed,
            "*STEP, NLGEOM, INC=100000", "*STATIC", f"1., {given.steps}., 1e-6, 1.",
            *moved, "*NODE PRINT, NSET=NDRIVEN", "RF", "*NODE PRINT, NSET=NALL", "U",
            "*END STEP", ""]  # fmt: skip


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


def solved(given, folder, limit=600, factor=1.0, stick=STICK):
    """Run CalculiX; load steps, Newton steps, seconds, penetration and forces by step."""
    path = Path(folder) / "case"
    path.with_suffix(".inp").write_text("\n".join(deck(given, factor, stick)))
    seconds, _ = limited(["ccx", "case"], limit, cwd=folder,
                         env={**os.environ, "OMP_NUM_THREADS": "1"})  # fmt: skip
    text = path.with_suffix(".dat").read_text()
    counted = [line for line in path.with_suffix(".cvg").read_text().splitlines()
               if line.split() and line.split()[0].isdigit()]  # fmt: skip
    d, worst, forces = given.dim, 0.0, []
    for _, rows in blocks(text, "displacements"):
        table = {int(row[0]): row[1 : d + 1] for row in rows}
        moved, start = [], 0
        for mesh, _ in given.bodies:
            n = len(mesh.points)
            moved.append(mesh.points + [table[start + i + 1] for i in range(n)])
            start += n * (2 if d == 2 else 1)
        worst = max(worst, given.penetration(moved))
    for time, rows in blocks(text, "forces"):
        there = np.array(rows)[:, 1 : d + 1]
        per = there.reshape(len(given.driven[1]), -1, d).sum(axis=1)
        forces.append(given.row(time, per))
    done = forces[-1][0] if forces else 0.0
    return {"steps": len(forces), "newton": len(counted), "seconds": seconds,
            "penetration": worst, "forces": forces, "reached": done / given.steps,
            "why": "out of time" if seconds >= limit - 1 else ""}  # fmt: skip
