"""Contacts that are found: as by hand, the rules for slaves, what is no contact."""

from dataclasses import replace

import numpy as np
import pytest

import amontons as am
from amontons.mechanics.meshes import second_order

STEEL = am.LinearElastic(1000.0, 0.3)


def block(name, size, cells, at, law=STEEL, **more):
    mesh = am.box(size, cells)
    return am.Body(replace(mesh, points=mesh.points + np.array(at)), law, name, **more)


def tower(**more):
    """Three blocks on one another, finer upwards."""
    return [
        block("low", (2, 2, 1), (4, 4, 2), (0, 0, 0), **more),
        block("middle", (1, 1, 1), (3, 3, 3), (0.5, 0.5, 1), **more),
        block("high", (1, 1, 0.5), (4, 4, 2), (0.6, 0.5, 2), **more),
    ]


def solved(bodies, contacts, load):
    supports = [am.Fix("low.bottom", 0)]
    return am.solve(am.Model(bodies, supports, contacts, [load]), tolerance=1e-11)


def same(one, other):
    return all(np.allclose(a, b, rtol=1e-8, atol=1e-10 * np.abs(b).max())
               for a, b in zip(one.displacement, other.displacement, strict=True))  # fmt: skip


@pytest.mark.parametrize("order", [1, 2])
def test_a_tower_is_as_if_named(order):
    bodies, load = tower(order=order), am.Traction("high.top", (0.05, 0, -1.0))
    found = am.find_contacts(bodies, mu=0.4)
    hand = [am.Contact("middle.bottom", master="low.top", mu=0.4),
            am.Contact("high.bottom", master="middle.top", mu=0.4)]  # fmt: skip
    assert [(c.slave, c.master) for c in found] == [
        ("middle on low", "low under middle"), ("high on middle", "middle under high")
    ]  # fmt: skip
    assert [pair.area for pair in found.pairs] == pytest.approx([1.0, 0.9], rel=1e-12)
    assert [(pair.gap, pair.overlap) for pair in found.pairs] == [(0, 0), (0, 0)]
    assert found.pairs[0].facets == (9, 16)
    assert same(solved(found.bodies, found.contacts, load), solved(bodies, hand, load))


def test_blocks_in_the_plane():
    bodies = [block("low", (2, 1), (4, 2), (0, 0)), block("high", (1, 1), 3, (0.5, 1))]
    found = am.find_contacts(bodies, mu=0.4)
    load = am.Pressure("high.top", 1.0)
    hand = [am.Contact("high.bottom", master="low.top", mu=0.4)]
    assert same(solved(found.bodies, found.contacts, load), solved(bodies, hand, load))


def arc(inner, outer, count, name, law=STEEL):
    """A quarter of a ring, 0 to 90 degrees, of quadrilaterals."""
    mesh = am.box((1, np.pi / 2), (2, count))
    r, angle = inner + (outer - inner) * mesh.points[:, 0], mesh.points[:, 1]
    points = np.stack([r * np.cos(angle), r * np.sin(angle)], axis=1)
    return am.Body(replace(mesh, points=points), law, name)


def test_rings_that_are_pressed_into_each_other():
    """The overlap is that of the circles, not of their chords: meshes do not match."""
    overlap = 0.002
    bodies = [arc(1, 2, 9, "shaft"), arc(2 - overlap, 3, 7, "hub")]
    found = am.find_contacts(bodies, mu=0.0)
    (pair,) = found.pairs
    assert pair.parts == ("shaft", "hub")
    assert pair.overlap == pytest.approx(overlap, rel=0.05)  # of 9 facets
    supports = [am.Fix(f"{b}.{s}", v) for b in ("shaft", "hub")
                for s, v in (("bottom", (None, 0)), ("top", (0, None)))]  # fmt: skip
    hand = [am.Contact("shaft.right", master="hub.left", mu=0.0)]
    answers = [am.solve(am.Model(b, supports, c), tolerance=1e-11)
               for b, c in ((found.bodies, found.contacts), (bodies, hand))]  # fmt: skip
    assert same(*answers)


# ---------------------------------------------------------------------------------- slaves
def slave_of(one, other, **more):
    return am.find_contacts([one, other], mu=0.1, **more).pairs[0].parts[0]


def test_the_slave_is_never_rigid_then_finer_then_softer_then_smaller_then_later():
    low, on = (1, 1, 1), (0, 0, 1)
    soft = am.LinearElastic(10.0, 0.3)
    assert slave_of(block("a", low, 2, (0, 0, 0)), block("b", low, 9, on, am.Rigid())) == "a"
    assert slave_of(block("a", low, 3, (0, 0, 0)), block("b", low, 2, on)) == "a"
    assert slave_of(block("a", low, 2, (0, 0, 0), soft), block("b", low, 2, on)) == "a"
    assert slave_of(block("a", low, 2, (0, 0, 0)), block("b", low, 2, on, soft)) == "b"
    assert slave_of(block("a", low, 2, (0, 0, 0)), block("b", (2, 2, 2), 4, on)) == "a"
    assert slave_of(block("a", low, 2, (0, 0, 0)), block("b", low, 2, on)) == "b"


