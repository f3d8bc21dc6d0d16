"""Pressure over overclosure along curves: by hand, by other roads, in models, files."""

from dataclasses import replace

import numpy as np
import pytest
from click.testing import CliRunner
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad
from scipy.optimize import brentq

import amontons as am
from amontons.app.cli import main
from amontons.core.errors import UnsupportedLaw
from amontons.mechanics.ready import gallery
from amontons.problem.friction import FrictionProblem
from amontons.problem.law import joined

HARDENS = am.OverclosureCurve([0.0, 1.0, 3.0, 10.0], [0.0, 0.1, 0.15, 0.2])
YIELDS = am.OverclosureCurve([0.0, 4.0, 5.0, 6.0], [-0.1, 0.1, 1.5, 9.0])
BENDS = am.OverclosureCurve([0.0, 2.0, 2.2, 9.0, 9.5], [-0.05, 0.0, 0.4, 0.45, 2.0])
GROWS = am.ExponentialOverclosure(2.0, 0.1)
CURVES = [HARDENS, YIELDS, BENDS, GROWS]


def one(curve, gap, give=0.05, area=2.0, mu=0.3):
    law = am.VaryingCompliance(curve, area, am.Coulomb(np.array([mu])))
    return FrictionProblem.from_delassus(np.diag([give] * 3), [[gap, 0.5, 0.0]], law)


@pytest.mark.parametrize("curve", CURVES)
@pytest.mark.parametrize("gap", [-2.0, -0.5, -0.05, 0.02, 0.3])
def test_one_contact(curve, gap):
    """u = W r + q meets the curve where a root finder says."""
    found = am.solve(one(curve, gap), tolerance=1e-12)
    assert found.converged

    def left(p):
        return gap + 0.05 * 2 * p + curve.needed(np.array([p]))[0][0]

    pressure = brentq(left, 0.0, 1e3) if left(0.0) < 0 else 0.0
    assert found.r[0, 0] == pytest.approx(2 * pressure, rel=1e-9, abs=1e-12)
    assert abs(found.r[0, 1]) <= 0.3 * found.r[0, 0] * (1 + 1e-9)


@pytest.mark.parametrize("curve", CURVES)
def test_a_curve_is_one_function_both_ways(curve):
    pressure = np.array([0.0, 1e-7, 1e-3, 0.5, 1.0, 1.5, 2.1, 5.5, 20.0])
    d, slope = curve.needed(pressure)
    np.testing.assert_allclose(curve.pressure_at(d), pressure, rtol=1e-9, atol=1e-18)
    step = 1e-5 * (1e-3 * (pressure > 1e-5) + pressure + 1e-9)
    more, _ = curve.needed(pressure + step)
    np.testing.assert_allclose((more - d) / step, slope, rtol=1e-3)
    for p, stored in zip(pressure[2:8], curve.energy(pressure)[2:8], strict=True):
        points = [q for q in (2e-6, 1.0, 2.0, 2.2, 3.0, 4.0, 5.0) if q < p]
        by_parts = (
            p * curve.needed(np.array([p]))[0][0]
            - quad(lambda q: curve.needed(np.array([q]))[0][0], 0, p, points=points, limit=200)[
                0
            ]
        )
        assert stored == pytest.approx(by_parts, rel=1e-4)


def test_the_exponential_law_of_calculix():
    at = GROWS.pressure_at(np.array([0.0, -0.1, 0.1]))
    np.testing.assert_allclose(at, [2.0, 0.02, 200.0], rtol=1e-12)


def test_one_line_is_a_stiffness():
    straight = am.OverclosureCurve([0.0, 30.0], [0.0, 0.1])
    plain = gallery.random_delassus(4, 8, 3, mu=0.3)
    soft = replace(plain, law=am.Compliant(plain.law, np.full(8, 1 / 300.0)))
    curved = replace(plain, law=am.VaryingCompliance(straight, 1.0, plain.law))
    one, other = (am.solve(each, tolerance=1e-12) for each in (soft, curved))
    np.testing.assert_allclose(other.r, one.r, atol=1e-8 * np.abs(one.r).max())


