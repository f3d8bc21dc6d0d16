"""Moreau-Jean time stepping of elastic bodies with contact, friction and impacts.

With v_theta = theta v1 + (1 - theta) v0, q1 = q0 + h v_theta, and impulses r of the contacts,

    M (v1 - v0) + h C v_theta + h K (q0 + theta h v_theta) = h f_theta + H r,
    M_hat v1 = H r + f,   M_hat = M + theta h C + theta^2 h^2 K                          (1)

A contact takes part when its gap, predicted as gap + prediction h u_N, is not positive; then
the law holds between r and u1 + e (u_N of before, 0), e being the restitution ([J], [AB] 10.1).
With `reach` those that are open by less take part too, and their law is that of the gap at the
end, q1: they close without penetration.  In long steps, in which a contact that has opened a
little would else go through, that keeps a wall of many joints together.

That law alone can create energy, of the order of the step size, where a closed contact is about
to open or a sliding one turns round: the law speaks of u1, the work of an impulse is that on
(u0 + u1) / 2, see `energy`.  Where contacts would add more in a step than the scheme loses in
it, those that do are solved again with the law on u_theta, which creates no energy at all.

Restitution never does so but for the loads within its step: implicit steps lift a body that
leaves the ground at once.  It is then made smaller by as much as that takes, of the order of
h g / |u_N|; impacts at some h g or less, of bodies that come to rest, lose it.

The law is one of contacts, so of nodes: e is the restitution of a body only where all of it
moves with its nodes, as one that is stiff against the step (a period below h).  A soft body
leaves after its waves have run through it, with what they bring back, whatever e.

Bodies of finite strains have steps of their own, see `large_inertia`.

Contacts that give way have the law of the end of the step, see `springs`, and no restitution.

M_hat does not change, and its W falls apart into the bodies: it is formed once, and every step
cuts the active contacts out of it.

Left out: corrections of the penetration that an impact leaves, at most
h (2 - prediction - theta) |u_N|: of a step that is not predicted to touch, 1 - prediction, and
of the next, which stops it, 1 - theta.

[AB] V. Acary, B. Brogliato, "Numerical methods for nonsmooth dynamical systems", Springer 2008.
[J] M. Jean, "The non smooth contact dynamics method", CMAME 177 (1999).
[A] V. Acary, "Energy conservation and dissipation properties of time-integration methods for
nonsmooth elastodynamics with contact", ZAMM 96 (2016).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ...core.clock import NEVER, Deadline
from ...core.errors import InvalidInput, UnsupportedForm
from ...core.words import helpful
from ...problem.friction import FrictionProblem
from ...problem.protocol import Problem
from ...problem.solution import FrictionSolution
from ...solvers.contract import Iterate
from ..model import Model
from ..model.large_deformation import LargeDeformation
from ..model.reactions import support_forces
from ..model.values import is_number
from .bolts import lock_times
from .energy import Energies
from .impulses import Shifts
from .large_inertia import LargeMovingModel
from .rubbing import rubbed
from .springs import Springs
from .state import State, TimeStep
from .system import Inertia, Motion

Array = NDArray[np.float64]
Index = NDArray[np.int64]
Mask = NDArray[np.bool_]
Local = Callable[[FrictionProblem], FrictionProblem]
Solve = Callable[[Problem, Iterate, Local | None], FrictionSolution]
TOUCHING = 1e-9  # gaps below this part of the size of a contact's area count as closed
CREATED = 1.0  # energy contacts may create in a step, relative to the total, per tolerance
W_LIMIT = 1e9  # bytes of W above which it is not formed


@helpful
@dataclass(frozen=True)
class MoreauJean:
    """Options of the dynamics; `step`, the step size, in the unit of time of the model."""

    step: float
    theta: float = 0.5  # 1/2: no numerical damping; 1: implicit Euler
    restitution: float = 0.0  # of contacts: normal velocity after over before an impact
    prediction: float = 0.5  # part of a step by which gaps are predicted
    reach: float = 0.0  # length: predicted gaps up to which open contacts take part
    mass_damping: float = 0.0  # Rayleigh, per time
    stiffness_damping: float = 0.0  # Rayleigh, time
    lumped: bool = False  # mass at the nodes instead of the consistent matrix
    condense: bool = True  # form W once where it fits into memory; it pays after a few steps

    def __post_init__(self) -> None:
        _expect("step", self.step, lambda step: step > 0, "> 0")
        _expect("theta", self.theta, lambda theta: 0.5 <= theta <= 1, "from 1/2 to 1")
        for name in ("restitution", "prediction"):
            _expect(name, getattr(self, name), lambda part: 0 <= part <= 1, "from 0 to 1")
        for name in ("reach", "mass_damping", "stiffness_damping"):
            _expect(name, getattr(self, name), lambda value: value >= 0, ">= 0")

        if self.reach > 0 and self.restitution > 0:
            raise InvalidInput(
                "expected 0 with restitution, which speaks of velocities, got "
                f"{self.reach!r}", ("reach",),
            )

    def prepare(self, model: Model, tolerance: float) -> MovingModel | LargeMovingModel:
        """The matrices of all steps; tolerance of their solves."""
        if model.kind.no_inertia:
            raise UnsupportedForm(f"model: {model.kind.no_inertia}")
        for name in lock_times(model):
            raise UnsupportedForm(
                f"pretension {name!r}: bolts are locked in quasi-static steps only; tighten "
                "them so, and begin the dynamics from that state with Fix on its length"
            )
        if model.kind is LargeDeformation:
            return LargeMovingModel(self, model, tolerance)
        return MovingModel(self, model, tolerance)


class MovingModel:
    """A model with the matrices of (1); `advance` makes one step."""

    def __init__(self, method: MoreauJean, model: Model, tolerance: float) -> None:
        self.method, self.motion, self.tolerance = method, Motion(model), tolerance
        parts = self.motion.parts
        inertia = Inertia(
            self.motion.body, method.mass_damping, method.stiffness_damping, method.lumped
        )
        h, theta = method.step, method.theta
        self.M, self.C, self.K = inertia.M, inertia.C, parts.stored_stiffness
        self.M_hat = sparse.csr_array(self.M + theta * h * self.C + theta**2 * h**2 * self.K)
        self.closed = TOUCHING * parts.sites.weights ** (
            1 / (model.dimension - 1)
        )
        nc, d = parts.carried.shape
        M_free = parts.reduced(self.M_hat)
        self.springs = Springs.of(self.motion.body.law, d)
        self.law = self.springs.of_impulses(self.motion.body.law, h, theta)
        self.base = FrictionProblem.from_global(
            M_free, parts.H, np.zeros(parts.unknowns), np.zeros((nc, d)), self.law,
            near_nullspace=parts.near_nullspace, levels=parts.levels,
            structure=parts.structure, name=model.name,
        )  # fmt: skip
        self._last_part: tuple[Index, FrictionProblem] | None = None
        self._last_active: tuple[Index, FrictionProblem] = (np.arange(nc), self.base)

    def begin(self, state: State) -> State:
        """The state before the first step: as it is."""
        return state

    def advance(
        self, state: State, time: float, solve: Solve, limit: Deadline = NEVER
    ) -> TimeStep:
        """One step from a state to a time; solve(problem, start) solves its problem."""
        parts, method = self.motion.parts, self.method
        h, theta = method.step, method.theta
        v0, q0 = state.velocity, state.displacement
        u0 = self._local(v0)
        gap = parts.gap + self._local(q0)[:, 0]
        near = self.closed + method.reach
        closing = gap + method.prediction * h * u0[:, 0] <= near
        active = np.flatnonzero(closing | self.springs.presses | self.law.tied)
        before, after = self.motion.prescribed(state.time), self.motion.prescribed(time)
        held = (after - before) / h
        force = theta * self.motion.load(time) + (1 - theta) * self.motion.load(state.time)
        known = self.M @ v0 + h * (
            force - (1 - theta) * (self.C @ v0) - self.K @ (q0 + h * theta * (1 - theta) * v0)
        )
        f = parts.gathered(known - self.M_hat @ held)
        f = parts.with_driven(f, self.base.M, held)
        carried = self._local(held)[active]  # by the supports
        start = Iterate(h * state.force[active])
        local = self._local_problem if self._condenses else None
        springs, pulled = self.springs.at(active), state.force[active]
        shifts = Shifts.of(
            u0[active], gap[active], method, springs, pulled, self.law.tied[active]
        )
        while True:
            solution = solve(self._problem(active, f, carried + shifts.values), start, local)
            v1 = parts.spread(_velocity(solution), held)
            q1 = q0 + h * (theta * v1 + (1 - theta) * v0)
            impulse = np.zeros_like(parts.carried)
            impulse[active] = solution.r
            energies, held_by = self._energies(state, v1, q1, force, impulse)
            excess = energies.contact - self._allowed(energies)
            changed = excess > 0 and shifts.changed(solution.r, self._local(v1)[active], excess)
            if not changed:
                break
            shifts, start = changed, Iterate(solution.r)
        u = self._local(q1)
        sliding = np.zeros(len(u), dtype=bool)
        sliding[active] = solution.sliding
        mean = 0.5 * (u0 + self._local(v1))[:, 1:]
        pulled, last = impulse / h, state.force
        work = (impulse[:, 1:] * mean).sum(axis=1) + self.springs.taken(last, pulled)
        slip = self.springs.slipped(self._local(q1 - q0), last, pulled)
        new = State(state.index + 1, time, q1, v1, pulled, u[:, 1:],
                    **rubbed(state, slip, sliding, np.minimum(work, 0.0)))  # fmt: skip
        reaction = support_forces(parts, held_by / h)
        return TimeStep(self.motion.body, new, solution, active, energies, parts.gap + u[:, 0],
                        reaction, force)  # fmt: skip

    def explained(self, solution: FrictionSolution) -> FrictionSolution:
        """The same record: inertia balances any load."""
        return solution

    def _local(self, v: Array) -> Array:
        """Local values of motions (dofs,): (nc, d)."""
        return self.motion.parts.local(v)

    def _problem(self, active: Index, f: Array, w: Array) -> FrictionProblem:
        """The problem of the active contacts, with the matrices of the last one if it can."""
        if not np.array_equal(self._last_active[0], active):
            columns = _rows_of(active, w.shape[1])
            H = sparse.csc_array(self.base.H[:, columns])  # type: ignore[index]
            structure = self.base.structure and self.base.structure.at(active)
            law = self.law.at(active)
            problem = replace(self.base, H=H, w=w, law=law, structure=structure)
            self._last_active = (active, problem)
        return replace(self._last_active[1], f=f, w=w)

    @property
    def _condenses(self) -> bool:
        return self.method.condense and 8.0 * self.base.w.size**2 <= W_LIMIT  # type: ignore[union-attr]

    @cached_property
    def _whole(self) -> FrictionProblem:
        """The Delassus form of all contacts: formed once, with what solvers keep of it."""
        return self.base.condensed()

    def _local_problem(self, problem: FrictionProblem) -> FrictionProblem:
        """The Delassus form of a problem of the last active set."""
        active = self._last_active[0]
        if self._last_part is None or not np.array_equal(self._last_part[0], active):
            self._last_part = (active, self._whole.restricted(active))
        return replace(
            self._last_part[1], q=problem.free_velocity, blur=problem.free_blur,
            law=problem.law, name=problem.name,
        )  # fmt: skip

    def _allowed(self, energies: Energies) -> float:
        """Energy that contacts may create, (1) of `energy`: that of the solve's tolerance."""
        size = energies.total + abs(energies.loads) + abs(energies.supports)
        return CREATED * self.tolerance * size

    def _energies(
        self, state: State, v1: Array, q1: Array, force: Array, impulse: Array
    ) -> tuple[Energies, Array]:
        """The balance of the step, see `energy`, and the impulses (dofs,) left to supports."""
        parts, h, theta = self.motion.parts, self.method.step, self.method.theta
        M, K, C = self.M, self.K, self.C
        dv, dq = v1 - state.velocity, q1 - state.displacement
        pushed = parts.whole_H @ impulse.ravel()
        q_theta = state.displacement + theta * dq
        # what supports, and the stiffness of rigid bodies, do for the balance of momentum
        held = np.zeros_like(dq)
        rest = M @ dv + C @ dq + h * (K @ q_theta - force) - pushed
        held[parts.held] = rest[parts.held]
        kinetic, elastic = 0.5 * v1 @ (M @ v1), 0.5 * q1 @ (K @ q1)
        v0, q0 = state.velocity, state.displacement
        stored = self.springs.energy(impulse / h)
        taken = stored - self.springs.energy(state.force)
        work = float(pushed @ dq) / h + taken  # but for what springs store
        lost = float((theta - 0.5) * (dv @ (M @ dv) + dq @ (K @ dq)))
        jump = min(max((theta - 0.5) * float(pushed @ dv), work), lost)
        gain = kinetic + elastic - 0.5 * v0 @ (M @ v0) - 0.5 * q0 @ (K @ q0) + taken
        return Energies(
            kinetic=float(kinetic), elastic=float(elastic) + stored, gain=float(gain),
            loads=float(force @ dq), supports=float(held @ dq) / h,
            contact=work - jump, damping=float(dq @ (C @ dq)) / h, numerical=lost - jump,
        ), rest  # fmt: skip


def _velocity(solution: FrictionSolution) -> Array:
    assert solution.v is not None  # the problem is in global form
    return solution.v


def _rows_of(contacts: Index, d: int) -> Index:
    """Rows of the local vectors of some contacts."""
    return (contacts[:, None] * d + np.arange(d)).ravel()


def _expect(name: str, value: object, good: Callable[[Any], bool], wanted: str) -> None:
    if not (is_number(value) and np.isfinite(value) and good(value)):  # type: ignore[call-overload]
        raise InvalidInput(f"expected a number {wanted}, got {value!r}", (name,))
