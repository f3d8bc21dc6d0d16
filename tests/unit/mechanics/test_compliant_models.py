"""Contact that gives way at the contacts of models: hand-calculated springs and sliders."""

import json

import numpy as np
import pytest
from block_case import block_case, command

import amontons as am
from amontons.core.errors import UnsupportedLaw
from amontons.solvers import METHODS

YOUNG, MU, STIFF, STICKY = 100.0, 0.3, 50.0, 20.0
SPRINGS = {"mu": MU, "stiffness": STIFF, "stick_stiffness": STICKY}
FLOOR = am.Plane((0, 1))


def block(top, cells=3, young=YOUNG, dim=2, **law):
    body = am.Body(am.box((1,) * dim, cells), am.LinearElastic(young=young, poisson=0.0))
    floor = am.Plane((0,) * (dim - 1) + (1,))
    law = law or SPRINGS
    return am.Model([body], [am.Fix("top", top)], [am.Contact("bottom", floor, **law)])


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("method", ["nodal", "mortar"])
def test_pressure_over_overclosure(dim, method):
    """Pressed by 0.03, body and contact in series: p / E + p / k = 0.03, p = 1."""
    found = am.solve(block([0] * (dim - 1) + [-0.03], dim=dim, **SPRINGS, method=method))
    np.testing.assert_allclose(found.fields.pressure, 1.0, rtol=1e-7)
    np.testing.assert_allclose(found.fields.gap, -1 / STIFF, rtol=1e-7)


@pytest.mark.parametrize("law", [
    am.Compliant(am.Coulomb([MU]), 1 / STIFF, 1 / STICKY),
    am.Compliant(am.CappedCoulomb([MU], [9.0]), 1 / STIFF, 1 / STICKY),
    am.Compliant(am.Cohesive(am.Coulomb([MU]), [0.0]), 1 / STIFF, 1 / STICKY),
])  # fmt: skip
def test_as_a_value(law):
    expected = am.solve(block([0.02, -0.03], cells=2), tolerance=1e-11).solution
    found = am.solve(block([0.02, -0.03], cells=2, law=law), tolerance=1e-11).solution
    np.testing.assert_allclose(found.r, expected.r, atol=1e-9)


def test_a_stiffness_may_be_a_function_of_position():
    """Pressed by a rigid block, pressure follows the stiffness of each node."""
    for method in ("nodal", "mortar"):
        law = {"mu": 0.0, "stiffness": lambda x: 50 + 50 * x[:, 0], "method": method}
        found = am.solve(block([0, -0.01], young=1e9, cells=4, **law)).fields
        if method == "nodal":
            expected = 0.01 * (50 + 50 * found.points[:, 0])
            np.testing.assert_allclose(found.pressure, expected, rtol=1e-5)
        assert found.force[:, 1].sum() == pytest.approx(0.75, rel=1e-5)


@pytest.mark.parametrize("cells", [3, 5])
def test_patch_between_meshes_that_do_not_match(cells):
    """Uniform pressure through a layer: p / E + p / k + p / E = 0.04, p = 1."""
    upper = am.Body(am.box((1, 1), 4), am.LinearElastic(young=YOUNG, poisson=0.0), "upper")
    lower = am.Body(am.box((1, 1), cells, origin=(0, -1)), upper.material, "lower")
    model = am.Model(
        [upper, lower], [am.Fix("upper.top", [0, -0.04]), am.Fix("lower.bottom", 0)],
        [am.Contact("upper.bottom", master="lower.top", mu=0.3, stiffness=STIFF)],
    )  # fmt: skip
    found = am.solve(model, tolerance=1e-11)
    np.testing.assert_allclose(found.fields.pressure, 1.0, rtol=1e-8)
    np.testing.assert_allclose(found.fields.gap, -1 / STIFF, rtol=1e-8)


def path(t):
    """0 -> 0.05 -> -0.05 -> 0.05 in six units of time."""
    return np.interp(t, [0, 1, 3, 5], [0, 0.05, -0.05, 0.05])


def stick_spring(times):
    """Shear of the return map: elastic trial, then back to the bound."""
    bound, shear, out = MU * STIFF * 0.02, 0.0, []
    for last, t in zip([0, *times], times, strict=False):
        shear = np.clip(shear - STICKY * (path(t) - path(last)), -bound, bound)
        out.append(shear)
    return np.array(out)


def loop(method, step, until=5.0, **model):
    stiff = block(lambda x, t: (path(t), -0.02), young=1e7, cells=1, **model)
    return list(am.evolve(stiff, method(step), until=until, tolerance=1e-10))


