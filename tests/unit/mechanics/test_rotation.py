"""Bodies that turn: how far, and the warning where small strains are no longer true."""

from dataclasses import replace

import numpy as np
import pytest
from click.testing import CliRunner

import amontons as am
from amontons.app.cli import main
from amontons.mechanics.model.rotation import LIMIT, angles, large_rotation
from amontons.mechanics.steps import MoreauJean, QuasiStatic, at_rest, evolve

STEEL = am.LinearElastic(1e8, 0.2, density=1000.0)
WIDTH, HEIGHT = 0.2, 1.0


def turning(dim, degrees, axis=(0.0, 0.0, 1.0)):
    """Gradient of a true rotation."""
    a = np.radians(degrees)
    if dim == 2:
        return np.array([[np.cos(a), -np.sin(a)], [np.sin(a), np.cos(a)]]) - np.eye(2)
    n = np.array(axis) / np.linalg.norm(axis)
    N = np.cross(np.eye(3), -n)
    return np.sin(a) * N + (1 - np.cos(a)) * N @ N


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("degrees", [0.0, 1e-3, 5.0, 60.0, 120.0, 179.0])
def test_the_angle_is_that_of_the_rotation_whatever_the_strain(dim, degrees):
    rng = np.random.default_rng(dim)
    stretch = np.eye(dim) + 0.2 * np.diag(rng.uniform(-1, 1, dim))
    stretch[0, 1] = stretch[1, 0] = 0.1
    R = np.eye(dim) + turning(dim, degrees, rng.normal(size=3))
    both = np.stack([R - np.eye(dim), R @ stretch - np.eye(dim), stretch - np.eye(dim)])
    np.testing.assert_allclose(angles(both), [degrees, degrees, 0], atol=1e-6)


def toppling(speed):
    """A tall block that turns about its right foot."""
    body = am.Body(am.box((WIDTH, HEIGHT), (2, 10)), STEEL, name="column")
    model = am.Model([body], [], [am.Contact("bottom", am.Plane((0, 1)), mu=1.0)],
                     [am.BodyForce((0, -9810.0))])  # fmt: skip
    start = at_rest(model, velocity=lambda x: (speed * x[1], -speed * (x[0] - WIDTH)))
    return model, start


def names(step):
    return [warning.name for warning in step.warnings]


def test_a_toppling_block_is_told_from_three_degrees_on():
    model, start = toppling(3.0)
    left = model.bodies[0].mesh.points[:, 0] == 0
    for step in evolve(model, MoreauJean(2e-3, theta=1.0), until=0.1, start=start):
        lifted = step.displacement[0][left, 1].mean()
        tilt = np.degrees(np.arctan(lifted / WIDTH))
        if tilt > 1.1 * LIMIT:
            assert "large-rotation" in names(step)
        if tilt < 0.9 * LIMIT:
            assert "large-rotation" not in names(step)
    (warning,) = [w for w in step.warnings if w.name == "large-rotation"]
    assert "body 'column' turns by" in warning.message
    assert float(warning.message.split("turns by ")[1].split()[0]) == pytest.approx(
        tilt, rel=0.05
    )
    assert "hyperelastic" in warning.message


def test_a_standing_block_is_not():
    model, start = toppling(0.01)
    for step in evolve(model, MoreauJean(2e-3, theta=1.0), until=0.02, start=start):
        assert names(step) == []


def cantilever(material, dim=2, force=1.0):
    """A plate that hangs on one side and sags onto nothing."""
    size, cells = ((4, 0.5), (16, 2)) if dim == 2 else ((4, 0.5, 0.5), (8, 1, 1))
    down = (0,) * (dim - 1)
    body = am.Body(am.box(size, cells), material, name="arm")
    floor = am.Plane((*down, 1), point=(*down, -9.0))
    return am.Model([body], [am.Fix("left", 0)], [am.Contact("bottom", floor, mu=0.1)],
                    [am.Traction("right", (*down, -force))])  # fmt: skip


@pytest.mark.parametrize("dim", [2, 3])
def test_statics_say_it_too_and_finite_strains_do_not(dim):
    linear = am.LinearElastic(1e3, 0.3)
    little, much = (am.solve(cantilever(linear, dim, f)) for f in (0.01, 0.8))
    assert "large-rotation" not in [w.name for w in little.warnings]
    assert "body 'arm' turns by" in "".join(w.message for w in much.warnings)
    assert "[large-rotation]" in str(much)
    bent = am.solve(cantilever(am.NeoHookean(1e3, 0.3), dim, 0.8))
    assert "large-rotation" not in [w.name for w in bent.warnings]


def test_compression_alone_does_not_turn():
    body = am.Body(am.box((1, 1), 3), am.LinearElastic(100, 0.3))
    model = am.Model([body], [am.Fix("top", (0, -0.3))],
                     [am.Contact("bottom", am.Plane((0, 1)), mu=0.3)])  # fmt: skip
    assert large_rotation(model, am.solve(model).fields) == []
    with np.errstate(all="raise"):
        broken = replace(am.solve(model).fields, displacement=(np.full((16, 2), np.nan),))
        assert large_rotation(model, broken) == []


def test_the_body_that_turns_is_named_and_the_others_counted():
    bodies = [
        am.Body(am.box((1, 1), 2, origin=(2 * k, 0)), STEEL, name=f"b{k}") for k in (0, 1, 2)
    ]

    def turn(rate):
        return lambda x: (-rate * x[1], rate * (x[0] % 2))

    ways = [turn(r) for r in (0.5, 0.0, 1.0)]
    model = am.Model(bodies, [], [am.Contact(f"b{k}.bottom", am.Plane((0, 1), (0, -5)), mu=0.1)
                                  for k in (0, 1, 2)])  # fmt: skip
    start = at_rest(model, velocity=ways)
    (step,) = evolve(model, MoreauJean(0.5), until=0.5, start=start)
    (warning,) = step.warnings
    angle = np.degrees(np.arctan(0.5))
    assert f"body 'b2' turns by {angle:.1f} degrees, and 1 more by over 3" in warning.message


CASE = """
[mesh]
box = [4, 0.5]
cells = [8, 1]
[material.default]
young = 1e3
poisson = 0.3
[[fix]]
on = "left"
value = [0, 0]
[[traction]]
on = "right"
value = [0, "-0.4*t"]
[[contact]]
slave = "bottom"
obstacle = { plane = { normal = [0, 1], point = [0, -9] } }
friction = { coulomb = 0.1 }
[evolution]
kind = "quasi-static"
step = 0.25
until = 2
"""


def test_a_run_tells_each_kind_once_and_again_at_the_end(tmp_path):
    case = tmp_path / "arm.toml"
    case.write_text(CASE)
    arguments = ["run", str(case), "-o", str(tmp_path / "out")]
    result = CliRunner().invoke(main, arguments)
    assert result.exit_code == 0, result.output
    told = [line for line in result.output.splitlines() if "[large-rotation]" in line]
    assert len(told) == 2
    assert told[0].startswith("t = ")
    first = told[0].split(":")[0]
    assert told[1].endswith(f"since {first})")
    assert told[1].startswith("warning: body 'body' turns by")
    small = CliRunner().invoke(main, [*arguments, "--set", "material.default.young=1e6"])
    assert "large-rotation" not in small.output
    quiet = CliRunner().invoke(main, [*arguments, "--quiet"])
    assert quiet.output == ""
    steps = list(evolve(am.read_case(str(case)).model, QuasiStatic(0.25), until=2))
    assert "large-rotation" in names(steps[-1])
