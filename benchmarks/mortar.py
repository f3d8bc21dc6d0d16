"""Dual mortar contact against what is known: patch test, balance, Hertz, Mindlin, shrink fits.

    python benchmarks/mortar.py [--cells 6,9,13] [--method NAME]

All meshes do not match; solved by `am.solve(model)`, or by another method.  Writes
results/mortar.md.
"""

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")

import argparse
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
from machine import describe
from mortar_models import BallOnBlock, Rings, dragged, measured, stacked
from scipy.spatial.transform import Rotation

import amontons as am
from amontons.mechanics.contact import mortar_contact
from amontons.solvers import METHODS

HERE = Path(__file__).parent
PATCHES = [  # dimension, cells below, above, their kinds, inner points moved
    (2, 3, 4, ("quad", "quad"), 0), (2, 9, 4, ("tri", "quad"), 0),
    (3, (3, 4, 2), (5, 3, 2), ("hex", "hex"), 0), (3, 3, 8, ("hex", "hex"), 0),
    (3, (7, 7, 2), 4, ("hex", "tet"), 0), (3, 4, (3, 3, 2), ("tet", "hex"), 0),
    (3, (3, 4, 2), (5, 3, 2), ("hex", "hex"), 0.12),
]  # fmt: skip


def patch_tests(solve):
    """Rows: mesh, largest error of pressure and shear, relative."""
    for dim, below, above, kinds, moved in PATCHES:
        solution = solve(stacked(dim, below, above, kinds, moved))
        shear = np.abs(solution.shear).max()
        error = max(np.abs(solution.pressure - 1).max(), shear)
        what = f"{below} {kinds[0]} under {above} {kinds[1]}" + (", distorted" if moved else "")
        yield f"{dim}D, {what}", f"{error:.1e}"


def balances():
    """Rows: surfaces, forces and moments (of unit tractions) that do not cancel."""
    cases = {
        "flat, 7 x 7 quads under 5 x 5, all covered": (0.0, 0.0, 0.0),
        "flat, partly covered": (0.23, 0.11, 0.0),
        "curved, gap": (0.05, 0.02, 0.1),
    }
    for name, (x, y, wave) in cases.items():
        low = am.box((1, 1, 1), (7, 7, 1))
        high = am.box((1, 1, 1), (5, 5, 1), origin=(x, y, 1))
        bodies = []
        for mesh in (high, low):
            lift = wave * np.sin(4 * mesh.points[:, 0]) * (mesh.points[:, 2] == 1)
            points = mesh.points + np.outer(lift, [0, 0, 1])
            bodies.append(am.Mesh(points, mesh.cells, mesh.surfaces))
        rows, on_master, _ = mortar_contact(bodies[0], "bottom", bodies[1], "top")
        H = np.vstack([rows.H.toarray(), on_master.toarray()])
        points = np.concatenate([mesh.points for mesh in bodies])
        force = max(abs(H.T @ np.tile(axis, len(points))).max() for axis in np.eye(3))
        turn = max(abs(H.T @ np.cross(axis, points).ravel()).max() for axis in np.eye(3))
        yield name, f"{force:.0e}", f"{turn:.0e}" if not wave else f"{turn:.0e} (gap x force)"


def invariance(solve):
    """Rows: what changes, largest difference of pressures and of forces, relative."""
    plain = solve(dragged())
    turn = Rotation.from_rotvec([0.3, -1.1, 0.7]).as_matrix()
    for what, axes, length, force in (
        ("turned about (0.3, -1.1, 0.7)", turn, 1.0, 1.0),
        ("lengths in 1e-3, forces in 1e4", np.eye(3), 1e3, 1e-4),
        ("both", turn, 1e3, 1e-4),
    ):
        other = solve(dragged(axes, length, force))
        pressure = other.pressure * length**2 / force - plain.pressure
        forces = other.force / force - plain.force @ axes.T
        yield (
            what, f"{np.abs(pressure).max() / plain.pressure.max():.0e}",
            f"{np.abs(forces).max() / np.abs(plain.force).max():.0e}",
            " ".join(f"{name} {count}" for name, count in other.counts.items()),
        )  # fmt: skip


