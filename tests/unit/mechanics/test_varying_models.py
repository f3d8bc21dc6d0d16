"""Friction that follows pressure or slip speed in models, steps and case files."""

import numpy as np
import pytest
from block_case import block_case, command
from scipy.integrate import solve_ivp

import amontons as am
from amontons.core.errors import UnsupportedLaw

YOUNG = 100.0
OVER_PRESSURE = am.FrictionCurve([0.5, 0.1], pressure=[0.0, 2.0])
OVER_SPEED = am.FrictionCurve([0.1, 0.5], speed=[0.0, 0.1])  # falling, it would stick-slip


def block(curve, top=(0.05, -0.01), **contact):
    body = am.Body(am.box((1, 1), 4), am.LinearElastic(young=YOUNG, poisson=0.0))
    value = top if callable(top) else list(top)
    floor = am.Contact("bottom", am.Plane((0, 1)), mu=curve, **contact)
    return am.Model([body], [am.Fix("top", value)], [floor])


def curve_of(curve, fields, speed=0.0):
    return curve(fields.pressure, speed * np.ones(len(fields.pressure)))


@pytest.mark.parametrize("method", ["nodal", "mortar"])
def test_the_pressure_is_force_over_area(method):
    found = am.solve(block(OVER_PRESSURE, method=method)).fields
    expected = curve_of(OVER_PRESSURE, found) * found.pressure
    np.testing.assert_allclose(-found.shear[:, 0], expected, rtol=1e-6)


def test_pairs_and_values():
    law = am.VaryingFriction(OVER_PRESSURE)
    upper = am.Body(am.box((1, 1), 4), am.LinearElastic(young=YOUNG, poisson=0.0), "upper")
    lower = am.Body(am.box((1, 1), 3, origin=(0, -1)), upper.material, "lower")
    model = am.Model(
        [upper, lower], [am.Fix("upper.top", [0.1, -0.02]), am.Fix("lower.bottom", 0)],
        [am.Contact("upper.bottom", master="lower.top", law=law)],
    )  # fmt: skip
    found = am.solve(model).fields
    expected = curve_of(OVER_PRESSURE, found) * found.pressure
    np.testing.assert_allclose(-found.shear[:, 0], expected, rtol=1e-6)


@pytest.mark.parametrize("springs", [{}, {"stiffness": 200.0, "stick_stiffness": 100.0}])
def test_the_speed_is_slip_over_the_step(springs):
    """All slide at the drag's speed in the end, whatever the step."""
    for step in (0.25, 0.5):
        model = block(OVER_SPEED, lambda x, t: (0.08 * t, -0.01), **springs)
        last = list(am.evolve(model, am.QuasiStatic(step), until=4.0))[-1]
        shear = -last.fields.shear[:, 0] / last.fields.pressure
        np.testing.assert_allclose(shear, 0.1 + 4 * 0.08, rtol=1e-4)
        np.testing.assert_allclose(last.problem.law.parameters[:, 0], 0.42, rtol=1e-4)


def test_a_body_slows_down_by_its_stribeck_curve():
    """v' = -mu(v) g of a rigid block, from 1 to rest."""
    curve = am.FrictionCurve([0.4, 0.1, 0.3], speed=[0.0, 0.3, 1.0])
    body = am.Body(am.box((4, 0.1), (4, 1)), am.Rigid(density=1.0))
    contact = am.Contact("bottom", am.Plane((0, 1)), mu=curve)
    model = am.Model([body], [], [contact], [am.BodyForce((0.0, -1.0))])
    start = am.at_rest(model, velocity=(1.0, 0.0))
    steps = list(am.evolve(model, am.MoreauJean(0.01, theta=1.0), start=start, until=3.0))
    exact = solve_ivp(
        lambda t, v: -np.interp(v, [0.0, 0.3, 1.0], [0.4, 0.1, 0.3]), (0, 3), [1.0],
        rtol=1e-9, dense_output=True, max_step=0.01,
    )  # fmt: skip
    for step in steps[::25]:
        v = step.v[0][:, 0].mean()
        assert v == pytest.approx(exact.sol(step.time)[0], abs=5e-3)


def test_what_has_no_reactions_refuses():
    with pytest.raises(UnsupportedLaw, match="follows pressure or slip speed needs"):
        block(OVER_SPEED, method="nitsche")
    with pytest.raises(am.InvalidInput, match="nor with a curve"):
        block(OVER_SPEED, mu_across=0.3, direction=(1, 0, 0))


CASE = block_case(
    '["0.08*t", "-0.01"]', "{ coulomb = { mu = [0.1, 0.5], speed = [0.0, 0.1] }, cap = 9.0 }",
    until=3.0,
)  # fmt: skip


def test_case_files_and_the_command_line(tmp_path):
    case = tmp_path / "case.toml"
    case.write_text(CASE)

    ran = command("run", case, "--output", tmp_path / "run")
    assert ran.exit_code == 0, ran.output
    state = am.load_state(next((tmp_path / "run").glob("*.h5")))
    np.testing.assert_allclose(state.force[:, 1] / state.force[:, 0], -0.42, rtol=1e-2)
    for wrong, told in (
        ("speed = [0.1, 0.0]", "ascending"), ("speed = [0.1]", "one number for"),
        ("sped = [0.0, 0.1]", "sped"), ("speed = 'fast'", "speed"),
    ):  # fmt: skip
        case.write_text(CASE.replace("speed = [0.0, 0.1]", wrong))
        refused = command("solve", case)
        assert refused.exit_code != 0
        assert told in refused.output and "Traceback" not in refused.output
    case.write_text(CASE.replace("*t", "").partition("[evolution]")[0])
    assert command("info", case).exit_code == 0
    solved = command("solve", case, "--output", tmp_path / "out")
    assert solved.exit_code == 0, solved.output
