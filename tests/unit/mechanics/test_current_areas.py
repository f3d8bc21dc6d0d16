"""Stresses of contact laws, and those that are told, are of the area of now that is faced.

CalculiX 2.20, surface to surface with NLGEOM, gives the same resultants for these slabs and
blocks as hexahedra: overclosure times stiffness times the area, to all its digits.  Its CPRESS
is overclosure times stiffness, also at nodes that are faced by half, CSHEAR1 slip times stick
slope, and the area that it prints (CF) the one of now.
"""

from dataclasses import replace

import numpy as np
import pytest
from tangent_checker import checked_tangents

import amontons as am
from amontons.mechanics.model.large_deformation import large_deformation, large_step

RIGID, SOFT = am.NeoHookean(1e5, 0.0), am.NeoHookean(1.0, 0.3)  # beside springs of contacts
DEEP, SLID, TAU = 1e-3, 4e-4, 1e-5
K, SLOPE = 2.0, 3.0
CURVE = am.OverclosureCurve([0.0, K * DEEP / 2, K * DEEP], [0.0, DEEP / 4, DEEP])
SPRINGS = {"mu": 0.9, "stiffness": K, "stick_stiffness": SLOPE}


def wider(x, t):
    """Twice as long until 1."""
    return x[0] * min(t, 1.0)


def down(x, t):
    """From .1 above, after 1."""
    return -(0.1 + DEEP) * min(max(t - 1.0, 0.0), 1.0)


def along(x, t):
    """After 2."""
    return SLID * max(t - 2.0, 0.0)


def pressed(dim, first, last, **law):
    """Forces on a slab of length 2 made twice as long, under a block from first to last."""
    wide = (1.0,) * (dim - 2)
    slab = am.box((2, *wide, 1), (4, *(1,) * (dim - 1)), origin=(0,) * (dim - 1) + (-1,))
    above = (first, *(-0.5,) * (dim - 2), 0.1)
    block = am.box((last - first, *(2.0,) * (dim - 2), 1), (1,) * dim, origin=above)
    free = (None,) * (dim - 2)
    supports = [am.Fix("lower.bottom", (None, *free, 0)),
                am.Fix("upper.top", (along, *(0,) * (dim - 2), down))]  # fmt: skip
    supports += [am.Fix(f"lower.{side}", (wider, *free, None)) for side in ("left", "right")]
    supports += [am.Fix("lower.front", (None, 0, None))] if dim == 3 else []
    contact = am.Contact("lower.top", master="upper.bottom", **law)
    bodies = [am.Body(slab, RIGID, name="lower"), am.Body(block, RIGID, name="upper")]
    model = am.Model(bodies, supports, [contact])
    *_, step = am.evolve(model, am.QuasiStatic(1.0), until=3.0)
    assert step.solution.converged
    return step


@pytest.mark.parametrize(("dim", "first", "last", "area"), [
    (2, -0.5, 4.5, 4.0), (2, 3.0, 5.2, 1.0 - SLID), (3, 1.1, 2.3, 1.2)
])  # fmt: skip
def test_springs_are_those_of_the_area_that_is_faced(dim, first, last, area):
    """All of the slab, an end of it, and a part in the middle of facets, where a node fades.

    Nodes of the ends are held along it, and supports take the shear there.
    """
    step = pressed(dim, first, last, **SPRINGS)
    force = step.fields.resultant
    np.testing.assert_allclose(force[-1], -K * DEEP * area, rtol=2e-4)
    np.testing.assert_allclose(force[0], SLOPE * SLID * area, rtol=2e-3)
    fields, (pair,) = step.fields, step.pairs.values()
    touches = fields.status > 0
    np.testing.assert_allclose(fields.pressure[touches], K * DEEP, rtol=2e-4)
    free = touches & (abs(fields.shear).max(axis=1) > 1e-5)  # not held along the surface
    size = np.linalg.norm(fields.shear[free], axis=1)
    np.testing.assert_allclose(size, SLOPE * SLID, rtol=2e-3)
    np.testing.assert_allclose(pair.area, area, rtol=2e-4)
    np.testing.assert_allclose(pair.largest_pressure, K * DEEP, rtol=2e-4)


def test_curves_are_those_of_the_area_that_is_faced():
    force = pressed(2, 3.0, 5.2, mu=0.0, stiffness=CURVE).fields.resultant
    np.testing.assert_allclose(force[-1], -K * DEEP * (1 - SLID), rtol=1e-4)


def dragged(first, last, **law):
    """A block that ends within facets of a slab, pressed until 1 and dragged until 1.5."""
    slab = am.box((4, 1), (4, 1), origin=(0, -1))
    block = am.box((last - first, 1), (1, 1), origin=(first, 0.0))
    stiff = am.NeoHookean(1e5, 0.0, density=1e-5)
    contact = am.Contact("lower.top", master="upper.bottom", **law)
    top = (lambda x, t: SLID * np.clip(t - 1, 0, 0.5) / 0.5, lambda x, t: -DEEP * min(t, 1.0))
    bodies = [am.Body(slab, stiff, name="lower"), am.Body(block, stiff, name="upper")]
    held = [am.Fix("lower.bottom", (0, 0)), am.Fix("upper.top", top)]
    return am.Model(bodies, held, [contact])


