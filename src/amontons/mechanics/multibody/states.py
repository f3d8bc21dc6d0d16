"""What is known of rigid bodies at the end of a step, and of the step."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...problem.rolling import Regimes, RollingProblem
from ...problem.solution import FrictionSolution
from .bodies import RigidBodies
from .meeting import Meetings
from .quick import Found
from .rows import rotations

Array = NDArray[np.float64]
Index = NDArray[np.int64]


class Motion(NamedTuple):
    """Where all bodies are and how they move; all (n, 3) but orientation (n, 4).

    spin: angular velocity in own axes.
    """

    position: Array
    orientation: Array
    velocity: Array
    spin: Array


@dataclass(frozen=True, eq=False)
class RigidState:
    """All that the next step needs: an evolution goes on from it with the same numbers."""

    index: int
    time: float
    motion: Motion
    keys: Index  # (nc, 3) slave, master and feature of the last contacts
    impulses: Array  # (nc, 3) theirs, in their frames
    moments: Array = field(default_factory=lambda: np.zeros((0, 3)))  # (nc, 3) or none


@dataclass(frozen=True)
class RigidEnergies:
    """Kinetic and potential energy at the end of a step, works within it."""

    kinetic: float
    potential: float
    gain: float  # of both together
    contact: float  # work of contacts and joints
    mending: float  # of overlaps

    @property
    def defect(self) -> float:
        """What the balance misses, of rounding."""
        return self.gain - self.contact - self.mending


@dataclass(frozen=True, eq=False)
class RigidStep:
    """One step: the state after it, its contacts and energies.

    meetings: contacts that were looked at, the first of `solution`; r (nc, 3): their impulses
    in their frames, normal first; frames (nc, 3, 3) by rows; joints (k, 3): impulses on the
    first bodies, in global axes; moments (nc, 3): angular impulses where friction resists
    rolling or spinning, about the normal first, else none.
    """

    system: RigidBodies
    state: RigidState
    meetings: Meetings
    frames: Array
    r: Array
    joints: Array
    energies: RigidEnergies
    _solved: FrictionSolution | Found | None = field(repr=False)

    @property
    def time(self) -> float:
        """Time at the end of the step."""
        return self.state.time

    @property
    def position(self) -> Array:
        """Centres of mass, (n, 3)."""
        return self.state.motion.position

    @property
    def rotation(self) -> Array:
        """Rotations from own to global axes, (n, 3, 3)."""
        return rotations(self.state.motion.orientation)

    @cached_property
    def solution(self) -> FrictionSolution | None:
        """Of the contact problem, made when asked for; None without contacts and joints."""
        return self._solved.solution if isinstance(self._solved, Found) else self._solved

    @property
    def moments(self) -> Array:
        """Angular impulses of the contacts in their frames, (nc, 3), or (0, 3)."""
        return self.state.moments

    @property
    def regimes(self) -> Regimes | None:
        """Which contacts slip, spin and roll; None where nothing resists rolling."""
        solution = self.solution
        if solution is None or not isinstance(solution.problem, RollingProblem):
            return None
        return solution.problem.regimes(solution.r)

    @property
    def status(self) -> NDArray[np.int8]:
        """ContactStatus of the contacts, (nc,)."""
        if self._solved is None:
            return np.zeros(0, np.int8)
        return self._solved.status[: len(self.r)]