# --------------------------------------------------------------------- what is no contact
def test_what_is_glued_or_thin_does_not_touch():
    with pytest.raises(am.InvalidInput, match="body is one part, all glued; .* glue=False"):
        am.find_contacts([am.Body(am.box((1, 1, 2), (1, 1, 2)), STEEL)], mu=0.1)
    thin = [block("low", (4, 4, 0.1), (4, 4, 1), (0, 0, 0)),
            block("high", (4, 4, 0.1), (4, 4, 1), (0, 0, 0.1))]  # fmt: skip
    found = am.find_contacts(thin, mu=0.1)  # their far sides are nearer than a facet is wide
    mesh = found.bodies[0].mesh
    nodes = mesh.surface_nodes("low under high")
    assert np.allclose(mesh.points[nodes, 2], 0.1)
    assert found.pairs[0].overlap == 0


def test_a_gap_and_an_overlap_are_told():
    for apart in (0.125, -0.03):
        bodies = [block("low", (1, 1, 1), 2, (0, 0, 0)),
                  block("high", (1, 1, 1), 3, (0, 0, 1 + apart))]  # fmt: skip
        (pair,) = am.find_contacts(bodies, mu=0.1).pairs
        assert pair.gap == pytest.approx(max(apart, 0), abs=1e-12)
        assert pair.overlap == pytest.approx(max(-apart, 0), abs=1e-12)
        assert ("gap 0.125" if apart > 0 else "overlap 0.03") in str(pair)


def test_parts_that_are_too_far_apart_are_refused_in_words():
    bodies = [block("low", (1, 1, 1), 2, (0, 0, 0)), block("high", (1, 1, 1), 2, (0, 0, 2))]
    with pytest.raises(am.InvalidInput, match="none of the 2 parts lies within the size of a "):
        am.find_contacts(bodies, mu=0.1)
    assert len(am.find_contacts(bodies, mu=0.1, gap=1.0)) == 1
    with pytest.raises(am.InvalidInput, match="within 0.9 of another"):
        am.find_contacts(bodies, mu=0.1, gap=0.9)
    with pytest.raises(am.InvalidInput, match="gap: expected a distance >= 0"):
        am.find_contacts(bodies, mu=0.1, gap=-1.0)


def test_names_are_excluded_alone_and_in_pairs():
    def pairs(*exclude):
        return [pair.parts for pair in am.find_contacts(tower(), mu=0.1, exclude=exclude).pairs]

    assert pairs(("middle", "low")) == pairs("low") == [("high", "middle")]
    with pytest.raises(am.InvalidInput, match="part 'lov': not found, .* mean 'low'"):
        pairs("lov")
    with pytest.raises(am.InvalidInput, match="expected a list, got one name"):
        am.find_contacts(tower(), mu=0.1, exclude="low")


def test_what_has_a_contact_by_hand_is_not_found_again():
    bodies = tower()
    hand = am.Contact("high.bottom", master="middle.top", tied=True)
    found = am.find_contacts(bodies, mu=0.1, known=[hand])
    assert [pair.parts for pair in found.pairs] == [("middle", "low")]
    turned = am.Contact("middle.top", master="high.bottom", tied=True)
    assert len(am.find_contacts(bodies, mu=0.1, known=[turned])) == 1


def test_parts_of_one_mesh_that_share_no_nodes():
    low, high = tower()[:2]
    n = len(low.mesh.points)
    upper = (replace(b, nodes=b.nodes + n, region="upper") for b in high.mesh.cells)
    cells = (*low.mesh.cells, *upper)
    whole = am.Mesh(np.concatenate([low.mesh.points, high.mesh.points]), cells)
    found = am.find_contacts([am.Body(whole, STEEL)], mu=0.1)
    assert found.pairs[0].parts == ("upper (part 2 of 2)", "body (part 1 of 2)")
    assert found.pairs[0].area == pytest.approx(1.0)


def test_a_ring_of_revolution_has_no_facets_on_its_axis():
    bodies = [am.Body(am.box((1, 1), 3), STEEL, "low", axisymmetric=True),
              block("high", (1, 1), 2, (0, 1), axisymmetric=True)]  # fmt: skip
    (pair,) = am.find_contacts(bodies, mu=0.1).pairs
    assert pair.area == pytest.approx(np.pi)


def test_serendipity_cells_meet():
    low, high = (replace(b, mesh=second_order(b.mesh, serendipity=True)) for b in tower()[:2])
    (pair,) = am.find_contacts([low, high], mu=0.1).pairs
    assert pair.area == pytest.approx(1.0)
