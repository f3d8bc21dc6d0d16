"""Two bodies that slide far: rotations, symmetry, edges, three dimensions, steps."""

from dataclasses import replace

import numpy as np
import pytest
from tangent_checker import checked_tangents

import amontons as am
from amontons.mechanics.model.large_deformation import large_deformation, large_step

NEO = am.NeoHookean(1.0, 0.3)


def pair(sides, mu):
    return am.Contact(sides[0], master=sides[1], mu=mu, kinematics="finite")


def spread(step):
    """Contact forces (nodes, d) on all nodes of a step's model, and where they are."""
    parts = large_deformation(step.model).parts
    moved = step.state.displacement.reshape(parts.X.shape)
    forces = parts.meet(moved).columns(step.frames) @ step.state.force.ravel()
    return parts.X + moved, forces.reshape(parts.X.shape)


# ------------------------------------------------------------------------ rotations
def turning(angle, shift):
    """Two blocks pressed and sheared until t = 1, then both ends turned until t = 2."""
    lower = am.Body(am.box((2, 1), (5, 2), origin=(-1, -1)), NEO, name="lower")
    upper = am.Body(am.box((1, 1), (3, 2), origin=(-0.4, 0)), NEO, name="upper")

    def moved(where, shift):
        def component(c):
            def value(x, t):
                a, load = angle * max(t - 1, 0), min(t, 1)
                at = np.asarray(x) + load * np.asarray(shift)
                turn = np.array([[np.cos(a), -np.sin(a)], [np.sin(a), np.cos(a)]])
                return float((turn @ at)[c] - x[c])

            return value

        return am.Fix(where, (component(0), component(1)))

    return am.Model([lower, upper], [moved("lower.bottom", (0, 0)),
                                     moved("upper.top", (shift, -0.15))],
                    contacts=[pair(("upper.bottom", "lower.top"), 0.3)])  # fmt: skip


@pytest.mark.parametrize(("angle", "shift", "status"), [(0.8, 0.1, 2), (-2.0, 0.35, 1)])
def test_a_rotation_of_everything_changes_nothing(angle, shift, status):
    """Neither where all nodes stick nor where all have slid."""
    model = turning(angle, shift)
    steps = list(am.evolve(model, am.QuasiStatic(0.25), until=2.0, tolerance=1e-12))
    before = next(s for s in steps if abs(s.state.time - 1) < 1e-9)
    assert {int(k) for k in before.solution.status} == {status}
    for step in steps[-4:]:
        assert np.abs(step.state.force - before.state.force).max() < 1e-10
        assert np.abs(step.solution.u).max() < 1e-10
        turned = [s.frames[:, 0] for s in (before, step)]
        a = angle * (step.state.time - 1)
        turn = np.array([[np.cos(a), -np.sin(a)], [np.sin(a), np.cos(a)]])
        assert np.abs(turned[0] @ turn.T - turned[1]).max() < 1e-10


# ------------------------------------------------------------------------- symmetry
def half_round(cells, name, down=True, radius=1.0):
    """A block of width and height 1 with a round end, down at y = 0 or up."""
    mesh = am.box((1.0, 1.0), cells)
    x, y = mesh.points[:, 0] - 0.5, mesh.points[:, 1]
    y = y + (radius - np.sqrt(radius**2 - x**2)) * (1 - y)
    points = np.stack([x, y], axis=1)
    if not down:  # half a turn keeps the orientation
        points = -points
    return am.Body(replace(mesh, points=points), NEO, name=name)


def test_two_like_bodies_meet_as_one_meets_a_plane():
    """A round end at 25 % compression against its mirror image, and against a rigid plane."""
    one = half_round((12, 8), "one")
    plane = am.solve(am.Model([one], [am.Fix("top", (0, -0.25))],
                              [am.Contact("bottom", am.Plane((0, 1)), mu=0)]),
                     tolerance=1e-11)  # fmt: skip
    other = half_round((12, 8), "other", down=False)
    both = am.solve(am.Model([one, other],
                             [am.Fix("one.top", (0, -0.25)), am.Fix("other.top", (0, 0.25))],
                             [pair(("one.bottom", "other.bottom"), 0)]),
                    tolerance=1e-11)  # fmt: skip
    assert (plane.force[:, 1] > 0).sum() >= 7
    assert np.abs(both.force - plane.force).max() < 1e-9
    moved = both.displacement[0] - plane.displacement[0]
    assert np.abs(moved).max() < 1e-9


