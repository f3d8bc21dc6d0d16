"""Orthotropic friction at the contacts of models: a block dragged at an angle, and in words."""

import json

import numpy as np
import pytest
from click.testing import CliRunner
from scipy.optimize import brentq

import amontons as am
from amontons.app.cli import main
from amontons.core.errors import UnsupportedLaw
from amontons.solvers import METHODS

YOUNG, MU1, MU2 = 100.0, 0.2, 0.5


def block(slide=(0.06, 0.03), cells=3, law=None, normal=(0, 0, 1), **friction):
    """A unit block pressed by 1 onto a floor and dragged along `slide`: all contacts slip."""
    friction = friction or {"mu": MU1, "mu_across": MU2, "direction": (1, 0, 0)}
    friction = {"law": law} if law is not None else friction
    body = am.Body(am.box((1, 1, 1), cells), am.LinearElastic(young=YOUNG, poisson=0.0))
    return am.Model([body], [am.Fix("top", (*slide, -1 / YOUNG))],
                    [am.Contact("bottom", am.Plane(normal), **friction)])  # fmt: skip


def resultant(model, *options):
    """(r_N, r_T along x, along y), summed; the frames of a floor are z, x, y."""
    return am.solve(model, *options).solution.r.sum(axis=0)


@pytest.mark.parametrize(
    ("slide", "expected"),
    [((0.1, 0.0), (-MU1, 0)), ((-0.1, 0.0), (MU1, 0)), ((0.0, 0.1), (0, -MU2))],
)
def test_along_the_principal_directions(slide, expected):
    np.testing.assert_allclose(resultant(block(slide)), [1, *expected], atol=3e-3)


def test_dragged_far_at_an_angle_slip_is_normal_to_the_ellipse():
    far, angle = 1e3, 0.7
    slip = np.array([np.cos(angle), np.sin(angle)])
    tau = -np.array([MU1**2, MU2**2]) * slip / np.hypot(*(slip * [MU1, MU2]))
    found = resultant(block(tuple(far * slip), cells=2))
    np.testing.assert_allclose(found, [1, *tau], atol=1e-3)


def test_a_direction_is_one_of_global_axes():
    """The same as mu1 and mu2 swapped, as an angle, and turned with the whole block."""
    r = am.solve(block(), tolerance=1e-11).solution.r
    for other in (
        {"mu": MU2, "mu_across": MU1, "direction": [0, -2, 5]},  # its part along the floor
        {"law": am.Orthotropic([MU1], [MU2], [0.0])},
        {"law": am.Orthotropic([MU2], [MU1], [np.pi / 2])},
        {"mu": MU2, "mu_across": MU1, "angle": np.pi / 2},
    ):
        found = am.solve(block(**other), tolerance=1e-11).solution.r
        np.testing.assert_allclose(found, r, atol=1e-8)


@pytest.mark.parametrize("method", METHODS)
def test_all_methods_on_a_mesh(method):
    """What a method makes of Coulomb's law on this mesh it makes of this one too."""
    options = {"time_limit": 30, "max_iterations": 2_000}
    solver = METHODS[method]()
    expected = resultant(block(cells=2))
    plain = am.drive(block(cells=2, mu=0.3).assemble(), solver, condense=True, **options)
    found = am.drive(block(cells=2).assemble(), solver, condense=True, **options)
    if method == "contact-multigrid":
        assert "orthotropic" in found.convergence.detail
    elif plain.converged:
        assert found.converged, str(found)
    if found.converged:
        np.testing.assert_allclose(found.r.sum(axis=0), expected, atol=1e-5)


def test_mortar_pairs_and_cohesion():
    lower = am.Body(am.box((1, 1, 1), 2, origin=(0, 0, -1)),
                    am.LinearElastic(young=YOUNG, poisson=0.0), "lower")  # fmt: skip
    upper = am.Body(am.box((1, 1, 1), 3), lower.material, "upper")
    model = am.Model(
        [upper, lower], [am.Fix("upper.top", (0.0, 0.1, 0.01)), am.Fix("lower.bottom", 0)],
        [am.Contact("upper.bottom", master="lower.top", mu=MU1, mu_across=MU2,
                    direction=(1, 0, 0), cohesion=2.0)],
    )  # fmt: skip
    found = am.solve(model)
    r = found.solution.r.sum(axis=0)
    assert r[0] < 0  # it pulls
    size = (model.law.cohesion.sum() + r[0]) * MU2
    assert np.abs(r[2]) == pytest.approx(size, rel=1e-6)
    assert found.solution.problem.error(found.solution.r, found.solution.v) < 1e-8


def steady_angle(*pull):
    """Direction in which a rigid body of weight 1 slides: its acceleration is along it."""
    def across(angle):
        e = np.array([np.cos(angle), np.sin(angle)])
        a = np.array(pull) - e * [MU1**2, MU2**2] / np.hypot(*(e * [MU1, MU2]))
        return a[0] * e[1] - a[1] * e[0]

    return brentq(across, 0.0, 0.7)


