"""Two bodies that slide far, at worst: overlaps, folds, needles, nothing opposite, ends."""

from dataclasses import replace

import numpy as np
import pytest

import amontons as am

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
    for old, new in (((0.4, 0), (0.64, 0.12)), ((0.6, 0.25), (0.7, 0.4)),
                     ((0.4, 0.25), (0.45, 0.3))):  # fmt: skip
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


def test_a_slave_without_master():
    """Held by supports it is as without contact; held by nothing else it is told."""
    beside = bodies(at=10.0)
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
