"""Bodies that yield: closed forms, derivatives, limit loads, contact, what is remembered."""

from dataclasses import replace

import numpy as np
import pytest

import amontons as am
from amontons.core.errors import InvalidInput, UnsupportedForm
from amontons.io.vtk import stresses
from amontons.mechanics.elements import stiffness
from amontons.mechanics.elements.yielding import YieldingBody
from amontons.mechanics.meshes import second_order

STEEL = {"young": 210e3, "poisson": 0.3}
LINEAR = am.ElastoPlastic(**STEEL, yield_stress=250.0, hardening=2000.0)
TABLE = am.ElastoPlastic(**STEEL, yield_stress=[(250, 0), (300, 0.01), (320, 0.05)])
TIMES = (0.0, 1.0, 2.0)


def bar(law, strains, **options):
    """A bar in 3D that is pressed on a floor, free to the sides; strains at TIMES."""
    body = am.Body(am.box((1, 1, 1), 2), law, **options)
    push = (None, None, lambda x, t: -np.interp(t, TIMES, strains))
    supports = [am.Fix("top", push), am.Fix("left", (0, None, None)),
                am.Fix("front", (None, 0, None))]  # fmt: skip
    return am.Model([body], supports, [am.Contact("bottom", am.Plane((0, 0, 1)), mu=0.0)])


def uniaxial(law, strain):
    """Stress and plastic strain of a first loading."""
    stress, plastic = np.array(law.yield_stress).T
    p, s = np.append(plastic, 1.0), np.append(stress, law.yields_at(1.0))
    total = np.append(0, s / law.young + p)
    return np.interp(strain, total, np.append(0, s)), np.interp(strain, total, np.append(0, p))


# ------------------------------------------------------------------ closed forms
@pytest.mark.parametrize("law", [LINEAR, TABLE], ids=["linear", "table"])
@pytest.mark.parametrize("strain", [0.001, 0.0012, 0.005, 0.02, 0.08])
def test_a_bar_in_one_step(law, strain):
    flat = law is TABLE and strain > 0.05  # p may be any, on the mean that of the bar
    (step,) = am.evolve(bar(law, (0, strain, 0)), am.QuasiStatic(1.0), until=1.0,
                        tolerance=1e-12 if flat else 1e-10)  # fmt: skip
    stress, plastic = uniaxial(law, strain)
    assert step.resultant()[2] == pytest.approx(stress, rel=1e-6)
    found = step.state.plastic.reshape(-1, 7)
    np.testing.assert_allclose(found[:, 0], plastic, rtol=1e-5, atol=1e-12)
    np.testing.assert_allclose(found[:, 1:4].sum(axis=1), 0, atol=1e-15)  # volume is kept
    assert step.supports["top"].wrench.force[2] == pytest.approx(-stress, rel=1e-6)
    for each in next(stresses(step.model, step.fields, step.time)):
        np.testing.assert_allclose(each, np.diag([0, 0, -stress]) * np.ones_like(each),
                                   atol=1e-4 * stress)  # fmt: skip


def test_loads_that_go_leave_what_has_flown():
    """Elastic on the way back; the other way round it yields where it has come to."""
    law, most = LINEAR, 0.01
    stress, plastic = uniaxial(law, most)
    steps = list(am.evolve(bar(law, (0, most, most - 0.001)), am.QuasiStatic(0.5), until=2.0))
    assert steps[-1].resultant()[2] == pytest.approx(stress - 0.001 * law.young, rel=1e-6)
    np.testing.assert_array_equal(steps[-1].state.plastic, steps[2].state.plastic)
    assert steps[1].energies.damping > 0 == steps[3].energies.damping
    for step in steps:
        assert abs(step.energies.defect) < 1e-7 * step.energies.turnover
    work = 250.0 * plastic + law.hardening * plastic**2 / 2
    lost = sum(step.energies.damping for step in steps)
    assert lost == pytest.approx(work, rel=0.05)  # two steps, each with the stress of its end


def test_shear_to_and_fro_through_the_first_place():
    """Closed form of each stretch.  Back at t = 2, supports are where they began."""
    shear, slope, limit, most = 200 / 2.6, 20.0, 1 / np.sqrt(3), 0.04
    steel = am.ElastoPlastic(200.0, 0.3, yield_stress=1.0, hardening=slope)

    def way(t):
        return most * (t if t <= 1 else 2 - t)

    sides = ("bottom", "top", "left", "right", "front", "back")
    supports = [am.Fix(side, lambda x, t: (way(t) * x[2], 0, 0)) for side in sides]
    model = am.Model([am.Body(am.box((1, 1, 1), cells=(2, 2, 2)), steel)], supports)
    stress, at = 0.0, 0.0
    for step in am.evolve(model, am.QuasiStatic(0.5), until=2.5):
        stress, at = stress + shear * (way(step.time) - at), way(step.time)
        flow = max(0.0, (abs(stress) - limit) / (shear + slope / 3))
        stress, limit = stress - np.sign(stress) * shear * flow, limit + slope / 3 * flow
        assert step.supports["top"].force[0] == pytest.approx(stress, rel=1e-9)


