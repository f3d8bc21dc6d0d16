"""Ridges of surfaces: kinks that their curvature does not explain."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import amontons as am
from amontons.mechanics.contact.facing import Skin
from amontons.mechanics.contact.ridges import ridges
from amontons.mechanics.meshes.facets import Facets


def line(points):
    """r of the nodes of a line through points (n, 2)."""
    n = len(points)
    ends = np.stack([np.arange(n - 1), np.arange(1, n)], axis=1)
    return ridges(Skin.of((Facets("line", ends),), 0), np.arange(n), np.asarray(points))


def bent(angles, lengths):
    """Points of a line whose facets have these directions."""
    ways = np.stack([np.cos(angles), np.sin(angles)], axis=1) * np.asarray(lengths)[:, None]
    return np.concatenate([np.zeros((1, 2)), np.cumsum(ways, axis=0)])


def test_a_kink_between_straight_parts_is_a_ridge():
    found = line(bent(np.radians([0, 0, 0, 8, 8, 8]), np.ones(6)))
    assert found[3] > 0.9
    assert np.delete(found, 3).max() < 1e-12


@pytest.mark.parametrize("grading", [1.0, 1.3])
def test_a_curved_line_has_none_however_coarse(grading):
    angles = np.cumsum(np.full(12, 0.2) * grading ** np.arange(12) / grading**6)
    assert line(bent(angles, grading ** np.arange(12))).max() == 0


def test_where_a_curve_begins_is_none():
    angles = np.radians([0, 0, 0, 5, 15, 25, 35])
    assert line(bent(angles, np.ones(7))).max() == 0


def test_an_edge_is_none_and_ridges_fade_towards_one():
    found = [line(bent(np.radians([0, 0, a, a]), np.ones(4)))[2] for a in (10, 30, 44, 60)]
    assert found[0] > found[1] > found[2] > found[3] == 0


def test_ends_tell_nothing():
    """Beside a kink one facet from the end something is known on the other side alone."""
    assert line(bent(np.radians([0, 9, 9, 9]), np.ones(4)))[1] > 0.9
    assert line(bent(np.radians([0, 9]), np.ones(2)))[1] == 0


@pytest.mark.parametrize("kind", ["hex", "tet"])
def test_a_ring_between_cone_and_cylinder_is_one_up_to_planes_of_symmetry(kind):
    box = am.box((1, 1, 1), (6, 2, 8), kind=kind)
    along, out, up = box.points.T
    radius = 0.5 + 0.5 * out * (1 + 0.24 * np.maximum(up - 0.5, 0))
    angle = 0.5 * np.pi * (1 - along)
    x = np.stack([radius * np.cos(angle), radius * np.sin(angle), up], axis=1)
    x = x @ Rotation.from_rotvec([0.3, -0.5, 1.0]).as_matrix()
    skin = Skin.of(box.surfaces["back"], 0)
    found = ridges(skin, skin.all, x)
    ring = np.isclose(up[skin.all], 0.5)
    assert ring.sum() == 7
    assert found[ring].min() > 0.5
    assert found[~ring].max() < 0.1
