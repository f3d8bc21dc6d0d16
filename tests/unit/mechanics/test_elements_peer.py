"""Elements against CalculiX 2.20: the work of loads on two or four distorted ones."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.sparse.linalg import spsolve

import amontons as am
from amontons.io.decks.shapes import SHAPES
from amontons.mechanics.elements import stiffness
from amontons.mechanics.elements.hyperelasticity import HyperelasticBody
from amontons.mechanics.meshes import second_order
from amontons.mechanics.meshes.cells import CELLS, FIRST

# f . u with displacements of `*NODE PRINT`, seven digits
WORK = {
    "C3D4": 0.010546595, "C3D10": 0.4178484, "C3D8": 0.014546481,
    "C3D6": 0.020688658, "C3D15": 0.42342567, "C3D20": 0.23927855,
    "C3D20R": 6.1430342, "CPE3": 0.0079721512, "CPE4": 0.0088529205,
    "CPE6": 0.018585632, "CPE8": 0.019222789, "CPE8R": 0.024584466,
    "CAX3": 0.00060174571, "CAX4": 0.00070630915, "CAX6": 0.0014011909,
    "CAX8": 0.001407638, "CAX8R": 0.0016235108,
}  # fmt: skip
DIGITS = 2e-6
SECTOR = 5e-4  # an axisymmetric element is a solid of 2 degrees there, its arcs are chords


def mesh_of(kind):
    """Two cubes or squares one on the other as elements of one type, all nodes moved."""
    shape = SHAPES[kind]
    first = FIRST.get(shape.cell, shape.cell)
    if first in ("quad", "tri"):
        mesh = am.box((1, 2), (1, 2), first, origin=(float(shape.plane == "axisymmetric"), 0))
    else:
        mesh = am.box((1, 1, 2), (1, 1, 2), "tet" if first == "tet" else "hex")
    if first == "wedge":
        n = mesh.cells[0].nodes
        halves = np.concatenate([n[:, [0, 1, 2, 4, 5, 6]], n[:, [0, 2, 3, 4, 6, 7]]])
        mesh = am.Mesh(mesh.points, (am.Cells("wedge", halves),))
    if CELLS[shape.cell].order == 2:
        mesh = second_order(mesh, serendipity=True)
    x = mesh.points
    moved = x + 0.06 * np.sin(5 * x + 7 * x[:, ::-1] + 1)
    cells = tuple(replace(b, integration=shape.integration) for b in mesh.cells)
    return am.Mesh(moved, cells, axisymmetric=shape.plane == "axisymmetric")


def loads(mesh):
    """Held nodes (n,) below, forces (n, dim) above."""
    x = mesh.points
    force = np.where(x[:, -1:] > 1.7, np.cos(3 * x + np.arange(mesh.dim)), 0.0)
    return x[:, -1] < 0.3, force


def moved(mesh, law):
    held, force = loads(mesh)
    free = np.repeat(~held, mesh.dim)
    K, u = stiffness(mesh, law).tocsc(), np.zeros(mesh.points.size)
    u[free] = spsolve(K[free][:, free], force.ravel()[free])
    return u.reshape(force.shape), force


@pytest.mark.parametrize("kind", WORK)
def test_work_of_loads(kind):
    u, force = moved(mesh_of(kind), am.LinearElastic(1000.0, 0.3))
    digits = SECTOR if SHAPES[kind].plane == "axisymmetric" else DIGITS
    assert (u * force).sum() == pytest.approx(WORK[kind], rel=digits)


@pytest.mark.parametrize("kind", ["C3D20R", "C3D8I", "C3D15", "C3D6", "CPE8R", "CPE4I", "CPS8"])
def test_uniform_strains_are_exact(kind):
    """Whatever the integration, on distorted elements."""
    mesh = mesh_of(kind)
    d = mesh.dim
    slope = np.random.default_rng(0).normal(size=(d, d))
    law = am.LinearElastic(1000.0, 0.3)
    force = (stiffness(mesh, law) @ (mesh.points @ slope.T).ravel()).reshape(-1, d)
    stress = law.stress(slope[None])[0, :d, :d]
    low, high = mesh.bounding_box()
    assert np.abs(force.sum(axis=0)).max() < 1e-9
    moment = force.T @ mesh.points  # sum f x^T = volume stress
    volume = np.trace(moment) / np.trace(stress)
    np.testing.assert_allclose(moment, volume * stress, atol=1e-9 * np.abs(moment).max())
    assert 0 < volume < np.prod(high - low)


def test_incompatible_modes_bend():
    """One layer of quadrilaterals, a cantilever: full integration locks in shear."""
    law = am.LinearElastic(1000.0, 0.0, "stress")
    found = {}
    for integration in ("full", "incompatible"):
        mesh = am.box((20, 1), (10, 1))
        cells = (replace(mesh.cells[0], integration=integration),)
        body = am.Body(am.Mesh(mesh.points, cells, mesh.surfaces), law)
        away = am.Contact("top", am.Plane((0, -1), (0, 99)), mu=0)
        model = am.Model([body], [am.Fix("left", 0)], [away], [am.Traction("right", (0, 1e-3))])
        found[integration] = am.solve(model).displacement[0][-1, 1]
    exact = 1e-3 * 20**3 / (3 * 1000 / 12)
    assert found["incompatible"] == pytest.approx(exact, rel=0.02)
    assert found["full"] < 0.5 * exact


RUBBER = [  # law, work of loads times 1e9 by *HYPERELASTIC with D1 = 0.5 (D2 = 1e20)
    (am.MooneyRivlin(0.4, 0.0, 4.0), 1638901.0574829567),
    (am.MooneyRivlin(0.3, 0.1, 4.0), 1638075.6676598628),
    (am.Ogden((0.8,), (1.7,), 4.0), 1638753.0851837667),
    (am.Ogden((0.63, 0.2), (1.3, -2.0), 4.0), 1586388.7295716238),
]


@pytest.mark.parametrize(("law", "work"), RUBBER, ids=repr)
def test_work_of_loads_on_rubber(law, work):
    """Two distorted C3D20 with strains of 10 percent; displacements of seven digits."""
    mesh = mesh_of("C3D20")
    held, force = loads(mesh)
    force, free = 0.004 * force, np.repeat(~held, 3)
    body, u = HyperelasticBody(mesh, law), np.zeros_like(force)
    for _ in range(8):
        inner, blocks = body.tangent(u)
        K = body.matrix(blocks).tocsc()[free][:, free]
        u.ravel()[free] += spsolve(K, (force - inner).ravel()[free])
    assert (u * force).sum() * 1e9 == pytest.approx(work, rel=2 * DIGITS)
