"""A law of a user's own, in one class: contacts with slack, a gap that is a part of the law."""

from dataclasses import dataclass

import numpy as np
import pytest

import amontons as am
from amontons.problem.law import Coulomb, Law, joined
from amontons.problem.law.changed import Changed


@dataclass(frozen=True, eq=False)
class Slack(Changed):
    """Another law at the end of a slack (nc,), unit of u."""

    law: Law
    offset: np.ndarray
    name = "Coulomb with slack"

    @property
    def plain(self):
        return self.law.plain

    def at(self, index):
        return Slack(self.law.at(index), self.offset[index])

    def scaled(self, force):
        return Slack(self.law.scaled(force), self.offset)


@pytest.fixture(params=["delassus", "global"])
def problems(request):
    """(with the law of slack, with the slack in the velocities)."""
    rng = np.random.default_rng(3)
    nc, slack = 5, np.array([0.0, 0.3, 0.1, 2.0, 0.05])
    H, w = rng.standard_normal((18, 3 * nc)), np.zeros((nc, 3))
    q = rng.standard_normal((nc, 3)) - [0.4, 0, 0]
    moved = q + slack[:, None] * [1, 0, 0]
    law = Coulomb(np.full(nc, 0.4))
    if request.param == "delassus":
        make = am.FrictionProblem.from_delassus
        W = H.T @ H
        return make(W, q, Slack(law, slack)), make(W, moved, law)
    make = am.FrictionProblem.from_global
    f, M = H @ np.linalg.solve(H.T @ H, q.ravel()), np.eye(18)
    return make(M, H, f, w, Slack(law, slack)), make(M, H, f, moved - q, law)


@pytest.mark.parametrize("solver", [None, am.SemismoothNewton()])
def test_slack_is_a_gap(problems, solver):
    """The reactions are those with the slack added to the gap, and the motion is that of r."""
    one, other = (am.solve(p, solver, tolerance=1e-11) for p in problems)
    assert one.converged and other.converged
    np.testing.assert_allclose(one.r, other.r, atol=1e-8)
    slack = problems[0].law.offset
    np.testing.assert_allclose(one.u[:, 0] + slack, other.u[:, 0], atol=1e-8)
    assert list(one.status) == list(other.status)
    assert (one.r[:, 0] > 0.01).any() and (one.r[:, 0] == 0).any()


def test_slack_among_other_laws(problems):
    """Joined with a law without slack, the contacts keep theirs."""
    law = problems[0].law
    both = joined([law.at(np.arange(3)), Coulomb(np.full(2, 0.4))])
    np.testing.assert_allclose(both.offset, [0, 0.3, 0.1, 0, 0])
    np.testing.assert_allclose(both.plain.parameters[:, 0], 0.4)


def test_slack_needs_reactions_and_velocities(problems):
    """r - rho u alone does not tell how far the slack has closed."""
    with pytest.raises(am.UnsupportedLaw, match="slack"):
        problems[0].law.augmented_reaction(np.zeros((5, 3)))
