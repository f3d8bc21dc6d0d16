"""Two bodies that slide far, at worst: overlaps, folds, needles, nothing opposite, ends."""

from dataclasses import replace

import numpy as np
import pytest

import amontons as am
from amontons.core.clock import deadline_of
from amontons.mechanics.meshes import Facets
from amontons.mechanics.model.large_deformation import large_deformation
from amontons.mechanics.model.overlapping import overlap_at_start
from amontons.solvers.contract import Breakdown, Iterate, Target

NEO = am.NeoHookean(1.0, 0.3)


def bodies(dim=2, *, over=0.0, order=1, at=0.0):
    """A block on a wider slab, at height `over` and moved along by `at`."""
    if dim == 2:
        below, above = am.box((2, 1), (10, 3), origin=(-0.5, -1)), am.box((1, 1), (4, 3))
    else:
        below = am.box((2, 2, 1), (6, 6, 2), origin=(-0.5, -0.5, -1))
        above = am.box((1, 1, 1), (3, 3, 2))
    shift = np.zeros(dim)
    shift[0], shift[-1] = at, over
    above = replace(above, points=above.points + shift)
    return [am.Body(mesh, NEO, name=name, order=order)
            for mesh, name in ((below, "lower"), (above, "upper"))]  # fmt: skip


def model(parts, *supports, loads=(), contacts=None):
    """Both with the slab's bottom held."""
    pair = am.Contact("upper.bottom", master="lower.top", mu=0.3)
    held = [am.Fix("lower.bottom", 0), *supports]
    return am.Model(parts, held, contacts or [pair], loads)


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize(("dim", "depth"), [(2, 0.1), (2, 0.3), (3, 0.15)])
def test_sides_that_overlap_at_first_are_pushed_apart(dim, depth, order):
    """Half a facet deep and more: as pressed together by as much."""
    overlap = model(bodies(dim, over=-depth, order=order), am.Fix("upper.top", 0))
    closed = model(bodies(dim, order=order), am.Fix("upper.top", (*[0] * (dim - 1), -depth)))
    forces = [np.ravel(am.solve(one).resultant)[-1] for one in (overlap, closed)]
    assert forces[0] > 0
    assert forces[0] == pytest.approx(forces[1], rel=0.3)  # of a block that was as much higher


def test_a_slave_that_folds_back():
    """A facet that looks away takes no part; the others do."""
    mesh = am.box((1, 1), (5, 4), kind="tri")
    points = mesh.points.copy()
    for old, new in (((0.4, 0), (0.64, 0.12)), ((0.6, 0.25), (0.83, 0.25)),
                     ((0.4, 0.25), (0.44, 0.4)), ((0.8, 0.25), (0.92, 0.25))):  # fmt: skip
        points[np.linalg.norm(mesh.points - old, axis=1).argmin()] = new
    upper = am.Body(replace(mesh, points=points), NEO, name="upper")
    solution = am.solve(model([bodies()[0], upper], am.Fix("upper.top", (0.02, -0.05))))
    assert solution.converged
    assert np.ravel(solution.resultant)[1] > 0.03


@pytest.mark.parametrize("dim", [2, 3])
def test_needles(dim):
    """Facets ten thousand times as long as wide."""
    lower, upper = bodies(dim)
    points = upper.mesh.points.copy()
    width = np.unique(points[:, 0].round(9))[1]
    points[np.abs(points[:, 0] - width) < 1e-6, 0] = 1e-4
    needle = am.Body(replace(upper.mesh, points=points), NEO, name="upper")
    tops = am.Fix("upper.top", (*[0] * (dim - 1), -0.05))
    forces = [np.ravel(am.solve(model([lower, one], tops)).resultant)[-1]
              for one in (upper, needle)]  # fmt: skip
    assert forces[1] == pytest.approx(forces[0], rel=0.1)


@pytest.mark.parametrize("order", [1, 2])
def test_a_slave_without_master(order):
    """Held by supports it is as without contact; held by nothing else it is told."""
    beside = bodies(at=10.0, order=order)
    solution = am.solve(model(beside, am.Fix("upper.top", (0, -0.05))))
    assert solution.converged
    assert not np.ravel(solution.resultant).any()
    pressed = model(beside, loads=[am.Traction("upper.top", (0, -0.05))])
    found = am.solve(pressed, check=False)
    assert not found.converged
    assert "'upper.bottom' faces 'lower.top' nowhere" in str(found)


