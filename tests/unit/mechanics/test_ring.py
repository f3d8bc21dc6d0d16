"""Rings of hexahedra: volume, surfaces, orientation, bad arguments."""

import numpy as np
import pytest

import amontons as am
from amontons.mechanics.meshes.facets import boundary
from amontons.mechanics.meshes.surfaces import facet_areas, facet_normals

AROUND = np.linspace(0, 2 * np.pi, 9)
SECTOR = [0.3, 0.5, 1.1, 2.0]
RADII, HEIGHTS = [1.0, 1.5, 3.0], [-1.0, 0.0, 0.5]


def area(mesh, name):
    return sum(facet_areas(mesh.points, block).sum() for block in mesh.surface(name))


def flux(mesh, blocks):
    """Integral of x . n: three volumes where facets point outwards and cover the boundary."""
    total = 0.0
    for block in blocks:
        middle = mesh.points[block.nodes].mean(axis=1)
        total += np.einsum("fc,fc", facet_normals(mesh.points, block), middle)
    return total


@pytest.mark.parametrize("angles", [AROUND, SECTOR], ids=["closed", "sector"])
def test_volume_and_surfaces_are_those_of_polygons(angles):
    mesh = am.ring(RADII, angles, HEIGHTS)
    steps = np.diff(angles)
    section = (9.0 - 1.0) * np.sin(steps).sum() / 2
    chords = 2 * np.sin(steps / 2).sum()
    assert flux(mesh, boundary(mesh.cells)) / 3 == pytest.approx(1.5 * section)
    assert area(mesh, "top") == pytest.approx(section)
    assert area(mesh, "bottom") == pytest.approx(section)
    assert area(mesh, "inner") == pytest.approx(1.5 * chords)
    assert area(mesh, "outer") == pytest.approx(1.5 * 3.0 * chords)
    ends = {"start", "end"} if len(angles) == len(SECTOR) else set()
    assert set(mesh.surfaces) == {"inner", "outer", "bottom", "top"} | ends
    assert all(area(mesh, name) == pytest.approx(2.0 * 1.5) for name in ends)
    assert len(mesh.points) == 9 * (len(angles) - (not ends))
    named = [block for blocks in mesh.surfaces.values() for block in blocks]
    assert flux(mesh, named) / 3 == pytest.approx(1.5 * section)  # outwards, and all of them


def test_nodes_are_where_the_lists_say():
    mesh = am.ring(RADII, SECTOR, HEIGHTS)
    start = mesh.points[mesh.surface_nodes("start")]
    assert np.allclose(np.arctan2(start[:, 1], start[:, 0]), SECTOR[0])
    inner = mesh.points[mesh.surface_nodes("inner")]
    assert np.allclose(np.hypot(inner[:, 0], inner[:, 1]), RADII[0])
    assert set(mesh.points[:, 2]) == set(HEIGHTS)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"radii": [0, 1]}, "radii: expected lengths > 0"),
        ({"radii": [2, 1]}, "radii: expected at least two growing numbers"),
        ({"heights": [0]}, "heights: expected at least two"),
        ({"angles": [0, np.nan]}, "angles: expected at least two growing numbers"),
        ({"angles": [0, 90, 180]}, "angles: expected at most 2 pi"),
        ({"angles": [0, np.pi, 2 * np.pi]}, "angles: expected steps below pi"),
    ],
)
def test_bad_rings_are_refused(change, words):
    given = {"radii": RADII, "angles": SECTOR, "heights": HEIGHTS} | change
    with pytest.raises(am.InvalidInput, match=words):
        am.ring(**given)
