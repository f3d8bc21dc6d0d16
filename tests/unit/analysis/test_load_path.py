"""Large deformations as path problems: pieces, derivatives, kernels, the folds of a block."""

import numpy as np
import pytest
from scipy import sparse

import amontons as am
from amontons.analysis.paths.continuation import Continuation
from amontons.analysis.paths.following import Limits, continue_both
from amontons.analysis.paths.load_path import LoadPath
from amontons.analysis.paths.sparse_kernel import sparse_kernel
from amontons.mechanics.model.large_deformation import large_deformation
from amontons.problem.law.states import OPEN, STICK

TURN = 0.023


def block(cells):
    """The rectangular block of ligursky2014 on a coarse mesh, and its rigidly turned state."""
    mesh = am.box((40, 80), cells=(cells, 2 * cells))
    law = am.CiarletGeymonat.from_lame(4000.0, 120.0, 30.0)
    c, s = -2 * np.sin(TURN / 2) ** 2, np.sin(TURN)

    def model(down):
        top = am.Fix("top", lambda x: (x[0] * c, x[0] * s - down))
        contact = am.Contact("bottom", am.Plane((0, 1)), mu=1.8)
        return am.Model([am.Body(mesh, law, integration="full")], [top], [contact])

    first, last = (large_deformation(model(down)) for down in (0.0, 1.0))
    path = LoadPath(last, first.load, first.prescribed)
    turned = (mesh.points - [0, 80]) @ np.array([[c, s], [-s, c]])
    return path, turned.ravel()[last.parts.free]


def sphere_path():
    """A small block pressed on a ball, with a drift."""
    mesh = am.box((1, 1), cells=3)
    model = am.Model([am.Body(mesh, am.NeoHookean(1.0, 0.3))], [am.Fix("top", (0.2, -0.2))],
                     [am.Contact("bottom", am.Sphere((0.4, -1), 1.0), mu=0.5)],
                     [am.Traction("left", (0.02, 0))])  # fmt: skip
    step = large_deformation(model)
    drift = 0.01 * np.random.default_rng(0).standard_normal(step.drift.shape)
    return LoadPath(step, 0.3 * step.load, 0.2 * step.prescribed, drift)


def test_selection_functions_and_their_derivatives():
    path = sphere_path()
    rng = np.random.default_rng(1)
    for _ in range(5):
        y, p = 0.03 * rng.standard_normal(path.step.unknowns), rng.uniform()
        active = path.piece(y, p)
        assert np.array_equal(path.residual_of(active, y, p), path.residual(y, p))
        assert (path.margins(active, y, p) >= 0).all()
        for piece in (active, "fs+-", "+-sf", "ssss"):
            if piece != active:
                assert (path.margins(piece, y, p) < 0).any()
            dy, dp = rng.standard_normal(y.shape), rng.standard_normal()
            J, Jp = path.jacobian_of(piece, y, p)
            h = 1e-6
            ahead = path.residual_of(piece, y + h * dy, p + h * dp)
            behind = path.residual_of(piece, y - h * dy, p - h * dp)
            change = (ahead - behind) / (2 * h)
            assert np.abs(J @ dy + Jp * dp - change).max() < 1e-6 * np.abs(change).max()
        J, Jp = path.jacobian(y, p)
        same = path.jacobian_of(active, y, p)
        assert abs(J - same[0]).max() == 0
        assert np.array_equal(Jp, same[1])


def test_pieces_that_meet_are_all_named():
    """A corner touches without force, after it has moved to the right: free or slip back."""
    path, y = block(2)
    assert path.pieces(y, 0.0, 1e-9) == ["fff"]
    lowest = path.at(0.0).local_velocity(y)[0, 0]
    down = np.zeros(path.step.parts.X.shape)
    down[:, 1] = -lowest  # with the top
    found = path.pieces(y + down.ravel()[path.step.parts.free], lowest, 1e-7)
    assert set(found) == {"fff", "-ff"}


def test_inverted_cells_have_an_infinite_residual_and_no_tangent():
    path, y = block(2)
    assert np.isinf(path.residual(y * 100, 0.0)).all()
    with pytest.raises(np.linalg.LinAlgError):
        path.jacobian(y * 100, 0.0)