def test_forces_do_not_depend_on_the_mesh_of_the_other_side():
    """The same with other meshes: the force is that against the plane, up to the mesh."""
    one = half_round((12, 8), "one")
    plane = am.solve(am.Model([one], [am.Fix("top", (0, -0.25))],
                              [am.Contact("bottom", am.Plane((0, 1)), mu=0.0)]))  # fmt: skip
    other = half_round((17, 11), "other", down=False)
    found = []
    for sides in (("one.bottom", "other.bottom"), ("other.bottom", "one.bottom")):
        both = am.solve(am.Model([one, other], [am.Fix("one.top", (0, -0.25)),
                                                am.Fix("other.top", (0, 0.25))],
                                 [pair(sides, 0.0)]))  # fmt: skip
        found.append(abs(both.force[:, 1].sum()))
    wanted = plane.force[:, 1].sum()
    assert np.abs(np.array(found) / wanted - 1).max() < 0.01
    assert abs(found[0] / found[1] - 1) < 0.005


# ---------------------------------------------------------------------------- edges
@pytest.mark.parametrize("swap", [False, True])
def test_a_body_leaves_the_edge_of_the_other_and_comes_back(swap):
    """A block pushed off a shelf, past its end, and back onto it; forces balance."""
    lower = am.Body(am.box((1.5, 0.5), (9, 3), origin=(-0.5, -0.5)), NEO, name="lower")
    upper = am.Body(am.box((1, 0.5), (5, 2)), NEO, name="upper")
    sides = ("upper.bottom", "lower.top")[:: -1 if swap else 1]

    def along(x, t):
        return 0.0 if t < 1 else 1.3 * (t - 1) if t < 2 else 1.3 * (3 - t)

    def down(x, t):
        return -0.02 * min(t, 1)

    model = am.Model([lower, upper],
                     [am.Fix("lower.bottom", 0), am.Fix("upper.top", (along, down))],
                     contacts=[pair(sides, 0.2)])  # fmt: skip
    closed, forces = [], []
    for step in am.evolve(model, am.QuasiStatic(0.1), until=3.0):
        assert step.solution.converged
        x, pushed = spread(step)
        size = np.abs(pushed).sum() + 1e-12
        assert np.abs(pushed.sum(axis=0)).max() < 1e-12 * size
        normal = step.state.force[:, 0]  # slivers beside the edge bear next to nothing
        closed.append(int((normal > 1e-3 * normal.max(initial=1e-9)).sum()))
        first = len(lower.mesh.points)
        forces.append(pushed[first:].sum(axis=0))
    forces = np.array(forces)
    assert closed[9] > 0
    assert closed[19] == 0
    assert closed[-1] == closed[9]
    assert abs(forces[-1, 1] / forces[9, 1] - 1) < 0.2
    assert (forces[:, 1] >= 0).all()


# --------------------------------------------------------------------------- in 3D
def boxes(kinds, *, swap=False, mu=0.3, top=0):
    """A cube on a wider slab, whose bottom is held."""
    lower = am.Body(am.box((2, 2, 1), (3, 3, 1), kind=kinds[0], origin=(-0.5, -0.5, -1)), NEO,
                    name="lower")  # fmt: skip
    upper = am.Body(am.box((1, 1, 1), 2, kind=kinds[1]), NEO, name="upper")
    sides = ("upper.bottom", "lower.top")[:: -1 if swap else 1]
    return am.Model([lower, upper], [am.Fix("lower.bottom", 0), am.Fix("upper.top", top)],
                    contacts=[pair(sides, mu)])  # fmt: skip


@pytest.mark.parametrize("swap", [False, True])
@pytest.mark.parametrize("kinds", [("hex", "hex"), ("tet", "hex"), ("hex", "tet")])
def test_the_tangent_is_exact_in_3d(kinds, swap):
    model = boxes(kinds, swap=swap)
    rng = np.random.default_rng(3)
    dofs = large_deformation(model).parts.X.size
    before = 0.02 * rng.standard_normal(dofs)
    problem = large_step(model, np.zeros(dofs), np.zeros(dofs), before)
    draws = (rng.standard_normal((2, problem.unknowns)) * [[0.03], [1.0]] for _ in range(10))
    assert checked_tangents(problem, draws) > 7


