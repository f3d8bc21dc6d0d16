"""The one-sided basis: against direct elimination, same solutions, no copies, no structure."""

import numpy as np
import pytest
from scipy import sparse

import amontons as am
from amontons.mechanics.ready.gallery import box_tower
from amontons.problem.friction import FrictionProblem
from amontons.problem.one_sided import HELD, one_sided

SOFT = am.LinearElastic(young=100, poisson=0.3)


def two_blocks(dim=3, lower=3, upper=2, supports=()):
    size, up = (1,) * dim, (0,) * (dim - 1) + (1,)
    bodies = [
        am.Body(am.box(size, lower), SOFT, name="lower"),
        am.Body(am.box(size, upper, origin=up), SOFT, name="upper"),
    ]
    drop = (0.005, -0.05) if dim == 2 else (0, 0.005, -0.05)
    return am.Model(
        bodies,
        [am.Fix("lower.bottom", 0), am.Fix("upper.top", drop), *supports],
        [am.Contact("upper.bottom", master="lower.top", mu=0.2, method="nodal")],
    )


def dense_elimination(problem, basis):
    """M, f, H in the unknowns (slave relative to the other side, rest), dense algebra only."""
    H, nc, d = problem.H.toarray(), problem.contacts, problem.dimension
    T = np.eye(problem.unknowns)
    for p in range(nc):
        dofs = basis.dofs[p][basis.dofs[p] != HELD]
        block = H[:, p * d : (p + 1) * d]
        rest = block.copy()
        rest[dofs] = 0
        T[dofs] -= np.linalg.pinv(block[dofs].T) @ rest.T
    return T, T.T @ problem.M.toarray() @ T, T.T @ problem.f, T.T @ H


def slab(dim):
    """The slave, held at one end, its other sides beyond the master's; with levels."""
    at = (0.0, *(0.2,) * (dim - 2), 1.0)
    bodies = [
        am.Body(am.refined(am.box((1,) * dim, 2)), SOFT, name="lower"),
        am.Body(am.refined(am.box((0.6,) * dim, 1, origin=at)), SOFT, name="upper"),
    ]
    drop = (0.01, *(0,) * (dim - 2), -0.05)
    return am.Model(
        bodies,
        [am.Fix("lower.bottom", 0), am.Fix("lower.left", 0), am.Fix("upper.top", drop)],
        [am.Contact("lower.top", master="upper.bottom", mu=0.3, method="mortar")],
    )


@pytest.mark.parametrize("model", [two_blocks(2), two_blocks(3), slab(2), slab(3)])
def test_it_is_direct_elimination(model):
    problem, dim = model.assemble(), model.dimension
    basis = one_sided(problem)
    T, M, f, H = dense_elimination(problem, basis)
    size = abs(M).max()
    np.testing.assert_allclose(basis.M.toarray(), M, atol=1e-13 * size)
    np.testing.assert_allclose(basis.f, f, atol=1e-13 * abs(f).max())
    np.testing.assert_allclose(basis.H.toarray(), H, atol=1e-14)
    vhat = np.random.default_rng(0).normal(size=problem.unknowns)
    np.testing.assert_allclose(basis.to_displacement(vhat), T @ vhat, atol=1e-14)
    np.testing.assert_allclose(basis.from_displacement(T @ vhat), vhat, atol=1e-13)
    modes = np.linalg.solve(T, problem.near_nullspace)
    np.testing.assert_allclose(basis.near_nullspace, modes, atol=1e-14)
    u = np.einsum("pij,pj->pi", basis.frames, vhat[basis.dofs])
    np.testing.assert_allclose(u, (H.T @ vhat).reshape(u.shape), atol=1e-14)
    identity = np.einsum("pij,pik->pjk", basis.axes, basis.axes)
    np.testing.assert_allclose(identity, np.tile(np.eye(dim), (len(u), 1, 1)), atol=1e-14)
    inverse = np.einsum("pij,pik->pjk", basis.inverse, basis.frames)
    np.testing.assert_allclose(inverse, np.tile(np.eye(dim), (len(u), 1, 1)), atol=1e-14)


def test_the_slave_keeps_its_side():
    """Rows n, t1, t2 are right-handed on the slave; its nodes carry the dofs."""
    model = two_blocks()
    problem = model.assemble()
    basis = one_sided(problem)
    parts = model.discretisation
    assert (parts.free[basis.dofs] >= parts.offsets[1]).all()
    np.testing.assert_allclose(np.linalg.det(basis.frames), 1)