def test_small_strains_are_those_of_linear_elasticity():
    """solve and evolve, below the yield stress."""
    one, other = (am.solve(am.Model(*_block(law, integration="full")))
                  for law in (LINEAR, am.LinearElastic(**STEEL)))  # fmt: skip
    np.testing.assert_allclose(one.displacement[0], other.displacement[0], atol=1e-11)
    np.testing.assert_allclose(one.resultant, other.resultant, atol=1e-6)
    np.testing.assert_allclose(one.fields.reaction[0], other.fields.reaction[0], atol=1e-7)


def _block(law, by=1e-4, **options):
    body = am.Body(am.box((2, 1), (8, 4)), law, **options)
    return [body], [am.Fix("top", (0, -by))], [am.Contact("bottom", am.Plane((0, 1)), mu=0.3)]


# ------------------------------------------------------------------ elements
def mesh_of(kind, *, axisymmetric=False):
    first = {"quad8": "quad", "tri6": "tri", "tet10": "tet", "hex20": "hex"}.get(kind, kind)
    dim = 2 if first in ("quad", "tri") else 3
    mesh = am.box((2.0, 1.5, 1.0)[:dim], (2, 2, 1)[:dim], first)
    mesh = am.Mesh(1 + mesh.points + 0.05 * np.sin(3 * mesh.points[:, ::-1]), mesh.cells)
    mesh = mesh if first == kind else second_order(mesh, serendipity=kind in ("quad8", "hex20"))
    return replace(mesh, axisymmetric=axisymmetric)


@pytest.mark.parametrize(("kind", "axisymmetric"), [
    ("quad", False), ("tri", False), ("quad8", False), ("quad", True), ("tri", True),
    ("quad8", True), ("hex", False), ("tet10", False), ("hex20", False),
])  # fmt: skip
def test_stiffness_is_the_derivative_of_forces(kind, axisymmetric):
    """With a history, and points on both sides of yielding."""
    mesh = mesh_of(kind, axisymmetric=axisymmetric)
    law = am.ElastoPlastic(1.0, 0.3, yield_stress=[(0.05, 0), (0.06, 0.1)], hardening=0.01)
    body, K = YieldingBody(mesh, law), stiffness(mesh, law).tocsr()
    x = mesh.points - 1
    u = (0.1 * np.sin(2 * x[:, ::-1]) + 0.02 * x).ravel()
    history = body.respond(0.7 * u, np.zeros(body.size)).history
    here = body.respond(u, history)
    assert 0 < (here.history.reshape(-1, 7)[:, 0] > history.reshape(-1, 7)[:, 0]).sum()
    way = np.random.default_rng(5).standard_normal(u.shape)

    def forces(s):
        v = u + s * way
        return K @ v - body.respond(v, history, tangent=False).forces

    h = 1e-6
    slope = (forces(h) - forces(-h)) / (2 * h)
    tangent = (K - here.stiffness) @ way
    assert abs(slope - tangent).max() < 1e-6 * abs(tangent).max()
    assert abs((here.stiffness - here.stiffness.T).data).max(initial=0.0) < 1e-15
    again = body.respond(u, here.history)  # at the end of a step nothing more flows
    np.testing.assert_allclose(again.forces, here.forces, atol=1e-15)
    np.testing.assert_allclose(again.history, here.history, atol=1e-15)


@pytest.mark.parametrize("kind", ["quad", "hex", "tet10"])
def test_stress_ends_on_the_yield_surface(kind):
    mesh = mesh_of(kind)
    law = am.ElastoPlastic(1.0, 0.3, yield_stress=[(0.05, 0), (0.06, 0.1)], hardening=0.01)
    strain = np.random.default_rng(2).normal(size=(50, 3, 3))
    strain = 0.2 * (strain + strain.swapaxes(1, 2))
    found = law.flow(strain, np.zeros_like(strain), np.zeros(50))
    s = 2 * law.shear * (strain - found.strain)
    s -= np.trace(s, axis1=1, axis2=2)[:, None, None] / 3 * np.eye(3)
    q = np.sqrt(1.5 * (s * s).sum(axis=(1, 2)))
    np.testing.assert_allclose(q, law.yields_at(found.p), rtol=1e-13)
    np.testing.assert_allclose(found.q, q, rtol=1e-13)
    size = np.sqrt((found.strain**2).sum(axis=(1, 2)) * 2 / 3)
    np.testing.assert_allclose(size, found.p, rtol=1e-12)
    assert len(mesh.cells)


