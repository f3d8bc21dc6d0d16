"""Over a jump: a spring that snaps through, whose equilibria are roots of a cubic."""

from dataclasses import dataclass, field

import numpy as np
import pytest
from scipy import sparse

from amontons.core.clock import NEVER, Deadline
from amontons.solvers.contract import Target
from amontons.solvers.newton.creeping import creeping
from amontons.solvers.newton.linear_steps import LinearSteps
from amontons.solvers.newton.states import PlainStates
from amontons.solvers.newton.step_lengths import Failed

FOLD = 2 / 3**1.5  # the load at which v = -1 / sqrt(3) has no neighbour any more
AT_REST = 2.0  # stiffness at v = -1 and 1 without load


@dataclass
class Snap:
    """v^3 - v = load in every one of some unknowns; endless: -1 - v^2 = 0, without any."""

    loads: np.ndarray
    endless: bool = False
    firmness: float = 0.0
    relaxed: np.ndarray = field(default_factory=lambda: np.zeros(1))
    shortest = 0.1

    def residual(self, v):
        force = -1 - v**2 if self.endless else v**3 - v - self.loads
        return force + self.firmness * AT_REST * (v - self.relaxed)

    def linearisation(self, v):
        slope = -2 * v if self.endless else 3 * v**2 - 1
        self.matrix = sparse.csc_array(np.diag(slope + self.firmness * AT_REST))
        return self

    def held(self, v, firmness):
        held = Snap(self.loads, self.endless, firmness, v.copy())
        held.states = lambda w: _States(held, w)
        return held

    def closed_pieces(self, v):
        return []


class _States(PlainStates):
    def linearisation(self, w):
        here = self._problem.linearisation(w)
        return _Linear(self._problem.residual(w), here.matrix)


@dataclass
class _Linear:
    residual: np.ndarray
    matrix: sparse.csc_array


def ways(problem, v, deadline=NEVER):
    """All states on the way."""
    return list(creeping(problem, v, 7, LinearSteps(None), Target(1e-10, deadline)))


@pytest.mark.parametrize("load", [1.02 * FOLD, 0.45, 1.0, 5.0])
def test_what_snaps_comes_to_the_root_that_is_left(load):
    (root,) = (z.real for z in np.roots([1, 0, -1, -load]) if abs(z.imag) < 1e-9)
    found = ways(Snap(np.array([load])), np.array([-1 / np.sqrt(3)]))
    assert found[-1][0] == pytest.approx(root, rel=0.02)
    assert len(found) <= 40


def test_others_stay_where_they_are():
    """Two unknowns: one snaps, the other has an equilibrium where it is."""
    found = ways(Snap(np.array([0.45, 0.0])), np.array([-1 / np.sqrt(3), -1.0]))
    assert found[-1][0] > 1
    assert found[-1][1] == pytest.approx(-1, abs=1e-3)


def test_what_never_rests_is_said():
    with pytest.raises(Failed, match="come to rest"):
        ways(Snap(np.zeros(1), endless=True), np.zeros(1))


def test_no_step_after_the_deadline():
    assert not ways(Snap(np.ones(1)), np.zeros(1), Deadline.after(0.0))