def test_both_bases_have_one_solution():
    problem = two_blocks().assemble()
    basis = one_sided(problem)
    hat = FrictionProblem.from_global(basis.M, basis.H, basis.f, problem.w, problem.mu)
    ours, theirs = am.drive(hat, tolerance=1e-11), am.drive(problem, tolerance=1e-11)
    assert {"slip", "stick"} <= {k for k, v in theirs.counts.items() if v}
    np.testing.assert_allclose(ours.r, theirs.r, atol=1e-8 * abs(theirs.r).max())
    v = basis.to_displacement(ours.v)
    np.testing.assert_allclose(v, theirs.v, atol=1e-8 * abs(theirs.v).max())


@pytest.mark.parametrize("solver", [
    am.ContactMultigrid(), am.ActiveSet(bound=am.FrictionBound.FIXED_POINT, nested=True),
    am.ActiveSet(bound=am.FrictionBound.FIXED_POINT, multigrid=am.MultigridCycle()),
])  # fmt: skip
def test_solvers_know_shares_of_other_nodes(solver):
    problem = slab(3).assemble()
    assert one_sided(problem).scale.min() < 0.7
    expected, found = (am.drive(problem, s, tolerance=1e-10)
                       for s in (am.SemismoothNewton(), solver))  # fmt: skip
    assert {"slip", "stick"} <= {k for k, v in expected.counts.items() if v}
    np.testing.assert_allclose(found.r, expected.r, atol=1e-7 * abs(expected.r).max())


def test_one_body_copies_nothing():
    block = am.Body(am.box((1, 1, 1), 2), SOFT)
    model = am.Model(
        [block], [am.Fix("top", 0)], [am.Contact("bottom", am.Plane((0, 0, 1)), mu=1)]
    )
    problem = model.assemble()
    basis = one_sided(problem)
    assert basis.M is problem.M
    assert basis.f is problem.f
    assert basis.H is problem.H
    assert basis.near_nullspace is problem.near_nullspace
    assert basis.coupling is None
    vhat = np.ones(problem.unknowns)
    assert basis.to_displacement(vhat) is vhat


def test_levels_are_those_of_the_new_basis():
    problem = two_blocks(3, 4, 2).assemble()
    basis = one_sided(problem)
    assert basis.levels[1:] == problem.levels[1:]
    coarse = np.random.default_rng(0).normal(size=problem.levels[0].shape[1])
    fine = basis.to_displacement(basis.levels[0] @ coarse)
    np.testing.assert_allclose(fine, problem.levels[0] @ coarse, atol=1e-14)


def test_variants_share_the_matrix():
    problem = two_blocks().assemble()
    first, other = one_sided(problem), one_sided(problem.with_load(2 * problem.f).with_mu(0.1))
    assert other.M is first.M
    np.testing.assert_allclose(other.f, 2 * first.f)


def test_matching_meshes_take_one_side():
    basis = one_sided(two_blocks(2, 2, 2).assemble())
    assert basis is not None
    dofs = np.sort(basis.dofs.ravel())
    assert len(np.unique(dofs)) == dofs.size
    assert np.ptp(dofs) < basis.M.shape[0] / 2  # not some here and some there


def test_planes_of_symmetry_leave_fewer_dofs():
    """Held on x = 0 on both sides of matching meshes, and against a plane."""
    held = [am.Fix("lower.left", (0, None, None)), am.Fix("upper.left", (0, None, None))]
    problem = two_blocks(3, 2, 2, held).assemble()
    basis = one_sided(problem)
    missing = basis.dofs == HELD
    assert (missing.sum(axis=1) <= 1).all()
    assert missing.sum() == 3
    assert not basis.frames.transpose(0, 2, 1)[missing].any()
    T, M, _, _ = dense_elimination(problem, basis)
    np.testing.assert_allclose(basis.M.toarray(), M, atol=1e-13 * abs(M).max())


def test_no_structure_is_none():
    assert one_sided(box_tower()) is None
    problem = two_blocks(2).assemble()
    assert one_sided(problem.condensed()) is None
    doubled = sparse.hstack([problem.H, problem.H])  # each node in two contacts
    twice = FrictionProblem.from_global(
        problem.M, doubled, problem.f, np.tile(problem.w, (2, 1)), np.tile(problem.mu, 2)
    )
    assert one_sided(twice) is None
    scaled = FrictionProblem.from_global(
        problem.M, 2 * problem.H, problem.f, problem.w, problem.mu
    )
    assert one_sided(scaled) is None
    held = two_blocks(3, 3, 2, [am.Fix("upper.left", (0, None, None))])
    assert one_sided(held.assemble()) is None  # the master slides past a held slave
