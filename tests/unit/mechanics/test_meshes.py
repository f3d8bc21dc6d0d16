"""Boxes, checks of meshes, integrals over surfaces."""

import numpy as np
import pytest

import amontons as am
from amontons.mechanics.meshes.cells import CELLS
from amontons.mechanics.meshes.check import MIRROR, _determinants, tet_determinants
from amontons.mechanics.meshes.facets import Cells, Facets, boundary, sides
from amontons.mechanics.meshes.surfaces import (
    facet_areas,
    facet_normals,
    nodal_normals,
    nodal_weights,
)

KINDS_3D = ("hex", "tet")
KINDS_2D = ("quad", "tri")
BOXES = [((1.0, 2.0, 3.0), (2, 3, 4), kind) for kind in KINDS_3D] + [
    ((1.0, 2.0), (2, 3), kind) for kind in KINDS_2D
]


@pytest.mark.parametrize(("size", "cells", "kind"), BOXES)
def test_box_has_the_named_sides_with_their_areas(size, cells, kind):
    origin = np.arange(1.0, len(size) + 1)
    mesh = am.box(size, cells, kind, origin=origin)
    names = [("left", "right"), ("front", "back"), ("bottom", "top")]
    names = names if len(size) == 3 else [names[0], names[2]]
    for axis, (low, high) in enumerate(names):
        for name, value, sign in ((low, 0.0, -1.0), (high, size[axis], 1.0)):
            nodes = mesh.surface_nodes(name)
            on = np.flatnonzero(np.isclose(mesh.points[:, axis], origin[axis] + value))
            np.testing.assert_array_equal(nodes, on)
            (facets,) = mesh.surface(name)
            area = np.prod(size) / size[axis]
            assert facet_areas(mesh.points, facets).sum() == pytest.approx(area)
            normal = nodal_normals(mesh.points, (facets,))[nodes]
            np.testing.assert_allclose(
                normal, sign * np.eye(len(size))[[axis] * len(nodes)], atol=1e-14
            )
            weights = nodal_weights(mesh.points, (facets,))
            assert weights.sum() == pytest.approx(area)
            assert (weights[nodes] > 0).all()
            assert not np.delete(weights, nodes).any()


@pytest.mark.parametrize(("size", "cells", "kind"), BOXES)
def test_boundary_of_a_box_is_closed(size, cells, kind):
    mesh = am.box(size, cells, kind)
    total = sum(facet_normals(mesh.points, block).sum(axis=0) for block in mesh.boundary)
    np.testing.assert_allclose(total, 0, atol=1e-12)
    named = sum(len(f.nodes) for s in mesh.surfaces.values() for f in s)
    assert sum(len(b.nodes) for b in mesh.boundary) == named


def test_box_counts_and_order():
    mesh = am.box((1, 1, 1), cells=(2, 3, 4))
    assert mesh.points.shape == (3 * 4 * 5, 3)
    assert mesh.cell_count == 24
    assert mesh.grid == (2, 3, 4)
    np.testing.assert_array_equal(mesh.points[1], [0.5, 0, 0])  # x runs fastest
    assert mesh.regions == ("default",)
    assert am.box((1, 1), 3).cell_count == 9
    assert am.box((1, 1, 1), 2, "tet").cell_count == 48


@pytest.mark.parametrize("kind", [k for k in CELLS if CELLS[k].dim > 1])
def test_shape_functions_are_a_partition_with_right_gradients(kind):
    cell = CELLS[kind]
    x = cell.corners.mean(axis=0) * 0.9 + 0.01
    assert cell.shape(x).sum() == pytest.approx(1)
    np.testing.assert_allclose(cell.shape(x) @ cell.corners, x, atol=1e-14)
    step = 1e-6
    for axis in range(cell.dim):
        e = step * np.eye(cell.dim)[axis]
        difference = (cell.shape(x + e) - cell.shape(x - e)) / (2 * step)
        np.testing.assert_allclose(cell.gradient(x)[:, axis], difference, atol=1e-8)
    for corner in cell.corners if kind != "pyramid" else cell.corners[:4]:
        unit = np.isclose(cell.corners, corner).all(axis=1)
        np.testing.assert_allclose(cell.shape(corner), unit, atol=1e-14)


@pytest.mark.parametrize("kind", [k for k in CELLS if CELLS[k].dim > 1])
def test_facets_of_reference_cells_point_outwards(kind):
    cell = CELLS[kind]
    mesh = am.Mesh(cell.corners, (Cells(kind, np.arange(cell.nodes)[None]),))
    for block in mesh.boundary:
        normals = facet_normals(mesh.points, block)
        outward = mesh.points[block.nodes].mean(axis=1) - cell.centre
        assert ((normals * outward).sum(axis=1) > 0).all()


@pytest.mark.parametrize("kind", [k for k in CELLS if CELLS[k].dim > 1])
def test_inverted_cells_are_turned(kind):
    cell = CELLS[kind]
    turned = np.arange(cell.nodes)[MIRROR[kind]][None]
    mesh = am.Mesh(cell.corners, (Cells(kind, turned),))
    np.testing.assert_array_equal(mesh.cells[0].nodes, np.arange(cell.nodes)[None])