@pytest.mark.parametrize("swap", [False, True])
@pytest.mark.parametrize("kinds", [("hex", "hex"), ("tet", "hex"), ("tet", "tet")])
def test_patch_in_3d(kinds, swap):
    lower = am.Body(am.box((1, 1, 1), (3, 3, 2), origin=(0, 0, -1), kind=kinds[0]), NEO,
                    name="lower")  # fmt: skip
    upper = am.Body(am.box((1, 1, 1), 2, kind=kinds[1]), NEO, name="upper")
    supports = [am.Fix("lower.bottom", (None, None, 0)),
                am.Fix("upper.top", (None, None, -0.6))]  # fmt: skip
    for name in ("lower", "upper"):
        supports += [am.Fix(f"{name}.left", (0, None, None)),
                     am.Fix(f"{name}.front", (None, 0, None))]  # fmt: skip
    sides = ("upper.bottom", "lower.top")[:: -1 if swap else 1]
    model = am.Model([lower, upper], supports, contacts=[pair(sides, 0.0)])
    solution = am.solve(model, tolerance=1e-12)
    for body, moved in zip(model.bodies, solution.displacement, strict=True):
        basis = np.c_[body.mesh.points, np.ones(len(body.mesh.points))]
        fit = np.linalg.lstsq(basis, moved, rcond=None)[0]
        assert np.abs(basis @ fit - moved).max() < 1e-10
    assert np.ptp(solution.pressure) < 1e-10


def uneven(mesh, seed):
    """The mesh with its nodes moved by a fifth of a cell, those of sides along them."""
    rng, x = np.random.default_rng(seed), mesh.points.copy()
    low, high = x.min(axis=0), x.max(axis=0)
    for k in range(3):
        inner = (x[:, k] > low[k] + 1e-9) & (x[:, k] < high[k] - 1e-9)
        x[inner, k] += 0.1 * rng.uniform(-1, 1, inner.sum())
    return replace(mesh, points=x)


@pytest.mark.parametrize(("kinds", "orders", "swap", "seed"), [
    (("hex", "hex"), (1, 1), False, 1), (("tet", "hex"), (1, 1), True, 2),
    (("hex", "hex"), (1, 2), True, 3), (("hex", "tet"), (2, 2), True, 2),
])  # fmt: skip
def test_patch_with_friction_on_uneven_meshes(kinds, orders, swap, seed):
    """Quadrilaterals that are no parallelograms: one stretch and one pressure all the same."""
    bodies, supports = [], [am.Fix("lower.bottom", (None, None, 0)),
                            am.Fix("upper.top", (None, None, -0.6))]  # fmt: skip
    for name, cells, kind, order, z in zip(("lower", "upper"), ((3, 3, 1), (2, 2, 1)), kinds,
                                           orders, (-1, 0), strict=True):  # fmt: skip
        mesh = uneven(am.box((1, 1, 1), cells, origin=(0, 0, z), kind=kind), seed - 10 * z)
        bodies.append(am.Body(mesh, NEO, name=name, order=order))
        supports += [am.Fix(f"{name}.left", (0, None, None)),
                     am.Fix(f"{name}.front", (None, 0, None))]  # fmt: skip
    sides = ("upper.bottom", "lower.top")[:: -1 if swap else 1]
    model = am.Model(bodies, supports, contacts=[pair(sides, 0.3)])
    solution = am.solve(model, tolerance=1e-10)
    for body, moved in zip(model.bodies, solution.displacement, strict=True):
        basis = np.c_[body.mesh.points, np.ones(len(body.mesh.points))]
        fit = np.linalg.lstsq(basis, moved, rcond=None)[0]
        assert np.abs(basis @ fit - moved).max() < 1e-10
    assert np.ptp(solution.pressure) < 1e-9
    assert np.abs(solution.shear).max() < 1e-9


