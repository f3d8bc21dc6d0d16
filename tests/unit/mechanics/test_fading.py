"""Nodes that leave the master's edge: forces are continuous, tangents exact, paths go on."""

from dataclasses import replace

import numpy as np
import pytest
from tangent_checker import FOURTH, checked_tangents

import amontons as am
from amontons.mechanics.contact.fading import FULL
from amontons.mechanics.model.large_deformation import large_deformation, large_step

NEO = am.NeoHookean(1.0, 0.3)
FAR = {2: -0.2, 3: -0.35}  # ways after which a facet of the slave has a part of 0.2 left


def overhanging(dim, more=None):
    """A block with a part of its lower side in front of another body."""
    cells = {2: ((3, 1), (5, 1)), 3: ((2, 2, 1), (3, 3, 1))}[dim]
    upper = am.Body(am.box((1,) * dim, cells[0]), NEO, name="upper")
    below = am.box((1,) * dim, cells[1], origin=(*[0.05] * (dim - 1), -1))
    return am.Model([upper, am.Body(below, NEO, name="lower")],
                    [am.Fix("upper.top", 0), am.Fix("lower.bottom", 0)],
                    [am.Contact("upper.bottom", master="lower.top",
                                **({"mu": 0.3} if more is None else more))])  # fmt: skip


def shifted(model, way):
    """(parts, displacements (nodes, d)): the upper body pressed in a little, and moved."""
    parts = large_deformation(model).parts
    u = np.zeros(parts.X.shape)
    u[: parts.ends[0], 0] = way
    u[: parts.ends[0], -1] = -0.01
    return parts, u


@pytest.mark.parametrize("dim", [2, 3])
def test_what_fades_is_continuous(dim):
    """w and the shares of neighbours grow from nothing, and end where nobody fades."""
    model, seen, faint, last = overhanging(dim), [], 0, None
    force = np.random.default_rng(2).uniform(0.5, 1, len(large_deformation(model).parts.at))
    for way in np.linspace(0.0, 0.5, 101):
        parts, u = shifted(model, -way)
        meeting = parts.meet(u).parts[0]
        w, passed = np.ones(len(force)), np.zeros(len(force))
        if meeting.fading is not None:
            w = meeting.fading.weights
            faint += 1
            passed = meeting.fading.shares @ (force * meeting.weights)
        law = (1 - w) * passed + w * force * meeting.weights
        if last is not None:
            seen.append(np.abs(law - last).max())
        last = law
    assert max(seen) < 0.05 * force.max() * parts.contact.pairs[0].areas.max()
    assert faint > 10


def test_a_uniform_pressure_is_no_error():
    """Neighbours with one pressure p hand on D p, whatever faces the master."""
    parts, u = shifted(overhanging(3), FAR[3])
    meeting = parts.meet(u).parts[0]
    fading = meeting.fading
    assert fading is not None
    assert fading.weights[fading.faint].max() < 1
    mean = fading.shares @ meeting.weights
    np.testing.assert_allclose(mean[fading.faint], meeting.weights[fading.faint], rtol=1e-12)
    assert FULL < 0.5  # nodes of a side that ends with the master's bear for themselves


def test_which_side_is_the_slave_is_no_matter_where_one_ends_within_facets():
    """A stiff block pressed on a slab: up to 4 % with FULL = 0.4, 2 % with 0.2."""
    slab = am.Body(am.box((3, 1), (15, 5)), NEO, name="slab")
    for beside in (0.0, 0.1):
        mesh = am.box((1, 0.5), (6, 3), origin=(0.9 + beside, 1))
        block, found = am.Body(mesh, am.NeoHookean(10.0, 0.3), name="block"), []
        for sides in (("slab.top", "block.bottom"), ("block.bottom", "slab.top")):
            model = am.Model([slab, block], [am.Fix("slab.bottom", 0),
                                             am.Fix("block.top", (0, -0.02))],
                             [am.Contact(sides[0], master=sides[1], mu=0.3)])  # fmt: skip
            found.append(np.abs(np.ravel(am.solve(model).resultant)[1]))
        assert np.ptp(found) < 0.006 * max(found)


