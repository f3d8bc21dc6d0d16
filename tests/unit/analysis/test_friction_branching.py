"""Proofs by multipliers and branching: checked apart, against all determinants, and refused."""

from dataclasses import replace

import numpy as np
import pytest
from uniqueness_checker import check_proof, smallest_determinant

import amontons as am
from amontons.analysis.certificates import friction_branching
from amontons.analysis.certificates.critical_friction import critical_friction
from amontons.analysis.certificates.determinant_search import NEGATIVE, POSITIVE, STOPPED
from amontons.analysis.certificates.friction_branching import Branching
from amontons.analysis.certificates.pair_multipliers import (
    find_pair_multipliers,
    is_oriented,
    proves,
)
from amontons.analysis.certificates.status_pieces import Pieces
from amontons.core.clock import NEVER, Deadline
from amontons.mechanics.ready.hild import hild_triangle


@pytest.fixture(autouse=True)
def _little_enumeration(monkeypatch):
    monkeypatch.setattr(friction_branching, "ENUMERATED", 2)


def random_pieces(seed):
    random = np.random.default_rng(seed)
    nc = int(random.integers(3, 6))
    A = random.standard_normal((2 * nc, 2 * nc))
    W = A @ A.T / nc + np.diag(random.uniform(0.2, 3, 2 * nc))
    mu = random.uniform(0.3, 1.0, nc)
    mu[random.random(nc) < 0.2] = 0.0
    mu[0] = 1.0
    return Pieces.of(am.FrictionProblem.from_delassus(W, np.ones((nc, 2)), mu))


@pytest.mark.parametrize("seed", range(8))
def test_branching_agrees_with_all_determinants(seed):
    pieces = random_pieces(seed)
    problem = am.FrictionProblem.from_delassus(
        pieces.W, np.ones((pieces.contacts, 2)), pieces.shape
    )
    upper = min(critical_friction(problem).upper, 20.0)
    for part in (0.7, 0.97):
        safe = Branching(pieces, part * upper, NEVER)
        assert safe.run() == POSITIVE
        assert check_proof(pieces.W, part * upper * pieces.shape, safe.leaves)
    if upper < 20:
        unsafe = Branching(pieces, 1.02 * upper, NEVER)
        assert unsafe.run() == NEGATIVE
        assert pieces.threshold(unsafe.failed)[0] <= 1.02 * upper
        assert smallest_determinant(pieces.W, 1.02 * upper * pieces.shape) < 0


def test_the_triangle_is_proved_and_checked():
    pieces = Pieces.of(hild_triangle(6).assemble())
    safe = Branching(pieces, 1.72, NEVER)
    assert safe.run() == POSITIVE
    assert any(leaf.multipliers is not None for leaf in safe.leaves)
    assert check_proof(pieces.W, np.full(6, 1.72), safe.leaves)
    unsafe = Branching(pieces, 1.73, NEVER)
    assert unsafe.run() == NEGATIVE
    assert pieces.word(unsafe.failed) == "fff+-+"


def test_many_contacts_have_pairs_only_where_it_matters(monkeypatch):
    monkeypatch.setattr("amontons.analysis.certificates.pair_multipliers.FEW", 3)
    monkeypatch.setattr("amontons.analysis.certificates.friction_branching.FEW", 3)
    monkeypatch.setattr("amontons.analysis.certificates.pair_multipliers.ACTIVE", 0.95)
    pieces = Pieces.of(hild_triangle(7).assemble())
    alone = Branching(pieces, 1.4, NEVER)  # multipliers of single contacts reach 1.48
    assert alone.run() == POSITIVE
    assert [len(leaf.multipliers.pairs) for leaf in alone.leaves] == [0]
    assert check_proof(pieces.W, np.full(7, 1.4), alone.leaves)
    mixed = Branching(pieces, 1.53, NEVER)
    assert mixed.run() == POSITIVE
    found = [leaf.multipliers for leaf in mixed.leaves if leaf.multipliers is not None]
    assert any(len(x.pairs) and len(x.singles) for x in found)
    assert check_proof(pieces.W, np.full(7, 1.53), mixed.leaves)


def test_the_checker_refuses_what_is_wrong():
    pieces = Pieces.of(hild_triangle(5).assemble())
    safe = Branching(pieces, 1.7, NEVER)
    assert safe.run() == POSITIVE
    mu = np.full(5, 1.7)
    assert check_proof(pieces.W, mu, safe.leaves)
    assert not check_proof(pieces.W, mu * 1.1, safe.leaves)  # above the threshold 1.795
    if len(safe.leaves) > 1:
        assert not check_proof(pieces.W, mu, safe.leaves[1:])
    k = next(i for i, leaf in enumerate(safe.leaves) if leaf.multipliers is not None)
    leaf = safe.leaves[k]
    worse = replace(leaf, multipliers=replace(leaf.multipliers, W=-leaf.multipliers.W))
    leaves = [*safe.leaves[:k], worse, *safe.leaves[k + 1 :]]
    assert not check_proof(pieces.W, mu, leaves)


def test_multipliers_prove_only_what_they_prove():
    pieces = Pieces.of(hild_triangle(4).assemble())
    m = np.full(4, 1.8)
    none = np.zeros_like(pieces.W)
    found, _ = find_pair_multipliers(pieces.W, none, m, time_limit=60)
    assert found is not None
    assert proves(found, pieces.W, none)
    assert is_oriented(found, m)
    assert not proves(found, pieces.W, none + 0.1)  # the matrix is not known that well
    assert not proves(replace(found, W=-found.W), pieces.W, none)
    mirror = np.diag([1.0, 1, 1, -1, 1, 1, 1, -1])  # all planes stay, one turns over
    assert not is_oriented(replace(found, W=mirror @ found.W @ mirror), m)
    refused, weights = find_pair_multipliers(pieces.W, none, np.full(4, 2.1), time_limit=60)
    assert refused is None  # above the threshold 2.026
    assert weights.shape == (4, 4)
    assert weights.min() >= 0


def test_time_is_respected():
    branching = Branching(Pieces.of(hild_triangle(12).assemble()), 1.3, Deadline.counted(0.0))
    assert branching.run() == STOPPED
    assert branching.leaves == []


def test_critical_friction_uses_multipliers_where_there_are_too_many_patterns(monkeypatch):
    monkeypatch.setattr("amontons.analysis.certificates.critical_friction.ENUMERATED", 3)
    found = critical_friction(hild_triangle(6).assemble(), gap=0.02)
    assert found.criterion == "multipliers"
    assert 0.97 * 1.72866 < found.lower < 1.72866 < found.upper < 1.72867
    W = hild_triangle(6).assemble().condensed().W.toarray()
    assert check_proof(W, np.full(6, found.lower), found.proof)