def test_a_cube_dragged_over_a_slab():
    """All nodes slide, against their motion, with mu times what presses them."""

    def along(x, t):
        return 0.4 * max(t - 1, 0)

    model = boxes(("hex", "hex"), top=(along, 0, lambda x, t: -0.05 * min(t, 1)))
    steps = list(am.evolve(model, am.QuasiStatic(0.25), until=2.5))
    r, u = steps[-1].state.force, steps[-1].solution.u
    assert (r[:, 0] > 0).sum() >= 6
    np.testing.assert_allclose(np.linalg.norm(r[:, 1:], axis=1), 0.3 * r[:, 0], atol=1e-9)
    assert ((r[:, 1:] * u[:, 1:]).sum(axis=1) <= 0).all()
    force = np.einsum("pkc,pk->pc", steps[-1].frames, r).sum(axis=0)
    assert abs(force[1]) < 1e-8 * force[2]
    assert force[0] < -0.25 * force[2]


# ------------------------------------------------------------------- sides of one slave
def test_a_side_of_the_slave_does_not_see_the_master_through_its_body():
    """Top and side of a block as the slave: a die on top has nothing to do with the side."""
    upper = am.Body(am.box((0.6, 0.5), (3, 2), origin=(0.5, 1.0)), NEO, name="upper")
    mesh = am.box((2, 1), (8, 4))
    (top,), (side,) = mesh.surface("top"), mesh.surface("left")
    both = (replace(top, nodes=np.concatenate([top.nodes, side.nodes])),)
    mesh = mesh.with_surfaces({"both": both})
    force = []
    for name in ("top", "both"):
        model = am.Model([am.Body(mesh, NEO, name="lower"), upper],
                         [am.Fix("lower.bottom", 0), am.Fix("upper.top", (0.0, -0.04))],
                         contacts=[pair((f"lower.{name}", "upper.bottom"), 0.3)])  # fmt: skip
        (step,) = am.evolve(model, am.QuasiStatic(1.0), until=1.0)
        force.append(spread(step)[1])
    assert np.abs(force[1] - force[0]).max() < 1e-8 * np.abs(force[0]).max()


def outlined(mesh):
    """The mesh with a surface of bottom and both sides."""
    sides = [mesh.surface(name)[0] for name in ("left", "bottom", "right")]
    outline = replace(sides[0], nodes=np.concatenate([side.nodes for side in sides]))
    return mesh.with_surfaces({"outline": (outline,)})


@pytest.mark.parametrize(("dim", "tilt"), [(2, 0.02), (2, 0.5), (3, 0.02),
                                           (2, -0.02), (2, -0.15), (3, -0.15)])  # fmt: skip
def test_a_side_of_the_slave_does_not_touch_a_master_edge_on_beyond_its_end(dim, tilt):
    """A block beside a slab: its far side saw one that rises, its near side one that falls."""
    up, rest = np.eye(dim)[-1], (1,) * (dim - 2)
    below = am.box((1, *rest, 0.5), (4, *rest, 2))
    rising = below.points + np.outer(tilt * below.points[:, 0] * below.points[:, -1], 2 * up)
    at = (1.1 if tilt > 0 else 1.4, *[0] * (dim - 2), 0.3)
    mesh = am.box((0.4, *rest, 0.8), (1, *rest, 2), origin=at)
    bodies = [am.Body(replace(below, points=rising), NEO, name="lower"),
              am.Body(outlined(mesh), NEO, name="upper")]
    held = [am.Fix("lower.bottom", 0), am.Fix("upper.top", tuple(-0.02 * up))]
    contact = pair(("upper.outline", "lower.top"), 0.3)
    solution = am.solve(am.Model(bodies, held, contacts=[contact]))
    assert solution.converged
    assert not np.ravel(solution.resultant).any()