def test_normals_are_those_of_what_faces_the_master():
    """The last facet of the slave rises beyond the master's end; a quarter of it is met.

    By that quarter its own normal counts, by the rest the master's, which is level.
    """
    parts, u = shifted(overhanging(2), 0.3)
    X = parts.X
    line = np.flatnonzero(np.abs(X[: parts.ends[0], 1]) < 1e-12)
    line = line[np.argsort(X[line, 0])]
    u[line[-1], 1] += 0.1
    meeting, x = parts.meet(u).parts[0], X + u
    ways = np.diff(x[line], axis=0)
    facets = np.stack([ways[:, 1], -ways[:, 0]], axis=1)  # down, as long as they are
    end = np.array([1.05, 0.0])
    part = (end - x[line[-2]]) @ ways[-1] / (ways[-1] @ ways[-1])
    assert 0.2 < part < 0.3
    level = np.array([0.0, -np.linalg.norm(facets[-1])])
    wanted = facets[-2] + part * (part * facets[-1] + (1 - part) * level)
    found = meeting.normals[np.flatnonzero(meeting.slaves == line[-2])[0]]
    np.testing.assert_allclose(found, -wanted / np.linalg.norm(wanted), atol=1e-12)


def test_who_is_the_slave_matters_little_where_a_rim_is_pressed_in():
    """Horizontal forces of a dragged die: up to 2 % with the normal of a chord at the rim."""
    slab = am.Body(am.box((3, 1), (30, 8)), NEO, name="slab")
    mesh = am.box((0.8, 0.5), (10, 6), origin=(0.5, 1.0))
    height = (1 - np.sqrt(1 - (mesh.points[:, 0] - 0.9) ** 2)) * (1.5 - mesh.points[:, 1]) / 0.5
    mesh = replace(mesh, points=mesh.points + np.outer(height, (0, 1)))
    die = am.Body(mesh, am.NeoHookean(10.0, 0.3), name="die")
    top = am.Fix("die.top", (lambda x, t: 0.075 * max(t - 2, 0), lambda x, t: -0.1 * min(t, 2)))
    found = []
    for slave, master in (("slab.top", "die.bottom"), ("die.bottom", "slab.top")):
        model = am.Model([slab, die], [am.Fix("slab.bottom", 0), top],
                         [am.Contact(slave, master=master, mu=0.3)])  # fmt: skip
        steps = am.evolve(model, am.QuasiStatic(1.0), until=6.0)
        found.append([abs(np.ravel(step.resultant())[0]) for step in steps][2:])
    np.testing.assert_allclose(*found, rtol=0.01)


@pytest.mark.parametrize(("dim", "more"), [
    (2, None), (3, None), (2, {"mu": 0.3, "stiffness": 5.0, "stick_stiffness": 3.0}),
    (3, {"mu": 0.3, "mu_across": 0.1, "direction": (1, 0, 0)}),
])  # fmt: skip
def test_the_tangent_of_what_fades_is_exact(dim, more):
    """Between differences, where some nodes fade."""
    model, rng = overhanging(dim, more), np.random.default_rng(5)
    parts, u = shifted(model, FAR[dim])
    fixed = np.ones(parts.X.size, dtype=bool)
    fixed[parts.free] = False
    start = u.ravel()
    before = start + 0.004 * rng.standard_normal(len(start))
    springs = more is not None and "stick_stiffness" in more
    drawn = 0.004 * rng.standard_normal((len(parts.at), dim - 1)) if springs else None
    problem = large_step(model, np.zeros(len(start)), np.where(fixed, start, 0.0), before,
                         drawn=drawn)  # fmt: skip
    draws = [(start[parts.free] + 0.004 * one, 0.01 * other)
             for one, other in rng.standard_normal((4, 2, problem.unknowns))]  # fmt: skip
    assert all(problem.contact_point(v).mixed is not None for v, _ in draws)
    assert checked_tangents(problem, draws) >= 2
    if more is None:  # and where some have slid while they were open
        motion = problem.contact_point(draws[0][0]).motion
        play = np.linalg.norm(motion, axis=1) * rng.uniform(0, 1, problem.contacts)
        assert checked_tangents(replace(problem, play=play), draws) >= 2


