"""Ties of bodies in large deformations: patches, turns, bonds, one body in two pieces."""

from dataclasses import replace

import numpy as np
import pytest
from tangent_checker import checked_tangents

import amontons as am
from amontons.mechanics.model.large_deformation import large_deformation, large_step

NEO = am.NeoHookean(1.0, 0.3)
BOND = {"stiffness": 2.0, "stick_stiffness": 0.5}


def blocks(dim=2, *, order=1, cells=((3, 2), (2, 2)), kinds=(None, None), apart=0.0, **law):
    """A unit cube tied onto another, of meshes that do not match: (bodies, contact)."""
    down = (0,) * (dim - 1) + (-1,)
    bodies = []
    for n, kind, at, name in zip(cells, kinds, (down, (0,) * dim), ("lower", "upper"),
                                 strict=True):  # fmt: skip
        counts = n if dim == 2 else (n[0], n[0], n[1])
        mesh = am.box((1,) * dim, counts, origin=at, **({"kind": kind} if kind else {}))
        if name == "upper":
            mesh = replace(mesh, points=mesh.points + np.eye(dim)[-1] * apart)
        bodies.append(am.Body(mesh, NEO, name=name, order=order))
    law = law or {"tied": True}
    return bodies, am.Contact("upper.bottom", master="lower.top", **law)


def held_by(bodies, field):
    """All outer sides but those that are tied follow x + field(x)."""
    sides = ["left", "right", "top", "bottom"]
    sides += ["front", "back"] if bodies[0].mesh.dim == 3 else []
    return [am.Fix(f"{body.name}.{side}", field) for body in bodies for side in sides
            if (body.name, side) not in (("upper", "bottom"), ("lower", "top"))]  # fmt: skip


PATCHES = [(2, 1, (None, "tri")), (2, 2, (None, None)), (3, 1, ("tet", None)),
           (3, 2, ("tet", None))]  # fmt: skip


@pytest.mark.parametrize(("dim", "order", "kinds"), PATCHES)
def test_patch(dim, order, kinds):
    """A large shear and stretch of both: the same everywhere."""
    slope = 0.2 * np.eye(dim) - 0.1 * np.ones((dim, dim))
    slope[0, -1] = 0.3
    bodies, tie = blocks(dim, order=order, kinds=kinds)
    model = am.Model(bodies, held_by(bodies, lambda x: slope @ x), [tie])
    found = am.solve(model, tolerance=1e-12)
    for body, moved in zip(model.bodies, found.displacement, strict=True):
        np.testing.assert_allclose(moved, body.mesh.points @ slope.T, atol=1e-10)
    assert set(found.status) == {am.ContactStatus.STICK}


@pytest.mark.parametrize(("dim", "apart"), [(2, 0.0), (2, 0.1), (3, 0.05)])
def test_turning_everything_changes_no_force(dim, apart):
    """Pulled and sheared, then turned by 2 radians: the same forces on the slaves."""
    bodies, tie = blocks(dim, apart=apart)

    def moved(shift):
        def component(c):
            def value(x, t):
                angle, load = 2.0 * max(t - 1, 0), min(t, 1)
                turn = np.eye(dim)
                turn[:2, :2] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
                return float((turn @ (np.asarray(x) + load * np.asarray(shift)))[c] - x[c])

            return value

        return tuple(component(c) for c in range(dim))

    pulled = [0.1] * (dim - 1) + [0.1]
    model = am.Model(bodies, [am.Fix("lower.bottom", moved([0] * dim)),
                              am.Fix("upper.top", moved(pulled))], [tie])  # fmt: skip
    steps = list(am.evolve(model, am.QuasiStatic(0.25), until=2.0, tolerance=1e-12))
    before, after = steps[3], steps[-1]
    size = np.abs(before.state.force).max()
    lengths = [np.linalg.norm(step.state.force, axis=1) for step in (before, after)]
    np.testing.assert_allclose(lengths[0], lengths[1], atol=1e-9)
    assert size > 1e-3
    parts = large_deformation(model).parts
    for step in (before, after):  # neither a sum nor a moment of all forces
        x = parts.X + step.state.displacement.reshape(parts.X.shape)
        pushed = parts.meet(x - parts.X).columns(step.frames) @ step.state.force.ravel()
        pushed = pushed.reshape(parts.X.shape)
        assert np.abs(pushed.sum(axis=0)).max() < 1e-13
        moment = x.T @ pushed
        assert np.abs(moment - moment.T).max() < 1e-9


