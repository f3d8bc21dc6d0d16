"""`FrictionProblem.update`: another W, q or mu, and what is kept of the old one."""

import numpy as np
import pytest
from scipy import sparse

import amontons as am
from amontons.mechanics.ready.gallery import random_delassus
from amontons.solvers.newton.block_lu import Symbolic


@pytest.fixture
def packing():
    """A sparse one."""
    return am.SpherePacking(20, seed=2).problem().condensed()


def test_all_of_it_is_another_problem(packing):
    W, q, mu = 2 * packing.W, 3 * packing.q, 0.5 * packing.mu
    found = packing.update(W=W, q=q, mu=mu)
    made = am.FrictionProblem.from_delassus(W, q, mu)
    assert np.array_equal(found.blocks.data, made.blocks.data)
    assert np.array_equal(am.drive(found).r, am.drive(made).r)
    assert not np.array_equal(packing.blocks.data, found.blocks.data)


def test_what_is_not_given_stays(packing):
    found = packing.update(q=2 * packing.q)
    assert found.W is packing.W
    assert np.array_equal(found.mu, packing.mu)
    assert packing.update().q is packing.q


def test_the_order_of_elimination_is_kept(packing):
    kept = Symbolic.of(packing)
    assert Symbolic.of(packing.update(W=0.5 * packing.W)) is kept
    assert Symbolic.of(packing.update(mu=0.1)) is kept


def test_another_pattern_is_analysed_anew(packing):
    kept = Symbolic.of(packing)
    diagonal = sparse.csr_array(sparse.diags_array(packing.W.diagonal()))
    found = packing.update(W=diagonal)
    assert Symbolic.of(found) is not kept
    assert Symbolic.of(found).products == 0
    assert am.drive(found).converged


def test_dense_and_sparse():
    problem = random_delassus(1, 6, rank=30)
    W = np.asarray(problem.W.toarray() if sparse.issparse(problem.W) else problem.W)
    found = problem.update(W=sparse.csr_array(2 * W))
    assert np.allclose(am.drive(found, tolerance=1e-12).r,
                       0.5 * am.drive(problem, tolerance=1e-12).r, atol=1e-9)  # fmt: skip


@pytest.mark.parametrize(
    ("change", "text"),
    [
        ({"W": np.eye(3)}, "W: expected shape"),
        ({"q": np.zeros((2, 3))}, "q: expected shape"),
        ({"mu": [-0.1]}, "mu"),
        ({"W": np.full((60, 60), np.nan)}, "W"),
    ],
)
def test_bad_input_is_named(packing, change, text):
    with pytest.raises(am.InvalidInput, match=text):
        packing.update(**change)


def test_the_global_form_has_no_W():
    with pytest.raises(am.UnsupportedForm):
        am.SpherePacking(5, seed=2).problem().update(mu=0.2)
