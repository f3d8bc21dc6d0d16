"""A part in contact with itself: slots that close, beside the half model on a plane."""

import numpy as np
import pytest
from folded_meshes import fork

import amontons as am

SOFT = am.LinearElastic(1000.0, 0.3)


def closed(mesh, contacts, bodies):
    loads = [am.NodalForce("up", (0, -2.0)), am.NodalForce("down", (0, 2.0))]
    return am.solve(am.Model(bodies, [am.Fix("left", 0)], contacts, loads), tolerance=1e-11)


@pytest.mark.parametrize("gap", [0.02, 0.1])
def test_a_slot_closes_as_its_half_does_on_a_plane(gap):
    mesh = fork(gap)
    found = am.find_contacts([am.Body(mesh, SOFT)], mu=0.0, itself=True)
    (pair,) = found.pairs
    assert pair.parts == ("body", "body")
    assert pair.gap == pytest.approx(gap)
    assert pair.area == pytest.approx(2.0, abs=0.3)
    whole = closed(mesh, found.contacts, found.bodies)
    u = whole.displacement[0]
    mirrored = {(round(x, 9), round(-y, 9)): k for k, (x, y) in enumerate(mesh.points.tolist())}
    other = np.array([mirrored[round(x, 9), round(y, 9)] for x, y in mesh.points.tolist()])
    assert np.allclose(u[other] * (1, -1), u, atol=1e-9)
    assert whole.fields.pressure.max() > 0
    # the upper half: held along y where it is cut, on a plane in the middle of the slot
    cells = mesh.cells[0].nodes
    used, numbers = np.unique(cells[mesh.points[cells][:, :, 1].mean(axis=1) > 0],
                              return_inverse=True)  # fmt: skip
    x = mesh.points[used]
    nodes = numbers.reshape(-1, 4)
    below = np.isclose(x[nodes][:, :, 1].min(axis=1), gap / 2) & (x[nodes][:, :, 0].min(1) > 1)
    bottom = am.Facets("line", nodes[below][:, :2])
    half = am.Mesh(x, (am.Cells("quad", nodes),), {"slot": (bottom,)}, node_sets={
        "left": np.flatnonzero(x[:, 0] < 1e-9), "cut": np.flatnonzero(np.abs(x[:, 1]) < 1e-9),
        "up": np.flatnonzero(x[:, 1] > gap / 2 + 1 - 1e-9),
    })  # fmt: skip
    contact = am.Contact("slot", am.Plane((0, 1)), mu=0.0, method="mortar")
    alone = am.solve(
        am.Model([am.Body(half, SOFT)], [am.Fix("left", 0), am.Fix("cut", (None, 0))],
                 [contact], [am.NodalForce("up", (0, -2.0))]), tolerance=1e-11,
    )  # fmt: skip
    assert np.allclose(alone.displacement[0], u[used], atol=1e-8 * np.abs(u).max())
    one, other = (dict(zip(f.points[:, 0].round(6).tolist(), f.pressure.tolist(), strict=True))
                  for f in (alone.fields, whole.fields))  # fmt: skip
    common = [at for at in one if at in other and at > 1.3]
    assert len(common) >= 5
    most = max(other.values())
    assert [one[at] for at in common] == pytest.approx([other[at] for at in common],
                                                       rel=1e-6, abs=1e-6 * most)  # fmt: skip


def test_what_is_solid_does_not_meet_itself():
    with pytest.raises(am.InvalidInput, match="no contact found"):
        am.find_contacts([am.Body(am.box((4, 0.1), (4, 1)), SOFT)], mu=0.1, itself=True)


def test_pressure_at_the_tips_of_a_closed_slot():
    """A slot inside a block that is pressed across it carries the pressure of the block."""
    whole = am.box((2, 2), 8)
    x, y = whole.points.T
    inside = np.flatnonzero((np.abs(y - 1) < 1e-9) & (x > 0.51) & (x < 1.49))
    twin = np.arange(len(x))
    twin[inside] = len(x) + np.arange(len(inside))
    (block,) = whole.cells
    above = whole.points[block.nodes].mean(axis=1)[:, 1] > 1
    nodes = np.where(above[:, None], twin[block.nodes], block.nodes)
    bare = am.Mesh(np.vstack([whole.points, whole.points[inside]]), (am.Cells("quad", nodes),))
    (rim,) = bare.boundary
    lips = rim.nodes[(np.abs(bare.points[rim.nodes][:, :, 1] - 1) < 1e-9).all(axis=1)]
    upper = (lips >= len(x)).any(axis=1)
    surfaces = {"upper": (am.Facets("line", lips[upper]),),
                "lower": (am.Facets("line", lips[~upper]),), **whole.surfaces}  # fmt: skip
    mesh = am.Mesh(bare.points, bare.cells, surfaces)
    found = am.solve(am.Model(
        [am.Body(mesh, SOFT)], [am.Fix("bottom", (None, 0)), am.Fix("left", (0, None))],
        [am.Contact("upper", master="lower", mu=0.3)], [am.Traction("top", (0, -1.0))],
    ), tolerance=1e-11)  # fmt: skip
    np.testing.assert_allclose(found.fields.points[:, 0], [0.75, 1.0, 1.25], atol=1e-12)
    np.testing.assert_allclose(found.fields.pressure, 1.0, rtol=1e-8)
