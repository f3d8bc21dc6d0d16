"""What is known of rigid bodies at the end of a step, and of the step."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...core.warned import ResultWarning
from ...problem.rolling import Regimes, RollingProblem
from ...problem.solution import FrictionSolution
from .bodies import RigidBodies
from .meeting import Meetings
from .quick import Found
from .rows import rotations, to_global, to_own, turned

Array = NDArray[np.float64]
Index = NDArray[np.int64]
MUCH = 0.01  # of `fastest`, lost by joints that nothing has jolted


class Motion(NamedTuple):
    """Where all bodies are and how they move; all (n, 3) but orientation (n, 4).

    spin: angular velocity in own axes.
    """

    position: Array
    orientation: Array
    velocity: Array
    spin: Array

    def shifted(self, by: Array, angle: Array) -> Motion:
        """Moved and turned, (n, 3) in global axes, with the velocities in own axes."""
        own = to_own(rotations(self.orientation), angle)
        return self._replace(
            position=self.position + by, orientation=turned(self.orientation, own)
        )


@dataclass(frozen=True, eq=False)
class RigidState:
    """All that the next step needs: an evolution goes on from it with the same numbers."""

    index: int
    time: float
    motion: Motion
    keys: Index  # (nc, 3) slave, master and feature of the last contacts
    impulses: Array  # (nc, 3) theirs, in their frames
    moments: Array = field(default_factory=lambda: np.zeros((0, 3)))  # (nc, 3) or none
    lost: float = 0.0  # energy that joints took without a jolt, an error of the steps
    most: float = 0.0  # largest of |lost| so far
    fastest: float = 0.0  # largest energy of `Joints` so far, or what gravity gives in a step
    left: float = 0.0  # velocity that the last solve may have left at a contact, see `leaves`
    reached: Motion | None = field(default=None, repr=False)  # by a step; others are jolted

    def loss_after(
        self, work: float, kinetic: float, fallen: float, tolerance: float
    ) -> tuple[float, float, float]:
        """`lost`, `most` and `fastest` after a step from here in which joints did this work.

        kinetic: energy at its end, of `Joints`; fallen: what gravity gives to free bodies in a
        step.  Bodies at rest move by errors of the solves alone: slower motion than `fallen` is
        no scale, and a loss of `tolerance` of it no error of the step.  A motion that somebody
        else has given may be jolted, which is no error either, but leaves errors of its solve.
        """
        if self.motion is not self.reached:
            return self.lost, self.most, max(self.fastest, kinetic, fallen, -tolerance * work)
        lost = self.lost - (work if abs(work) > tolerance * fallen else 0.0)
        most = max(self.most, abs(lost))
        return lost, most, max(self.fastest, kinetic, fallen, abs(work))

    @property
    def doubtful(self) -> bool:
        """True where joints have taken more than `MUCH` of the energy without a jolt."""
        return self.most > MUCH * self.fastest


@dataclass(frozen=True)
class RigidEnergies:
    """Kinetic and potential energy at the end of a step, works within it.

    joints: all of a jolt, where the step begins, and else what the size of the step costs or
    gives, an error of it.  What the tolerance leaves of their work, `contact` has in it.
    """

    kinetic: float
    potential: float
    gain: float  # of both together
    contact: float  # work of contacts, and of the solve's errors at joints
    mending: float  # of overlaps
    joints: float = 0.0  # work of joints

    @property
    def defect(self) -> float:
        """What the balance misses, of rounding."""
        return self.gain - self.contact - self.mending - self.joints


@dataclass(frozen=True, eq=False)
class RigidStep:
    """One step: the state after it, its contacts and energies.

    meetings: contacts that were looked at, the first of `solution`; r (nc, 3): their impulses
    in their frames, normal first; frames (nc, 3, 3) by rows; joints (k, 3): impulses on the
    first bodies, in global axes; moments (nc, 3): angular impulses where friction resists
    rolling or spinning, about the normal first, else none.  warnings: of the first step, where
    bodies overlapped as they were given (`overlap_at_start`), of the one in which the energy
    that joints lose by long steps gets too much (`too_long`), and of the first in which joints
    decide the motion along the normal of a contact that slides (`undetermined`), else none.
    """

    system: RigidBodies
    state: RigidState
    meetings: Meetings
    frames: Array
    r: Array
    joints: Array
    energies: RigidEnergies
    _solved: FrictionSolution | Found | None = field(repr=False)
    warnings: tuple[ResultWarning, ...] = ()

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

    @property
    def velocity(self) -> Array:
        """Of the centres of mass, (n, 3)."""
        return self.state.motion.velocity

    @property
    def spin(self) -> Array:
        """Angular velocities in global axes, (n, 3); those of the state are in own axes."""
        return to_global(self.rotation, self.state.motion.spin)

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


def overlap_at_start(
    system: RigidBodies, found: Meetings, allowed: float
) -> tuple[ResultWarning, ...]:
    """A warning where bodies as they are given overlap by more than allowed, unit of length.

    found: their meetings.  Such bodies are moved apart within the first step.
    """
    deep = found.gaps < -allowed
    if not deep.any():
        return ()
    worst = int(np.argmin(found.gaps))
    slave, master = int(found.slave[worst]), int(found.master[worst])
    other = "a plane" if master < 0 else _named(system, master)
    pairs = len({*zip(found.slave[deep].tolist(), found.master[deep].tolist(), strict=True)})
    least = "at least " if len(system.planes) > 1 else ""  # which plane it is nobody tells
    more = f", {least}{pairs} pairs in all" if pairs > 1 else ""
    place = ", ".join(f"{x:.4g}" for x in found.points[worst])
    text = (
        f"{_named(system, slave)} and {other} overlap at the start by "
        f"{-found.gaps[worst]:.3g} at ({place}){more}: they are moved apart within the first "
        "step, so that bodies do not begin where they were put; give positions without overlap"
    )
    return (ResultWarning("overlap-at-start", text),)


def too_long(before: RigidState, after: RigidState, step: float) -> tuple[ResultWarning, ...]:
    """A warning in the step in which what joints have lost gets more than `MUCH`."""
    if before.doubtful or not after.doubtful:
        return ()
    turns = step * np.linalg.norm(after.motion.spin, axis=1)
    fast = int(np.argmax(turns))
    text = (
        f"joints have {'taken' if after.lost > 0 else 'given'} "
        f"{100 * abs(after.lost) / after.fastest:.2g} % of the largest kinetic "
        "energy that is not spin about axes of symmetry "
        f"until t = {after.time:.4g} without a jolt, by the size of the steps "
        f"(body {fast} turns by {turns[fast]:.2g} rad in this one); the loss falls with its "
        f"third power: take steps of {0.5 * step:.3g} or less"
    )
    return (ResultWarning("joints-lose-energy", text),)


def undetermined(system: RigidBodies, slave: int, master: int) -> tuple[ResultWarning, ...]:
    """A warning where rigid bodies do not tell what load a contact with friction carries."""
    other = "a plane" if master < 0 else _named(system, master)
    text = (
        f"joints decide the motion of {_named(system, slave)} and {other} along the normal of "
        "their contact, not along it: equilibrium of rigid bodies does not say what load the "
        "contact carries and what the joints, so that its friction is one of many answers; "
        "leave the motion along the normal to the contact (a joint less), or take mu = 0"
    )
    return (ResultWarning("friction-undetermined", text),)


def _named(system: RigidBodies, number: int) -> str:
    name = system.bodies[number].name
    return f"body {number} '{name}'" if name else f"body {number}"