def test_dragged_off_the_end_and_back():
    """Beyond the end no force; back on the slab as a block that comes on it."""

    def along(x, t):
        return 1.7 * (max(t - 1, 0) if t < 2 else max(3 - t, 0))

    top = am.Fix("upper.top", (along, lambda x, t: -0.05 * min(t, 1)))
    steps = list(am.evolve(model(bodies(), top), am.QuasiStatic(0.05), until=3.0))
    normal = {round(step.time, 2): step.state.force[:, 0].sum() for step in steps}
    assert normal[1.0] > 0.03
    assert normal[2.0] == pytest.approx(0, abs=1e-12)
    assert normal[3.0] == pytest.approx(normal[1.0], rel=0.05)


def test_a_path_that_ends_keeps_its_last_state():
    """Pressed by a load alone it falls off the end: all steps before are there."""

    def along(x, t):
        return 1.7 * max(t - 1, 0)

    load = am.Traction("upper.top", lambda x, t: (0, -0.02 * min(t, 1)))
    slid = model(bodies(), am.Fix("upper.top", (along, None)), loads=[load])
    kept = []

    def go():
        for step in am.evolve(slid, am.QuasiStatic(0.05), until=3.0):
            kept.append(step)  # noqa: PERF402  # it ends on the way

    with pytest.raises(am.NotConverged, match="no equilibrium found"):
        go()
    assert kept[-1].time > 1.8
    assert np.ravel(kept[-1].resultant())[1] == pytest.approx(0.02, rel=1e-6)


def test_two_masters():
    """One slave of both, and both as slaves of one master."""
    parts = [*bodies(), am.Body(am.box((1, 1), 5, origin=(1.5, -1)), NEO, name="end")]
    supports = [am.Fix("upper.top", (1.2, -0.05)), am.Fix("end.bottom", 0)]
    sides = (("upper.bottom", "lower.top"), ("upper.bottom", "end.top"))
    straight = am.solve(model(parts, *supports, contacts=[
        am.Contact(one, master=other, mu=0.1) for one, other in sides]))  # fmt: skip
    assert straight.converged
    turned = [am.Contact(other, master=one, mu=0.1) for one, other in sides]
    way = (lambda x, t: 1.2 * max(t - 1, 0), lambda x, t: -0.05 * min(t, 1))
    top = am.Fix("upper.top", way)
    both = model(parts, top, supports[1], contacts=turned)
    *_, last = am.evolve(both, am.QuasiStatic(0.1), until=2.0)
    first = len(both.discretisation.placed[0].rows.nodes)
    normal = last.state.force[:, 0]
    assert normal[:first].sum() > 0.005
    assert normal[first:].sum() > 0.005


# ------------------------------------------------------------- words, and the last good state
BEYOND = 2.0  # square of the stretch beyond which the energy below is not a number


def brittle():
    """C:C / 4 and the like of Saint Venant and Kirchhoff, not a number beyond a stretch."""
    one = np.eye(3)
    symmetric = (np.einsum("ik,jl->ijkl", one, one) + np.einsum("il,jk->ijkl", one, one)) / 2
    stiff = np.einsum("ij,kl->ijkl", one, one) + symmetric

    def torn(C, values):
        far = np.linalg.eigvalsh(C)[:, -1] > BEYOND
        values = np.array(values)
        values[far] = np.nan
        return values

    def stress(C):
        return torn(C, np.einsum("ijkl,nkl->nij", stiff, (C - one) / 2))

    def energy(C):
        return np.einsum("nij,nij->n", stress(C), C - one) / 4

    def moduli(C):
        return torn(C, np.broadcast_to(stiff, (len(C), 3, 3, 3, 3)))

    return am.UserEnergy(energy, stress, moduli, name="glass")


def ending(what):
    """A model whose path ends at some time, and which words tell where."""
    lower, upper = bodies()
    if what == "pressed flat":
        down = am.Fix("upper.top", (0, lambda x, t: -2.2 * t))
        return model([lower, upper], down), "cell .* of body 'upper' is pressed to det F"
    if what == "not a number":
        torn = am.Body(upper.mesh, brittle(), name="upper")
        held = [am.Fix("upper.left", (0, -0.02)),
                am.Fix("upper.right", (lambda x, t: t, -0.02))]  # fmt: skip
        return model([lower, torn], *held), "glass: .* not a finite number .* of body 'upper'"
    load = am.Traction("upper.top", lambda x, t: (0, -0.02 * min(4 * t, 1)))
    held = am.Fix("upper.top", (lambda x, t: 2.4 * max(t - 0.25, 0), None))
    return model([lower, upper], held, loads=[load]), "no equilibrium .* faces 'lower.top'"


