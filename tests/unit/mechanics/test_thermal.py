"""Thermal strains and orthotropic elasticity against exact fields; what is refused."""

import numpy as np
import pytest

import amontons as am
from amontons.io.case import read_case
from amontons.io.vtk import model_fields
from amontons.mechanics.elements.elasticity import held_stress
from amontons.mechanics.elements.nodal_stress import stress_of
from amontons.mechanics.elements.thermal import thermal_load
from amontons.mechanics.meshes import second_order

STEEL = am.LinearElastic(210e3, 0.3, expansion=12e-6)
AWAY = {2: am.Plane((0, -1), (0, 9)), 3: am.Plane((0, 0, -1), (0, 0, 9))}
WOOD = am.OrthotropicElastic((12e3, 800, 500), (0.4, 0.45, 0.5), (700, 650, 60),
                             expansion=(4e-6, 30e-6, 40e-6))  # fmt: skip


def contact(d):
    """Out of reach: a model has contacts."""
    return am.Contact("top", AWAY[d], mu=0.0)


def stress(solution):
    found = model_fields(solution.model, solution.fields, solution)
    return found.cell["stress"], found.point["stress"]


@pytest.mark.parametrize("kind", ["quad", "tri", "hex", "tet"])
@pytest.mark.parametrize("order", [1, 2])
def test_a_free_body_grows_without_stress(kind, order):
    d = 3 if kind in ("hex", "tet") else 2
    law = am.LinearElastic(210e3, 0.3, "stress", expansion=12e-6)
    body = am.Body(am.box((1,) * d, 2, kind), law, order=order)
    sides = ("left", "front", "bottom") if d == 3 else ("left", "bottom")
    held = [am.Fix(side, [0 if k == j else None for j in range(d)])
            for k, side in enumerate(sides)]  # fmt: skip
    solution = am.solve(am.Model([body], held, [contact(d)], [am.Temperature(100.0)]))
    np.testing.assert_allclose(solution.displacement[0], 12e-4 * body.mesh.points, atol=1e-12)
    for values in stress(solution):
        assert np.abs(values).max() < 1e-7


@pytest.mark.parametrize("space", ["bar", "stress", "strain", "axisymmetric"])
def test_restrained_bars(space):
    """sigma = -E alpha T along one direction, or over 1 - nu (1 - 2 nu) in two (three)."""
    d, heat = (3 if space == "bar" else 2), 50.0
    plane = "stress" if space == "stress" else "strain"
    law = am.LinearElastic(210e3, 0.3, plane, expansion=12e-6)
    body = am.Body(am.box((4, 1, 1)[:d], (4, 2, 2)[:d]), law,
                   axisymmetric=space == "axisymmetric")  # fmt: skip
    E, nu, alpha = 210e3, 0.3, 12e-6
    low = ("bottom",) if d == 2 else ("front", "bottom")
    ends = ("left", "right") if space != "axisymmetric" else ("left", "top")
    axis = {"left": 0, "right": 0, "bottom": d - 1, "front": 1, "top": 1}
    held = [am.Fix(on, [0 if axis[on] == j else None for j in range(d)])
            for on in dict.fromkeys((*ends, *low))]  # fmt: skip
    away = am.Contact("right" if space == "axisymmetric" else "top",
                      am.Plane((-1, 0), (9, 0)) if space == "axisymmetric" else AWAY[d], mu=0)
    solution = am.solve(am.Model([body], held, [away], [am.Temperature(heat)]))
    cells, nodes = stress(solution)
    exact = -E * alpha * heat / (1 - nu if space == "strain" else 1)
    along = 1 if space == "axisymmetric" else 0
    np.testing.assert_allclose(cells[:, along], exact, rtol=1e-9)
    np.testing.assert_allclose(nodes[:, along], exact, rtol=1e-9)
    if space == "strain":
        np.testing.assert_allclose(cells[:, 2], exact, rtol=1e-9)
    force = solution.supports[ends[-1]].force[along]
    area = 16 * np.pi if space == "axisymmetric" else 1
    assert force == pytest.approx(exact * area, rel=1e-9)


def test_bimetal_strip_bends():
    """Two layers of equal height and modulus: curvature 3 (a1 - a2) T / (2 (h1 + h2))."""
    mesh = am.box((10, 0.2), (100, 8))
    low = mesh.points[mesh.cells[0].nodes].mean(axis=1)[:, 1] < 0.1
    nodes = mesh.cells[0].nodes
    cells = (am.Cells("quad", nodes[low], "low"), am.Cells("quad", nodes[~low], "high"))
    strip = second_order(am.Mesh(mesh.points, cells, mesh.surfaces))
    laws = {name: am.LinearElastic(100e3, 0.0, "stress", expansion=alpha)
            for name, alpha in (("low", 20e-6), ("high", 10e-6))}  # fmt: skip
    body = am.Body(strip, laws, order=2)
    held = [am.Fix("left", (0, None))]
    at = np.flatnonzero(np.abs(strip.points).max(axis=1) == 0)
    strip.node_sets["corner"] = at
    solution = am.solve(am.Model([body], [*held, am.Fix("corner", (None, 0))],
                                 [am.Contact("top", am.Plane((0, -1), (0, 9)), mu=0)],
                                 [am.Temperature(30.0)]))  # fmt: skip
    curvature = 3 * (20e-6 - 10e-6) * 30 / (2 * 0.2)
    tip = solution.displacement[0][strip.points[:, 0] == 10, 1].mean()
    assert tip == pytest.approx(curvature * 10**2 / 2, rel=2e-3)