PRESSED = am.Fix("upper.top", (0, -DEEP))
GIVEN = {"tresca": 0.1, "stiffness": K, "stick_stiffness": SLOPE}
INERTIA = am.MoreauJean(0.1, mass_damping=10.0)


@pytest.mark.parametrize(("first", "last", "method", "law"), [
    (1.1, 2.3, am.QuasiStatic(0.5), GIVEN), (1.97, 3.2, am.QuasiStatic(0.5), GIVEN),
    (1.1, 2.3, INERTIA, SPRINGS), (1.97, 3.2, INERTIA, GIVEN),
    (1.1, 2.3, INERTIA, {**SPRINGS, "stiffness": CURVE})])  # fmt: skip
def test_springs_are_those_of_all_that_neighbours_of_dropped_nodes_bear(
    first, last, method, law
):
    """The share of a node that dropped out is their area; it does not stiffen springs."""
    *_, step = am.evolve(dragged(first, last, **law), method, until=1.7)
    fields, (pair,), area = step.fields, step.pairs.values(), last - first
    np.testing.assert_allclose(fields.resultant[1], -K * DEEP * area, rtol=1e-4)
    np.testing.assert_allclose(fields.resultant[0], SLOPE * SLID * area, rtol=1e-3)
    touches = fields.status > 0
    np.testing.assert_allclose(fields.pressure[touches], K * DEEP, rtol=1e-4)
    np.testing.assert_allclose(abs(fields.force[:, 1]), fields.areas * fields.pressure,
                               rtol=1e-3, atol=1e-9)  # fmt: skip
    assert pair.area == pytest.approx(area, rel=1e-6)


def test_springs_are_those_of_all_that_neighbours_of_held_nodes_bear():
    """Nodes that supports hold have no force of their own, whatever the law."""
    model = dragged(-0.5, 4.5, mu=0.0, stiffness=K)
    ends = [am.Fix(f"lower.{side}", (0, 0)) for side in ("left", "right")]
    found = am.solve(replace(model, supports=(model.supports[0], *ends, PRESSED)))
    assert found.resultant.ravel()[1] == pytest.approx(-4 * K * DEEP, rel=1e-4)
    np.testing.assert_allclose(found.pressure, K * DEEP, rtol=1e-4)


@pytest.mark.parametrize(("dim", "order", "kind"), [(2, 1, None), (2, 2, None), (3, 1, "tet")])
def test_tangents_where_nodes_drop_out_are_exact(dim, order, kind):
    """A block over the middle of facets, under a given bound and on springs."""
    wide, mid, rng = (1,) * (dim - 2), (0,) * (dim - 2), np.random.default_rng(3)
    slab = am.box((2, *wide, 1), (4, *(2,) * (dim - 1)), origin=(0, *mid, -1), kind=kind)
    block = am.box((0.6, *(0.6,) * (dim - 2), 0.5), (2, *(2,) * (dim - 2), 1),
                   origin=(0.55, *(0.35,) * (dim - 2), -0.02))  # fmt: skip
    bodies = [am.Body(slab, SOFT, name="lower", order=order),
              am.Body(block, SOFT, name="upper", order=order)]  # fmt: skip
    contact = am.Contact("lower.top", master="upper.bottom", tresca=0.01, stiffness=1.0)
    held = [am.Fix("lower.bottom", 0), am.Fix("upper.top", 0)]
    model = am.Model(bodies, held, [contact])
    parts = large_deformation(model).parts
    before = 0.01 * rng.standard_normal(parts.X.size)
    assert parts.meet(before.reshape(parts.X.shape)).passed.max() > 1.05
    problem = large_step(model, np.zeros(parts.X.size), np.zeros(parts.X.size), before)
    draws = (rng.standard_normal((2, problem.unknowns)) * [[0.01], [1.0]] for _ in range(3))
    assert checked_tangents(problem, draws) > 1


