import numpy as np
import pytest

from amontons.analysis.profiles import performance_profile
from amontons.core.errors import InvalidInput


def test_hand_computed():
    tau, rho = performance_profile([[1.0, 2.0], [3.0, 1.0], [2.0, np.inf]])
    np.testing.assert_allclose(tau, [1, 2, 3])
    np.testing.assert_allclose(rho, [[2 / 3, 2 / 3, 1], [1 / 3, 2 / 3, 2 / 3]])


def test_failures_and_problems_that_nobody_solves():
    tau, rho = performance_profile([[np.nan, np.inf], [1.0, np.nan]])
    np.testing.assert_allclose(tau, [1])
    np.testing.assert_allclose(rho, [[0.5], [0.0]])


def test_units_do_not_matter():
    times = np.random.default_rng(0).uniform(0.1, 2, (20, 3))
    for a, b in zip(performance_profile(times), performance_profile(1e3 * times), strict=True):
        np.testing.assert_allclose(a, b)


def test_what_is_not_counted_is_no_failure():
    with pytest.raises(InvalidInput, match="does not count its operations"):
        performance_profile([[1.0, None], [2.0, 3.0]])


@pytest.mark.parametrize("times", [[1.0, 2.0], [[0.0]], [[-1.0, 1.0]], np.zeros((0, 2))])
def test_refused(times):
    with pytest.raises(InvalidInput, match="times"):
        performance_profile(times)