@pytest.mark.parametrize("what", ["pressed flat", "not a number", "off the edge"])
def test_an_end_is_told_and_leaves_no_trace(what):
    """In words that name the place; from the last state on all goes as if nobody had tried."""
    hostile, words = ending(what)
    kept, quick = [], am.NonlinearNewton(smallest_share=0.2, patience=6)

    def go():
        for step in am.evolve(hostile, am.QuasiStatic(0.125), until=1.5, solver=quick):
            kept.append(step)  # noqa: PERF402  # it ends on the way

    with pytest.raises(am.NotConverged, match=words) as told:
        go()
    assert kept
    assert "contact None" not in str(told.value)
    assert np.isfinite(told.value.solution.v).all()
    last = kept[-2].state
    found = [next(am.evolve(each, am.QuasiStatic(0.125), until=9.0, start=last)).state
             for each in (hostile, ending(what)[0])]  # fmt: skip
    for state in found:
        np.testing.assert_array_equal(state.displacement, kept[-1].state.displacement)
        np.testing.assert_array_equal(state.force, kept[-1].state.force)


def test_who_runs_out_of_time_is_told_the_place_too():
    """A limit of time hid what words would have said after it."""
    problem = large_deformation(model(bodies(at=10.0), am.Fix("upper.top", (0, -0.05))))
    target = Target(1e-8, deadline_of(1e-9))
    start = Iterate(problem.reactions(problem.known_state), None)
    with pytest.raises(Breakdown, match="stopped after .*'upper.bottom' faces 'lower.top' no"):
        list(am.NonlinearNewton().iterates(problem, start, target))


def test_load_steps_shorten_and_lengthen_themselves():
    """Pressed by half at once: some load steps, the last ones longer than the first."""
    solution = am.solve(model(bodies(), am.Fix("upper.top", (0.3, -0.5))))
    assert solution.converged
    halved = am.solve(model(bodies(), am.Fix("upper.top", (0.15, -0.25))))
    assert solution.convergence.iterations < 6 * halved.convergence.iterations


def test_a_cell_that_is_inverted_from_the_start():
    lower, upper = bodies()
    points = upper.mesh.points.copy()
    points[np.linalg.norm(points - (0.25, 1 / 3), axis=1).argmin()] += (0.6, 0)
    with pytest.raises(am.InvalidInput, match=r"cell|inside out"):
        am.solve(model([lower, am.Body(replace(upper.mesh, points=points), NEO, name="upper")],
                       am.Fix("upper.top", (0, -0.05))))  # fmt: skip


@pytest.mark.parametrize("kind", ["tri", "tet"])
def test_a_cell_whose_node_went_through_its_opposite_side_is_named(kind):
    """It was taken for one that is numbered the other way round, and overlapped others."""
    flat = kind == "tri"
    mesh = am.box((1, 1), 3, kind=kind) if flat else am.box((1, 1, 1), 3, kind=kind)
    either = mesh.cells[0].nodes.copy()
    either[::2, :2] = either[::2, 1::-1]  # numbered so, all is well
    (region,) = replace(mesh, cells=(replace(mesh.cells[0], nodes=either),)).cells
    assert np.array_equal(np.sort(region.nodes), np.sort(mesh.cells[0].nodes))
    points = mesh.points.copy()
    points[np.linalg.norm(points - 1 / 3, axis=1).argmin()] += 0.6
    with pytest.raises(am.InvalidInput, match=rf"{kind} cell near \(.*\).* inside out"):
        replace(mesh, points=points)