def hertz(solve, cells):
    """Rows: peak pressure and radius of a quarter of a ball on a block, against Hertz."""
    for slave in ("ball", "block"):
        for inner in cells:
            case = BallOnBlock(inner=inner, rest=8, push=0.003, zone=0.06, slave=slave)
            start = time.process_time()
            model = case.model()
            found = measured(case, solve(model))
            yield (
                slave, inner, model.assemble().unknowns, found.contacts,
                f"{100 * (found.peak / found.peak_hertz - 1):+.2f}",
                f"{100 * (found.radius / found.radius_hertz - 1):+.2f}",
                f"{time.process_time() - start:.1f}",
            )  # fmt: skip


def mindlin(solve, cells):
    """Rows: stick radius of half a ball dragged with half of the friction that it has."""
    for inner in cells:
        case = BallOnBlock(inner=inner, shift=0.0015, mu=0.2276, slave="block")
        model = case.model()
        for _ in range(4):  # secant on mu: Q hardly depends on it
            found = measured(case, solve(model.with_mu(case.mu)))
            if abs(found.used - 0.5) < 1e-3:
                break
            case = replace(case, mu=case.mu * found.used / 0.5)
        exact = found.stick_mindlin
        yield (
            inner, model.assemble().unknowns, f"{found.used:.4f}", f"{exact:.4f}",
            f"{found.stick_axis:.4f} ({100 * (found.stick_axis / exact - 1):+.1f})",
            f"{found.stick:.4f} ({100 * (found.stick / exact - 1):+.1f})",
            f"{100 * (found.peak / found.peak_hertz - 1):+.2f}",
        )  # fmt: skip


def rings(solve):
    """Rows: pressure of two rings pressed into each other, against Lamé."""
    cases = [((12, 16), 0), ((24, 32), 0), ((48, 64), 0), ((33, 20), 0), ((66, 40), 0),
             ((16, 24), 2), ((24, 16), 2)]  # fmt: skip
    for around, layers in cases:
        case = Rings(around=around, layers=layers)
        solution = solve(case.model())
        error = 100 * (solution.pressure / case.lame - 1)
        mean = np.average(error, weights=solution.weights)
        what = f"{3 if layers else 2}D, {around[0]} in {around[1]} a quarter"
        yield what, f"{mean:+.2f}", f"{error.min():+.2f} … {error.max():+.2f}"


def refined(solve):
    """Rows: spread of the pressure of rings whose cells are halved in both directions."""
    for around in ((33, 20), (24, 16), (20, 33)):
        for overlap in (0.005, 0.0002):
            rows = []
            for fine in (1, 2, 4):
                case = Rings(tuple(fine * k for k in around), overlap=overlap,
                             radial=(10 * fine, 12 * fine))  # fmt: skip
                model = case.model()
                solution, problem = solve(model), model.assemble()
                missed = np.zeros(problem.w.shape)
                missed[:, 0] = case.missed(problem, model)
                smooth = solve(replace(problem, w=problem.w - missed)).r[:, 0]
                weights = solution.weights
                rows.append([*_spread(case, solution.pressure, weights),
                             _spread(case, smooth / weights, weights)[1]])  # fmt: skip
            mean, spread, rest = np.transpose(rows)
            yield (
                f"{around[0]} in {around[1]} a quarter", overlap, _listed(mean, "+.3f"),
                _listed(spread, ".3f"), _listed(np.log2(spread[:-1] / spread[1:]), ".2f"),
                _listed(rest, ".3f"),
            )  # fmt: skip


def _spread(case, pressure, weights):
    """Mean and standard deviation of pressures (nc,) against Lamé, per cent."""
    error = 100 * (pressure / case.lame - 1)
    mean = np.average(error, weights=weights)
    return mean, np.sqrt(np.average((error - mean) ** 2, weights=weights))


def _listed(values, form):
    return " / ".join(f"{x:{form}}" for x in values)


