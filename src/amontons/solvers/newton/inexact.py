"""Semismooth Newton with approximate steps, for several deformable bodies in contact.

The Newton equation is solved by GMRES, preconditioned by the LU of an earlier step or even of
an earlier problem with the same W (`joints`): near the solution few contacts change their
status.  The law, line search and convergence are those of `SemismoothNewton`, at a fraction of
its factors.

[EW] S. Eisenstat, H. Walker (see `newton`).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from ...problem.friction import Form, FrictionProblem
from ..contract import Iterate
from .functions import Linearised
from .joints import Joints
from .semismooth import Linearisation, SemismoothNewton, State

Array = NDArray[np.float64]
LOOSEST, TIGHTEST = 1e-3, 1e-4  # relative tolerance of GMRES: looser ones misled cold starts


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
        before = self.joints.memory.flops
        dr, count = self.joints.solve(A, B, -F, tolerance)
        dr = dr[self.contacts, :d]
        assert self.problem.W is not None
        du = (self.problem.W @ dr.ravel()).reshape(dr.shape)
        flops = self.joints.memory.flops - before + 2.0 * self.problem.blocks.data.size
        return State(dr, du, flops=flops), count
