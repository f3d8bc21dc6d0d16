"""Several deformable bodies: factors shared by equal bodies, W body by body, inexact Newton."""

import numpy as np
import pytest
from scipy import sparse

import amontons as am
from amontons.linear.bodies import Bodies, BodyFactor
from amontons.linear.multifrontal import Fronts
from amontons.problem import matrices as global_matrices
from amontons.problem.condensation import Condensation
from amontons.solvers.auto import state as portfolio_state
from amontons.solvers.auto.portfolio import TRACKS, Portfolio
from amontons.solvers.contract import Iterate, Target
from amontons.solvers.newton import inexact
from amontons.solvers.newton.joints import Joints

STONE = am.LinearElastic(young=2.2e9, poisson=0.2, density=2000)


def one_step(dim=3, rows=3, blocks=2):
    """First time step of a wall under weight and a sideways push, in global form."""
    size, cells = {2: ((0.4, 0.2), (24, 4)), 3: ((0.4, 0.2, 0.2), (4, 2, 2))}[dim]
    made = am.Wall(rows, blocks, size, cells, STONE, plate=0.1)
    down = (0,) * (dim - 1) + (-1e5,)
    push = (2e4,) + (0,) * (dim - 1)
    model = made.model(
        [], [am.Traction("plate.top", down), am.Traction("row 2 block 1.left", push)]
    )
    step = next(am.evolve(model, am.MoreauJean(step=1e-3, theta=1), until=1e-3))
    return step.problem


@pytest.fixture(scope="module")
def wall():
    return one_step()


# ------------------------------------------------------------------ bodies
def test_equal_bodies_share_a_kind(wall):
    bodies = wall.bodies
    assert bodies.count == 2 + 3 + 2 + 1
    assert sorted(len(m) for m in bodies.members) == [1, 2, 5]  # plate, half and whole blocks
    unknowns = np.concatenate([m.ravel() for m in bodies.members])
    np.testing.assert_array_equal(np.sort(unknowns), np.arange(wall.unknowns))
    for members, matrix in zip(bodies.members, bodies.matrices, strict=True):
        for one in members:
            found = wall.M[one][:, one]
            assert abs(found - matrix).max() <= 1e-12 * abs(matrix).max()


def test_bodies_that_differ_do_not_share():
    M = sparse.csc_array(sparse.diags_array([2.0, 2.0, 2.001]))
    assert [len(m) for m in Bodies.of(M).members] == [2, 1]
    stiff = np.array([[2.0, 1.0], [1.0, 2.0]])
    M = sparse.csc_array(sparse.block_diag([stiff, stiff, stiff + 1e-9]))
    assert [len(m) for m in Bodies.of(M).members] == [2, 1]


@pytest.mark.parametrize("columns", [None, 5])
def test_the_factor_of_bodies_solves(wall, columns):
    factor = wall.factor()
    assert isinstance(factor, BodyFactor)
    shape = (wall.unknowns,) if columns is None else (wall.unknowns, columns)
    x = np.random.default_rng(1).standard_normal(shape)
    np.testing.assert_allclose(factor.solve(wall.M @ x), x, atol=1e-9)


def test_a_body_that_is_singular_is_named():
    K = sparse.csr_array(np.kron(np.eye(2), np.ones((60, 60))))
    problem = am.FrictionProblem.from_global(
        K, np.eye(120)[:, :3], np.ones(120), np.zeros((1, 3)), [0.5]
    )
    with pytest.raises(am.SingularOperator):
        problem.factor()


# ------------------------------------------------------------------ W
@pytest.mark.parametrize("dim", [2, 3])
def test_w_by_bodies_is_w(dim):
    problem = one_step(dim)
    H = problem.H.toarray()
    dense = H.T @ np.linalg.solve(problem.M.toarray(), H)
    local = problem.condensed()
    np.testing.assert_allclose(local.W.toarray(), dense, atol=1e-12 * abs(dense).max())
    again = am.FrictionProblem.from_delassus(local.W, local.q, local.law)
    for name in ("indptr", "indices", "diagonal"):
        np.testing.assert_array_equal(getattr(local.blocks, name), getattr(again.blocks, name))
    scale = abs(dense).max()
    np.testing.assert_allclose(local.blocks.data, again.blocks.data, atol=1e-12 * scale)
    assert local.blocks.density < 0.7


