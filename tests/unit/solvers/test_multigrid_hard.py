"""Contact multigrid where it is weak, round pairs and layers; and its parts."""

from dataclasses import replace

import numpy as np

import amontons as am
from amontons.linear.patched import PatchedBlocks, Rows
from amontons.linear.some_rows import SomeRows
from amontons.mechanics.meshes import Cells
from amontons.problem import matrices
from amontons.problem.law.states import SLIP
from amontons.problem.solution import Outcome
from amontons.solvers.contract import Iterate
from amontons.solvers.driver import drive
from amontons.solvers.multigrid.cycles import _Run
from amontons.solvers.multigrid.levels import ContactLevels
from amontons.solvers.multigrid.nodes import CLOSED
from amontons.solvers.multigrid.tangent import Tangent


def die(size):
    """A die with a round underside on a slab of other cells, pressed and pushed."""
    lower = am.box((3, 1, 0.75), cells=(6 * size, 2 * size, 2 * size), origin=(-1.5, 0, -0.75))
    upper = am.box((1, 0.8, 0.6), cells=(4 * size, 3 * size, 2 * size), origin=(0, 0.1, 0))
    points = np.array(upper.points)
    points[:, 2] += 0.25 * (points[:, 0] - 0.5) ** 2 * (1 - points[:, 2] / 0.6)
    round_one = replace(upper, points=points)
    bodies = [
        am.Body(lower, am.LinearElastic(100, 0.3), "lower"),
        am.Body(round_one, am.LinearElastic(200, 0.3), "upper"),
    ]
    supports = [am.Fix("lower.bottom", 0), am.Fix("upper.top", (0.02, 0, -0.03))]
    return am.Model(bodies, supports, [am.Contact("upper.bottom", master="lower.top", mu=0.3)])


def layers(cells):
    """Layers of materials 1 000 times as stiff as those between, in no relation to levels."""
    mesh = am.box((1, 1, 1), cells=cells)
    nodes = mesh.cells[0].nodes
    stiff = np.floor(5 * mesh.points[nodes].mean(axis=1)[:, 2]) % 2 == 0
    parts = (Cells("hex", nodes[stiff], "stiff"), Cells("hex", nodes[~stiff], "soft"))
    laws = {"stiff": am.LinearElastic(200, 0.3), "soft": am.LinearElastic(0.2, 0.3)}
    return am.Model(
        [am.Body(replace(mesh, cells=parts, grid=None), laws)],
        [am.Fix("top", lambda x: (0, 0.02, 0.006 - 0.015 * x[0]))],
        [am.Contact("bottom", am.Plane((0, 0, 1), (0, 0, 0)), mu=0.3)],
    )


def judged_by_residual(problem, monkeypatch):
    """So that no W is formed and the motion is that of the cycles."""
    monkeypatch.setattr(matrices, "CHEAP", 0.0)
    monkeypatch.setattr(matrices, "EXACT_WORK", 0.0)
    return problem.fresh()


def test_cycles_of_a_round_pair_do_not_grow(monkeypatch):
    """Without a sweep over the nodes beside contacts there are half as many more."""
    counts = []
    for size in (1, 2):
        problem = judged_by_residual(die(size).assemble(), monkeypatch)
        solution = drive(problem, am.ContactMultigrid(), tolerance=1e-8)
        assert solution.convergence.outcome is Outcome.CONVERGED
        counts.append(solution.convergence.iterations)
    assert max(counts) <= 12
    assert counts[1] <= 1.25 * counts[0]


def test_stiff_and_soft_layers_come_to_an_end(monkeypatch):
    """Linear multigrid needs 62 iterations itself, with the contact face free."""
    problem = judged_by_residual(layers(8).assemble().assembled(), monkeypatch)
    solution = drive(problem, am.ContactMultigrid(), tolerance=1e-9)
    assert solution.convergence.outcome is Outcome.CONVERGED
    assert solution.convergence.iterations <= 150


def test_some_rows_are_those_of_the_matrix():
    """Residual and sweep of rows that a solve has changed, beside the whole matrix."""
    A = layers(5).assemble().assembled().hierarchy.levels[0].A
    rng = np.random.default_rng(0)
    patch = PatchedBlocks(A, Rows.of(A, np.array([1, 4, 5])))
    patch.data *= 2.0
    patch.inverse /= 2.0
    whole, free = patch.stored(), np.zeros(A.nodes, dtype=bool)
    b, x = rng.standard_normal((2, A.nodes, 3))
    found, wanted = np.empty_like(b), np.empty_like(b)
    patch.residual(x, b, found)
    whole.residual(x, b, wanted)
    np.testing.assert_allclose(found, wanted, atol=1e-12 * np.abs(wanted).max())
    some = SomeRows.of(whole, np.arange(A.nodes))
    for backward in (False, True):
        swept = x.copy()
        some.smooth(b, swept, free, backward)
        whole.smooth(b, x, free, backward)
        np.testing.assert_allclose(swept, x, atol=1e-12 * np.abs(x).max())