def beside_a_support(width, gap=0.1):
    """The right end of the upper body is held; only there a sliver of it faces the lower."""
    upper = am.Body(am.box((1, 1), (3, 2)), NEO, name="upper")
    lower = am.Body(am.box((1, 1), (3, 2), origin=(1 - width, -1 - gap)), NEO, name="lower")
    return am.Model([upper, lower], [am.Fix("upper.right", 0), am.Fix("lower.bottom", 0)],
                    [am.Contact("upper.bottom", master="lower.top", mu=0)],
                    [am.Traction("upper.top", (0.1, -0.02))])  # fmt: skip


@pytest.mark.parametrize("width", [1e-3, 1e-6])
def test_slivers_beside_a_support_leave_the_residual_exact(width):
    """Who is alone there compares with nobody, and its averages are of the size 2 / width."""
    model, rng = beside_a_support(width), np.random.default_rng(3)
    parts = large_deformation(model).parts
    u = 0.01 * rng.standard_normal(parts.X.shape)
    fixed = np.ones(u.size, dtype=bool)
    fixed[parts.free] = False
    u[parts.X[:, 0] > 0.99] = 0
    u[2, 1] = 0  # of the slave alone
    problem = large_step(model, np.zeros(u.size), np.zeros(u.size), u.ravel())
    v = u.ravel()[parts.free]
    meeting = problem.contact_point(v).meeting.parts[0]
    assert meeting.met.sum() == 1
    assert np.abs(meeting.averages.data).max() > 0.1 / width
    near = [problem.residual(v + 1e-15 * rng.standard_normal(len(v))) for _ in range(4)]
    assert np.ptp(near, axis=0).max() < 1e-11 * np.abs(near).max()
    if width > 1e-6:
        draws = 0.1 * rng.standard_normal((2, len(v)))
        assert checked_tangents(problem, [(v, one) for one in draws], FOURTH) == 2


def test_what_touches_nobody_is_solved_as_without_contact():
    """Also where the only slave that faces the master does so by a sliver: 8 and 4 steps."""
    model = beside_a_support(0.05, gap=1.0)
    with_contact, without = (am.solve(one, tolerance=1e-10).convergence.iterations
                             for one in (model, replace(model, contacts=[])))  # fmt: skip
    assert with_contact <= without + 1


def sliver(width):
    """(problem, v) at rest but for noise, where facets face the master by a strip alone."""
    model, rng = overhanging(3), np.random.default_rng(7)
    parts, u = shifted(model, 0.55 - width)  # one row of facets has a strip over the edge
    u[:, :2] += 1e-8 * rng.standard_normal((len(u), 2))  # in a plane no edges coincide
    u[:, 2] += 0.01 * rng.standard_normal(len(u))
    start = u.ravel()
    fixed = np.ones(parts.X.size, dtype=bool)
    fixed[parts.free] = False
    before = start + 0.004 * rng.standard_normal(len(start))
    problem = large_step(model, np.zeros(len(start)), np.where(fixed, start, 0.0), before)
    return problem, start[parts.free]


