"""One surface against itself: slots that close, folds, sides found anew."""

import numpy as np
import pytest
from folded_meshes import fork, hairpin
from tangent_checker import FOURTH, checked_tangents

import amontons as am
from amontons.mechanics.contact.facing import Skin
from amontons.mechanics.contact.folds import Fold
from amontons.mechanics.meshes import Facets
from amontons.mechanics.meshes.order import second_order
from amontons.mechanics.model.large_deformation import large_deformation, large_step

NEO = am.NeoHookean(1000.0, 0.3)
SLOT = 0.1


def chosen(mesh, wanted):
    """Facets of the whole outside whose centres are wanted."""
    out = []
    for block in mesh.boundary:
        kept = wanted(mesh.points[block.nodes].mean(axis=1))
        if kept.any():
            out.append(Facets(block.kind, block.nodes[kept]))
    return tuple(out)


def slotted(dim=2, order=1):
    """A fork of two beams: its slot from both sides, "all" of its outside."""
    flat = mesh = fork(SLOT)
    if dim == 3:  # pulled out by one layer
        n, (quads,) = len(flat.points), flat.cells
        points = np.concatenate([np.c_[flat.points, np.full(n, z)] for z in (0.0, 0.5)])
        nodes = np.concatenate([quads.nodes, quads.nodes + n], axis=1)
        sets = {k: np.concatenate([v, v + n]) for k, v in flat.node_sets.items()}
        mesh = am.Mesh(points, (am.Cells("hex", nodes),), node_sets=sets)
    mesh = second_order(mesh) if order == 2 else mesh

    def inside(x):
        return (x[:, 0] > 1 + 1e-9) & (np.abs(x[:, 1]) < SLOT) & (x[:, 0] < 3 - 1e-9)

    return mesh.with_surfaces({
        "all": chosen(mesh, lambda x: np.ones(len(x), dtype=bool)),
        "slot": chosen(mesh, lambda x: inside(x + 1e-6)),
        "high": chosen(mesh, lambda x: inside(x) & (x[:, 1] > 0)),
        "low": chosen(mesh, lambda x: inside(x) & (x[:, 1] < 0)),
    })  # fmt: skip


def pressed(mesh, slave, master, mu=0.0, order=1):
    """Both arms loaded towards each other until the slot closes."""
    size = np.zeros(mesh.dim)
    size[1] = 10.0 / len(mesh.node_sets["up"])
    loads = [am.NodalForce("up", tuple(-size)), am.NodalForce("down", tuple(size))]
    return am.Model([am.Body(mesh, NEO, name="fork")], [am.Fix("left", 0)],
                    [am.Contact(slave, master=master, mu=mu)], loads)  # fmt: skip


@pytest.mark.parametrize(("dim", "order"), [(2, 1), (2, 2), (3, 1)])
def test_a_slot_closes_as_with_two_surfaces(dim, order):
    """Its outline against itself, beside its two sides given by hand.

    The whole outside has other normals at the ends of the arms, which go on round the corner.
    """
    mesh = slotted(dim, order)
    every = [am.solve(pressed(mesh, *sides), tolerance=1e-11)
             for sides in (("high", "low"), ("slot", "slot"), ("all", "all"))]  # fmt: skip
    assert every[0].pressure.max() > 1
    moved = [np.asarray(one.displacement[0]) for one in every]
    np.testing.assert_allclose(moved[0], moved[1], atol=1e-9)
    np.testing.assert_allclose(moved[0], moved[2], atol=0.02)


def test_sides_of_an_outside():
    """What faces across the slot has two sides; nothing is seen through the beams."""
    mesh = slotted()
    skin = Skin.of(mesh.surface("all"), 0)
    fold = Fold.of(skin, mesh.points)
    centre = mesh.points[skin.nodes].mean(axis=1)
    slot = (np.abs(centre[:, 1]) < SLOT) & (centre[:, 0] > 1.01) & (centre[:, 0] < 2.99)
    upper = centre[:, 1] > 0
    assert len(set(fold.side[slot & upper])) == 1
    assert len(set(fold.side[slot])) == 2
    over, under = fold.halves
    one, other = fold.candidates(mesh.points)
    assert (slot[over[one]] & slot[under[other]]).all()
    assert set(over[one]) == set(np.flatnonzero(slot & (fold.side == 0)))


