"""What holds parts together and moves them: ties, references, springs, tools, overlaps."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

import amontons as am

from .case import Case, Value

YOUNG, NU = 100.0, 0.3
PLANE = YOUNG / (1 - NU**2)  # stiffness of a wide body in plane strain
SOFT = am.LinearElastic(YOUNG, NU)
STRAIGHT = am.LinearElastic(YOUNG, 0.0)  # keeps its section when it is stretched


def tie(size: int) -> list[Value]:
    """Two bricks that are glued, meshes that do not match; pulled by 2 at the end."""
    near = am.Body(am.box((1, 1, 1), (2, size, size)), SOFT, "near")
    mesh = am.box((2, 1, 1), (3, size + 1, size + 1), "tet", origin=(1, 0, 0))
    far = am.Body(mesh, SOFT, "far")
    rollers = [
        am.Fix(f"{name}.{side}", value)
        for name in ("near", "far")
        for side, value in (("front", (None, 0, None)), ("bottom", (None, None, 0)))
    ]
    model = am.Model(
        [near, far], [am.Fix("near.left", (0, None, None)), *rollers],
        [am.Contact("near.right", master="far.left", tied=True)],
        [am.Traction("far.right", (2.0, 0, 0))],
    )  # fmt: skip
    moved = am.solve(model, tolerance=1e-10).displacement[1]
    end, glued = (moved[mesh.surface_nodes(side), 0] for side in ("right", "left"))
    exact = 2.0 * 3 / YOUNG
    return [Value("displacement of the end", float(end.mean()), exact),
            Value("sag of the glued side", float(np.ptp(glued)), 0.0, scale=exact)]  # fmt: skip


def reference(size: int) -> list[Value]:
    """A bar 4 x 1 x 2 whose end is moved and turned by a reference beside it."""
    body = am.Body(am.box((4, 1, 2), (2 * size, 1, size)), STRAIGHT, order=2)
    pull, turn = 0.02, 0.01
    model = am.Model(
        [body],
        [am.Fix("left", 0), am.Fix("R", (pull, None, None)),
         am.Fix("R.rotation", (0, turn, 0))],
        references=[am.Reference("R", (4.0, 0.5, 1.0))],
        constraints=[am.Coupling("right", "R")],
    )  # fmt: skip
    found = am.solve(model, tolerance=1e-10).references["R"]
    area, inertia = 2.0, 1 * 2**3 / 12
    return [Value("force", float(found.force[0]), YOUNG * area * pull / 4),
            Value("moment", float(found.moment[1]), YOUNG * inertia * turn / 4),
            Value("deflection", float(found.displacement[2]), -turn * 4 / 2)]  # fmt: skip


def spring(size: int) -> list[Value]:
    """A block on rollers and a spring of its own stiffness at its top, pressed by 3."""
    body = am.Body(am.box((2, 1), (2 * size, size)), SOFT)
    own = PLANE * 2 / 1
    model = am.Model(
        [body], [am.Fix("R", (0, None)), am.Fix("R.rotation", 0), am.Fix("left", (0, None))],
        [am.Contact("bottom", am.Plane((0, 1)), mu=0.0)], [am.NodalForce("R", (0, -3.0))],
        references=[am.Reference("R", (1.0, 1.0))],
        constraints=[am.Coupling("top", "R", components=(1,))],
        springs=[am.Spring([("R", 1, 1.0)], own)],
    )  # fmt: skip
    found = am.solve(model, tolerance=1e-10)
    return [Value("displacement", float(found.references["R"].displacement[1]), -3 / (2 * own)),
            Value("contact force", float(found.resultant[1]), 1.5)]  # fmt: skip


def tool(size: int) -> list[Value]:
    """A rigid tool with a flat face is pressed 0.01 into a block on rollers."""
    block = am.Body(am.box((2, 1), (2 * size, size)), SOFT, "block")
    punch = am.Body(am.box((3, 1), 1, origin=(-0.5, 1)), am.Rigid(), "punch")
    model = am.Model(
        [block, punch],
        [am.Fix("block.bottom", (None, 0)), am.Fix("block.left", (0, None)),
         am.Fix("punch.top", (0, -0.01))],
        [am.Contact("block.top", am.Plane((0, -1), (0, 1)), mu=0.0, follows="punch")],
    )  # fmt: skip
    found = am.solve(model, tolerance=1e-10)
    return [Value("pressure", float(found.fields.pressure.mean()), PLANE * 0.01),
            Value("spread of the pressure", float(np.ptp(found.fields.pressure)), 0.0,
                  scale=PLANE * 0.01)]  # fmt: skip


def overlap(size: int) -> list[Value]:
    """Two blocks of height 1 between rollers, made 0.01 too high together."""
    lower = am.Body(am.box((1, 1), (size, size)), SOFT, "lower")
    upper = am.Body(am.box((1, 1), (size + 1, size), origin=(0, 0.99)), SOFT, "upper")
    model = am.Model(
        [lower, upper],
        [am.Fix("lower.bottom", (None, 0)), am.Fix("upper.top", (None, 0)),
         am.Fix("lower.left", (0, None)), am.Fix("upper.left", (0, None))],
        [am.Contact("upper.bottom", master="lower.top", mu=0.0)],
    )  # fmt: skip
    found = am.solve(model, tolerance=1e-10)
    return [Value("pressure", float(found.fields.pressure.mean()), PLANE * 0.01 / 2)]


def slot(size: int) -> list[Value]:
    """A block with a closed slot inside, pressed across it: as if there were none."""
    n = 4 * size
    whole = am.box((2, 2), n)
    x, y = whole.points.T
    inside = np.flatnonzero((np.abs(y - 1) < 1e-9) & (x > 0.51) & (x < 1.49))
    twin = np.arange(len(x))
    twin[inside] = len(x) + np.arange(len(inside))
    (block,) = whole.cells
    above = whole.points[block.nodes].mean(axis=1)[:, 1] > 1
    nodes = np.where(above[:, None], twin[block.nodes], block.nodes)
    points = np.vstack([whole.points, whole.points[inside]])
    bare = am.Mesh(points, (replace(block, nodes=nodes),))
    (rim,) = bare.boundary
    lips = rim.nodes[(np.abs(points[rim.nodes][:, :, 1] - 1) < 1e-9).all(axis=1)]
    upper = (lips >= len(x)).any(axis=1)
    sides = {"upper lip": (am.Facets("line", lips[upper]),),
             "lower lip": (am.Facets("line", lips[~upper]),)}  # fmt: skip
    sides |= {side: whole.surfaces[side] for side in ("bottom", "top", "left")}
    mesh = replace(bare, surfaces=sides)
    model = am.Model(
        [am.Body(mesh, SOFT)], [am.Fix("bottom", (None, 0)), am.Fix("left", (0, None))],
        [am.Contact("upper lip", master="lower lip", mu=0.3)], [am.Traction("top", (0, -1.0))],
    )  # fmt: skip
    solved = am.solve(model, tolerance=1e-10)
    sunk = solved.displacement[0][mesh.surface_nodes("top"), 1]
    return [Value("displacement of the top", float(sunk.mean()), -2 / PLANE),
            Value("pressure between the lips", float(solved.fields.pressure.mean()), 1.0)]


def layers(size: int) -> list[Value]:
    """A rod of length 1 whose modulus grows from 100 to 200, one for each layer of cells."""
    mesh = am.box((1, 0.1), (4 * size, 1))
    (block,) = mesh.cells
    middle = mesh.points[block.nodes].mean(axis=1)[:, 0]
    cells = tuple(
        am.Cells("quad", block.nodes[k : k + 1], f"layer {k}") for k in range(len(middle))
    )
    graded = {
        f"layer {k}": am.LinearElastic(YOUNG * (1 + x), 0.0) for k, x in enumerate(middle)
    }
    body = am.Body(replace(mesh, cells=cells), graded)
    model = am.Model([body], [am.Fix("left", (0, None)), am.Fix("bottom", (None, 0))],
                     loads=[am.Traction("right", (1.0, 0))])  # fmt: skip
    moved = am.solve(model).displacement[0][mesh.surface_nodes("right"), 0]
    return [Value("displacement of the end", float(moved.mean()), np.log(2.0) / YOUNG)]


def _sector(size: int) -> tuple[am.Mesh, float]:
    """30 degrees of a ring 1 < r < 2, with the sides "inner", "outer", "flat" and "tilted"."""
    angle = np.pi / 6
    box = am.box((1, 1), (4 * size, 2 * size))
    r, a = 1 + box.points[:, 0], angle * box.points[:, 1]
    points = np.stack([r * np.cos(a), r * np.sin(a)], axis=1)
    names = {"inner": "left", "outer": "right", "flat": "bottom", "tilted": "top"}
    sides = {name: box.surfaces[old] for name, old in names.items()}
    return am.Mesh(points, box.cells, sides), angle


def _on_axes(mesh: am.Mesh, angle: float, material: am.LinearElastic, load: object) -> float:
    """Radial displacement at the inner side, the tilted one held along its own axes."""
    along = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    model = am.Model(
        [am.Body(mesh, material)],
        [am.Fix("flat", (None, 0)), am.Fix("turned", (None, 0))], loads=[load],
        constraints=[am.Axes("turned", "tilted", along)],
    )  # fmt: skip
    nodes = mesh.surface_nodes("inner")
    outward = mesh.points[nodes] / np.linalg.norm(mesh.points[nodes], axis=1)[:, None]
    moved = am.solve(model).displacement[0][nodes]
    return float(np.einsum("kc,kc->k", moved, outward).mean())


def sector(size: int) -> list[Value]:
    """Pressure 1 inside a tube in plane strain."""
    mesh, angle = _sector(size)
    u = _on_axes(mesh, angle, SOFT, am.Pressure("inner", 1.0))
    lame = (1 + NU) / YOUNG * 1 / 3 * ((1 - 2 * NU) + 4)
    return [Value("radial displacement inside", u, lame)]


def disc(size: int) -> list[Value]:
    """A disc with a hole turns: rho omega^2 = 1, plane stress."""
    mesh, angle = _sector(size)
    law = am.LinearElastic(YOUNG, NU, plane="stress")
    u = _on_axes(mesh, angle, law, am.BodyForce(lambda x: x))
    around = ((3 + NU) * 4 + (1 - NU)) / 4  # stress at the hole
    return [Value("radial displacement inside", u, around / YOUNG)]


CASES = (
    Case("tie", "Two parts glued",
         "A bar of two parts, hexahedra and tetrahedra that do not match, is glued and pulled.",
         "Hooke: displacement sigma L / E, sections stay plane", tie, (2, 3)),
    Case("reference", "Bar moved by a reference node",
         "The end of a bar (nu = 0) follows a reference that is moved and turned.",
         "Bernoulli: force E A d / L, moment E I phi / L, deflection phi L / 2",
         reference, (1, 2), remarks="Hexahedra of second order."),
    Case("spring", "Block and spring side by side",
         "A block on a plane and a spring as stiff as the block are pressed by 3 together.",
         "Each carries half", spring, (2, 4)),
    Case("tool", "Block under a rigid tool",
         "A rigid tool with a flat face is pressed into a block on rollers, without friction.",
         "Hooke in plane strain: pressure E / (1 - nu^2) d / h", tool, (2, 4)),
    Case("overlap", "Overlap of two blocks",
         "Two blocks between rollers are too high together; the overlap is pressed away.",
         "Hooke in plane strain: pressure E / (1 - nu^2) d / (h1 + h2)", overlap, (2, 4)),
    Case("slot", "Slot that is closed",
         "A block with a slot of no width inside is pressed across it, a part on itself.",
         "The stress is uniform, as in a block without a slot", slot, (2, 4)),
    Case("layers", "Rod with a stiffness that grows along it",
         "A rod is pulled whose modulus grows linearly to twice its value.",
         "Displacement sigma L / E ln 2", layers, (1, 2, 4), order=2,
         remarks="One modulus for each layer of cells, that of its middle."),
    Case("sector", "Tube, a sector of it",
         "A sector of 30 degrees of a tube under pressure inside, held along its own axes.",
         "Lamé, plane strain", sector, (1, 2, 4), order=2),
    Case("disc", "Disc that turns",
         "A disc with a hole turns about its middle; a sector of 30 degrees, plane stress.",
         "Timoshenko and Goodier, Theory of Elasticity, section 32", disc, (1, 2, 4), order=2),
)  # fmt: skip