@settings(max_examples=25, deadline=None)
@given(
    seed=st.integers(0, 10**6), mu=st.sampled_from([0.0, 0.4]),
    steps=st.lists(st.tuples(st.floats(0.01, 5), st.floats(1e-3, 5)), min_size=1, max_size=6),
    begin=st.floats(-1.0, 1.0),
)  # fmt: skip
def test_any_growing_table(seed, mu, steps, begin):
    """Converged, and every contact on its curve."""
    rise, way = np.array(steps).T
    curve = am.OverclosureCurve(
        np.concatenate([[0.0], np.cumsum(rise)]),
        begin + np.concatenate([[0.0], np.cumsum(way)]),
    )
    plain = gallery.random_delassus(seed, 5, 3, mu=mu)
    law = am.VaryingCompliance(curve, np.linspace(0.5, 2.0, 5), plain.law)
    found = am.solve(replace(plain, law=law), tolerance=1e-9)
    assert found.converged
    d, _ = curve.needed(law.pressures(found.r))
    closed = found.r[:, 0] > 1e-7 * np.abs(found.r).max(initial=1e-300)
    size = np.abs(found.u).max() + np.abs(d).max()
    assert np.abs(found.u[:, 0] + d)[closed].max(initial=0.0) <= 1e-6 * size
    assert (found.u[:, 0] + d)[~closed].min(initial=0.0) >= -1e-6 * size


def test_joined_with_others_and_in_other_units():
    plain = gallery.random_delassus(4, 8, 3, mu=0.3)
    law = joined([
        am.VaryingCompliance(HARDENS, 2.0, plain.law.at(np.arange(3))),
        am.Compliant(plain.law.at(np.arange(2)), 0.1),
        am.VaryingCompliance(GROWS, 1.0, plain.law.at(np.arange(3))),
    ])  # fmt: skip
    found = am.solve(replace(plain, law=law), tolerance=1e-11)
    for index, curve, area in ((np.arange(3), HARDENS, 2.0), (np.arange(5, 8), GROWS, 1.0)):
        r, u = found.r[index, 0], found.u[index, 0]
        d, _ = curve.needed(r / area)
        np.testing.assert_allclose((u + d)[r > 0], 0, atol=1e-8 * np.abs(u).max())
    closed = found.r[3:5, 0] > 0
    np.testing.assert_allclose((found.u + 0.1 * found.r)[3:5, 0][closed], 0, atol=1e-8)
    part = law.at(np.array([5, 0, 3]))
    assert [len(index) for index, _ in part.pieces] == [1, 1]
    assert part.curved.tolist() == [True, True, False]
    scaled = law.scaled(3.0)
    np.testing.assert_allclose(scaled.energy(3 * found.r), 3 * law.energy(found.r), rtol=1e-12)
    with pytest.raises(UnsupportedLaw, match="curves of one of both"):
        joined([law, am.VaryingFriction(am.FrictionCurve([0.1, 0.2], pressure=[0, 1]))])


# ------------------------------------------------------------------------------- models
def block(stiffness, down=-0.01, **contact):
    body = am.Body(am.box((1, 1), 4), am.LinearElastic(young=100.0, poisson=0.0))
    floor = am.Contact("bottom", am.Plane((0, 1)), stiffness=stiffness, **contact)
    return am.Model([body], [am.Fix("top", [0, down])], [floor])


@pytest.mark.parametrize("curve", CURVES)
def test_a_block_on_a_soft_floor(curve):
    """p / E + D(p) is the way of its top."""
    found = am.solve(block(curve, -0.05, mu=0.2), tolerance=1e-10)
    pressure = brentq(lambda p: p / 100.0 + curve.needed(np.array([p]))[0][0] - 0.05, 0.0, 1e3)
    np.testing.assert_allclose(found.fields.pressure, pressure, rtol=1e-6)
    assert "straight pressure over overclosure" in found.convergence.detail
    value = am.VaryingCompliance(curve, law=am.Coulomb(np.array([0.2])))
    as_value = am.Contact("bottom", am.Plane((0, 1)), law=value)
    assert as_value.stiffness is curve
    assert as_value.mu == 0.2


