"""Small steps are solved without a problem object: the same answers as the solvers give."""

import pickle
from dataclasses import replace

import numpy as np
import pytest

import amontons as am
from amontons.linear.blocks import BlockRows, inverse_norms
from amontons.mechanics.multibody import sweeping
from amontons.mechanics.multibody.quick import Found, eliminated_of

FLOOR = am.Plane((0, 0, 1))


def rocking(mu=2.0):
    """A slender block that is let go tilted by 0.1."""
    tilt, corner = 0.1, np.array([0.1, 0, -0.5])
    turn = np.array([[np.cos(tilt), 0, np.sin(tilt)], [0, 1, 0],
                     [-np.sin(tilt), 0, np.cos(tilt)]])  # fmt: skip
    block = am.RigidBody(
        am.cuboid((0.2, 0.2, 1.0)), 2500, [0.1, 0, 0] - turn @ corner,
        (np.cos(tilt / 2), 0, np.sin(tilt / 2), 0),
    )  # fmt: skip
    return am.RigidBodies([block], [FLOOR], mu=mu)


def pile(restitution=0.0):
    """Balls that fall on each other and on the floor."""
    at = np.random.default_rng(3).uniform(-0.05, 0.05, (5, 3))
    at[:, 2] = 0.12 + 0.21 * np.arange(5)
    balls = [am.RigidBody(am.Ball(0.1), position=place) for place in at]
    return am.RigidBodies(balls, [FLOOR], mu=0.3, restitution=restitution)


def pendulum():
    """A rod on a hinge, above a floor on which a second body stands."""
    rod = am.RigidBody(am.cuboid((0.1, 0.1, 1.0)), position=(0.5, 0, 1.0),
                       orientation=(np.cos(np.pi / 4), 0, np.sin(np.pi / 4), 0))  # fmt: skip
    box = am.RigidBody(am.cuboid((0.2, 0.2, 0.2)), position=(0.05, 0, 0.1))
    hinge = [am.Joint(0, -1, (0, y, 1.0)) for y in (-0.2, 0.2)]
    return am.RigidBodies([rod, box], [FLOOR], mu=0.5, joints=hinge)


def both(system, step, until, tolerance=1e-12):
    """Steps by sweeps and by the solver that is chosen otherwise."""
    asked = {"step": step, "until": until, "tolerance": tolerance}
    return (
        list(am.evolve_rigid(system, **asked, solver=solver)) for solver in (None, am.Auto())
    )


@pytest.mark.parametrize(
    ("make", "until", "tolerance"),
    # the rod wedges under its hinge, where rounding alone hides an error of 1.5e-11
    [(rocking, 2.2, 1e-12), (pile, 0.5, 1e-12), (lambda: pile(0.4), 0.5, 1e-12),
     (pendulum, 0.55, 1e-12), (pendulum, 0.8, 1e-10)],
)  # fmt: skip
def test_quick_steps_follow_those_of_the_solvers(make, until, tolerance):
    """Within what the tolerance lets them differ, over impacts."""
    system = make()
    ours, theirs = both(system, 2e-3, until, tolerance)
    assert sum(isinstance(s._solved, Found) for s in ours) > 0.5 * len(ours)
    assert not any(isinstance(s._solved, Found) for s in theirs)
    for a, b in zip(ours, theirs, strict=True):
        np.testing.assert_allclose(a.position, b.position, rtol=0, atol=1e-10)
        np.testing.assert_allclose(a.rotation, b.rotation, rtol=0, atol=1e-10)
    assert max(abs(s.energies.defect) for s in ours) < 1e-12 * ours[0].energies.potential


def test_sweeps_with_momentum_follow_the_solvers_too(monkeypatch):
    """As many contacts have them, which plain sweeps are too dear for."""
    monkeypatch.setattr(sweeping, "WORK", 0)
    for system, step in ((pile(), 2e-3), (pendulum(), 2e-3)):
        ours, theirs = both(system, step, 0.3)
        swept = [s._solved for s in ours if isinstance(s._solved, Found)]
        assert len(swept) > 50 and max(found.sweeps for found in swept) > 2
        np.testing.assert_allclose(ours[-1].position, list(theirs)[-1].position, atol=1e-10)


def test_bad_impulses_of_the_last_step_are_no_start():
    """After an impact none are better: the step is that from no impulses, bit by bit."""
    system = pile()
    late = list(am.evolve_rigid(system, step=2e-3, until=0.4))[-1].state
    bad, none = (
        next(am.evolve_rigid(system, step=2e-3, until=0.402,
                             start=replace(late, impulses=factor * late.impulses)))
        for factor in (1e6, 0.0)
    )  # fmt: skip
    np.testing.assert_array_equal(bad.r, none.r)


