"""Cones of statuses in 2D: every difference of a solution and a reference is in one of them."""

import numpy as np
import pytest

from amontons.analysis.solutions.discs.plane_sets import PlaneLaw

STATUSES = "f+-s"


def point(random, status, mu):
    """z (4,) of a status; sizes from 1e-6 to 1."""
    a, b = 10.0 ** random.uniform(-6, 0, 2) * (random.random(2) < 0.8)
    if mu == 0 and status == "+":
        return np.array([a, 0.0, 0.0, b * random.choice([-1, 1])])
    if status == "f":
        return np.array([0.0, 0.0, a, b * random.choice([-1, 1])])
    if status == "s":
        share = random.choice([-1.0, 1.0, random.uniform(-1, 1)])
        return np.array([a, share * mu * a, 0.0, 0.0])
    sign = 1.0 if status == "+" else -1.0
    return np.array([a, sign * mu * a, 0.0, -sign * b])


def touched(z, mu):
    """The statuses of z, which obeys the law exactly."""
    slides = z[2] == 0
    out = "f" if not z[:2].any() else ""
    out += "s" if mu > 0 and not z[2:].any() else ""
    out += "+" if slides and z[1] == mu * z[0] and (z[3] <= 0 or mu == 0) else ""
    return out + ("-" if mu > 0 and slides and z[1] == -mu * z[0] and z[3] >= 0 else "")


def assert_holds(form, d):
    """d is a sum of generators with the products that the form speaks of."""
    x = np.linalg.lstsq(form.G, d)[0]
    size = np.abs(d).max() + 1e-300
    assert np.abs(form.G @ x - d).max() <= 1e-9 * size
    for i, j in form.pairs:
        assert x[i] * x[j] >= -1e-9 * np.abs(x).max() ** 2


@pytest.mark.parametrize("mu", [0.0, 1e-12, 1e-5, 0.4, 3.0, 50.0])
def test_cones_hold_all_differences(mu):
    random = np.random.default_rng(0)
    own = "f+" if mu == 0 else STATUSES
    for _ in range(300):
        z0 = point(random, random.choice(list(own)), mu)
        law = PlaneLaw(mu, z0, touched(z0, mu))
        assert law.touches
        assert law.statuses(".") in ("fs+-", "f+")
        for status in own:
            (form,) = law.forms(status, [0, 1, 2, 3])
            assert np.linalg.matrix_rank(form.G) == form.G.shape[1]
            assert_holds(form, point(random, status, mu) - z0)


@pytest.mark.parametrize("mu", [0.0, 1e-5, 0.4, 50.0])
def test_cones_with_an_apex_hold_all_points(mu):
    random = np.random.default_rng(1)
    law = PlaneLaw(mu, None)
    for status in "f+" if mu == 0 else STATUSES:
        (form,) = law.forms(status, [0, 1, 2, 3, 4])
        for _ in range(100):
            assert_holds(form, np.append(point(random, status, mu), 1.0))


def test_slight_friction_may_stick_on_both_sides():
    # slides to one side so slowly that -z0 is almost in the plane r_N, r_T
    mu, z0 = 1e-5, np.array([1.0, -1e-5, 0.0, 1e-6])
    (form,) = PlaneLaw(mu, z0, "-").forms("s", [0, 1, 2, 3])
    for r_T in (-mu, mu):
        assert_holds(form, np.array([1.0, r_T, 0, 0]) - z0)
        assert_holds(form, np.array([2.0, 2 * r_T, 0, 0]) - z0)
    (other,) = PlaneLaw(mu, z0 * [1, -1, 1, -1], "+").forms("s", [0, 1, 2, 3])
    assert_holds(other, np.array([2.0, -2 * mu, 0, 0]) - z0 * [1, -1, 1, -1])


def test_regions_and_what_lies_in_them():
    sliding = PlaneLaw(0.5, np.array([1.0, 0.5, 0.0, -1.0]), "+")
    assert [letter for letter in ".cfsl+-" if sliding.lies_in(letter)] == [".", "c", "l", "+"]
    assert PlaneLaw(0.0, None).statuses("c") == "+"
    assert all(PlaneLaw(0.5, None).lies_in(letter) for letter in ".cfsl+-")