@pytest.mark.parametrize(("held", "count"), [(0.35, 2), (0.7, 4)])
def test_facets_of_held_nodes_alone_that_are_passed_are_told(held, count):
    """They bear no force; with the master as the slave nothing comes through, or is told."""
    mesh = am.box((1, 0.5), (6, 3), origin=(0, 1.0))
    facets = mesh.surface("bottom")[0]
    left = (mesh.points[facets.nodes][:, :, 0] <= held).all(axis=1)
    part = Facets(facets.kind, facets.nodes[left])
    mesh = am.Mesh(mesh.points, mesh.cells, {**mesh.surfaces, "part": (part,)})
    law = am.NeoHookean(1.0, 0.3)
    bodies = [am.Body(am.box((1, 1), (8, 4)), law, name="low"), am.Body(mesh, law, name="up")]
    supports = [am.Fix("low.bottom", (0, 0.05)), am.Fix("up.part", 0), am.Fix("up.top", 0)]
    for slave, master, told in (("up.bottom", "low.top", 1), ("low.top", "up.bottom", 0)):
        contact = am.Contact(slave, master=master, mu=0.3)
        solution = am.solve(am.Model(bodies, supports, [contact]))
        assert solution.converged
        found = [w for w in solution.warnings if w.name == "held-slave-facets"]
        assert len(found) == told
        if told:
            assert f"all nodes of {count} of its 6 facets" in found[0].message
            assert "make the other surface the slave" in found[0].message


@pytest.mark.parametrize(
    ("aside", "size", "told"),
    [(0.0, 1.0, ""), (5.0, 1.0, "[5, 1.05] to [6, 1.05]"),
     (5.0, 1e-7, "[5e-07, 1.05e-07] to [6e-07, 1.05e-07]")],
)  # fmt: skip
def test_a_slave_that_no_master_faces_is_told(aside, size, told):
    """Its contacts were open, and nothing said that they could not be anything else."""
    law, place = am.NeoHookean(1.0, 0.3), (aside * size, 1.1 * size)
    bodies = [am.Body(am.box((size, size), 2), law, name="low"),
              am.Body(am.box((size, size), 2, origin=place), law, name="up")]  # fmt: skip
    supports = [am.Fix("low.bottom", 0), am.Fix("up.top", (0, -0.05 * size))]
    contact = am.Contact("up.bottom", master="low.top", mu=0.3)
    warned = [w.message for w in am.solve(am.Model(bodies, supports, [contact])).warnings
              if w.name == "unfaced-slave"]  # fmt: skip
    assert len(warned) == bool(told)
    if told:
        assert f"'up.bottom' reaches from {told}" in warned[0]


def test_a_slave_that_is_held_everywhere_says_what_to_do():
    law = am.NeoHookean(1.0, 0.3)
    bodies = [am.Body(am.box((1, 1), 2), law, name="low"),
              am.Body(am.box((1, 1), 3, origin=(0, 1)), law, name="up")]  # fmt: skip
    supports = [am.Fix("low.bottom", (0, 0.05)), am.Fix("up.bottom", 0), am.Fix("up.top", 0)]
    with pytest.raises(am.InvalidInput, match="make the master the slave"):
        am.solve(am.Model(bodies, supports, [am.Contact("up.bottom", master="low.top", mu=0)]))


def test_a_corner_that_is_inside_out_is_named_where_no_integration_point_is():
    """det F of a bilinear square is 1 - 0.6 (x + y): -0.2 at a corner, else at least 0.054."""
    square = am.Body(am.box((1, 1), 1), NEO, name="lower")
    problem = large_deformation(am.Model([square], [am.Fix("lower.left", 0)], [
        am.Contact("lower.top", am.Plane((0, -1), (0, 5)), mu=0)]))  # fmt: skip
    u = np.zeros(square.mesh.points.shape)
    u[(square.mesh.points == 1).all(axis=1)] = -0.6
    v = u.ravel()[problem.parts.free]
    assert "the corner at (1, 1) of cell 0 at (0.5, 0.5) is turned inside out, det F = -0.2 " \
        "there, in body 'lower'" in problem.remark(v)  # fmt: skip
    assert "pressed to det F = 0.0536" in problem.remark(v)
    assert "corner" not in problem.remark(v / 2)


