"""A gap that is given takes the place of the one that the meshes have."""

import numpy as np
import pytest
from click.testing import CliRunner

import amontons as am
from amontons.app.cli import main

STEEL = am.LinearElastic(young=100.0, poisson=0.0)


def pair(lift=0.0, cells=3, **contact):
    upper = am.Body(am.box((1, 1), 4, origin=(0, lift)), STEEL, "upper")
    lower = am.Body(am.box((1, 1), cells, origin=(0, -1)), STEEL, "lower")
    return am.Model(
        [upper, lower], [am.Fix("upper.top", [0, -0.02]), am.Fix("lower.bottom", 0)],
        [am.Contact("upper.bottom", master="lower.top", mu=0.2, **contact)],
    )  # fmt: skip


@pytest.mark.parametrize("method", ["nodal", "mortar"])
@pytest.mark.parametrize("clearance", [0.01, 0.0, -0.02, lambda x: 0.01 + 0 * x[:, 0]])
def test_two_blocks(method, clearance):
    """(way - gap) / 2 of a strain in each, whatever the meshes say of the gap."""
    cells = 3 if method == "mortar" else 4
    model = pair(0.005, cells, clearance=clearance, method=method)
    gap = clearance if not callable(clearance) else 0.01
    found = am.solve(model, tolerance=1e-10).fields
    np.testing.assert_allclose(found.pressure, 100 * (0.02 - gap) / 2, rtol=1e-6)


@pytest.mark.parametrize("clearance", [0.01, 0.0, -0.02, lambda x: 0.01 + 0 * x[:, 0]])
def test_two_blocks_where_they_are_now(clearance):
    """The same with pairs that are found again: the difference goes along with the slave."""
    model = pair(0.005, clearance=clearance, kinematics="finite")
    gap = clearance if not callable(clearance) else 0.01
    found = am.solve(model, tolerance=1e-10).fields
    np.testing.assert_allclose(found.pressure, 100 * (0.02 - gap) / 2, rtol=1e-6)


def test_a_clearance_over_an_obstacle():
    """Rubber pushed down by 0.3 over a gap of 0.1, said to be 0.2: as pushed by 0.2 over it."""
    forces = []
    for push, clearance in ((0.3, 0.2), (0.2, None)):
        body = am.Body(am.box((1, 1), 4), am.NeoHookean(100.0, 0.3))
        contact = am.Contact("bottom", am.Plane((0, 1), (0, -0.1)), mu=0.3, clearance=clearance)
        model = am.Model([body], [am.Fix("top", (0.02, -push))], [contact])
        forces.append(am.solve(model, tolerance=1e-11).resultant)
    np.testing.assert_allclose(forces[0], forces[1], rtol=1e-8)


def test_a_gap_along_the_surface():
    found = am.solve(pair(clearance=lambda x: np.where(x[:, 0] > 0.5, 0.1, 0.0))).fields
    at = found.points[:, 0]
    assert (found.pressure[at > 0.7] == 0).all()
    assert (found.pressure[at < 0.3] > 0).all()


def test_refused():
    with pytest.raises(am.InvalidInput, match="clearance on 'upper.bottom'"):
        pair(clearance="wide")
    with pytest.raises(am.InvalidInput, match="finite numbers"):
        am.solve(pair(clearance=lambda x: np.full(len(x), np.nan)))


def test_case_files(tmp_path):
    path = tmp_path / "case.toml"
    path.write_text('''
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
obstacle = { plane = { normal = [0, 1] } }
friction = { coulomb = 0.2 }
clearance = 0.01
''')
    found = am.solve(am.read_case(path).model, tolerance=1e-10)
    np.testing.assert_allclose(found.fields.pressure, 4.0, rtol=1e-8)
    path.write_text(path.read_text().replace("= 0.01", '= "t"'))
    done = CliRunner().invoke(main, ["solve", str(path)])
    assert done.exit_code == 2
    assert "contact[0].clearance" in done.output
