"""A bolted lap joint: clamped by a bolt, pulled until it slips, and on."""

from __future__ import annotations

import numpy as np

import amontons as am

from .case import Case, Value

MU, CLAMP = 0.25, 200.0
STEEL = am.LinearElastic(2000.0, 0.3)
HEAD, SHANK = (0, 1, 4, 5), (2, 3)  # columns of cells, of width 1


def _bolt(size: int) -> am.Mesh:
    """In the plane: a shank 2 wide and 4 high between head and nut, 6 wide and 1 high."""
    fine = am.box((6, 6), 6 * size, origin=(-3, -3))
    (block,) = fine.cells
    centre = fine.points[block.nodes].mean(axis=1)
    kept = (np.abs(centre[:, 0]) < 1) | (np.abs(centre[:, 1]) > 2)
    used, nodes = np.unique(block.nodes[kept], return_inverse=True)
    points, cells = fine.points[used], nodes.reshape(-1, 4)
    bare = am.Mesh(points, (am.Cells("quad", cells),), {})
    (rim,) = bare.boundary
    middle = points[rim.nodes].mean(axis=1)
    inner = np.abs(np.abs(middle[:, 1]) - 2) < 1e-9
    above = middle[:, 1] > 0
    surfaces = {"head": (am.Facets("line", rim.nodes[inner & above]),),
                "nut": (am.Facets("line", rim.nodes[inner & ~above]),)}  # fmt: skip
    mesh = am.opened(am.Mesh(points, bare.cells, surfaces), "cut", (0, 0), (0, 1))
    top = int(np.flatnonzero((np.abs(mesh.points - (0, 3)) < 1e-9).all(axis=1))[0])
    return am.Mesh(mesh.points, mesh.cells, mesh.surfaces, node_sets={"middle": [top]})


def _joint(size: int, pull: float) -> am.Model:
    """Two plates; each is two pieces beside the shank, held together by equations.

    The upper one is moved by `pull` between t = 1 and 2, and as far again until 3.
    """
    bodies, ties, contacts = [], [], []
    for level, low in (("lower", -2.0), ("upper", 0.0)):
        for side, start in (("left", -6.0), ("right", 2.0)):
            mesh = am.box((4.0, 2.0), (4 * size, 2 * size), origin=(start, low))
            bodies.append(am.Body(mesh, STEEL, f"{level} {side}"))
        ties += [
            am.Equation([(f"{level} right.left", c, 1.0), (f"{level} left.right", c, -1.0)])
            for c in (0, 1)
        ]
    for side, sign in (("left", -1.0), ("right", 1.0)):
        contacts.append(am.Contact(f"upper {side}.bottom", master=f"lower {side}.top", mu=MU,
                                   name=f"faying {side}"))  # fmt: skip
        for end, other in (("head", f"upper {side}.top"), ("nut", f"lower {side}.bottom")):
            contacts.append(am.Contact(
                f"bolt.{end}", master=other, mu=0.0, name=f"{end} {side}",
                where=lambda x, sign=sign: sign * x[:, 0] > 1.5,
            ))  # fmt: skip
    supports = [
        am.Fix("lower left.left", 0), am.Fix("middle", (0, None)),
        am.Fix("upper right.right", (lambda x, t: pull * max(0.0, t - 1.0), None)),
    ]  # fmt: skip
    return am.Model(
        [*bodies, am.Body(_bolt(size), STEEL, "bolt")], supports, contacts,
        [am.NodalForce("F", [lambda x, t: CLAMP * min(t, 1.0)])],
        constraints=[*ties, am.Pretension("F", ("cut-below", "cut-above"))],
    )  # fmt: skip


def lap_joint(size: int) -> list[Value]:
    """Forces at the faying surface when it is clamped, slips, and has slipped twice as far."""
    steps = am.evolve(_joint(size, 1.0), am.QuasiStatic(step=1.0), until=3.0, tolerance=1e-6)
    clamped, slipping, slipped = list(steps)

    def between(step: am.ModelSolution) -> np.ndarray:
        return sum(pair.force for name, pair in step.pairs.items() if "faying" in name)

    out = [Value("force between the plates when clamped", between(clamped)[1], CLAMP)]
    for name, step in (("slip load", slipping), ("load after the slip", slipped)):
        drawn = step.supports["upper right.right"].force[0]
        out.append(Value(name, drawn, MU * CLAMP))
    return out


CASES = (
    Case("lap-joint", "Bolted lap joint",
         "Two plates, mu 0.25, are clamped by a bolt of 200 N and pulled apart sideways.",
         "Hand calculation: slip load mu F n with n = 1 surface, before and after",
         lap_joint, (1, 2),
         remarks="In the plane; the bolt keeps its force, and its shank does not touch. "
         "Contact and friction alone hold the upper plate and the bolt, so that forces have "
         "the tolerance of the solver, here 1e-6.", close=1e-5),
)  # fmt: skip
