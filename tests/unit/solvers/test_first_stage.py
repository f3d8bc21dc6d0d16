"""The compiled first stage of Auto: where it ends, and how the race goes on from there."""

import numpy as np
import pytest

import amontons as am
from amontons.solvers.auto.first_stage import first_chunks
from amontons.solvers.auto.tracks import EARLY, LEAST, sweeps_on_stacks
from amontons.solvers.sweeps.kernels import (
    Acceleration,
    SweepOrder,
    sweep_data,
    watch_for,
)


def faint(seed, size):
    """30 contacts that do not couple, loaded by 1, beside a chain of 30 loaded by `size`."""
    random = np.random.default_rng(seed)
    chain = 2.0 * np.eye(60) - 0.95 * (np.eye(60, k=1) + np.eye(60, k=-1))
    chain[:31, :31] = 2.0 * np.eye(31)
    W = np.kron(chain, np.eye(3) + 0.1 * np.ones((3, 3)))
    q = random.standard_normal((60, 3)) - [2.0, 0, 0]
    q[30:] *= size
    return am.FrictionProblem.from_delassus(W, q, np.full(60, 0.4))


@pytest.mark.parametrize("size", [1e-3, 1e-4])
def test_ends_with_the_first_sweep_that_will_do_at_every_contact(size):
    problem, tolerance = faint(3, size), 1e-3
    found = am.drive(problem, tolerance=tolerance)
    record = found.convergence
    sweeps = Acceleration(
        sweep_data(problem, order=SweepOrder.APPROACH), np.zeros((60, 3)), 10
    )
    in_sum = None
    for k in range(1, 100):
        sweeps.sweep(1, watch_for(0.0))
        good = problem.error(sweeps.r) <= tolerance
        in_sum = k if good and in_sum is None else in_sum
        if good and problem.weakest(sweeps.r).error <= tolerance**0.5:
            break
    assert found.converged
    assert in_sum < k
    assert record.iterations == k
    assert record.error == pytest.approx(problem.error(found.r), rel=1e-9)
    assert record.contact_error == pytest.approx(problem.weakest(found.r).error, rel=1e-9)


@pytest.mark.parametrize("seed", [1, 2])
def test_the_race_goes_on_where_the_first_stage_was(seed):
    problem = am.SpherePacking(60, mu=0.3, seed=seed).problem().condensed()
    found = am.drive(problem, tolerance=1e-11)
    watched = am.drive(problem, tolerance=1e-11, callback=lambda step, iterate: None)
    chunks = first_chunks(len(problem.blocks.indices), problem.contacts)
    assert found.convergence.iterations > sum(chunks)
    assert found.convergence.solver == watched.convergence.solver == "Auto"
    assert found.convergence.iterations == watched.convergence.iterations
    assert np.allclose(found.r, watched.r, rtol=1e-9, atol=1e-9 * abs(watched.r).max())


def test_records_are_whole():
    found = am.drive(faint(1, 1.0))
    assert str(found.convergence).startswith("converged with Auto")
    assert found.convergence.advice
    assert not found.r.flags.writeable
    assert not found.u.flags.writeable
    assert found.warnings == ()
    assert len(found.pattern) == 60


def test_on_stacks_the_first_chunk_is_shorter_where_sweeps_are_dear():
    counts = [sweeps_on_stacks(cost) for cost in (5e3, 2e4, 1e6)]
    assert counts[0] == LEAST
    assert EARLY <= counts[1] <= LEAST
    assert counts[2] == EARLY
