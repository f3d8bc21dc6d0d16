"""Normals between two sides: at a ridge those of the straight side, whoever is the slave."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import amontons as am
from amontons.mechanics.contact.current_mortar import MortarPair
from amontons.mechanics.contact.facing import Skin
from amontons.mechanics.contact.ridges import ridges
from amontons.mechanics.meshes.facets import Facets

TILT = 0.12  # of a cone behind a cylinder


def ridged(*, swap, straight=True):
    """A line with a ridge in the middle of 4 facets over 4 level ones; the pair, positions."""
    along = np.linspace(0, 1, 5)
    over = np.stack([along, 0.01 + TILT * np.maximum(along - 0.5, 0)], axis=1)
    under = np.stack([np.linspace(-0.03, 1.04, 6), np.zeros(6)], axis=1)
    if not straight:
        under[:, 1] -= 0.3 * (under[:, 0] - 0.4) ** 2
    x = np.concatenate([over, under])
    first, second = (
        Skin.of((Facets("line", np.stack(ends, axis=1)),), 0)
        for ends in ((np.arange(4), np.arange(1, 5)), (np.arange(6, 11), np.arange(5, 10)))
    )
    sides = (second, first) if swap else (first, second)
    slaves = sides[0].all
    free = np.ones((len(slaves), 2), dtype=bool)
    pair = MortarPair(slaves, *sides, free, areas=np.full(len(slaves), 0.25),
                      ridges=ridges(sides[0], slaves, x))  # fmt: skip
    return pair, x


def test_at_a_ridge_of_the_slave_the_normal_is_that_of_a_straight_master():
    """The mean of both facets is tilted by half of the cone's angle."""
    pair, x = ridged(swap=False)
    meeting = pair.at(x)
    assert meeting.facing.own.unit[2, 0] == pytest.approx(-np.sin(TILT / 2), rel=0.01)
    assert abs(meeting.normals[2, 0]) < 0.08 * np.sin(TILT / 2)


def test_a_straight_slave_has_its_own_normals_over_a_ridge():
    pair, x = ridged(swap=True)
    beside = pair.at(x).normals[2:4, 0]  # of whose facets parts face both sides of the ridge
    np.testing.assert_allclose(beside, 0, atol=0.15 * TILT / 2)


def test_normals_turn_with_everything():
    pair, x = ridged(swap=False, straight=False)
    turn = Rotation.from_rotvec([0, 0, 2.1]).as_matrix()[:2, :2]
    np.testing.assert_allclose(
        pair.at(x @ turn.T).normals, pair.at(x).normals @ turn.T, atol=1e-13
    )


def ridged_in_space():
    """A block whose lower side has a ridge over one that bulges, of other cells."""
    over = am.box((1, 1, 0.2), (4, 3, 1))
    under = am.box((1.1, 1.1, 0.2), (3, 4, 1), origin=(-0.04, -0.06, -0.2), kind="tet")
    p, q = over.points.copy(), under.points.copy()
    p[:, 2] += 0.01 + TILT * np.maximum(p[:, 0] - 0.5, 0)
    q[:, 2] -= 0.2 * (q[:, 0] - 0.4) ** 2 + 0.1 * (q[:, 1] - 0.5) ** 2
    x = np.concatenate([p, q])
    sides = (Skin.of(over.surfaces["bottom"], 0), Skin.of(under.surfaces["top"], len(p)))
    slaves = sides[0].all
    pair = MortarPair(slaves, *sides, np.ones((len(slaves), 3), dtype=bool),
                      areas=np.full(len(slaves), 0.08),
                      ridges=ridges(sides[0], slaves, x))  # fmt: skip
    return pair, x


@pytest.mark.parametrize("of", ["line", "line exchanged", "space"])
def test_slopes_of_normals_are_exact(of):
    pair, x = (
        ridged_in_space() if of == "space" else ridged(swap="ex" in of, straight=False)
    )
    assert (pair.ridges > 0.5).any() == ("ex" not in of)
    rng, far = np.random.default_rng(3), 1e-6
    for _ in range(20):
        at = x + 0.01 * rng.standard_normal(x.shape)
        way = rng.standard_normal(x.shape)
        found = pair.at(at).slopes.normals @ way.ravel()
        one, other = (pair.at(at + s * far * way).normals for s in (1, -1))
        differences = ((one - other) / (2 * far)).ravel()
        size = np.abs(differences).max()
        np.testing.assert_allclose(found, differences, atol=1e-7 * size)


def quarter(radii, along, cells, widened):
    """A quarter of a tube from z to z; widened(z) scales the outer radius."""
    box = am.box((1, 1, 1), cells)
    turn, out, up = box.points.T
    z = along[0] + (along[1] - along[0]) * up
    radius = radii[0] + (radii[1] * widened(z) - radii[0]) * out
    angle = 0.5 * np.pi * (1 - turn)
    return replace(
        box, points=np.stack([radius * np.cos(angle), radius * np.sin(angle), z], axis=1)
    )


def push(slave, master):
    """Axial forces of a pin with a cone in front in a tube, 3 % narrower, without friction."""
    tube = quarter((1.0, 1.5), (0.0, 1.2), (4, 1, 6), np.ones_like)
    pin = quarter((0.5, 1.0), (-1.6, -0.1), (3, 1, 6),
                  lambda z: 0.97 + 0.06 * np.clip((-0.1 - z) / 0.5, 0, 1))  # fmt: skip
    held = [am.Fix(f"{name}.left", (0, None, None)) for name in ("tube", "pin")]
    held += [am.Fix(f"{name}.right", (None, 0, None)) for name in ("tube", "pin")]
    held += [am.Fix("tube.top", (None, None, 0)),
             am.Fix("pin.bottom", (0, 0, lambda x, t: 0.9 * t))]  # fmt: skip
    bodies = [am.Body(tube, am.NeoHookean(1, 0.3), name="tube"),
              am.Body(pin, am.NeoHookean(10, 0.3), name="pin")]  # fmt: skip
    model = am.Model(bodies, held, [am.Contact(slave, master=master, mu=0)])
    steps = am.evolve(model, am.QuasiStatic(0.1), until=1.0)
    return [abs(step.resultant()[2]) for step in steps][-4:]


def test_either_side_of_a_press_fit_is_the_slave():
    """Where the pin has passed with its ridge; with means as normals 2.5 times as much."""
    pin, tube = (push(*sides) for sides in (("pin.back", "tube.front"),
                                            ("tube.front", "pin.back")))  # fmt: skip
    assert np.mean(pin) == pytest.approx(np.mean(tube), rel=0.08)