def test_a_bar_in_two_pieces_bends_as_one():
    """Meshes that match: large bending of a cantilever, cut across and along."""
    whole = am.Body(am.box((4, 0.5), (16, 2)), NEO, name="whole")
    bend = am.Fix("right", (-1.0, 1.5))
    single = am.solve(am.Model([whole], [am.Fix("left", 0), bend]))
    left = am.Body(am.box((2, 0.5), (8, 2)), NEO, name="a")
    right = am.Body(am.box((2, 0.5), (8, 2), origin=(2, 0)), NEO, name="b")
    held = [am.Fix("a.left", 0), am.Fix("b.right", (-1.0, 1.5))]
    both = am.solve(am.Model([left, right], held, [am.Contact("b.left", master="a.right",
                                                              tied=True)]))  # fmt: skip
    ends = [m.displacement[-1][np.abs(m.model.bodies[-1].mesh.points[:, 0] - 3) < 1e-9]
            for m in (single, both)]  # fmt: skip
    np.testing.assert_allclose(ends[0], ends[1], atol=1e-7)


def test_a_bond_gives_way_by_force_over_stiffness():
    """Pulled and sheared; then turned: by the traction on its own area over its stiffness."""
    bodies, tie = blocks(cells=((3, 2), (3, 2)), tied=True, stiffness=0.5, stick_stiffness=0.2)
    model = am.Model(bodies, [am.Fix("lower.bottom", 0), am.Fix("upper.top", (0.1, 0.2))],
                     [tie])  # fmt: skip
    found = am.solve(model, tolerance=1e-11)
    traction = found.r / model.discretisation.sites.weights[:, None]
    np.testing.assert_allclose(found.gap, -traction[:, 0] / 0.5, atol=1e-9)
    np.testing.assert_allclose(found.fields.slip, -traction[:, 1:] / 0.2, atol=1e-9)
    assert found.gap.max() > 0.01
    *_, last = am.evolve(model, am.QuasiStatic(0.5), until=1.0, tolerance=1e-11)
    np.testing.assert_allclose(last.state.force, found.r, atol=1e-8)
    assert abs(last.energies.defect) < 1e-3 * last.energies.turnover


@pytest.mark.parametrize(("first", "last", "longer"), [
    (0.0, 2.0, 1.5), (0.5, 1.5, 1.0), (0.55, 1.15, 1.0)])  # fmt: skip  # some drop out
def test_a_bond_acts_on_what_the_sides_share(first, last, longer):
    """Two slabs that are made longer, and a block on half of its last nodes."""
    stiff, long = am.NeoHookean(1e5, 0.0), last - first
    slab = am.box((2, 1), (4, 1), origin=(0, -1))
    block = am.box((long, 1), (3, 1), origin=(first, 0))
    bodies = [am.Body(slab, stiff, name="lower"), am.Body(block, stiff, name="upper")]
    sides = [f"{body}.{side}" for body in ("lower", "upper") for side in ("left", "right")]
    held = [am.Fix("lower.bottom", (None, 0)), am.Fix("upper.top", (None, 1e-3))]
    held += [am.Fix(side, (lambda x: (longer - 1) * x[0], None)) for side in sides]
    tie = am.Contact("lower.top", master="upper.bottom", tied=True, stiffness=2.0)
    found = am.solve(am.Model(bodies, held, [tie]))
    (pair,) = found.pairs.values()
    assert found.resultant.ravel()[1] == pytest.approx(2e-3 * long, rel=2e-4)
    assert pair.area == pytest.approx(longer * long, rel=2e-4)
    np.testing.assert_allclose(found.pressure, -2e-3 / longer, rtol=2e-4)


@pytest.mark.parametrize(("dim", "order", "kind", "first", "last"), [
    (2, 1, "quad", 0.0, 2.0), (2, 2, "tri", 0.55, 1.15), (3, 1, "hex", 0.55, 1.15)])
