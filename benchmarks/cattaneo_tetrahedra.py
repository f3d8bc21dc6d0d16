"""Two spheres pressed, pushed and drawn back on tetrahedra of gmsh, against the closed form.

    python -m benchmarks.cattaneo_tetrahedra [--only "order 1, 0.07"] [--missing]

The model of `cattaneo_mindlin`: two half spaces whose gap is that of two spheres, nu = 0, on
meshes of gmsh (not installed by default) that grow with the distance and do not match.  Errors
of nodal tractions (force over area) and of `am.mean_tractions`, root mean squares over the
contact in parts of mu p0: everywhere, and farther than a facet from the edges of contact and
zones.  Rows are added to results/cattaneo_tetrahedra.json; the page is written of all.
"""

import sys
import tempfile
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parent))

from cattaneo_mindlin import MU, RADIUS, SIDE, YOUNG, keep, zones_of

import amontons as am

NEAR, GROWTH, COARSER = 1.25, 0.3, 1.17  # where cells are small; beyond; of the master
RUNS = {f"order {order}, {size}": (order, size)
        for order, sizes in ((1, (0.2, 0.13, 0.09, 0.07)), (2, (0.2, 0.13)))
        for size in sizes}  # fmt: skip


def block(size, up):
    """A half of a block beside z = 0, y > 0, of tetrahedra with that size in the contact."""
    import gmsh

    gmsh.initialize(interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        corner = (-SIDE, 0, 0 if up > 0 else -SIDE)
        gmsh.model.occ.addBox(*corner, 2 * SIDE, SIDE, SIDE)
        gmsh.model.occ.synchronize()
        gmsh.model.addPhysicalGroup(3, [tag for _, tag in gmsh.model.getEntities(3)])
        for _, tag in gmsh.model.getEntities(2):
            _, _, low, _, side, high = gmsh.model.getBoundingBox(2, tag)
            if high - low < NEAR:
                name = "contact" if abs(low) < NEAR else "far"
            elif side < NEAR:
                name = "front"
            else:
                continue
            gmsh.model.addPhysicalGroup(2, [tag], name=name)
        field = gmsh.model.mesh.field.add("MathEval")
        far = f"Sqrt(x*x+y*y+z*z)-{NEAR}"
        sizes = f"{size}+{GROWTH / 2}*({far}+Fabs({far}))"
        gmsh.model.mesh.field.setString(field, "F", sizes)
        gmsh.model.mesh.field.setAsBackgroundMesh(field)
        for source in ("ExtendFromBoundary", "FromPoints", "FromCurvature"):
            gmsh.option.setNumber(f"Mesh.MeshSize{source}", 0)
        gmsh.model.mesh.generate(3)
        with tempfile.TemporaryDirectory() as folder:
            gmsh.write(f"{folder}/block.msh")
            return am.read_mesh(f"{folder}/block.msh")
    finally:
        gmsh.finalize()


def model(order, size):
    """Pressed until t = 1, pushed until 2, and drawn back until 3."""
    law, depth = am.LinearElastic(YOUNG, 0.0), 1 / RADIUS
    bodies = [am.Body(block(size, 1), law, "upper", order=order),
              am.Body(block(COARSER * size, -1), law, "lower", order=order)]  # fmt: skip
    top = (lambda x, t: 0.7 * MU * depth * max(0.0, 1 - abs(t - 2)), 0,
           lambda x, t: -1.1 * depth * min(t, 1.0))  # fmt: skip
    sides = [am.Fix(f"{body}.front", (None, 0, None)) for body in ("upper", "lower")]
    return am.Model(
        bodies, [am.Fix("upper.far", top), am.Fix("lower.far", 0), *sides],
        [am.Contact("upper.contact", master="lower.contact", mu=MU,
                    clearance=lambda p: (p[:, 0] ** 2 + p[:, 1] ** 2) / (2 * RADIUS))],
    )  # fmt: skip


def errors(step, before, size):
    """(share Q / mu P, h / a, four errors of nodes, four of means).

    Of p / p0 and q / mu p0, everywhere and away from edges.  before: see `zones_of`; NaN while
    nothing pushes.
    """
    fields = step.fields
    pressed = before is not None and np.isnan(before)
    a, peak, share, zones = zones_of(fields, None if pressed else before)
    r = np.linalg.norm(fields.points[:, :2], axis=1)

    def shear(zones):
        parts = [s * b / a * np.sqrt(np.maximum(1 - (r / b) ** 2, 0)) for b, s in zones]
        return sum(parts, np.zeros(len(r)))

    exact = shear([] if pressed else zones)
    edges = [a, *(b for b, _ in zones)] if not pressed else [a]
    away = np.min([np.abs(r - b) for b in edges], axis=0) > size
    out = []
    for traction in (fields.force / fields.weights[:, None], am.mean_tractions(step)):
        p = traction[:, 2] * MU / peak - shear([(a, 1.0)])
        for error in (p, -traction[:, 0] / peak - exact):
            for those in (r < 1.4 * a, (r < 1.4 * a) & away):
                square = fields.weights[those] @ error[those] ** 2
                out.append(float(np.sqrt(square / (np.pi * a**2 / 2))))
    return share, size / a, out[:4], out[4:]


def run(name):
    """The row of a run: seconds, unknowns, and per stage what `errors` says."""
    order, size = RUNS[name]
    began, before, stages = time.process_time(), float("nan"), []
    whole = model(order, size)
    steps = am.evolve(whole, am.QuasiStatic(step=1.0), until=3.0, tolerance=1e-9)
    for number, step in enumerate(steps):
        stages.append(errors(step, before, size))
        before = stages[-1][0] if number else None
    unknowns = sum(body.mesh.points.size for body in whole.bodies)
    seconds = time.process_time() - began
    return {"name": name, "unknowns": unknowns, "seconds": seconds, "stages": stages}


def page(rows):
    """Lines of the page."""
    head = ["cells", "unknowns", "h / a", "tractions", "p", "p away", "locked in", "pushed",
            "pushed away", "drawn back", "drawn back away", "CPU s"]  # fmt: skip
    lines = [head, ["---"] * len(head)]
    for row in sorted(rows, key=lambda row: list(RUNS).index(row["name"])):
        order = RUNS[row["name"]][0]
        for kind, name in ((2, "at nodes"), (3, "means")):
            first, pushed, back = (stage[kind] for stage in row["stages"])
            told = [*first[:2], first[2], *pushed[2:], *back[2:]]
            begin = ["tet4" if order == 1 else "tet10", str(row["unknowns"]),
                     f"{row['stages'][0][1]:.3f}"]  # fmt: skip
            end = f"{row['seconds']:.0f}"
            if kind == 3:
                begin, end = ["", "", ""], ""
            lines.append([*begin, name, *(f"{100 * value:.1f}" for value in told), end])
    return [f"| {' | '.join(line)} |" for line in lines]


def main():
    """Run what is asked for and write the page."""
    keep(__doc__, RUNS, run, page, [
        "Two spheres, pushed and drawn back, on tetrahedra",
        "Errors in percent of p0 (p) and mu p0 (shear): over the contact, and farther than a",
        "facet from edges (away).  Locked in: shear after pressing; theory has none.",
    ])  # fmt: skip


if __name__ == "__main__":
    main()