def test_a_second_cycle_goes_on_from_the_first():
    """It is a cycle for what the first one has left."""
    hierarchy = layers(4).assemble().assembled().hierarchy
    A = hierarchy.levels[0].A
    b = np.random.default_rng(0).standard_normal((A.nodes, 3))
    x, r = np.zeros_like(b), np.empty_like(b)
    hierarchy.cycle(0, b, x)
    A.residual(x, b, r)
    z = np.zeros_like(b)
    hierarchy.cycle(0, r, z)
    wanted = x + z
    hierarchy.improve(0, b, x)
    np.testing.assert_allclose(x, wanted, atol=1e-10 * np.abs(wanted).max())


def test_products_are_kept_of_what_nobody_can_write():
    problem = die(1).assemble()
    v = np.ones(problem.unknowns)
    first = problem.times_M(v).copy()
    v[0] = 2.0
    assert (problem.times_M(v) != first).any()  # it could have been written to
    v.flags.writeable = False
    assert problem.times_M(v) is problem.times_M(v)
    np.testing.assert_array_equal(problem.times_M(v), problem.M @ v)


def cycles_at(problem, count):
    """The state of contact multigrid after some cycles: run, values at nodes."""
    levels = ContactLevels.of(problem)
    options = am.ContactMultigrid(nested=False)
    run = _Run(levels, Tangent(levels.truncation), options, levels.finest(problem), 0)
    x = levels.start(problem, Iterate(np.zeros((problem.contacts, problem.dimension))))
    for _ in zip(range(count), run.cycles(x), strict=False):
        pass
    return run, x


def test_slip_ends_where_it_would_turn_round(monkeypatch):
    """The tangent holds friction in its direction: past zero a correction is thrown back."""
    run, x = cycles_at(judged_by_residual(die(1).assemble(), monkeypatch), 6)
    contacts = run.contacts
    slips = (contacts.state == CLOSED + SLIP) & (contacts.r[:, 0] > 0)
    assert slips.sum() >= 2
    V = contacts.tangent()[0]
    before, H = x[contacts.node], contacts.H
    slip = np.einsum("cai,ci->ca", H[:, :, 1:], contacts.u[:, 1:])
    for share, left in ((0.5, 0.5), (2.0, 0.0)):  # of the slip taken back, and what is left
        moved = x.copy()
        moved[contacts.node] -= share * slip
        contacts.limit(V, before, moved)
        u = np.einsum("cai,ca->ci", H, moved[contacts.node]) + contacts.w
        wanted = contacts.u[slips] * [1, left, left]
        np.testing.assert_allclose(u[slips], wanted, atol=1e-12 * np.abs(contacts.u).max())
    smooth = replace(contacts, law=am.Coulomb(np.zeros(len(slips))))  # nothing jumps
    smooth.r, smooth.u, smooth.state = contacts.r, contacts.u, contacts.state
    moved = x.copy()
    moved[contacts.node] -= 2 * slip
    smooth.limit(V, before, moved)
    u = np.einsum("cai,ca->ci", H, moved[contacts.node]) + contacts.w
    np.testing.assert_allclose(u[slips, 1:], -contacts.u[slips, 1:], rtol=1e-9)


def test_a_tangent_renewed_in_parts_is_the_tangent(monkeypatch):
    """Only what has changed is multiplied, and the sum of it is what the states ask for."""
    run, _ = cycles_at(judged_by_residual(die(1).assemble(), monkeypatch), 8)
    assert run.updates >= 3
    parts = run.tangent
    at_once = Tangent(run.levels.truncation)
    at_once.begin(0, run.contacts)
    at_once.renew(*parts.parts, turned=0.0)
    assert len(at_once.hierarchy.levels) > 1
    pairs = zip(at_once.hierarchy.levels[1:], parts.hierarchy.levels[1:], strict=True)
    for one, other in pairs:
        size = np.abs(one.A.data).max()
        np.testing.assert_allclose(other.A.data, one.A.data, atol=1e-12 * size, rtol=0)
        size = np.abs(one.A.inverse).max()
        np.testing.assert_allclose(other.A.inverse, one.A.inverse, atol=1e-9 * size, rtol=0)
    parts.begin(0, run.contacts)  # and all of it is forgotten for the next contacts
    for plain, other in zip(
        run.levels.hierarchy.levels[1:], parts.hierarchy.levels[1:], strict=True
    ):
        np.testing.assert_array_equal(other.A.stored().data, plain.A.stored().data)