def test_heating_closes_a_gap():
    """A bar 10 long, a gap of 0.01: sigma = -E (alpha T - 0.001)."""
    body = am.Body(am.box((10, 1), (10, 1)), am.LinearElastic(1e5, 0.0, expansion=1e-5))
    wall = am.Contact("right", am.Plane((-1, 0), (10.01, 0)), mu=0.0)
    held = [am.Fix("left", (0, 0))]
    for heat, pressure in ((50.0, 0.0), (100.0, 0.0), (300.0, 200.0)):
        solution = am.solve(am.Model([body], held, [wall], [am.Temperature(heat)]))
        assert solution.pressure == pytest.approx(pressure, abs=1e-6)
    steps = am.QuasiStatic(0.5)
    model = am.Model([body], held, [wall], [am.Temperature(lambda x, t: 300.0 * t)])
    *_, last = am.evolve(model, steps, until=1.0)
    np.testing.assert_allclose(model_fields(model, last.fields, last).cell["stress"][:, 0],
                               -200.0, rtol=1e-6)  # fmt: skip


def test_temperatures_add_by_region_and_nodes():
    mesh = am.box((2, 1), (2, 1))
    cells = tuple(am.Cells("quad", mesh.cells[0].nodes[k : k + 1], name)
                  for k, name in enumerate(("cold", "hot")))  # fmt: skip
    body = am.Body(am.Mesh(mesh.points, cells, mesh.surfaces), STEEL)
    model = am.Model([body], [am.Fix("left", 0)], [contact(2)], [
        am.Temperature(10.0), am.Temperature(5.0, region="hot"),
        am.Temperature(lambda x: x[1], on="right"),
    ])  # fmt: skip
    from amontons.mechanics.model.temperature import warming

    x = mesh.points
    expected = 10 + 5 * (x[:, 0] >= 1) + x[:, 1] * (x[:, 0] == 2)
    np.testing.assert_allclose(warming(model.with_load(2.0))[0], 2 * expected)


def test_orthotropic_is_isotropic_where_it_says_so():
    E, nu = 210e3, 0.3
    G = E / (2 * (1 + nu))
    for plane in ("strain", "stress"):
        one = am.LinearElastic(E, nu, plane, expansion=12e-6)
        axes = ((1, 2, 0.5), (0, 1, 3)) if plane == "strain" else ((1, 2), (-2, 1))
        other = am.OrthotropicElastic((E,) * 3, (nu,) * 3, (G,) * 3, axes, plane,
                                      expansion=12e-6)  # fmt: skip
        for d in (2, 3):
            np.testing.assert_allclose(other.moduli(d), one.moduli(d), atol=1e-9 * E)
            slope = np.random.default_rng(1).normal(size=(4, d, d))
            np.testing.assert_allclose(other.stress(slope), one.stress(slope), atol=1e-8 * E)
            np.testing.assert_allclose(held_stress(other, d), held_stress(one, d), atol=1e-9)


@pytest.mark.parametrize("turn", [0.0, 30.0, 90.0])
def test_orthotropic_bar(turn):
    """A bar pulled along x whose fibres are at an angle: 1 / E_x of the textbook."""
    c, s = np.cos(np.radians(turn)), np.sin(np.radians(turn))
    law = am.OrthotropicElastic(WOOD.young, WOOD.poisson, WOOD.shear, ((c, s, 0), (-s, c, 0)),
                                expansion=WOOD.expansion)  # fmt: skip
    E1, E2, _ = WOOD.young
    soft = c**4 / E1 + s**4 / E2 + (1 / WOOD.shear[0] - 2 * WOOD.poisson[0] / E1) * (c * s) ** 2
    body = am.Body(am.box((1, 1, 1), 2), law)
    sets = body.mesh.node_sets
    for name, at in (("o", (0, 0, 0)), ("y", (0, 1, 0)), ("z", (0, 0, 1))):
        sets[name] = np.flatnonzero((body.mesh.points == at).all(axis=1))
    held = [am.Fix("o", 0), am.Fix("y", (0, None, 0)), am.Fix("z", (0, None, None))]
    pull = [am.Traction("right", (6.0, 0, 0)), am.Traction("left", (-6.0, 0, 0))]
    solution = am.solve(am.Model([body], held, [contact(3)], pull))
    u, x = solution.displacement[0], body.mesh.points
    slope = np.linalg.lstsq(np.c_[x, np.ones(len(x))], u, rcond=None)[0][:3].T
    assert slope[0, 0] == pytest.approx(6 * soft, rel=1e-9)
    warm = am.solve(am.Model([body], held, [contact(3)], [am.Temperature(10.0)]))
    grown = np.linalg.lstsq(np.c_[x, np.ones(len(x))], warm.displacement[0], rcond=None)[0][:3]
    R = np.array(law.axes)
    exact = R.T @ np.diag([4e-5, 30e-5, 40e-5]) @ R
    np.testing.assert_allclose(0.5 * (grown + grown.T), exact, atol=1e-12)
    left = stress_of(body.mesh, law, warm.displacement[0], np.full(27, 10.0))
    assert max(np.abs(values).max() for values in left) < 1e-8