def test_a_contact_that_moves_nothing_keeps_its_block(wall):
    H = sparse.csc_array(sparse.hstack([wall.H, sparse.csc_array((wall.unknowns, 3))]))
    parts = Condensation(wall.bodies, H, 3)
    rows = parts.delassus(wall.factor())
    assert len(rows.diagonal) == wall.contacts + 1
    assert not rows.diagonal_blocks[-1].any()


def test_what_is_formed_follows_from_counted_work(wall, monkeypatch):
    block = am.Body(am.box((1, 1, 1), cells=6), am.LinearElastic(young=200, poisson=0.3))
    model = am.Model([block], [am.Fix("top", (0, 0, -0.01))],
                     [am.Contact("bottom", am.Plane((0, 0, 1)), mu=1.0)])  # fmt: skip
    one = model.assemble()
    monkeypatch.setattr(global_matrices, "EXACT_WORK", 0)
    parts, whole = wall.matrices.condensation, one.matrices.condensation
    assert parts.work < 0.2 * parts.compressed_work
    assert whole.work > 0.5 * whole.compressed_work
    assert wall.condensing_is_cheap
    monkeypatch.setattr(global_matrices, "DENSE_LIMIT", 1e4)
    fresh = am.FrictionProblem.from_global(wall.M, wall.H, wall.f, wall.w, wall.law)
    assert not fresh.condensing_is_cheap
    with pytest.raises(am.InvalidInput, match="W would take"):
        fresh.condensed()


def test_a_part_of_a_problem_is_that_part(wall):
    local = wall.condensed()
    some = np.arange(0, wall.contacts, 3)
    part = local.restricted(some)
    rows = (3 * some[:, None] + np.arange(3)).ravel()
    np.testing.assert_array_equal(part.W.toarray(), local.W.toarray()[np.ix_(rows, rows)])
    np.testing.assert_array_equal(part.q, local.q[some])
    np.testing.assert_array_equal(part.law.mu, local.law.mu[some])
    whole, contacts = part.whole
    assert whole is local
    np.testing.assert_array_equal(contacts, some)
    assert part.with_load(2 * part.q).whole[0] is local


# ------------------------------------------------------------------ the block LU
@pytest.mark.parametrize("seed", range(3))
def test_fronts_solve_a_sparse_block_matrix(seed):
    random = np.random.default_rng(seed)
    sizes = random.integers(1, 9, 12)
    ends = np.cumsum(sizes)
    rows = [np.arange(e - s, e) for e, s in zip(ends, sizes, strict=True)]
    coupled = random.random((12, 12)) < 0.2
    coupled |= coupled.T | np.eye(12, dtype=bool)
    A = random.standard_normal((ends[-1],) * 2) * np.repeat(
        np.repeat(coupled, sizes, axis=0), sizes, axis=1
    )
    A += 6 * np.sqrt(ends[-1]) * np.eye(ends[-1])
    fronts = Fronts.of(sizes, [set(np.flatnonzero(c)) - {k} for k, c in enumerate(coupled)])

    def block(g, others):
        wide = np.concatenate([rows[g], *(rows[h] for h in others)])
        return A[np.ix_(rows[g], wide)], A[np.ix_(wide[len(rows[g]) :], rows[g])]

    factor = fronts.factor(block)
    x = random.standard_normal(ends[-1])
    np.testing.assert_allclose(factor.solve(A @ x), x, atol=1e-4)
    assert fronts.entries < 1.5 * ends[-1] ** 2