def search():
    """Rows: facets of two flat surfaces, CPU seconds for all averages."""
    for n in (20, 40, 80, 160):
        low = am.box((1, 1, 1), (n, n, 1))
        high = am.box((1, 1, 1), (n * 4 // 5, n * 4 // 5, 1), origin=(0, 0, 1.01))
        start = time.process_time()
        mortar_contact(high, "bottom", low, "top")
        seconds = time.process_time() - start
        facets = n**2 + (n * 4 // 5) ** 2
        yield facets, f"{seconds:.2f}", f"{1e6 * seconds / facets:.0f}"


def table(title, head, rows):
    """A section with a table, printed as it comes."""
    lines = [f"## {title}", "| " + " | ".join(head) + " |", "|---" * len(head) + "|"]
    print("\n".join(lines), flush=True)
    for row in rows:
        lines.append("| " + " | ".join(map(str, row)) + " |")
        print(lines[-1], flush=True)
    return "\n".join(lines) + "\n"


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--cells", default="6,9,13")
    parser.add_argument("--method", choices=METHODS, default="auto")
    options = parser.parse_args()
    cells = [int(c) for c in options.cells.split(",")]

    def solve(model):
        return am.solve(model, METHODS[options.method](), tolerance=1e-9)

    def exact(model):
        return am.solve(model, METHODS[options.method](), tolerance=1e-12)

    machine = "; ".join(f"{name} {value}" for name, value in describe().items())
    parts = [
        "# Dual mortar contact against what is known\n",
        f"Regenerate: `python benchmarks/mortar.py --cells {options.cells}"
        + (f" --method {options.method}`.\n" if options.method != "auto" else "`.\n"),
        f"{machine}. Errors in per cent where nothing else is said; meshes never match.\n",
        table("Patch test", ("mesh", "largest error, relative"), patch_tests(exact)),
        table("Balance", ("surfaces", "force", "moment"), balances()),
        table("Invariance: a round foot pressed and dragged on a block",
              ("change", "pressure", "force", "contacts"), invariance(exact)),
        table("Hertz: a quarter of a ball (R = 1, a = 0.057) on a block",
              ("slave", "cells in the radius", "unknowns", "in contact", "peak pressure",
               "radius", "CPU s"), hertz(solve, cells)),
        table("Cattaneo-Mindlin: half a ball on a block, c / a",
              ("cells in the radius", "unknowns", "Q / (mu P)", "exact",
               "from q / p on the axis", "from the area that sticks", "peak pressure"),
              mindlin(solve, cells[:2])),
        table("Rings pressed into each other, overlap 0.005 of the radius",
              ("mesh", "mean pressure", "pressure"), rings(solve)),
        table("Rings, cells of both halved twice",
              ("slave in master", "overlap", "mean", "standard deviation", "its order",
               "without what facets miss"),
              refined(solve)),
        table("Cost of the averages", ("facets", "CPU s", "µs per facet"), search()),
        NOTE,
    ]  # fmt: skip
    (HERE / "results/mortar.md").write_text("\n".join(parts))


NOTE = """\
- The patch test is exact on parallelograms and triangles. Shape functions of other
  quadrilaterals are rational functions on the plane, integrated by 25 points per triangle.
- Hertz and Mindlin hold for a << R; here a / R = 0.057 (Hertz) and 0.11 (Mindlin). The radius
  is that of the straight line p² over r², the area that sticks is known to half a cell.
- Mindlin's slave is the block: the normals of the ball, as far as they are tilted, turn
  r³ / 2 R² of the approach into slip.
- Lamé's rings hold for small overlaps; pressures at each node, the range includes the ends.
- Gaps of rings are those of the circles: the spread of pressures is a part of the overlap,
  however small that is. It is that of straight facets, which move between their nodes by less
  than the circle: averages of Lamé's own displacements scatter by 2e-4 of the overlap where the
  slave is finer than its master, by 1e-5 where it is coarser, and pressures answer waves by
  their wave number. Without what facets miss (last column) the spread goes; else it falls with
  the first power of the size of facets.
"""

if __name__ == "__main__":
    main()