def test_a_spring_and_a_slider_loop():
    """Loading, slip, unloading, reversal, slip back: the hysteresis of the hand calculation."""
    steps = loop(am.QuasiStatic, 0.1)
    times = np.array([step.time for step in steps])
    shear = np.array([step.state.force[:, 1].sum() for step in steps])
    np.testing.assert_allclose(shear, stick_spring(times), atol=2e-5)
    assert abs(shear).max() == pytest.approx(MU, rel=1e-4)
    status = [set(step.status) for step in steps]
    stick, slip = {am.ContactStatus.STICK}, {am.ContactStatus.SLIP}
    assert status[1] == stick and status[9] == slip  # the bound is met at 0.015
    assert status[11] == stick and status[18] == slip  # reversal: the spring unloads first
    # displacement is that of the surfaces, spring and all
    np.testing.assert_allclose(steps[3].fields.slip[:, 0], path(0.4), rtol=1e-4)
    # the loop from t = 1 to 5 dissipates 4 tau (a - tau / k)
    lost = -sum(step.energies.contact for step in steps[10:])
    assert lost == pytest.approx(4 * MU * (0.05 - MU / STICKY), rel=2e-2)
    for step in steps:
        e = step.energies
        assert e.contact <= 1e-9
        assert abs(e.defect) <= 1e-7 * e.turnover


def test_a_spring_stores_what_the_loads_put_in():
    steps = loop(am.QuasiStatic, 0.1, until=0.3)  # all elastic
    e = steps[-1].energies
    stored = 0.5 * STICKY * path(0.3) ** 2 + 0.5 * STIFF * 0.02**2
    assert e.elastic == pytest.approx(stored, rel=1e-4)
    assert sum(s.energies.supports for s in steps) == pytest.approx(stored, rel=1e-4)
    assert abs(sum(s.energies.contact for s in steps)) <= 1e-6 * stored


def test_a_contact_that_opens_forgets_its_spring():
    """Sheared, lifted, put down elsewhere: no shear is left, and it counts from there."""
    def top(x, t):
        return (np.interp(t, [0, 1, 2, 3], [0, 0.01, 0.01, 0.012]),
                np.interp(t, [0, 1, 1.5, 2], [-0.02, -0.02, 0.01, -0.02]))  # fmt: skip

    steps = list(am.evolve(block(top, young=1e7, cells=1), am.QuasiStatic(0.25), until=3.0))
    shear = {step.time: step.state.force[:, 1].sum() for step in steps}
    assert shear[1.0] == pytest.approx(-STICKY * 0.01, rel=1e-4)
    assert shear[1.5] == 0.0
    assert abs(shear[2.0]) <= 1e-6
    assert shear[3.0] == pytest.approx(-STICKY * 0.002, rel=1e-3)


def test_a_body_without_supports_stands_on_its_springs():
    body = am.Body(am.box((1, 1), 3), am.LinearElastic(young=1e6, poisson=0.0))
    model = am.Model([body], [], [am.Contact("bottom", FLOOR, **SPRINGS)],
                     [am.BodyForce((0.05, -1.0))])  # fmt: skip
    found = am.solve(model)
    weights, fields = found.fields.weights, found.fields
    assert weights @ fields.gap == pytest.approx(-1 / STIFF, rel=1e-4)
    assert weights @ fields.slip[:, 0] == pytest.approx(0.05 / STICKY, rel=1e-4)
    loose = am.Model([body], [], model.contacts, [am.BodyForce((0.4, -1.0))])
    with pytest.raises(am.NotConverged, match="there is no solution"):
        am.solve(loose)


@pytest.mark.parametrize("method", sorted({*METHODS} - {"frictionless-interior-point"}))
def test_all_solvers(method):
    model = block([0.03, -0.03], cells=2)
    expected = am.solve(model, tolerance=1e-11).solution
    assert expected.counts["stick"] and expected.counts["slip"]
    found = am.solve(model, METHODS[method](), check=False, time_limit=30).solution
    assert found.converged, str(found)
    np.testing.assert_allclose(found.r, expected.r, atol=1e-6)
    assert found.v.shape == (found.problem.unknowns,)
    assert model.assemble().error(found.r, found.v) <= 1e-8
    again = am.drive(model.assemble(), METHODS[method](), start=found, tolerance=1e-7,
                     condense=True)  # fmt: skip
    assert again.convergence.iterations == 0


# ---------------------------------------------------------------- dynamics
def mass(springs, theta=0.5, velocity=(0.0, -1.0), height=0.0, **more):
    """A unit block, density 1, stiff beside its contact springs."""
    body = am.Body(am.box((1, 1), 1, origin=(0, height)),
                   am.LinearElastic(young=1e7, poisson=0.0, density=1.0))  # fmt: skip
    model = am.Model([body], [], [am.Contact("bottom", FLOOR, **springs)], **more)
    return model, am.at_rest(model, velocity=velocity)


@pytest.mark.parametrize("theta", [0.5, 1.0])
def test_a_bounce_on_springs(theta):
    """Half a period pi sqrt(m / k) in contact, and away again with nearly the same speed."""
    model, start = mass({"mu": 0.0, "stiffness": STIFF})
    steps = list(am.evolve(model, am.MoreauJean(1e-3, theta=theta), start=start, until=0.6))
    closed = [step.time for step in steps if step.state.force[:, 0].any()]
    assert closed[-1] == pytest.approx(np.pi / np.sqrt(STIFF), rel=2e-2)
    depth = max(-step.gap.min() for step in steps)
    assert depth == pytest.approx(1 / np.sqrt(STIFF), rel=2e-2)
    rebound = steps[-1].state.velocity.reshape(-1, 2)[:, 1].mean()
    assert 0.95 <= rebound <= 1.0
    for step in steps:
        assert step.energies.contact <= 1e-9
        assert abs(step.energies.defect) <= 1e-6 * max(step.energies.total, 1e-3)
    total = [0.5, *(step.energies.total for step in steps)]
    assert (np.diff(total) <= 1e-9).all()