@pytest.mark.parametrize(
    ("count", "bend", "gap"), [(48, 0.8, 0.1), (64, 0.8, 0.1), (96, 1.2, 0.08)]
)
def test_what_is_all_but_in_contact_is_of_one_side_as_far_as_it_goes(count, bend, gap):
    """A ring crushed to two lobes: flanks of the neck see the lobes' far ends, too.

    These came before neighbours, so that sides in contact changed from step to step.
    """
    angle = 2 * np.pi * (np.arange(count) + 0.5) / count
    unit = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    i = np.arange(count)
    j = (i + 1) % count
    quads = am.Cells("quad", np.stack([i, i + count, j + count, j], axis=1))
    mesh = am.Mesh(np.concatenate([unit, 1.2 * unit]), (quads,))
    inner = mesh.boundary[0].nodes
    skin = Skin.of((Facets("line", inner[(inner < count).all(axis=1)]),), 0)
    wide = 1.3 * unit[:, 0]
    crushed = np.stack([wide, unit[:, 1] * (gap + bend * wide**2)], axis=1)
    there = np.roll(crushed, -1, axis=0) - np.roll(crushed, 1, axis=0)
    out = there[:, ::-1] * (1, -1) / np.linalg.norm(there, axis=1)[:, None]
    side = Fold.of(skin, mesh.points).at(np.concatenate([crushed, crushed + 0.1 * out])).side
    neck = np.abs(crushed[skin.nodes].mean(axis=1)[:, 0]) < 0.35
    upper = unit[skin.nodes].mean(axis=1)[:, 1] > 0
    assert len(set(side[neck & upper])) == 1
    assert set(side[neck & ~upper]) == {1 - side[neck & upper][0]}


def told(step):
    """Warnings about masters inside the slave."""
    return [w.message for w in step.warnings if w.name == "master-inside-slave"]


def test_a_folded_beam_is_as_with_two_surfaces():
    """Arms of a hairpin, pressed together and pulled along each other.

    The low one's end is held: its last facet would have one average alone as a slave, and the
    other's tip go through it, with .4 of the force.
    """
    def along(x, t):
        return 0.4 * max(t - 1, 0)

    def down(x, t):
        return -0.42 * min(t, 1)

    body = am.Body(hairpin(), am.NeoHookean(1.0, 0.3), name="beam")
    supports = [am.Fix("left", 0), am.Fix("press", (along, down))]
    found = []
    for sides in (("beam.top", "beam.top"), ("high", "low"), ("low", "high")):
        model = am.Model([body], supports, [am.Contact(sides[0], master=sides[1], mu=0.3)])
        until = 0.8 if sides[0] == "low" else 1.4
        steps = list(am.evolve(model, am.QuasiStatic(0.2), until=until, tolerance=1e-11))
        assert [bool(told(step)) for step in steps] == [sides[0] == "low" and step is steps[-1]
                                                        for step in steps]  # fmt: skip
        if until < 1:
            assert "carry no contact force, as where supports hold them" in told(steps[-1])[0]
            continue
        found.append([np.sum(step.supports["press"].force[:2], axis=0) for step in steps])
        assert steps[-1].state.force[:, 0].max() > 1e-3
    np.testing.assert_allclose(found[0], found[1], rtol=1e-7, atol=1e-10)


def test_an_end_that_goes_through_another_of_the_same_surface_is_told():
    """Both ends are held: whichever is the slave has no force there."""
    body = am.Body(hairpin(), am.NeoHookean(1.0, 0.3), name="beam")
    supports = [am.Fix("left", 0), am.Fix("right", (0, -0.5))]
    contact = am.Contact("beam.top", master="beam.top", mu=0.3)
    (message,) = told(am.solve(am.Model([body], supports, [contact])))
    assert "up to 0.156" in message
    assert message.endswith("refine 'beam.top' there")


@pytest.mark.parametrize("of", [hairpin, slotted, lambda: slotted(3), lambda: slotted(3, 2)])
def test_the_tangent_is_exact(of):
    """In space the slot's root and the arms' ends are seen edge-on; sides share middles."""
    mesh = of()
    name = "top" if "press" in mesh.surfaces else "all"
    model = am.Model([am.Body(mesh, NEO)], [am.Fix("left", 0)],
                     [am.Contact(name, master=name, mu=0.3)])  # fmt: skip
    dofs = large_deformation(model).parts.X.size
    rng = np.random.default_rng(3)
    before = 0.004 * rng.standard_normal(dofs)
    problem = large_step(model, np.zeros(dofs), np.zeros(dofs), before)
    # couples across a gap of six facets bend fast, as what fades does: by fourth order
    draws = (rng.standard_normal((2, problem.unknowns)) * [[0.004], [0.008]]
             for _ in range(6 if mesh.dim == 2 else 3))  # fmt: skip
    assert checked_tangents(problem, draws, FOURTH) >= (4 if mesh.dim == 2 else 2)