def test_one_step_is_that_of_the_solvers_to_rounding():
    """From the same states, with impacts among them."""
    system = pile()
    for before in list(am.evolve_rigid(system, step=2e-3, until=0.5))[::5]:
        options = {"step": 2e-3, "until": before.time + 2e-3, "start": before.state}
        ours, theirs = (
            next(am.evolve_rigid(system, tolerance=1e-14, solver=solver, **options))
            for solver in (None, am.Auto())
        )
        for name in ("position", "velocity", "spin"):
            a, b = (getattr(s.state.motion, name) for s in (ours, theirs))
            np.testing.assert_allclose(a, b, rtol=0, atol=1e-12, err_msg=name)


def test_the_solution_is_told_as_by_the_solvers():
    steps = list(am.evolve_rigid(rocking(), step=1e-3, until=0.5))
    for step in steps[::50]:
        if step.solution is None:
            continue
        solution = step.solution
        assert isinstance(step._solved, Found) and solution is step.solution
        problem, record = solution.problem, solution.convergence
        assert solution.converged and record.error <= record.tolerance == 1e-6
        assert problem.error(solution.r) == pytest.approx(record.error, abs=1e-12)
        weakest = problem.weakest(solution.r)
        assert weakest.error == pytest.approx(record.contact_error, abs=1e-12)
        np.testing.assert_array_equal(solution.r[: len(step.r)], step.r)
        np.testing.assert_allclose(solution.u, problem.velocity(solution.r)[0], atol=1e-12)
        again = am.drive(problem, start=solution, tolerance=1e-6, contact_tolerance=np.inf)
        np.testing.assert_array_equal(solution.status, again.status)
        np.testing.assert_array_equal(step.status, again.status[: len(step.r)])
        assert str(record).startswith("converged with GaussSeidel")
    copy = pickle.loads(pickle.dumps(steps[-1]))
    np.testing.assert_array_equal(copy.solution.r, steps[-1].solution.r)


def test_what_sweeps_do_not_solve_goes_to_the_solvers_with_the_same_start(monkeypatch):
    """And what these do not solve is reported: a tolerance that rounding does not allow."""
    system = pile()
    late = list(am.evolve_rigid(system, step=2e-3, until=0.4))[-1].state
    monkeypatch.setattr(sweeping, "WORK", 0)
    monkeypatch.setattr(sweeping.Search, "swept_while_promising", lambda self, start: None)
    monkeypatch.setattr(sweeping, "ROUNDS", 0)
    step = next(am.evolve_rigid(system, step=2e-3, until=0.402, start=late))
    assert not isinstance(step._solved, Found) and step.solution.converged
    with pytest.raises(am.NotConverged, match="step"):
        next(am.evolve_rigid(system, step=2e-3, until=0.402, start=late, tolerance=1e-30))
    monkeypatch.undo()
    with pytest.raises(am.NotConverged, match="step"):
        next(am.evolve_rigid(system, step=2e-3, until=0.402, start=late, tolerance=1e-30))


def test_blocks_are_eliminated_as_by_numpy():
    """Regular ones, of bad condition, singular and zero."""
    rng = np.random.default_rng(5)
    root = rng.standard_normal((40, 3, 3))
    root[10:20, :, 2] *= 1e-2
    root[20:30, :, 1:] = 0.0
    A = root @ root.swapaxes(1, 2) * 10.0 ** rng.uniform(-6, 6, (40, 1, 1))
    A[30:35] = np.eye(3) * rng.uniform(1, 2, (5, 1, 1))
    A[35:] = 0.0
    number = np.arange(40, dtype=np.int32)
    out, rho = eliminated_of(A, number)
    expected = BlockRows(np.arange(41, dtype=np.int32), number, A, number).eliminated
    size = np.abs(A).max(axis=(1, 2))
    unit = np.repeat([0, -1, 0, 1, 2], [1, 9, 2, 4, 1])
    scale = np.where(size > 0, size, 1.0)[:, None] ** unit
    assert 10 < expected[:, 0].sum() < 30
    # the inverse of a block at the edge of what counts as regular loses six digits
    np.testing.assert_allclose(out / scale, expected / scale, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(rho, inverse_norms(A), rtol=1e-12)