def test_the_block_starts_at_rest_and_has_two_folds():
    path, y = block(4)
    assert np.abs(path.residual(y, 0.0)).max() < 1e-14
    folds = []
    for longest in (0.5, 0.1):
        options = Continuation(max_step=longest)
        branch = continue_both(path, y, 0.0, Limits((0.0, 1.0)), options)
        assert branch.parameter[-1] == 1.0
        folds.append([event.parameter for event in branch.folds])
        assert branch.folds[0].before[-2:] == "ff"
    high, low = folds[0]
    assert 0.49 < low < high < 0.55
    assert np.abs(np.subtract(*folds)).max() < 1e-9
    middle = (low + high) / 2
    states = branch.at(middle)
    assert len(states) == 3
    for state in states:
        problem = path.at(middle)
        assert np.abs(problem.residual(state)).max() < 1e-9
        r, u = problem.reactions(state), problem.local_velocity(state)
        assert u[:, 0].min() > -1e-12
        assert r[:, 0].min() > -1e-9
        assert np.abs(r[:, 0] * u[:, 0]).max() < 1e-9
        assert (np.abs(r[:, 1]) <= 1.8 * r[:, 0] + 1e-8).all()
        assert (r[:, 1] * u[:, 1]).max() < 1e-9
    assert {problem.pieces(state)[-1] for state in states} >= {OPEN, STICK}


@pytest.mark.parametrize("lines", [1, 2])
def test_kernels_of_sparse_matrices(lines):
    rng = np.random.default_rng(lines)
    for n in (7, 40):
        J, Jp = rng.standard_normal((n, n)), rng.standard_normal(n)
        J[:, 0] = J[:, 1]  # J alone is singular: the line may be without p
        if lines == 2:
            J[2], Jp[2] = J[3], Jp[3]
        found = sparse_kernel(sparse.csc_array(J), Jp, 1 / n, 1e-10)
        assert found.shape == (n + 1, lines)
        assert np.abs(J @ found[:-1] + np.outer(Jp, found[-1])).max() < 1e-12
        weight = np.r_[np.full(n, 1 / n), 1.0]
        assert np.allclose((found.T * weight) @ found, np.eye(lines), atol=1e-10)


def test_an_evolution_crosses_a_jump():
    """A block that slides lets go of its ground in a jump: load steps alone end at the fold."""

    def top(x, t):
        return 0.5 * max(0.0, t - 1), -0.2 * min(t, 1.0)

    mesh = am.box((1, 1), cells=6)
    model = am.Model([am.Body(mesh, am.NeoHookean(1.0, 0.3))], [am.Fix("top", top)],
                     [am.Contact("bottom", am.Plane((0, 1)), mu=0.3)])  # fmt: skip
    *_, before = am.evolve(model, am.QuasiStatic(0.25), until=1.75)
    with pytest.raises(am.NotConverged, match="no equilibrium found beyond 0.8"):
        list(am.evolve(model, am.QuasiStatic(0.25), until=2.0, start=before.state))
    solver = am.NonlinearNewton(crossing=am.PathCrossing())
    (after,) = am.evolve(
        model, am.QuasiStatic(0.25), until=2.0, start=before.state, solver=solver
    )
    assert "over folds at 0.879" in after.solution.convergence.detail
    assert after.solution.converged
    r, gap = after.state.force, after.gap
    assert gap.min() > -1e-10
    assert r[:, 0].min() > -1e-8
    assert np.abs(r[:, 0] * gap).max() < 1e-9
    assert (np.abs(r[:, 1]) <= 0.3 * r[:, 0] + 1e-8).all()
    with pytest.raises(am.NotConverged, match="followed to"):
        list(am.evolve(
            model, am.QuasiStatic(0.25), until=2.0, start=before.state,
            solver=am.NonlinearNewton(crossing=am.PathCrossing(max_points=2)),
        ))  # fmt: skip


@pytest.mark.parametrize("cells", [3, 6])
def test_contacts_without_friction_close_and_slip(cells):
    """Each point of the curve is a solution: no contact may stick after it closes."""
    body = am.Body(am.box((1, 1), cells=cells), am.NeoHookean(1.0, 0.3))
    ground = am.Plane(point=(0, -0.03), normal=(0.1, 1))
    model = am.Model([body], [am.Fix("top", (0.12, -0.17))],
                     contacts=[am.Contact("bottom", ground, mu=0.0)])  # fmt: skip
    branch = am.follow(model)
    assert branch.stops == (am.Stop.INTERVAL, am.Stop.INTERVAL)
    closing = [e for e in branch.events if e.kind is am.EventKind.STATUS]
    assert len(closing) == cells + 1
    assert set("".join(map(str, branch.status))) <= {"f", "+"}
    errors = [s.convergence.error for s in branch.solutions[1:]]
    assert max(errors) < 1e-8
    solved = am.solve(model, tolerance=1e-10)
    np.testing.assert_allclose(branch.solutions[-1].r, solved.r, atol=1e-8)