@pytest.mark.parametrize("width", [1e-3, 1e-7])
def test_slivers_leave_the_residual_exact(width):
    """Forces on others by averages over a strip, told to rounding over its width squared."""
    problem, v = sliver(width)
    meeting = problem.contact_point(v).meeting.parts[0]
    assert 0 < (meeting.weights[meeting.met] / problem.parts.contact.pairs[0].areas[
        meeting.met]).min() < 2 * width  # fmt: skip
    rng = np.random.default_rng(1)
    near = [problem.residual(v + 1e-15 * rng.standard_normal(len(v))) for _ in range(4)]
    assert np.ptp(near, axis=0).max() < 1e-11 * np.abs(near).max()


@pytest.mark.parametrize("width", [1e-3, 1e-7])
def test_motion_since_a_sliver_is_no_extrapolation_of_it(width):
    """Bodies deform by 0.01 while they slide by 0.15: averages over a strip make more of it."""
    problem, v = sliver(width)
    parts, rng = problem.parts, np.random.default_rng(8)
    before = problem.displacement(v)
    now = before + 0.01 * rng.standard_normal(before.shape)
    now[: parts.ends[0], 0] -= 0.15
    here, earlier = parts.meet(now).parts[0], parts.meet(before).parts[0]
    grown = here.met & earlier.met & (earlier.remembered < 1e-3)
    assert grown.any()
    motion = here.motion(earlier)[grown]
    np.testing.assert_allclose(motion[:, :2] - (-0.15, 0), 0, atol=0.04)


def round_end(cells, name, *, up):
    """A block with a round end at the origin, above or below."""
    mesh = am.box((1.0,) * 3, cells)
    x = mesh.points - (0.5, 0.5, 0.0)
    x[:, 2] += (1.0 - np.sqrt(1.0 - (x[:, :2] ** 2).sum(axis=1))) * (1 - x[:, 2])
    turn = (1, 1, 1) if up else (-1, 1, -1)
    return am.Body(replace(mesh, points=x * turn), NEO, name=name)


def test_round_ends_slide_off_each_other_in_space():
    """Over three quarters of the body; there was no equilibrium where a node dropped out."""
    both = [round_end((3,) * 3, "one", up=True), round_end((4,) * 3, "other", up=False)]
    way = (lambda x, t: 0.3 * max(t - 1, 0), 0.0, lambda x, t: -0.2 * min(t, 1))
    model = am.Model(both, [am.Fix("one.top", way), am.Fix("other.top", 0)],
                     [am.Contact("one.bottom", master="other.bottom", mu=0.3)])  # fmt: skip
    steps = list(am.evolve(model, am.QuasiStatic(0.5), until=3.5))
    assert max(step.solution.convergence.linear_iterations for step in steps) <= 20
    up = [np.ravel(step.resultant())[2] for step in steps[2:]]
    assert (np.diff(up) < 0).all()


def test_gaps_of_nodes_that_hardly_anything_faces_are_those_of_geometry():
    """Below a die that rises ever steeper gaps grow; .004 was told of one .3 away."""
    mesh = am.box((1.0, 1.0), (10, 4), origin=(-0.5, 0.0))
    x, y = mesh.points.T
    angle = 2 * np.arcsin(0.5 / 0.52) * x
    curved = np.stack([0.52 * np.sin(angle), 0.52 * (1 - np.cos(angle))], axis=1)
    own = np.stack([x * y, y], axis=1)
    mesh = replace(mesh, points=own + (1 - y)[:, None] * curved)
    slab = am.Body(am.box((2.0, 0.5), (16, 3), origin=(-0.93, -0.5)), NEO, name="slab")
    model = am.Model([slab, am.Body(mesh, NEO, name="die")],
                     [am.Fix("slab.bottom", 0), am.Fix("die.top", (0, -0.02))],
                     [am.Contact("slab.top", master="die.bottom", mu=0.3)])  # fmt: skip
    gap = am.solve(model).gap
    assert (gap > -1e-12).all()
    closed = np.flatnonzero(gap < 1e-9)
    assert len(closed)
    assert (np.diff(gap[: closed[0] + 1]) < 0).all()
    assert (np.diff(gap[closed[-1] :]) > 0).all()
