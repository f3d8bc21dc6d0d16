"""Warped facets seen all but edge-on: they fade before their outline crosses itself."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from amontons.mechanics.contact.edge_on import visible
from amontons.mechanics.contact.facet_integrals import FacetPairs

SQUARE = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0.0]])
STEP = 1e-6
DIFFERENCE = {-2: 1 / 12, -1: -2 / 3, 1: 2 / 3, 2: -1 / 12}


def tilted(angle, warp, shape=SQUARE):
    """A facet above the unit square, turned by an angle (degrees) from facing it."""
    x = shape[::-1] - (0.5, 0.5, 0)
    x = x + [[0, 0, warp * (-1) ** k] for k in range(4)]
    x = x @ Rotation.from_rotvec([0, np.radians(angle), 0]).as_matrix().T
    return x + (0.45, 0.55, 0.8)


def pair_of(master, second=False):
    """The unit square, seen from below, and a master."""
    four, more = np.array([4]), np.array([4 if second else 0])
    return FacetPairs(SQUARE[None], four, master[None], four, more, more,
                      (more[0], more[0]))  # fmt: skip


def least_corner(master):
    """The least area of a corner as seen from the square, over the mean."""
    ahead = np.roll(master, -1, axis=0) - master
    seen = np.cross(ahead, -np.roll(ahead, 1, axis=0))[:, 2]
    return (seen / seen.mean()).min() if seen.mean() < 0 else -1.0


def test_plane_facets_are_whole_and_warped_ones_go_before_they_cross():
    crossed = 0
    for warp in (0.0, 1e-3, 0.02, 0.2):
        last = 1.0
        for angle in np.linspace(0, 89.99, 200):
            x = tilted(angle, warp)
            w = visible(SQUARE[None], x[None])[0]
            corner = -np.max(-np.array([least_corner(x)]))
            crossed += corner <= 0
            assert w <= last + 1e-12
            assert (w == 1) if warp == 0 else (w == 0 or corner > 0.05)
            last = w
    assert crossed > 20


def test_shapes_that_are_none_of_the_warp_do_not_matter():
    taper = np.array([[0, 0, 0], [1, 0, 0], [0.51, 1, 0], [0.49, 1, 0.0]])
    joined = np.array([[0, 0, 0], [1, 0, 0], [0.5, 1, 0], [0.5, 1, 0.0]])
    for shape in (taper, joined):
        assert visible(SQUARE[None], tilted(70, 0.0, shape)[None])[0] == pytest.approx(1.0)


@pytest.mark.parametrize("second", [False, True])
def test_integrals_stay_bounded_and_slopes_exact(second):
    """Functions of first order are between 0 and 1: so are their averages."""
    rng, fading = np.random.default_rng(0), 0
    for angle in np.linspace(80, 95, 21):
        pair = pair_of(tilted(angle, 0.03), second)
        (mass, cross), slopes = pair.integrals(), pair.slopes()
        area = mass[..., :4].sum()
        assert cross[..., :4].sum() == pytest.approx(area)
        assert (cross[..., :4] >= -1e-12 * area).all()
        w = visible(pair.slave, pair.master)[0]
        ways = rng.standard_normal((2, 1, 4, 3))
        sides = {k: replace(pair, slave=pair.slave + k * STEP * ways[0],
                            master=pair.master + k * STEP * ways[1])
                 for k in DIFFERENCE}  # fmt: skip
        for which, found in enumerate(slopes):
            change = sum(part * sides[k].integrals()[which]
                         for k, part in DIFFERENCE.items()) / STEP  # fmt: skip
            own = found @ np.concatenate(ways, axis=1).ravel()
            assert np.abs(own - change).max() <= 1e-7
        fading += 0 < w < 1
    assert fading >= 3