def test_a_singular_front_is_named():
    fronts = Fronts.of([2], [set()])
    empty = np.zeros((2, 2)), np.zeros((0, 2))
    with pytest.raises(am.SingularOperator, match="front of group 0"):
        fronts.factor(lambda g, others: empty)


# ------------------------------------------------------------------ joints and Newton
def test_joints_solve_the_newton_equation(wall):
    local = wall.condensed()
    joints = Joints.of(local)
    assert joints is Joints.of(local.with_load(2 * local.q))  # kept with W
    assert len(joints.strips) < wall.contacts / 6
    random = np.random.default_rng(3)
    A = np.eye(3) * random.random((wall.contacts, 1, 1))
    B = local.rho[:, None, None] * (np.eye(3) - A)
    W = local.W.toarray()
    K = (B @ W.reshape(-1, 3, len(W))).reshape(W.shape)
    K += np.asarray(sparse.block_diag(list(A)).todense())
    joints.memory.kept = None  # of another law
    for scale in (1.0, 1e9):
        b = scale * random.standard_normal(local.q.shape)
        dr, count = joints.solve(A, B, b, 1e-4)
        left = np.linalg.norm(K @ dr.ravel() - b.ravel())
        assert left <= 5e-4 * np.linalg.norm(b)
        assert count <= 3
    nothing, count = joints.solve(A, B, np.zeros_like(b), 1e-4)
    assert count == 0
    assert not nothing.any()


def test_rigid_bodies_have_no_joints():
    assert Joints.of(am.SpherePacking(20).problem().condensed()) is None


def test_inexact_newton_finds_the_solution_and_keeps_its_factor(wall):
    local = wall.condensed()
    exact = am.drive(local, am.SemismoothNewton(), tolerance=1e-10)
    found = am.drive(local, am.InexactNewton(), tolerance=1e-10)
    assert exact.converged
    assert found.converged
    assert found.convergence.linear_iterations > 0
    np.testing.assert_allclose(found.r, exact.r, atol=1e-6 * abs(exact.r).max())
    kept = Joints.of(local).memory.kept
    near = am.drive(local, am.InexactNewton(), tolerance=1e-10, start=Iterate(1.001 * exact.r))
    assert near.converged
    assert near.convergence.iterations <= 4
    assert kept is not None


def test_parts_use_the_factor_of_the_whole(wall):
    local = wall.condensed()
    closed = np.flatnonzero(am.drive(local).r[:, 0] > 0)
    part = local.restricted(closed)
    found = am.drive(part, am.InexactNewton(), tolerance=1e-9)
    assert found.converged
    assert Joints.of(part.whole[0]) is Joints.of(local)
    np.testing.assert_allclose(found.r, am.drive(part, tolerance=1e-9).r,
                               atol=1e-5 * abs(found.r).max())  # fmt: skip


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize(("work", "kind"), [(0, am.InexactNewton), (1e6, am.SemismoothNewton)])
def test_auto_has_a_track_of_newton_on_walls(dim, work, kind, monkeypatch):
    """Inexact, or exact where an LU in blocks is little work."""
    problem = one_step(dim, rows=4).condensed()
    monkeypatch.setattr(portfolio_state, "EXACT_WORK", work)
    start, target = np.zeros((problem.contacts, 3)), Target(1e-9)
    assert portfolio_state.State(problem, target, start).newton_kind is kind
    table = [entry for entry in TRACKS if entry.name == "inexact Newton"]
    found = Portfolio(problem, target, start, tuple(table)).iterates()
    assert any(problem.error(iterate.r) <= 1e-9 for iterate in found)


def test_where_newton_stalls_the_portfolio_goes_on(wall, monkeypatch):
    monkeypatch.setattr(Joints, "newton_cost", lambda self, digits: 0.0)
    monkeypatch.setattr(portfolio_state, "EXACT_WORK", 0)
    monkeypatch.setattr(inexact.InexactNewton, "iterates", lambda *_: iter(()))
    solution = am.drive(wall, tolerance=1e-8)
    assert solution.converged
    assert solution.convergence.detail != "inexact Newton"