# ------------------------------------------------------------------ a thick-walled tube
def tube(cells, order=1, integration="auto"):
    """Inner pressures of a tube with b = 2 a, in plane strain, that is widened step by step."""
    mesh = replace(am.box((1.0, 0.1), (cells, 1), origin=(1.0, 0.0)), axisymmetric=True)
    law = am.ElastoPlastic(1000.0, 0.3, yield_stress=1.0)
    body = am.Body(mesh, law, order=order, integration=integration)
    supports = [am.Fix("left", (lambda x, t: 0.004 * t, None)), am.Fix("top", (None, 0)),
                am.Fix("bottom", (None, 0))]  # fmt: skip
    away = am.Contact("right", am.Plane((-1, 0), (9, 0)), mu=0.0)
    steps = am.evolve(am.Model([body], supports, [away]), am.QuasiStatic(0.1), until=1.0)
    inner = np.abs(body.mesh.points[:, 0] - 1) < 1e-9
    return [s.fields.reaction[0][inner, 0].sum() / (2 * np.pi * 0.1) for s in steps]


@pytest.mark.parametrize(("cells", "order"), [(8, 1), (16, 1), (4, 2)])
def test_a_tube_reaches_its_limit_pressure(cells, order):
    """2 / sqrt(3) ln(b / a) times the yield stress, which small strains can not pass."""
    pressure = np.array(tube(cells, order))
    limit = 2 / np.sqrt(3) * np.log(2)
    assert pressure[-1] == pytest.approx(limit, rel=0.004)
    assert pressure[-1] - pressure[-2] < 0.002 * limit
    elastic = 0.0004 * 1000 / 1.3 * (4 - 1) / (0.4 * 1 + 4)  # Lamé: a = 1, b = 2
    assert pressure[0] == pytest.approx(elastic, rel=0.005)


def test_a_load_beyond_the_limit_is_refused_with_its_share():
    mesh = replace(am.box((1.0, 0.1), (8, 1), origin=(1.0, 0.0)), axisymmetric=True)
    law = am.ElastoPlastic(1000.0, 0.3, yield_stress=1.0)
    lid = am.Contact("top", am.Plane((0, -1), (0, 0.1)), mu=0.0)
    limit = 2 / np.sqrt(3) * np.log(2)

    def loaded(p):
        push = am.Pressure("left", p)
        body, base = am.Body(mesh, law), am.Fix("bottom", (None, 0))
        return am.solve(am.Model([body], [base], [lid], [push]))

    assert loaded(0.95 * limit).converged  # the lid lets it thicken: it holds 0.964
    with pytest.raises(am.NotConverged, match=r"no equilibrium found beyond 0\.64\d* of"):
        loaded(1.5 * limit)


# ------------------------------------------------------------------ contact
def test_contact_between_a_body_that_yields_and_one_that_does_not():
    """Mortar contact on meshes that do not match: uniform stress in both."""
    soft = am.Body(am.box((1, 1), (3, 3)), TABLE)
    stiff = am.Body(am.box((1, 1), (4, 2), origin=(0, 1)), am.LinearElastic(**STEEL))
    sides = [am.Fix("body 1.left", (0, None)), am.Fix("body 2.left", (0, None))]
    supports = [*sides, am.Fix("body 1.bottom", (None, 0)), am.Fix("body 2.top", (None, -0.02))]
    bodies = [replace(soft, name="body 1"), replace(stiff, name="body 2")]
    pair = am.Contact("body 2.bottom", master="body 1.top", mu=0.0)
    solution = am.solve(am.Model(bodies, supports, [pair]))
    pressure = solution.fields.pressure
    np.testing.assert_allclose(pressure, pressure.mean(), rtol=1e-6)
    soft_stress, _ = next(stresses(solution.model, solution.fields, None))
    np.testing.assert_allclose(soft_stress[:, 1, 1], -pressure.mean(), rtol=1e-6)
    s = soft_stress[0] - np.trace(soft_stress[0]) / 3 * np.eye(3)
    p = solution.fields.plastic[0].reshape(-1, 7)[0, 0]
    assert np.sqrt(1.5 * (s * s).sum()) == pytest.approx(float(TABLE.yields_at(p)), rel=1e-6)
    assert p > 0.01