def test_a_mass_swings_on_its_stick_springs():
    """Pressed by its weight, it swings along the floor with sqrt(k_T / m)."""
    model, start = mass({"mu": 50.0, "stiffness": 1e4, "stick_stiffness": STICKY},
                        velocity=(0.1, 0.0), loads=[am.BodyForce((0.0, -100.0))])  # fmt: skip
    steps = list(am.evolve(model, am.MoreauJean(2e-3), start=start, until=1.3))
    way = np.array([step.displacement[0][:, 0].mean() for step in steps])
    period = 2 * np.pi / np.sqrt(STICKY)
    low = steps[int(np.argmin(way[: int(period / 2e-3)]))].time
    assert way.max() == pytest.approx(0.1 / np.sqrt(STICKY), rel=0.05)
    assert low == pytest.approx(0.75 * period, rel=0.05)


# ---------------------------------------------------------------- in words
def test_what_has_no_reactions_refuses():
    with pytest.raises(UnsupportedLaw, match="compliance of contact needs") as told:
        block([0, 0], **SPRINGS, method="nitsche")
    assert told.value.at == ("contacts", 0, "stiffness")
    with pytest.raises(am.InvalidInput, match="expected a stiffness > 0, got 0 at"):
        _ = block([0, 0], mu=0.3, stiffness=0.0).law
    with pytest.raises(am.InvalidInput, match="compliance > 0 at all nodes"):
        am.Contact("bottom", FLOOR, law=am.Compliant(am.Coulomb([0.3, 0.3]), [0.0, 1.0]))
    model = block([0.01, -0.01])
    with pytest.raises(UnsupportedLaw, match="compliance"):
        am.follow(model.assemble())
    assert "compliance" in am.uniqueness(model.assemble()).reason


CASE = block_case(
    '["0.02*t", "-0.02"]',
    '{ coulomb = 0.3, stiffness = 50.0, stick_stiffness = "20 + 0*x" }', young=1e7, step=0.25,
)  # fmt: skip


def test_case_files_and_the_command_line(tmp_path):
    case = tmp_path / "case.toml"
    case.write_text(CASE)

    ran = command("run", case, "--output", tmp_path / "run")
    assert ran.exit_code == 0, ran.output
    state = am.load_state(next((tmp_path / "run").glob("*.h5")))
    np.testing.assert_allclose(state.force.sum(axis=0), [1, -0.3], atol=1e-4)  # it slips
    case.write_text(CASE.replace("*t", "").partition("[evolution]")[0])
    assert command("info", case, "--json", tmp_path / "facts.json").exit_code == 0
    facts = json.loads((tmp_path / "facts.json").read_text())
    assert facts["contact compliance"][1] == pytest.approx(1 / (50 * 0.25))
    refused = command("convert", case, tmp_path / "a.hdf5")
    assert refused.exit_code != 0
    assert "stores a coefficient of Coulomb friction" in refused.output
    for wrong, words in (("stiffness = 0", "expected a number > 0"),
                         ("stiffnes = 1", "stiffness")):  # fmt: skip
        case.write_text(CASE.replace("stiffness = 50.0", wrong))
        told = command("solve", case)
        assert told.exit_code != 0
        assert words in told.output


def test_a_rigid_body_stands_on_its_springs():
    """Without springs its reactions would not be known: three contacts, three motions."""
    body = am.Body(am.box((1, 1), 2), am.Rigid(density=1.0))
    model = am.Model([body], [], [am.Contact("bottom", FLOOR, **SPRINGS)],
                     [am.BodyForce((0.05, -1.0))])  # fmt: skip
    fields = am.solve(model).fields
    assert fields.weights @ fields.gap == pytest.approx(-1 / STIFF)
    assert fields.weights @ fields.slip[:, 0] == pytest.approx(0.05 / STICKY)


@pytest.mark.parametrize("method", [am.QuasiStatic(0.1), am.MoreauJean(0.01)])
def test_springs_go_on_from_a_saved_state(method):
    body = am.Body(am.box((1, 1), 2), am.LinearElastic(young=YOUNG, poisson=0.0, density=1.0))
    drag = am.Fix("top", lambda x, t: (0.03 * np.sin(3 * t), -0.02))
    model = am.Model([body], [drag], [am.Contact("bottom", FLOOR, **SPRINGS)])
    end = 20 * method.step
    whole = list(am.evolve(model, method, until=end))
    rest = list(am.evolve(model, method, start=whole[9].state, until=end))
    assert whole[-1].state.force[:, 1].any()
    np.testing.assert_array_equal(rest[-1].state.force, whole[-1].state.force)