def test_facets_given_inwards_are_turned():
    mesh = am.box((1, 1, 1), 2)
    (facets,) = mesh.surface("left")
    inwards = Facets("quad", facets.nodes[:, ::-1])
    again = am.Mesh(mesh.points, mesh.cells, {"left": (inwards,)})
    normals = facet_normals(again.points, again.surface("left")[0])
    np.testing.assert_allclose(normals, [[-0.25, 0, 0]] * 4, atol=1e-15)


SQUARE = np.array([[0, 0], [1, 0], [1, 1], [0, 1.0]])
QUAD = (Cells("quad", np.array([[0, 1, 2, 3]])),)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"points": np.zeros((4, 4))}, "points: expected shape"),
        ({"points": SQUARE * np.nan}, "finite"),
        ({"points": np.vstack([SQUARE, [[5, 5]]])}, "belongs to no cell"),
        ({"points": SQUARE * [1, 0]}, "degenerate"),
        ({"points": SQUARE[[0, 2, 1, 3]]}, "folded"),
        ({"cells": (Cells("quad", np.array([[0, 1, 2, 4]])),)}, "node numbers 0..3"),
        ({"cells": (Cells("quad", np.array([[0, 1, 2]])),)}, "expected shape"),
        ({"cells": (Cells("hex", np.array([[0, 1, 2, 3]])),)}, "expected one of tri, quad"),
        ({"cells": ()}, "got none"),
        ({"surfaces": {"s": (Facets("line", np.array([[0, 2]])),)}}, "no side of a cell"),
        ({"surfaces": {"s": (Facets("tri", np.array([[0, 1, 2]])),)}}, "expected facets line"),
        ({"surfaces": {"s": (Facets("line", np.array([[0, 9]])),)}}, "node numbers"),
    ],
)
def test_bad_meshes_are_rejected(change, words):
    with pytest.raises(am.InvalidInput, match=words):
        am.Mesh(**({"points": SQUARE, "cells": QUAD} | change))


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (((1,), 2), "size"),
        (((1, 1, 1, 1), 2), "size"),
        (((1, -1), 2), "size"),
        (((1, np.inf), 2), "size"),
        (((1, 1), 0), "cells"),
        (((1, 1), 1.5), "cells"),
        (((1, 1), (1, 2, 3)), "cells"),
        (((1, 1), 2, "hex"), "quad or tri"),
        (((1, 1, 1), 2, "quad"), "hex or tet"),
    ],
)
def test_bad_boxes_are_rejected(arguments, words):
    with pytest.raises(am.InvalidInput, match=words):
        am.box(*arguments)
    with pytest.raises(am.InvalidInput, match="origin"):
        am.box((1, 1), 2, origin=(0, 0, 0))


def test_unknown_and_empty_surfaces():
    mesh = am.box((1, 1), 2)
    with pytest.raises(
        am.InvalidInput, match=r"known: bottom, left, right, top; did you mean 'bottom'"
    ):
        mesh.surface("botom")
    empty = am.Mesh(mesh.points, mesh.cells, {"nothing": ()})
    with pytest.raises(am.InvalidInput, match="no facets"):
        empty.surface("nothing")
    with pytest.raises(am.InvalidInput, match="there are no named surfaces"):
        am.Mesh(mesh.points, mesh.cells).surface("top")


def test_boundary_leaves_out_inner_facets():
    mesh = am.box((1, 1, 1), 2, "tet")
    assert sum(len(b.nodes) for b in boundary(mesh.cells)) == 6 * 4 * 2


def hub(count):
    """Triangles around one point, which is a corner of all of them."""
    angle = 2 * np.pi * np.arange(count) / count
    points = np.vstack([[0, 0], np.column_stack([np.cos(angle), np.sin(angle)])])
    rim = 1 + np.arange(count)
    return am.Mesh(points, (Cells("tri", np.column_stack([0 * rim, rim, np.roll(rim, -1)])),))


@pytest.mark.parametrize("mesh", [
    *(am.box(size, cells, kind) for size, cells, kind in BOXES), hub(5), hub(200),
])  # fmt: skip
def test_the_boundary_is_what_one_cell_alone_has(mesh):
    (found,) = boundary(mesh.cells)
    ((_, table),) = sides(mesh.cells).items()
    _, first, count = np.unique(
        np.sort(table, axis=1), axis=0, return_index=True, return_counts=True
    )
    np.testing.assert_array_equal(found.nodes, table[np.sort(first[count == 1])])


def test_many_tetrahedra_are_judged_as_few_ones():
    mesh = am.box((1, 2, 3), cells=3, kind="tet")
    points = mesh.points + 0.2 * np.random.default_rng(0).standard_normal(mesh.points.shape)
    points[:2] = points[2]  # one of no volume
    table = np.array(mesh.cells[0].nodes)
    expected, _ = _determinants(CELLS["tet"], points[table])
    found = tet_determinants(points, table)
    assert (found < 0).any() and (found == 0).any()
    np.testing.assert_allclose(found, expected, atol=1e-15)
