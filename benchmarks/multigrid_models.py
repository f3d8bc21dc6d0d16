"""Models of `multigrid` whose meshes nobody chose for multigrid: pairs, and one body of a kind.

Pairs are those of [PK] in linear elasticity: two blocks, a rounded die that irons a slab, and a
half ball that presses a beam; sizes double from row to row.  Two more are all of tetrahedra
that a mesh generator makes anew for every size: two blocks, and a half ball on a block.

[PK] S. Petrides, T. Hartland, T. Kolev et al., "AMG with filtering: an efficient preconditioner
for interior point methods in large-scale contact mechanics optimization", arXiv:2505.18576.
"""

import tempfile
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
from large_sliding_models import rounded

import amontons as am
from amontons.mechanics.meshes import Cells

RADIUS = 0.5  # of the ball
STEEL = am.LinearElastic(young=200, poisson=0.3)


def pair(slave, master, supports, mu, slave_name="upper.bottom", master_name="lower.top"):
    """Two bodies in contact."""
    soft = am.LinearElastic(young=100, poisson=0.3)
    bodies = [am.Body(master, soft, "lower"), am.Body(slave, STEEL, "upper")]
    return am.Model(bodies, supports, [am.Contact(slave_name, master=master_name, mu=mu)])


def two_blocks(size, mu):
    """Cubes whose meshes do not match, pressed and dragged."""
    lower = am.box((1, 1, 1), cells=4 * size)
    upper = am.box((0.8, 0.8, 0.8), cells=3 * size, origin=(0.1, 0.1, 1.0))
    supports = [am.Fix("lower.bottom", 0), am.Fix("upper.top", (0.01, 0, -0.02))]
    return pair(upper, lower, supports, mu)


def ironing(size, mu):
    """A die with a round underside, pressed into a slab and pushed along."""
    lower = am.box((3, 1, 0.75), cells=(12 * size, 4 * size, 3 * size), origin=(-1.5, 0, -0.75))
    upper = am.box((1, 0.8, 0.6), cells=(5 * size, 4 * size, 3 * size), origin=(0, 0.1, 0))
    upper = replace(upper, points=rounded(upper, 1.0))
    supports = [am.Fix("lower.bottom", 0), am.Fix("upper.top", (0.02, 0, -0.03))]
    return pair(upper, lower, supports, mu)


def beam_and_ball(size, mu):
    """Half a ball of tetrahedra pressed onto the middle of a beam that is held at its ends."""
    lower = am.box((4, 1, 1), cells=(16 * size, 4 * size, 4 * size), origin=(-2, -0.5, -1.0))
    supports = [am.Fix("lower.left", 0), am.Fix("lower.right", 0),
                am.Fix("upper.top", (0.005, 0, -0.04))]  # fmt: skip
    return pair(half_ball(int(np.log2(size))), lower, supports, mu, "upper.round")


def two_blocks_of_tets(size, mu):
    """The two blocks in tetrahedra, without levels."""
    lower, upper = (generated(unit_cube, edge / size) for edge in (0.2, 0.17))
    upper = replace(upper, points=0.8 * np.array(upper.points) + [0.1, 0.1, 1.0])
    supports = [am.Fix("lower.bottom", 0), am.Fix("upper.top", (0.01, 0, -0.02))]
    return pair(upper, lower, supports, mu)


def ball_on_block(size, mu):
    """Half a ball pressed onto a block, both in tetrahedra without levels."""
    lower = generated(unit_cube, 0.125 / size)
    lower = replace(lower, points=np.array(lower.points) * [2, 2, 1] - [1, 1, 1])
    supports = [am.Fix("lower.bottom", 0), am.Fix("upper.top", (0.005, 0, -0.04))]
    return pair(generated(_half_ball, 0.2 / size), lower, supports, mu, "upper.round")


@cache
def half_ball(level):
    """The lower half of a ball that touches the origin, refined `level` times."""
    if not level:
        return generated(_half_ball, 0.25)
    mesh = am.refined(half_ball(level - 1))
    points = np.array(mesh.points)
    nodes = mesh.surface_nodes("round")
    ray = points[nodes] - [0, 0, RADIUS]
    points[nodes] = [0, 0, RADIUS] + RADIUS * ray / np.linalg.norm(ray, axis=1)[:, None]
    return replace(mesh, points=points)