def test_energy_of_quasi_static_steps_is_kept():
    """What the support gives is in the body and in the springs of contact, at any stage."""
    model = block(HARDENS, lambda x, t: -0.3 * t, mu=0.0)
    steps = list(am.evolve(model, am.QuasiStatic(0.02), until=1.0, tolerance=1e-10))
    p = steps[-1].fields.pressure[0]
    stored = 0.5 * p**2 / 100 + HARDENS.energy(np.array([p]))[0]
    assert steps[-1].energies.elastic == pytest.approx(stored, rel=1e-8)
    assert p > 1


def test_a_ball_on_a_hardening_spring_keeps_its_energy_within_the_step():
    body = am.Body(am.box((1, 1), 1), am.LinearElastic(young=1e5, poisson=0.0, density=1.0))
    floor = am.Contact("bottom", am.Plane((0, 1), point=(0, -0.05)), mu=0.0, stiffness=HARDENS)
    model = am.Model([body], [am.Fix("top", [0, None])], [floor],
                     [am.BodyForce([0.0, -5.0])])  # fmt: skip
    steps = list(am.evolve(model, am.MoreauJean(2e-3), until=0.6, tolerance=1e-10))
    assert max(step.gap.max() for step in steps) <= 0.051
    assert min(step.gap.min() for step in steps) < -0.05
    assert all(step.solution.converged for step in steps)


def test_case_files(tmp_path):
    case = """
[mesh]
box = [1, 1]
cells = 4
[material.default]
young = 100
poisson = 0
[[fix]]
on = "top"
value = [0, -0.05]
[[contact]]
slave = "bottom"
obstacle = {{ plane = {{ normal = [0, 1] }} }}
friction = {{ coulomb = 0.2, stiffness = {law} }}
"""
    path = tmp_path / "case.toml"
    for law, curve in (
        ("{ pressure = [0, 1, 3, 10], overclosure = [0, 0.1, 0.15, 0.2] }", HARDENS),
        ("{ p0 = 2, c0 = 0.1 }", GROWS),
    ):
        path.write_text(case.format(law=law))
        found = am.solve(am.read_case(path).model, tolerance=1e-10)
        p = found.fields.pressure
        np.testing.assert_allclose(p / 100 + curve.needed(p)[0], 0.05, rtol=1e-7)
    for law, words in (
        ("{ pressure = [0, 1], overclosure = [0, -0.1] }", "overclosure: expected growing"),
        ("{ pressure = [1, 2], overclosure = [0, 0.1] }", "expected 0, where it begins"),
        ("{ p0 = 2 }", "c0"), ("{ p0 = 2, c0 = 0 }", "c0: expected a number > 0"),
    ):  # fmt: skip
        path.write_text(case.format(law=law))
        done = CliRunner().invoke(main, ["solve", str(path)])
        assert done.exit_code == 2
        assert words in done.output
        assert "contact[0].friction.stiffness" in done.output


def test_bad_laws():
    with pytest.raises(am.InvalidInput, match="expected OverclosureCurve"):
        am.VaryingCompliance(lambda d: d, 1.0, am.Coulomb(np.ones(1)))
    with pytest.raises(am.InvalidInput, match="two or more"):
        am.OverclosureCurve([0.0], [0.0])
    with pytest.raises(am.InvalidInput, match="cohesion"):
        block(HARDENS, mu=0.1, cohesion=1.0)
    with pytest.raises(UnsupportedLaw, match="compliance of contact"):
        am.solve(block(HARDENS, mu=0.1, method="nitsche"))
