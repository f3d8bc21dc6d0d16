"""Processes that fork, spawn or are served after a solve: factors do not come along alive."""

import multiprocessing
import os
from concurrent.futures import ProcessPoolExecutor

import numpy as np
import pytest
from scipy import sparse

import amontons as am
from amontons.linear.direct import Backend

N = 400
SECONDS = 60  # a deadlock, not a slow machine
FORKS = hasattr(os, "fork")
pytestmark = [
    pytest.mark.skipif(not FORKS, reason="no fork on this system"),
    pytest.mark.filterwarnings("ignore:.*multi-threaded.*fork:DeprecationWarning"),
]


def problem(stiffness=2.0):
    """One contact at the end of a chain: M is factorised."""
    M = sparse.diags_array(
        [[-1.0] * (N - 1), [stiffness] * N, [-1.0] * (N - 1)], offsets=[-1, 0, 1]
    )
    H = sparse.csc_array(np.eye(N, 2))
    return am.FrictionProblem.from_global(
        M.tocsc(), H, np.full(N, -0.01), np.zeros((1, 2)), [0.3]
    )


def pool(method, target, argument):
    """The result of a call in another process."""
    with multiprocessing.get_context(method).Pool(1) as workers:
        return workers.apply_async(target, (argument,)).get(timeout=SECONDS)


def executor(method, target, argument):
    context = multiprocessing.get_context(method)
    with ProcessPoolExecutor(1, mp_context=context) as workers:
        return workers.submit(target, argument).result(timeout=SECONDS)


def solved_again(mu):
    return am.solve(KNOWN.with_mu(mu)).r


def solved_anew(stiffness):
    return am.solve(problem(stiffness)).r


def solved_with_rslab(stiffness):
    return am.linear.Direct(Backend.RSLAB).factor(problem(stiffness).M)


def forked_twice(stiffness):
    """In a process of a process."""
    reading, writing = os.pipe()
    if os.fork() == 0:
        os.write(writing, am.solve(problem(stiffness)).r.tobytes())
        os._exit(0)
    os.wait()
    return np.frombuffer(os.read(reading, 16)).reshape(1, 2)


KNOWN = problem()


@pytest.mark.parametrize("call", [pool, executor])
@pytest.mark.parametrize(
    ("target", "argument"), [(solved_again, 0.2), (solved_anew, 2.5), (forked_twice, 2.5)]
)
def test_forked_processes_solve_with_old_and_new_factors(call, target, argument):
    here = solved_again(argument) if target is solved_again else solved_anew(argument)
    assert call("fork", target, argument) == pytest.approx(here, rel=1e-12)


def large(n=200):
    """A membrane of n^2 unknowns, whose factor is solved with by several threads."""
    beside = [-1.0] * (n - 1)
    line = sparse.diags_array([beside, [2.0] * n, beside], offsets=[-1, 0, 1])
    eye = sparse.eye_array(n)
    return (sparse.kron(line, eye) + sparse.kron(eye, line)).tocsc()


FACTORS = []


def solved_with_the_factor(columns):
    b = np.ones((FACTORS[0].matrix.shape[0], columns))
    return FACTORS[0].solve(b).sum(axis=0)


@pytest.mark.parametrize("columns", [1, 8])
def test_a_large_factor_is_made_again_in_a_forked_process(columns):
    matrix = large()
    factor = am.linear.Direct().factor(matrix)
    FACTORS[:] = [type("Both", (), {"matrix": matrix, "solve": factor.apply})]
    here = solved_with_the_factor(columns)
    assert pool("fork", solved_with_the_factor, columns) == pytest.approx(here, rel=1e-10)


@pytest.mark.skipif(not Backend.RSLAB.installed, reason="no rslab")
def test_a_forked_process_refuses_a_backend_that_would_wait_forever():
    am.solve(KNOWN)
    with pytest.raises(am.InvalidInput, match=r"RSLAB.*fork.*spawn"):
        pool("fork", solved_with_rslab, 2.0)


def test_a_spawned_process_takes_a_solved_problem_and_gives_its_solution_back():
    here = am.solve(KNOWN)
    there = pool("spawn", am.solve, KNOWN)
    assert there.converged
    assert there.r == pytest.approx(here.r, rel=1e-12)


@pytest.mark.slow_faults
@pytest.mark.parametrize("call", [pool, executor])
@pytest.mark.parametrize("method", ["spawn", "forkserver"])
def test_other_ways_to_start_processes(call, method):
    box = am.Body(am.box((1, 1, 1), 6), am.LinearElastic(1.0, 0.3))
    model = am.Model([box], supports=[am.Fix("top", (0, 0, -0.01))],
                     contacts=[am.Contact("bottom", am.Plane((0, 0, 1)), mu=0.3)])  # fmt: skip
    here = am.solve(model)
    for given in (model, KNOWN):
        assert call(method, am.solve, given).converged
    assert call(method, am.solve, model).r == pytest.approx(here.r, rel=1e-9)
