"""Semismooth Newton with approximate steps, for several deformable bodies in contact.

The Newton equation is solved by GMRES, preconditioned by the LU of an earlier step or even of
an earlier problem with the same W (`joints`): near the solution few contacts change their
status.  The law, line search and convergence are those of `SemismoothNewton`, at a fraction of
its factors.

`DeformablePortfolio` is what `Auto` runs on such W:

    accelerated sweeps    while they promise an end before Newton would be there
    inexact Newton        with full steps until it stalls: from the start, from where it takes
                          fewer steps than from a swept point; from the best point; from the
                          start with a line search.  Exact where an LU in blocks is quick
    the usual portfolio   then

[EW] S. Eisenstat, H. Walker (see `newton`).
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from ...core.errors import SingularOperator
from ...linear.blocks import spatial
from ...problem.friction import Form, FrictionProblem
from ..auto.portfolio import DEPTH, Portfolio
from ..contract import Breakdown, Iterate, Patience
from ..sweeps.kernels import Acceleration, watch_for
from .functions import Linearised
from .joints import Joints
from .line_search import FullStep
from .semismooth import Condensed, Linearisation, SemismoothNewton, State

Array = NDArray[np.float64]
LOOSEST, TIGHTEST = 1e-3, 1e-4  # relative tolerance of GMRES: looser ones misled cold starts
CHUNK, LOOK = 40, 0.1  # sweeps between two looks at their rate: number, part of Newton's cost
SLOWER = 1.5  # sweeps get slower than their first rate promises
EXACT_WORK = 1e6  # products of blocks in an LU up to which an exact step costs no more
STALLED = 8  # Newton steps without halving the error after which it is left


@dataclass(frozen=True)
class InexactNewton(SemismoothNewton):
    """`SemismoothNewton` on the Delassus form with GMRES and a kept block LU.

    Meant for W of several deformable bodies; where W has no large blocks, the steps are exact.
    """

    form: ClassVar[Form] = Form.DELASSUS

    def _linearise(self, problem: FrictionProblem) -> Linearisation:
        whole, contacts = problem.whole
        joints = Joints.of(whole)
        if joints is None:
            return super()._linearise(problem)
        return _Preconditioned(problem, joints, contacts)


@dataclass(frozen=True, eq=False)
class _Preconditioned:
    """Newton equation of some contacts of a problem by GMRES on all of them.

    The others stay open, so one preconditioner serves every choice of contacts.
    """

    problem: FrictionProblem
    joints: Joints
    contacts: np.ndarray

    def state(self, start: Iterate) -> State:
        """r of the start and its velocity."""
        return State(start.r, self.problem.velocity(start.r)[0])

    def step(self, state: State, linearised: Linearised, forcing: float) -> tuple[State, int]:
        """dr to the relative tolerance `forcing`, within bounds."""
        d, shape = state.r.shape[1], (self.joints.nc, 3)
        F = np.zeros(shape)
        A, B = np.tile(np.eye(3), (shape[0], 1, 1)), np.zeros((*shape, 3))
        F[self.contacts, :d] = linearised[0]
        A[self.contacts, :d, :d], B[self.contacts, :d, :d] = linearised[1], linearised[2]
        tolerance = float(np.clip(forcing, TIGHTEST, LOOSEST))
        before = self.joints.flops
        dr, count = self.joints.solve(A, B, -F, tolerance)
        dr = dr[self.contacts, :d]
        assert self.problem.W is not None
        du = (self.problem.W @ dr.ravel()).reshape(dr.shape)
        flops = self.joints.flops - before + 2.0 * self.problem.blocks.data.size
        return State(dr, du, flops=flops), count


@dataclass(eq=False)
class DeformablePortfolio(Portfolio):
    """`Portfolio` with the stages above before its own."""

    def stages(self) -> Iterator[Iterate]:
        """All stages in the order of the module's text."""
        whole, _ = self.problem.whole
        joints = Joints.of(whole)
        if joints is not None:
            yield from self._sweeps_before(joints)
            kind = InexactNewton
            if Condensed.in_blocks(self.problem, EXACT_WORK):
                kind = SemismoothNewton
            full = kind(line_search=FullStep())
            yield from self._inexact(full, self.start)
            yield from self._inexact(full, self.r)
            yield from self._inexact(kind(), self.start)
        yield from super().stages()

    def _sweeps_before(self, joints: Joints) -> Iterator[Iterate]:
        """Accelerated sweeps until they have cost, or promise to cost, more than Newton."""
        cost = self.accelerated_cost
        memory, watch = Acceleration(self.data, self.r, DEPTH), watch_for(self.goal)
        spent, last = 0.0, self.error
        while True:
            newton = joints.newton_cost(math.log10(max(min(self.error / self.goal, 1e12), 1.0)))
            count = memory.sweep(int(np.clip(LOOK * newton / cost, 5, CHUNK)), watch)
            yield self._offer(memory.r.copy(), count, "Anderson Gauss-Seidel", watch[2])
            spent += cost * count
            promise = cost * self._sweeps_left(last, count)
            last = self.latest
            if spent + SLOWER * promise > newton:
                return

    def _inexact(self, solver: SemismoothNewton, r: Array) -> Iterator[Iterate]:
        """Newton from r until it stalls."""
        name = "inexact Newton" if isinstance(solver, InexactNewton) else "semismooth Newton"
        start = Iterate(r[:, : self.problem.dimension].copy())
        patience = Patience(STALLED)
        try:
            for iterate in solver.iterates(self.problem, start, self.target):
                found = self._offer(spatial(iterate.r), 1, name)
                yield replace(found, linear_iterations=iterate.linear_iterations)
                if patience.over(self.latest):
                    return
        except (Breakdown, SingularOperator):
            return