# ------------------------------------------------------------------ what is remembered
def test_a_step_tried_again_is_the_same():
    """The state before it is not changed; a file of it leads on to the same numbers."""
    model = am.Model(*_block(LINEAR, by=0.02))
    first = list(am.evolve(model, am.QuasiStatic(0.5), until=1.0))
    state = first[0].state
    kept = state.plastic.copy()
    again = [next(am.evolve(model, am.QuasiStatic(0.5), until=1.0, start=state))
             for _ in range(2)]  # fmt: skip
    for step in again:
        np.testing.assert_array_equal(step.state.displacement, again[0].state.displacement)
        np.testing.assert_array_equal(step.state.plastic, again[0].state.plastic)
    np.testing.assert_array_equal(state.plastic, kept)
    np.testing.assert_allclose(again[0].state.plastic, first[1].state.plastic, atol=1e-12)


def test_a_saved_state_has_the_history(tmp_path):
    (step,) = am.evolve(am.Model(*_block(LINEAR, by=0.02)), am.QuasiStatic(1.0), until=1.0)
    assert step.state.plastic.any()
    am.save_state(tmp_path / "state.h5", step.state)
    found = am.load_state(tmp_path / "state.h5")
    np.testing.assert_array_equal(found.plastic, step.state.plastic)


# ------------------------------------------------------------------ what can not be
@pytest.mark.parametrize(("given", "message"), [
    ({}, "yield_stress: expected a stress > 0 or rows"),
    ({"yield_stress": -1.0}, "expected a stress > 0, got -1"),
    ({"yield_stress": [(250, 0.1)]}, "expected plastic strain 0 in the first row"),
    ({"yield_stress": [(250, 0), (240, 0.1)]}, "row 2: expected stresses that do not fall"),
    ({"yield_stress": [(250, 0), (260, 0)]}, "row 2: expected plastic strains that grow"),
    ({"yield_stress": "much"}, "yield_stress"),
    ({"yield_stress": 250, "hardening": -1.0}, "hardening: expected a slope >= 0"),
    ({"yield_stress": 250, "plane": "stress"}, "plane: elasto-plastic bodies are in"),
])  # fmt: skip
def test_laws_that_can_not_be(given, message):
    with pytest.raises(InvalidInput, match=message):
        am.ElastoPlastic(**STEEL, **given)


def test_what_bodies_that_yield_lack_is_said():
    bodies, supports, contacts = _block(LINEAR)
    model = am.Model(bodies, supports, contacts)
    with pytest.raises(UnsupportedForm, match="no one linear problem"):
        model.assemble()
    with pytest.raises(UnsupportedForm, match="quasi-static steps; use QuasiStatic"):
        am.evolve(model, am.MoreauJean(0.1), until=1.0)
    for given in ({"kinematics": "finite"}, {"method": "nitsche"}):
        with pytest.raises(InvalidInput, match="bodies that yield have small strains"):
            am.Model(bodies, supports, [replace(contacts[0], **given)])
    rubber = am.Body(am.box((1, 1), 1), am.NeoHookean(1.0, 0.3), name="rubber")
    with pytest.raises(InvalidInput, match="bodies that yield have small strains"):
        am.Model([*bodies, rubber], supports, contacts)
    with pytest.raises(UnsupportedForm, match="TangentNewton"):
        am.solve(model, am.SemismoothNewton())


CASE = """
[mesh]
box = [2, 1]
cells = [4, 2]
[material.default]
law = "elasto-plastic"
young = 210e3
poisson = 0.3
{}
[[contact]]
slave = "bottom"
friction = {{ coulomb = 0.1 }}
obstacle = {{ plane = {{ normal = [0, 1] }} }}
"""


@pytest.mark.parametrize(("rows", "wanted"), [
    ("yield_stress = 250\nhardening = 2000", LINEAR),
    ("yield_stress = [[250, 0], [300, 0.01], [320, 0.05]]", TABLE),
    ("yield_stress = [[250, 0], [200, 0.01]]", "default: yield_stress: row 2"),
    ("hardening = 1", "default: yield_stress: expected a stress > 0"),
])  # fmt: skip
def test_laws_of_case_files(tmp_path, rows, wanted):
    path = tmp_path / "block.toml"
    path.write_text(CASE.format(rows))
    if isinstance(wanted, str):
        with pytest.raises(am.FileFormatError, match=wanted):
            am.read_case(path)
    else:
        assert am.read_case(path).model.bodies[0].material == wanted