def test_a_node_that_drops_out_leaves_its_area_and_no_energy_to_account_for():
    """What springs of its neighbours store on it; it was booked as brought, and as rubbed."""
    stiff = am.NeoHookean(1e3, 0.0, density=1e-3)
    slab, block = am.box((2, 1), (4, 1), origin=(0, -1)), am.box((1.2, 1), 3, origin=(0.5, 0))
    bodies = [am.Body(slab, stiff, name="lower"), am.Body(block, stiff, name="upper")]
    top = (lambda x, t: 2 * np.clip(t - 0.1, 0, 0.2), lambda x, t: -0.02 * min(t / 0.1, 1.0))
    contact = am.Contact("lower.top", master="upper.bottom", mu=0.1, stiffness=100.0,
                         stick_stiffness=100.0)  # fmt: skip
    held = [am.Fix("lower.bottom", 0), am.Fix("upper.top", top)]
    model, method = am.Model(bodies, held, [contact]), am.MoreauJean(0.05, mass_damping=5.0)
    steps = list(am.evolve(model, method, until=0.3))
    peak = max(step.energies.total for step in steps)
    assert [np.count_nonzero(step.state.force[:, 0]) for step in steps[-2:]] == [4, 3]
    assert abs(steps[-1].energies.numerical) < 0.02 * peak
    slid, normal = 0.1, 2.0
    assert steps[-1].energies.contact == pytest.approx(-0.1 * normal * slid, rel=0.1)
    assert abs(steps[-1].energies.defect) < 1e-10 * peak


@pytest.mark.parametrize(("first", "last", "law"), [(1.1, 2.3, SPRINGS), (1.97, 3.2, GIVEN)])
def test_springs_keep_their_stresses_where_inertia_ends(first, last, law):
    """A node that had dropped out, and its neighbours, go on without a jump."""
    model = dragged(first, last, **law)
    *_, moving = am.evolve(model, INERTIA, until=1.7)
    *_, still = am.evolve(model, am.QuasiStatic(0.1), until=1.8, start=moving.state)
    np.testing.assert_allclose(still.fields.resultant, moving.fields.resultant, rtol=3e-4)


def floor(dim, order, **law):
    """A soft body on an obstacle."""
    mesh = am.box((1.0,) * dim, (2,) * dim)
    tilted = am.Plane((0.1,) * (dim - 1) + (1,), (0.0,) * dim)
    contact = am.Contact("bottom", tilted, **law)
    body = am.Body(mesh, SOFT, order=order)
    return am.Model([body], [am.Fix("top", 0)], [contact])


def test_a_stretched_body_stands_on_springs_of_its_area():
    """Twice as long on a plane that it overlaps."""
    slab = am.Body(am.box((2, 1), (4, 1)), RIGID)
    sides = [am.Fix(side, (lambda x: x[0], None)) for side in ("left", "right")]
    contact = am.Contact("bottom", am.Plane((0, 1), (0, DEEP)), mu=0.0, stiffness=K)
    found = am.solve(am.Model([slab], [*sides, am.Fix("top", (None, 0))], [contact]))
    assert found.resultant.ravel()[1] == pytest.approx(4 * K * DEEP, rel=2e-4)
    np.testing.assert_allclose(found.pressure, K * DEEP, rtol=2e-4)


@pytest.mark.parametrize("slave", ["slab", "block"])
@pytest.mark.parametrize("law", [{"mu": 0.9, "cap": TAU}, {"tresca": TAU}])
def test_a_bound_is_that_of_the_part_that_is_faced(slave, law):
    """A block of .2 that ends within facets of the slab, of which whole nodes have .4."""
    slab = am.box((1, 0.2), (10, 1), origin=(0, -0.2))
    block = am.box((0.2, 0.1), (2, 1), origin=(0.45, 0))
    bodies = [am.Body(slab, am.NeoHookean(1.0, 0.3), name="slab"),
              am.Body(block, am.NeoHookean(1.0, 0.3), name="block")]  # fmt: skip
    sides = ["slab.top", "block.bottom"][:: 1 if slave == "slab" else -1]
    contact = am.Contact(sides[0], master=sides[1], **law)
    push = am.Fix("block.top", (0.05, -2e-3))
    found = am.solve(am.Model(bodies, [am.Fix("slab.bottom", 0), push], [contact]))
    assert found.converged
    fields, (pair,) = found.fields, found.pairs.values()
    touches = fields.status > 0
    np.testing.assert_allclose(abs(fields.shear[touches, 0]), TAU, rtol=0.02)  # fading: a mean
    slid = (fields.areas * fields.shear[:, 0])[touches]
    np.testing.assert_allclose(abs(slid.sum()), TAU * 0.2, rtol=0.02)
    assert pair.area == pytest.approx(0.2, rel=0.02)


@pytest.mark.parametrize(("dim", "order", "law"), [
    (2, 1, SPRINGS), (2, 2, {"tresca": 0.01}), (3, 1, SPRINGS),
    (3, 2, {"mu": 0.3, "cap": 0.02, "cohesion": 0.01, "stiffness": 3.0})])  # fmt: skip
def test_tangents_in_front_of_obstacles_are_exact(dim, order, law):
    model, rng = floor(dim, order, **law), np.random.default_rng(7)
    dofs = large_deformation(model).parts.X.size
    before = 0.01 * rng.standard_normal(dofs)
    problem = large_step(model, np.zeros(dofs), np.zeros(dofs), before)
    draws = (rng.standard_normal((2, problem.unknowns)) * [[0.02], [1.0]] for _ in range(8))
    assert checked_tangents(problem, draws) > 2
