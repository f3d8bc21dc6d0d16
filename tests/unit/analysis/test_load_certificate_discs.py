"""Certificates for one load in 3D: never a wrong one, and each checked by other code."""

import numpy as np
import pytest
from brute_force_3d import random_problem_3d, solutions_by_brute_force
from disc_checker import accepted

import amontons as am
from amontons.analysis.certificates.one_load import certificate as one_load
from amontons.analysis.certificates.one_load.answer import LoadOutcome
from amontons.analysis.certificates.one_load.certificate import certify_load
from amontons.analysis.solutions.discs.search import DiscProof
from amontons.mechanics.ready.gallery import random_delassus


def certificate(W, q, mu, r, **options):
    problem = am.FrictionProblem.from_delassus(W, q, mu)
    solution = min(
        am.multistart(problem, starts=100).solutions, key=lambda s: np.abs(s.r - r).max()
    )
    return certify_load(problem, solution, **options)


@pytest.mark.parametrize("seed", [1, 6, 12, 14, 30])
def test_certified_or_refuted_as_a_fine_search_has_it(monkeypatch, seed):
    monkeypatch.setattr(one_load, "FEW", {2: 1000, 3: 1000})
    W, q, mu = random_problem_3d(seed)
    truth = solutions_by_brute_force(W, q, mu, angles=18, most=1500)
    answer = certificate(W, q, mu, truth[0][1], time_limit=600)
    if len(truth) == 1:
        assert answer.outcome is LoadOutcome.CERTIFIED
        assert accepted(W, q, mu, DiscProof(answer.branches, ()), [truth[0][1]])
    else:
        assert answer.outcome is LoadOutcome.REFUTED
        assert am.FrictionProblem.from_delassus(W, q, mu).error(answer.other.r) < 1e-8
        assert np.abs(answer.other.r - answer.r0).max() > 1e-3


def test_the_cube_has_one_solution():
    body = am.Body(am.box((1, 1, 1), cells=2), am.LinearElastic(young=200, poisson=0.3))
    model = am.Model(
        [body],
        supports=[am.Fix("top", lambda x: (0, 0.2, 0.06 - 0.15 * x[0]))],
        contacts=[am.Contact("bottom", am.Plane(normal=(0, 0, 1)), mu=1.0)],
    )
    problem = model.assemble().condensed()
    answer = certify_load(problem, am.solve(problem), time_limit=600)
    assert answer.outcome is LoadOutcome.CERTIFIED
    assert answer.r0 == pytest.approx(am.solve(problem).r, abs=1e-6)


def test_no_time_is_undecided():
    W, q, mu = random_problem_3d(10)
    problem = am.FrictionProblem.from_delassus(W, q, mu)
    answer = certify_load(problem, am.solve(problem), time_limit=1e-6)
    assert answer.outcome is LoadOutcome.UNDECIDED
    assert "stopped" in answer.reason


def test_what_is_no_solution_is_refused():
    problem = random_delassus(0, 2, 3)
    solution = am.solve(problem)
    other = am.solve(random_delassus(1, 3, 3))
    with pytest.raises(am.InvalidInput, match="expected reactions"):
        certify_load(problem, other)
    with pytest.raises(am.InvalidInput, match="expected a solution"):
        certify_load(problem.with_load(-np.ones((2, 3))), solution)
    with pytest.raises(am.InvalidInput, match="time_limit"):
        certify_load(problem, solution, time_limit=0)