def test_quasi_static_and_dynamic_steps():
    still = block((0.0, 0.0), cells=2)
    drag = am.Fix("top", lambda x, t: (0.05 * t, 0.1 * t, -0.01))
    moving = am.Model(still.bodies, [drag], still.contacts)
    last = list(am.evolve(moving, am.QuasiStatic(0.5), until=1.0))[-1]
    assert last.energies.contact <= 1e-9
    inside = last.solution.r[:, 1:] / [MU1, MU2]
    assert (np.linalg.norm(inside, axis=1) <= last.solution.r[:, 0] + 1e-9).all()
    body = am.Body(still.bodies[0].mesh,
                   am.LinearElastic(young=1e4, poisson=0.0, density=1.0))  # fmt: skip
    model = am.Model([body], [], still.contacts, [am.BodyForce((0.3, 0.3, -1.0))])
    state = list(am.evolve(model, am.MoreauJean(0.02), until=0.4))[-1]
    x, y, _ = state.state.velocity.reshape(-1, 3).mean(axis=0)
    assert np.arctan2(y, x) == pytest.approx(steady_angle(0.3, 0.3), rel=0.02)
    assert state.energies.contact <= 1e-9


def test_a_loose_body_on_a_slope_is_held_or_not():
    body = am.Body(am.box((1, 1, 1), 2), am.LinearElastic(young=YOUNG, poisson=0.0))
    contact = am.Contact("bottom", am.Plane((0, 0, 1)), mu=MU1, mu_across=MU2,
                         direction=(1, 0, 0))  # fmt: skip
    pull = 0.35  # between both
    held = am.Model([body], [], [contact], [am.BodyForce((0, pull, -1.0))])
    np.testing.assert_allclose(resultant(held), [1, 0, -pull], atol=1e-6)
    loose = am.Model([body], [], [contact], [am.BodyForce((pull, 0, -1.0))])
    with pytest.raises(am.NotConverged, match="there is no solution"):
        am.solve(loose)


@pytest.mark.parametrize(("friction", "says"), [
    ({"mu": 0.2, "mu_across": 0.4}, "go together"),
    ({"mu": 0.2, "direction": (1, 0, 0)}, "go together"),
    ({"tresca": 0.2, "mu_across": 0.4, "direction": (1, 0, 0)}, "neither with tresca"),
    ({"mu": 0.2, "mu_across": 0.4, "direction": (1, 0, 0), "cap": 1}, "nor with cap"),
    ({"mu": 0.2, "mu_across": 0.4, "direction": (1, 0)}, "three numbers"),
    ({"mu": 0.2, "mu_across": 0.4, "direction": (0, 0, 1)}, "direction along the surface"),
    ({"mu": 0.2, "mu_across": -0.4, "direction": (1, 0, 0)}, "mu_across"),
    ({"mu": 0.0, "mu_across": 0.4, "direction": (1, 0, 0)}, "both positive"),
])  # fmt: skip
def test_bad_contacts_are_refused(friction, says):
    with pytest.raises(am.InvalidInput, match=says):
        _ = block(**friction).law


def test_what_does_not_take_it_says_so():
    contact = am.Contact("bottom", am.Plane((0, 1)), mu=0.2, mu_across=0.4, direction=(1, 0, 0))
    flat = am.Body(am.box((1, 1), 2), am.LinearElastic(young=YOUNG, poisson=0.0))
    with pytest.raises(am.InvalidInput, match="in 2D there is one direction"):
        am.Model([flat], [], [contact])
    given = {"mu": 0.2, "mu_across": 0.4, "direction": (1, 0, 0)}
    with pytest.raises(UnsupportedLaw, match="orthotropic friction needs"):
        block(**given, method="nitsche")
    with pytest.raises(UnsupportedLaw, match="orthotropic Coulomb friction"):
        am.write_fclib(block().assemble(), "never.hdf5")


CASE = """
[mesh]
box = [1, 1, 1]
cells = 2
[material.default]
young = 100.0
poisson = 0.0
[[fix]]
on = "top"
value = [0.0, 0.1, -0.01]
[[contact]]
slave = "bottom"
obstacle = { plane = { normal = [0, 0, 1] } }
friction = { coulomb = [0.2, 0.5], direction = [1, 0, 0] }
"""


def run(*arguments):
    return CliRunner().invoke(main, [str(a) for a in arguments])


def test_case_files_and_the_command_line(tmp_path):
    case = tmp_path / "case.toml"
    case.write_text(CASE)
    done = run("solve", case, "--output", tmp_path / "out")
    assert done.exit_code == 0, done.output
    assert run("info", case, "--json", tmp_path / "facts.json").exit_code == 0
    facts = json.loads((tmp_path / "facts.json").read_text())
    assert facts["friction coefficient"] == pytest.approx([0.2, 0.5])
    read = am.read_case(case).model if hasattr(am, "read_case") else None
    if read is not None:
        np.testing.assert_allclose(resultant(read), [1, 0, -0.5], atol=5e-3)


@pytest.mark.parametrize(("friction", "says"), [
    ("coulomb = [0.2, 0.5]", "coulomb: expected two coefficients with a direction"),
    ("coulomb = 0.2, direction = [1, 0, 0]", "expected two coefficients with a direction"),
    ("coulomb = [0.2], direction = [1, 0, 0]", "2 numbers"),
    ("coulomb = [0.2, -0.1], direction = [1, 0, 0]", ">= 0"),
    ("coulomb = [0.2, 0.5], direction = [0, 0, 1]", "direction along the surface"),
    ("coulomb = [0.2, 0.5], direction = [1, 0, 0], cap = 1.0", "nor with cap"),
])  # fmt: skip
def test_case_files_are_refused_in_words(tmp_path, friction, says):
    case = tmp_path / "case.toml"
    case.write_text(CASE.replace("coulomb = [0.2, 0.5], direction = [1, 0, 0]", friction))
    done = run("solve", case)
    assert done.exit_code != 0
    assert says in " ".join(done.output.split())
