"""The cube dragged over a rigid plane, against an independent solution (tests/data/cube.json).

Set-up of S. Hüeber, G. Stadler, B. Wohlmuth, "A primal-dual active set algorithm for
three-dimensional contact problems with Coulomb friction", SIAM J. Sci. Comput. 30 (2008).
"""

import json
from pathlib import Path

import numpy as np
import pytest

import amontons as am

REFERENCE = json.loads((Path(__file__).parents[1] / "data" / "cube.json").read_text())
PLANE = am.Plane(normal=(0, 0, 1))


def cube(level, contact):
    block = am.Body(am.box((1, 1, 1), cells=2**level), am.LinearElastic(young=200, poisson=0.3))
    top = am.Fix("top", lambda x: (0, 0.2, 0.06 - 0.15 * x[0]))
    return am.Model([block], supports=[top], contacts=[contact])


@pytest.mark.parametrize("level", [1, 2, 3, 4])
def test_coulomb(level):
    model = cube(level, am.Contact("bottom", PLANE, mu=1.0))
    solution = am.drive(model.assemble(), tolerance=1e-9)
    fields = model.recover(solution)
    expected = REFERENCE[f"level{level}"]
    assert solution.converged
    counts = solution.counts
    assert (counts["slip"] + counts["stick"], counts["slip"]) == (
        expected["contact"],
        expected["slip"],
    )
    np.testing.assert_allclose(fields.resultant, expected["resultant"], rtol=1e-6)
    assert fields.pressure.max() == pytest.approx(expected["max_pressure"], rel=1e-6)
    assert fields.gap.max() == pytest.approx(expected["max_gap"], rel=1e-6)
    touching = solution.status > 0
    slip = np.linalg.norm(fields.slip[touching], axis=1).max()
    assert slip <= expected["max_slip"] * (1 + 1e-6)


@pytest.mark.parametrize("level", [1, 2, 3])
def test_tresca_with_the_bound_integrated_against_the_shape_functions(level):
    """Given friction 800 xy(1-x)(1-y); the bound enters as a force, so divide by the weight."""
    model = cube(level, am.Contact("bottom", PLANE, tresca=0.0))
    rows = model.discretisation.placed[0].rows
    h = 0.5**level
    force = 800 * _moments(rows.points[:, 0], h) * _moments(rows.points[:, 1], h)
    model = cube(level, am.Contact("bottom", PLANE, tresca=force / rows.weights))
    solution = am.drive(model.assemble(), tolerance=1e-9)
    expected = REFERENCE[f"level{level}"]["tresca"]
    assert int((solution.status > 0).sum()) == expected["contact"]
    assert int(solution.sliding.sum()) == expected["slip_all"]
    resultant = model.recover(solution).resultant
    np.testing.assert_allclose(resultant, expected["resultant"], rtol=1e-6)


def _moments(x, h):
    """Integral of t (1 - t) times the hat function at each x of a grid of size h on [0, 1]."""
    gauss, weights = np.polynomial.legendre.leggauss(3)
    total = np.zeros_like(x)
    for side in (-1, 1):
        inside = (x + side * h > -1e-9) & (x + side * h < 1 + 1e-9)
        for g, w in zip((gauss + 1) / 2, weights / 2, strict=True):
            t = x + side * g * h
            total += np.where(inside, w * h * (1 - g) * t * (1 - t), 0.0)
    return total