@pytest.mark.parametrize("swap", [False, True])
def test_sides_of_a_block_that_is_pressed_bear_nothing(swap):
    """They see the slab edge-on: forces were .9 % off, with the slab's side as slave 17 %."""
    below, force = am.box((2, 1), (10, 3), origin=(-0.5, -1)), []
    for name in ("bottom", "outline"):
        bodies = [am.Body(below, NEO, name="lower"),
                  am.Body(outlined(am.box((1, 1), (4, 3))), NEO, name="upper")]
        sides = (f"upper.{name}", "lower.top")[:: -1 if swap else 1]
        held = [am.Fix("lower.bottom", 0), am.Fix("upper.top", (0, -0.05))]
        solution = am.solve(am.Model(bodies, held, contacts=[pair(sides, 0.3)]))
        force.append(np.abs(np.ravel(solution.resultant)[-1]))
    assert force[1] == pytest.approx(force[0], rel=3e-3)


def test_little_force_on_a_side_beside_the_contact_is_not_left_out():
    """4e-8 of all, beside a real one, of a sliver a gap away: the balance is told with it."""
    below = am.Body(am.box((2, 1), (10, 3), origin=(-0.5, -1), kind="tri"), NEO, name="lower",
                    order=2)  # fmt: skip
    mesh = outlined(am.box((1, 1), (4, 3), kind="tri"))
    held = [am.Fix("lower.bottom", 0), am.Fix("upper.top", (0, lambda x, t: -0.05 * t))]
    model = am.Model([below, am.Body(mesh, NEO, name="upper", order=2)], held,
                     contacts=[pair(("upper.outline", "lower.top"), 0.3)])  # fmt: skip
    steps = am.evolve(model, am.QuasiStatic(0.25), until=0.5)
    assert max(step.solution.convergence.error for step in steps) < 1e-8


@pytest.mark.parametrize("swap", [False, True])
@pytest.mark.parametrize("dim", [2, 3])
def test_the_tangent_is_exact_where_sides_lean_over(dim, swap):
    """Some of their facets are hardly opposite the slab."""
    deep = (1,) * (dim - 2)
    mesh = am.box((1, *deep, 0.6), (2, *deep, 2), origin=(0.3, *[0] * (dim - 2), 0.01))
    moved = mesh.points.copy()
    moved[:, 0] += 0.8 * (moved[:, 0] - 0.8) * moved[:, -1]
    below = am.box((1.6, *deep, 0.5), (5, *deep, 1), origin=(0, *[0] * (dim - 2), -0.5))
    bodies = [am.Body(below, NEO, name="lower"),
              am.Body(outlined(replace(mesh, points=moved)), NEO, name="upper")]  # fmt: skip
    sides = ("upper.outline", "lower.top")[:: -1 if swap else 1]
    model = am.Model(bodies, [am.Fix("lower.bottom", 0), am.Fix("upper.top", 0)],
                     contacts=[pair(sides, 0.3)])  # fmt: skip
    rng, parts = np.random.default_rng(3), large_deformation(model).parts
    problem = large_step(model, *np.zeros((2, parts.X.size)),
                         0.02 * rng.standard_normal(parts.X.size))  # fmt: skip
    seen = parts.meet(np.zeros(parts.X.shape)).parts[0].shared.opposed
    assert ((seen > 0) & (seen < 1)).sum() > 1
    draws = (rng.standard_normal((2, problem.unknowns)) * [[0.02], [1.0]] for _ in range(10))
    assert checked_tangents(problem, draws) > 6


# --------------------------------------------------------------- a slave wider than the master
def test_a_slave_of_second_order_wider_than_the_master_sticks_in_a_few_steps():
    """Bulges were extrapolated beyond the master's rim: 46 steps, or no state at all."""
    below = am.box((1, 1, 0.5), (3, 3, 1), origin=(-0.5, -0.5, -0.5))
    above = am.box((0.6, 0.6, 0.5), (2, 2, 1), origin=(-0.3, -0.3, 0))
    bodies = [am.Body(below, NEO, name="below", order=2),
              am.Body(above, am.NeoHookean(4.0, 0.3), name="above", order=2)]  # fmt: skip
    pressed = am.Fix("above.top", (0, 0, lambda x, t: -0.05 * t))
    model = am.Model(bodies, [am.Fix("below.bottom", 0), pressed],
                     contacts=[pair(("below.top", "above.bottom"), 0.2)])  # fmt: skip
    steps = list(am.evolve(model, am.QuasiStatic(0.25), until=1.0))
    assert len(steps) == 4
    assert max(step.solution.convergence.iterations for step in steps) <= 4
