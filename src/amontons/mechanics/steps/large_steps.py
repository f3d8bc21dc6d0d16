"""Quasi-static steps of large deformations: friction on the motion since the last step.

Every step begins from the last state and goes to its load in load steps where it must.
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from ...core.clock import NEVER, Deadline
from ...problem.law import Law, VaryingFriction
from ...problem.law.law import MU
from ...problem.solution import FrictionSolution
from ..contact.closing import slid_while_open
from ..contact.current_mortar import MortarMeeting
from ..contact.dragged import before
from ..contact.surface_axes import still_drawn
from ..model import Model
from ..model.diagnosis import with_diagnosis
from ..model.faced import Faced
from ..model.large_deformation import LargeDeformation, large_step
from ..model.nodal_forces import NodalForces
from ..model.nonlinear_parts import nonlinear_parts
from ..model.reactions import support_forces
from ..model.rubbed_between import without_rubbed
from .energy import Energies, Forces, path_work, slow_energies
from .moreau_jean import Solve
from .passage import Crossing, taken
from .rubbing import quasi_static_friction, rubbed
from .springs import Springs
from .state import State, TimeStep, undeformed
from .system import Motion

Array = NDArray[np.float64]
AT_BOUND = 1e-6  # relative distance of a friction force from its bound that counts as none


class LargeSlowModel:
    """A model in large deformations and without inertia; `advance` makes one step."""

    def __init__(self, model: Model, crossing: Crossing | None = None) -> None:
        self.motion, self.crossing = Motion(model), crossing
        self._acted: tuple[State, Model, Forces] | None = None  # at the end of the last step

    def begin(self, state: State) -> State:
        """The state before the first step: undeformed, also where supports hold the body."""
        return undeformed(state, self.motion)

    def _known(self, state: State) -> tuple[NodalForces | Array, Array, Array]:
        """Load, prescribed values (dofs,) and free displacements (n,) of the last state."""
        free = state.displacement[self.motion.parts.free]
        if state.is_unloaded:
            nothing = np.zeros_like(state.displacement)
            return nothing, nothing, free
        return *self.motion.applied(state.time), free

    def advance(
        self, state: State, time: float, solve: Solve, limit: Deadline = NEVER
    ) -> TimeStep:
        """One step from a state to a time; solve(problem, start) solves its problem.

        limit: of the path to it where that is followed.
        """
        load, prescribed = self.motion.applied(time)
        q0 = state.displacement
        body = self.motion.body
        body = body.divided(q0) if nonlinear_parts(body).folds else body
        state = self._on_areas(body, state)
        drawn = self._drawn(body, state)
        problem = large_step(body, load, prescribed, q0, self._known(state), drawn)
        if self.crossing is not None:  # as its path has it
            problem = without_rubbed(problem)
        force = np.einsum("pk,pkc->pc", state.force, problem.earlier.frames)
        problem = replace(problem, drift=problem.drift + before(problem.parts.contact, force))
        if self.crossing is None:  # a kink beyond those that paths know
            problem = replace(problem, play=slid_open(problem, state, time - state.time))
        if isinstance(problem.law, VaryingFriction):  # of the speed in this step
            problem = problem.with_law(problem.law.lasting(abs(time - state.time) or 1.0))
        arrive = None
        if self.crossing is not None:
            drift = last_motion(problem, state, time - state.time)
            arrive = partial(self.crossing.along, problem, drift, limit)
        solution, passage = taken(
            lambda start: solve(problem, start, None), arrive, state.force, (state.time, time)
        )
        assert solution.v is not None
        q1 = problem.displacement(solution.v).ravel()
        meeting = problem.contact_point(solution.v).meeting
        axes = meeting.frames
        force = np.einsum("pkc,pk->pc", axes, solution.r)
        if drawn is not None:
            drawn = still_drawn(drawn, axes, problem.parts.contact.heard)
        tied = body.law.tied[:, None]  # what bonds give way is no slip
        way = slid = solution.u[:, 1:]
        if drawn is not None:
            way = solution.u[:, 1:] - drawn
            slid = way + self._stretched(body, q1, solution.r)
            slid -= self._stretched(body, q0, state.force)
        way, slid = np.where(tied, 0.0, way), np.where(tied, 0.0, slid)
        both = zip((state.force, solution.r), (problem.earlier, meeting), strict=True)
        rubs = [r[:, 1:] * there.passed[:, None] for r, there in both]
        work = quasi_static_friction(*rubs, slid)
        acting = self._forces(body, q1, load, solution.r)
        energies = self._energies(body, state, q1, load, acting, float(work.sum()))
        passed = time - state.time
        velocity = (q1 - q0) / passed if passed else np.zeros_like(q1)
        new = State(state.index + 1, time, q1, velocity, solution.r,
                    np.where(tied, solution.u[:, 1:], state.slip + way),
                    **rubbed(state, slid, solution.sliding, work),
                    growth=meeting.growth if body.law.has_stresses else np.zeros(0),
                    )  # fmt: skip
        self._acted = new, body, acting
        rest = acting.inner - acting.load - acting.pushed
        active = np.arange(len(way))
        faced = Faced.of(meeting, self.motion.parts.sites.weights, force)
        return TimeStep(body, new, solution, active, energies, solution.u[:, 0],
                        support_forces(self.motion.parts, rest), acting.load, axes,
                        passage, faced)  # fmt: skip

    def _on_areas(self, body: Model, state: State) -> State:
        """The state with forces that have its stresses on the areas where it ends.

        Those of a step with inertia had its areas, halfway, and nodes that `fading` knows may
        have dropped out of it: they get the mean that it has for them.
        """
        if not state.growth.size:
            return state
        parts = nonlinear_parts(body)
        meeting = parts.meet(state.displacement.reshape(parts.X.shape))
        growth = meeting.growth
        if (growth == state.growth).all():
            return state
        force = state.force * (growth / state.growth)[:, None]
        lost = (state.growth == 1) & ~force.any(axis=1)
        if lost.any():
            axes = meeting.frames
            mean = meeting.shares @ np.einsum("pkc,pk->pc", axes, force)
            force += lost[:, None] * np.einsum("pkc,pc->pk", axes, mean)
        return replace(state, force=force, growth=growth)

    def _drawn(self, body: Model, state: State) -> Array | None:
        """How far springs along the surface are drawn, (nc, d-1); None without any."""
        if not (Springs.of(body.law, state.force.shape[1]).sticks & ~body.law.tied).any():
            return None
        drawn = self._stretched(body, state.displacement, state.force)
        return np.where(body.law.tied[:, None], 0.0, -drawn)

    def _stretched(self, body: Model, q: Array, force: Array) -> Array:
        """C_T r_T at displacements q (dofs,), (nc, d-1); force (nc, d) in the frames there."""
        law = self._law_at(body, q)
        return Springs.of(law, force.shape[1]).C[:, 1:] * force[:, 1:]

    def _law_at(self, body: Model, q: Array) -> Law:
        """The law on the areas at displacements q (dofs,)."""
        parts = nonlinear_parts(body)
        return parts.contact.over(parts.meet(q.reshape(parts.X.shape))).law

    def explained(self, solution: FrictionSolution) -> FrictionSolution:
        """The same record; one that failed says which bodies give way."""
        return with_diagnosis(solution, self.motion.body)

    def _energies(
        self, body: Model, state: State, q1: Array, load: NodalForces, after: Forces,
        friction: float,
    ) -> Energies:  # fmt: skip
        """The balance of `slow_energies`; after: the forces at the displacements q1."""
        q0, load_0 = state.displacement, self.motion.load_of(state)
        kept = self._acted
        if kept is not None and kept[0] is state and kept[1] is body:
            shape = nonlinear_parts(body).X.shape
            before = replace(kept[2], load=load_0.at(q0.reshape(shape)))
        else:
            before = self._forces(body, q0, load_0, state.force)
        path = path_work(before, after, q1 - q0)
        bend = self._bend(q0, q1, load_0, load)
        return slow_energies(before, after, q1 - q0, self.motion.parts.fixed, friction, path,
                             bend)  # fmt: skip

    def _bend(self, q0: Array, q1: Array, before: NodalForces, after: NodalForces) -> float:
        """Work of loads that follow the body beyond that of the mean of their ends.

        By Simpson's rule, exact for pressures that grow along with a motion on a straight line.
        """
        if not (before.following or after.following):
            return 0.0
        shape = nonlinear_parts(self.motion.body).X.shape
        ends = (before.at(q0.reshape(shape)) + after.at(q1.reshape(shape))) / 2
        middle = (0.5 * (before + after)).at(((q0 + q1) / 2).reshape(shape))
        return float((middle - ends) @ (q1 - q0)) * 2 / 3

    def _forces(self, body: Model, q: Array, load: NodalForces, r: Array) -> Forces:
        """All forces at displacements q (dofs,); r (nc, d): in the frames there."""
        parts = nonlinear_parts(body)
        moved = q.reshape(parts.X.shape)
        meeting = parts.meet(moved)
        pushed = meeting.pushed(meeting.frames, r)
        # of all forces on the slave's side, on all of its area
        law, shared = parts.contact.over(meeting).law, meeting.passed
        stored = Springs.of(law.scaled(shared), r.shape[1]).energy(r * shared[:, None])
        return Forces(parts.forces(moved), load.at(moved), pushed, parts.energy(moved), stored)


def slid_open(problem: LargeDeformation, state: State, duration: float) -> Array | None:
    """How far contacts may slide in the step before they close, (nc,); None for none.

    By the motion in the last step, scaled to the duration of this one.  Laws of the speed of
    the slip take that of all of a step, those along tangents of the surface have no such law.
    """
    parts = problem.parts
    contact = parts.contact.over(problem.earlier)
    moved = (duration * state.velocity).reshape(parts.X.shape)
    law = contact.law
    if contact.framed or law.varies or not moved.any():
        return None
    u = problem.before.reshape(parts.X.shape)
    apart = problem.earlier.gap + law.offset
    open_ = (state.force[:, 0] + law.cohesion < contact.rho * apart) & ~law.tied
    found = slid_while_open(parts.meet(u - moved), problem.earlier, u - moved, u, open_,
                            law.offset, parts.resolved(u)[1])  # fmt: skip
    return found if found.any() else None


def last_motion(problem: LargeDeformation, state: State, duration: float) -> Array:
    """V (nc, d) of `passage`: how the contacts moved in the last step, scaled to a duration.

    Those with an obstacle move with their node.  Between bodies that deform the law at the last
    state says it: what sticks has not moved, what slips has moved against its force.
    """
    parts, moved = problem.parts, duration * state.velocity
    out = moved[parts.at]
    meeting = problem.earlier
    pairs = np.concatenate(
        [np.full(len(p.slaves), isinstance(p, MortarMeeting)) for p in meeting.parts]
    )
    if not pairs.any() and not problem.law.tied.any():
        return out
    n = meeting.normals
    along = meeting.relative(moved.reshape(parts.X.shape))
    along -= n * (n * along).sum(axis=1)[:, None]
    law = parts.contact.over(meeting).law
    pressed = np.array(law.pressed(state.force))  # T^-1 r; T^-1 of that is where it slips from
    size, bound = np.linalg.norm(pressed[:, 1:], axis=1), law.parameters[:, MU]
    bound = bound * np.maximum(pressed[:, 0], 0.0)
    pressed[:, 0] = 0.0
    back = law.pressed(pressed)[:, 1:]
    back = np.einsum("pk,pkc->pc", back, meeting.frames[:, 1:])
    length = np.linalg.norm(back, axis=1)
    against = -back / np.where(length > 0, length, 1.0)[:, None]
    slipped = against * np.linalg.norm(along, axis=1)[:, None]
    rubs = pairs & (bound > 0)
    slips = size >= (1 - AT_BOUND) * bound
    told = np.where(slips[:, None], slipped, 0.0)
    told = np.where(rubs[:, None], told, np.where(pairs[:, None], along, out))
    return np.where(problem.law.tied[:, None], 0.0, told)