@pytest.mark.parametrize(
    ("law", "depth", "told"),
    [(am.LinearElastic(1.0, 0.3), 0.1, True), (NEO, 0.1, True), (NEO, 1e-3, False)],
)
def test_bodies_that_overlap_as_they_are_given_get_a_word(law, depth, told):
    """With place and depth, static and once in time; a press fit is thin, or says so."""
    heavy = replace(law, density=1.0)
    parts = [replace(body, material=heavy) for body in bodies(over=-depth)]
    one = model(parts, am.Fix("upper.top", 0))
    names = [w.name for w in am.solve(one).warnings]
    assert ("overlap-at-start" in names) == told
    step, after = am.evolve(one, am.MoreauJean(0.1), until=0.2)
    found = [w for w in step.warnings if w.name == "overlap-at-start"]
    assert bool(found) == told
    assert "overlap-at-start" not in [w.name for w in after.warnings]
    if told:
        assert "by 0.1 at (" in found[0].message
        meant = replace(one.contacts[0], clearance=-depth)
        said = replace(one, contacts=[meant])
        assert "overlap-at-start" not in [w.name for w in am.solve(said).warnings]


def overlapping(*given):
    """Messages of a model of bodies, (name, mesh), the first a slave of all others."""
    parts = [am.Body(mesh, NEO, name=name) for name, mesh in given]
    (slave, _), *masters = given
    pairs = [am.Contact(f"{slave}.bottom", master=f"{name}.top", mu=0.0) for name, _ in masters]
    held = [am.Fix(f"{slave}.top", 0)]
    return [w.message for w in overlap_at_start(am.Model(parts, held, pairs), None)]


def test_an_overlap_with_several_masters_is_told_as_with_one():
    upper = "upper", am.box((2, 1), (4, 2), origin=(0, 0.8))
    left, right = ((f"l{k}", am.box((1, 1), 2, origin=(k, 0))) for k in (0, 1))
    (one,), (several,) = overlapping(upper, left), overlapping(upper, left, right)
    for message in (one, several):
        assert "overlap at the start by 0.2 at" in message


def ring(radii, columns):
    """A quarter of a ring: its bottom the inner surface."""
    mesh = am.box((1, 1), (columns, 2))
    angle = np.pi / 2 * (1 - mesh.points[:, 0])
    r = radii[0] + (radii[1] - radii[0]) * mesh.points[:, 1]
    return replace(mesh, points=np.stack([r * np.cos(angle), r * np.sin(angle)], axis=1))


def test_chords_and_slivers_are_no_overlap_of_bodies():
    """A coarse hub that touches a fine shaft; a thin press fit on a mesh with one sliver."""
    assert not overlapping(("hub", ring((1, 1.5), 8)), ("shaft", ring((0.5, 1), 64)))
    graded = am.box((1, 1), (5, 2))
    x = graded.points.copy()
    x[np.isclose(x[:, 0], 0.4), 0] = 0.2 + 1e-3
    lower = "lower", replace(graded, points=x)
    for depth, told in ((1e-3, False), (0.05, True)):
        upper = "upper", am.box((1, 1), (4, 2), origin=(0, 1 - depth))
        assert bool(overlapping(upper, lower)) == told


@pytest.mark.parametrize(("dim", "down"), [(2, 0.2), (2, 0.1), (3, 0.15)])
def test_a_master_deep_inside_a_coarse_slave_is_told_and_the_other_way_is_not(dim, down):
    """A wedge goes between nodes of the slave, whose averages see little of its edge."""
    three = dim == 3
    wedge = (am.box((0.6, 0.6, 0.8), (6, 2, 4), origin=(0.2, 0.2, 0.5)) if three
             else am.box((0.6, 0.8), (6, 4), origin=(0.2, 0.5)))  # fmt: skip
    up = np.eye(dim)[-1]
    points = wedge.points + np.outer(1.5 * np.abs(wedge.points[:, 0] - 0.5), up)
    low = am.box((1, 1, 0.5), (3, 3, 2)) if three else am.box((1, 0.5), (3, 2))
    bodies = [am.Body(low, am.NeoHookean(1.0, 0.3), name="low"),
              am.Body(replace(wedge, points=points), am.NeoHookean(10.0, 0.3), name="up")]
    supports = [am.Fix("low.bottom", 0), am.Fix("up.top", tuple(-down * up))]
    for slave, master, told in (("low.top", "up.bottom", 1), ("up.bottom", "low.top", 0)):
        contact = am.Contact(slave, master=master, mu=0.3)
        solution = am.solve(am.Model(bodies, supports, [contact]))
        found = [w for w in solution.warnings if w.name == "master-inside-slave"]
        assert len(found) == told
        if told:
            assert "make 'up.bottom' the slave, or refine 'low.top'" in found[0].message