def _half_ball(model):
    ball = model.occ.addSphere(0, 0, RADIUS, RADIUS, angle1=-np.pi / 2, angle2=0)
    model.occ.synchronize()
    model.addPhysicalGroup(3, [ball], name="body")
    sides = [tag for _, tag in model.getBoundary([(3, ball)], oriented=False)]
    flat = [t for t in sides if model.occ.getCenterOfMass(2, t)[2] > RADIUS - 1e-9]
    model.addPhysicalGroup(2, flat, name="top")
    model.addPhysicalGroup(2, [t for t in sides if t not in flat], name="round")


def unit_cube(model):
    """The cube with its surfaces bottom and top."""
    box = model.occ.addBox(0, 0, 0, 1, 1, 1)
    model.occ.synchronize()
    model.addPhysicalGroup(3, [box], name="body")
    for name, z in (("bottom", 0.0), ("top", 1.0)):
        corner = (-0.1, -0.1, z - 0.1), (1.1, 1.1, z + 0.1)
        found = model.getEntitiesInBoundingBox(*corner[0], *corner[1], dim=2)
        model.addPhysicalGroup(2, [tag for _, tag in found], name=name)


def generated(shape, size):
    """Tetrahedra of gmsh with edges of about `size` in what shape(gmsh.model) makes."""
    import gmsh

    gmsh.initialize(interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.option.setNumber("Mesh.Algorithm3D", 10)
        gmsh.option.setNumber("Mesh.MeshSizeMax", size)
        gmsh.option.setNumber("Mesh.MeshSizeMin", size)
        shape(gmsh.model)
        gmsh.model.mesh.generate(3)
        with tempfile.TemporaryDirectory() as folder:
            path = str(Path(folder) / "mesh.msh")
            gmsh.write(path)
            return am.read_mesh(path)
    finally:
        gmsh.finalize()


def pressed(mesh, material=STEEL, order=1, mu=0.3):
    """A body pressed onto a plane and dragged by its top."""
    return am.Model(
        [am.Body(mesh, material, order=order)],
        [am.Fix("top", lambda x: (0, 0.02, 0.006 - 0.015 * x[0]))],
        [am.Contact("bottom", am.Plane((0, 0, 1), (0, 0, 0)), mu=mu)],
    )


def slender(size):
    """A plate ten times as wide as it is high."""
    return pressed(am.box((10, 10, 1), cells=(20 * size, 20 * size, 2 * size)))


def flat_cells(size):
    """A cube of cells four times as wide as they are high."""
    return pressed(am.box((1, 1, 1), cells=(4 * size, 4 * size, 16 * size)))


def jumping(size):
    """Layers of materials 1 000 times as stiff as those between, in no relation to levels."""
    mesh = am.box((1, 1, 1), cells=8 * size)
    nodes = mesh.cells[0].nodes
    stiff = np.floor(5 * mesh.points[nodes].mean(axis=1)[:, 2]) % 2 == 0
    cells = (Cells("hex", nodes[stiff], "stiff"), Cells("hex", nodes[~stiff], "soft"))
    laws = {"stiff": am.LinearElastic(200, 0.3), "soft": am.LinearElastic(0.2, 0.3)}
    return pressed(replace(mesh, cells=cells, grid=None), laws)


def quadratic(size):
    """Hexahedra of second order."""
    return pressed(am.box((1, 1, 1), cells=4 * size), order=2)


def quadratic_tets(size):
    """Tetrahedra of second order."""
    return pressed(am.box((1, 1, 1), cells=4 * size, kind="tet"), order=2)


PAIRS = {
    "two blocks": two_blocks,
    "ironing": ironing,
    "beam and ball": beam_and_ball,
    "two blocks of tetrahedra": two_blocks_of_tets,
    "ball on a block of tetrahedra": ball_on_block,
}
KINDS = {
    "plate": slender,
    "flat cells": flat_cells,
    "layers 1 to 1 000": jumping,
    "hexahedra of second order": quadratic,
    "tetrahedra of second order": quadratic_tets,
}