@pytest.mark.parametrize("integration", ["full", "reduced"])
def test_forces_of_a_temperature_balance(integration):
    mesh = second_order(am.box((1, 1, 1), 2), serendipity=True)
    cells = tuple(am.Cells(b.kind, b.nodes, b.region, integration) for b in mesh.cells)
    mesh = am.Mesh(mesh.points, cells, mesh.surfaces)
    force = thermal_load(mesh, WOOD, mesh.points @ [1.0, -2.0, 3.0])
    assert np.abs(force.sum(axis=0)).max() < 1e-12
    assert np.abs(np.cross(mesh.points, force).sum(axis=0)).max() < 1e-12


def test_what_is_refused():
    body = am.Body(am.box((1, 1), 1), am.LinearElastic(1, 0.3))
    with pytest.raises(am.InvalidInput, match="no material has an expansion"):
        am.Model([body], [am.Fix("left", 0)], [contact(2)], [am.Temperature(1.0)]).assemble()
    warm = am.Body(am.box((1, 1), 1), STEEL)
    with pytest.raises(am.InvalidInput, match="region 'steel': not found"):
        am.Model([warm], [am.Fix("left", 0)], [contact(2)],
                 [am.Temperature(1.0, region="steel")]).assemble()  # fmt: skip
    with pytest.raises(am.InvalidInput, match="surface 'lft': not found"):
        am.Model([warm], [am.Fix("left", 0)], [contact(2)], [am.Temperature(1.0, on="lft")])
    with pytest.raises(am.InvalidInput, match="region or on"):
        am.Temperature(1.0, "a", "b")
    with pytest.raises(am.InvalidInput, match="poisson.*too large"):
        am.OrthotropicElastic((1, 1, 1), (0.9, 0.9, 0.9), (1, 1, 1))
    with pytest.raises(am.InvalidInput, match="young: expected three"):
        am.OrthotropicElastic((1, 1), (0.1,) * 3, (1, 1, 1))
    with pytest.raises(am.InvalidInput, match="span a plane"):
        am.OrthotropicElastic((1,) * 3, (0.1,) * 3, (1,) * 3, ((1, 0, 0), (2, 0, 0)))


def test_case_file(tmp_path):
    text = """
[mesh]
box = [10, 1]
cells = [10, 1]
axisymmetric = true
[material.default]
young = 1e5
poisson = 0.0
expansion = 1e-5
[[fix]]
on = "bottom"
value = ["free", 0]
[[temperature]]
value = "100 + 0 * x"
[[contact]]
slave = "top"
friction = { coulomb = 0.1 }
obstacle = { plane = { point = [0, 1], normal = [0, -1] } }
"""
    path = tmp_path / "case.toml"
    path.write_text(text)
    model = read_case(path).target
    assert model.axisymmetric
    assert am.solve(model.with_mu(0.0)).pressure == pytest.approx(100.0)
    wood = text.replace("poisson = 0.0", "poisson = [0.1, 0.2, 0.3]\nshear = [9, 9, 9]")
    wood = wood.replace("young = 1e5", 'law = "orthotropic-elastic"\nyoung = [100, 80, 60]')
    path.write_text(wood)
    law = read_case(path).target.bodies[0].material
    assert law.young == (100, 80, 60) and law.expansion == (1e-5,) * 3


@pytest.mark.parametrize("dim", [2, 3])
def test_the_mean_of_each_cell(dim):
    """As with cells that have one temperature each, which bends a beam by 1 - 1 / n^2 of it."""
    n = 2
    law = am.LinearElastic(100.0, 0.0, expansion=1e-3)
    mesh = am.box((1, 1, 1)[:dim], (1, n, n)[:dim])
    up = np.array(mesh.points[:, -1])
    bent = [
        thermal_load(mesh, law, up, mean=mean)[:, 0] @ ((up - 0.5) * mesh.points[:, 0])
        for mean in (False, True)
    ]
    assert bent[0] == pytest.approx(100 * 1e-3 / 12)
    assert bent[1] == pytest.approx(bent[0] * (1 - 1 / n**2))
    heat = [am.Temperature(lambda x: x[-1], mean=mean) for mean in (False, True)]
    model = am.Model([am.Body(mesh, law)], [am.Fix("left", 0)], loads=heat)
    twice = am.Model([am.Body(mesh, law)], [am.Fix("left", 0)],
                     loads=[am.Traction("right", (0.0,) * dim)])
    force = model.assemble().f - twice.assemble().f
    free = model.discretisation.free
    both = sum(thermal_load(mesh, law, up, mean=m).ravel()[free] for m in (False, True))
    np.testing.assert_allclose(force, both, atol=1e-15)