def test_a_bond_across_a_distance_has_its_stiffness(dim, order, kind, first, last):
    """Stiff slabs .05 apart: the slave's rows are told by its inner nodes, too."""
    stiff, wide, mid = am.NeoHookean(1e4, 0.0, density=1e-5), (1,) * (dim - 2), (0,) * (dim - 2)
    slab = am.box((2, *wide, 1), (4, *wide, 2), kind, origin=(0, *mid, -1))
    block = am.box((last - first, *wide, 1), (3, *wide, 1), kind, origin=(first, *mid, 0.05))
    bodies = [am.Body(mesh, stiff, name=name, order=order)
              for mesh, name in ((slab, "lower"), (block, "upper"))]  # fmt: skip
    top = (lambda x, t: min(4e-3 * t, 2e-3), *mid, lambda x, t: min(2e-3 * t, 1e-3))
    held = [am.Fix("lower.bottom", 0), am.Fix("upper.top", top)]
    tie = am.Contact("lower.top", master="upper.bottom", tied=True, **BOND)
    model, area = am.Model(bodies, held, [tie]), last - first
    for method in (am.QuasiStatic(1.0), am.MoreauJean(0.25, mass_damping=10.0)):
        *_, found = am.evolve(model, method, until=1.0)
        (pair,), total = found.pairs.values(), found.fields.resultant
        np.testing.assert_allclose(total[[0, -1]], [1e-3 * area, 2e-3 * area], rtol=1e-3)
        np.testing.assert_allclose(found.fields.pressure, -2e-3, rtol=1e-3)
        assert pair.area == pytest.approx(area, rel=1e-3)


@pytest.mark.parametrize(("dim", "order", "law"), [
    (2, 1, {"tied": True}), (3, 2, {"tied": True}),
    (2, 1, {"tied": True, "stiffness": 2.0, "stick_stiffness": 1.0}),
    (3, 1, {"tied": True, "stick_stiffness": 3.0}),
])  # fmt: skip
def test_tangents_are_exact(dim, order, law):
    bodies, tie = blocks(dim, order=order, apart=0.05, **law)
    model = am.Model(bodies, [am.Fix("lower.bottom", 0), am.Fix("upper.top", 0)], [tie])
    rng = np.random.default_rng(3)
    dofs = large_deformation(model).parts.X.size
    problem = large_step(model, np.zeros(dofs), np.zeros(dofs),
                         0.01 * rng.standard_normal(dofs))  # fmt: skip
    draws = (rng.standard_normal((2, problem.unknowns)) * [[0.02], [1.0]] for _ in range(4))
    assert checked_tangents(problem, draws) == 4


def test_a_tie_beside_contact_that_slides():
    """A sole tied under a block is dragged over a slab: one chain of nodes and pairs."""
    slab = am.Body(am.box((3, 1), (9, 3), origin=(-0.5, -1.25)), NEO, name="slab")
    sole = am.Body(am.box((1, 0.25), (5, 2), origin=(0, -0.25)), NEO, name="sole")
    block = am.Body(am.box((1, 1), (3, 3)), NEO, name="block")
    way = (lambda x, t: 0.6 * max(t - 1, 0), lambda x, t: -0.06 * min(t, 1))
    model = am.Model([slab, sole, block],
                     [am.Fix("slab.bottom", 0), am.Fix("block.top", way)],
                     [am.Contact("sole.bottom", master="slab.top", mu=0.3),
                      am.Contact("block.bottom", master="sole.top", tied=True)])  # fmt: skip
    *_, last = am.evolve(model, am.QuasiStatic(0.25), until=2.0)
    pairs = [np.asarray(last.resultant([k])) for k in (0, 1)]
    np.testing.assert_allclose(pairs[0], pairs[1], atol=1e-7)
    assert pairs[0][0] == pytest.approx(-0.3 * pairs[0][1], rel=0.1)


@pytest.mark.parametrize(("contact", "word"), [
    (am.Contact("upper.bottom", am.Plane((0, 1)), tied=True), "use Fix"),
    (am.Contact("upper.bottom", master="lower.bottom", tied=True), "in front of it"),
    (am.Contact("upper.bottom", master="upper.bottom", tied=True), "between two surfaces"),
])  # fmt: skip
def test_what_can_not_be_tied_is_said(contact, word):
    bodies, _ = blocks()
    with pytest.raises((am.UnsupportedForm, am.InvalidInput), match=word):
        am.solve(am.Model(bodies, [am.Fix("lower.left", 0), am.Fix("upper.top", 0)], [contact]))
