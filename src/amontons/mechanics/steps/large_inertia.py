"""Dynamics of large deformations: steps that keep momenta and energy, with impacts.

With q_h, v_h the means of both ends of a step h, F(q0, q1) the inner forces of
`elements.discrete_gradient`, whose work is the change of the stored energy, and impulses r,

    q1 - q0 = h v_h,    M (v1 - v0) + h C v_h + h F(q0, q1) = h f(q_h) + H r.               (1)

Times v_h this is the balance of energy, without any loss of the scheme; times a rigid motion of
the nodes at q_h that of momentum and of moment of momentum: both change by loads, supports and
contacts alone ([ST], [G]).  f is the load at the mean time, of loads that follow at q_h.

Gaps are those at q0; normals, tangents and averages, in H, those of q0 + h v0 / 2.  Couples
(`contact.couples`), in H too, are of places at q_h: impulses between bodies have neither sum
nor moment there, and the law has the motions H^T v that they work on.  A contact takes part
where its gap and `prediction` h u_N are not positive together; its law is that of
`moreau_jean`: between r and u1 + e u0, and where contacts would create energy on u_theta, with
bounds of impulses, and springs of contacts that give way as in `springs`.  Stresses of the law
act on the areas of those averages (`contact.grown_areas`).  Springs keep how far they are drawn
when an area grows: energy that brings is no work, and -`numerical`.

Ties have the averages T of `contact.carried`, which never change: T v1 = 0, so that they do no
work on v_h, and as T q_h = 0 their impulses have neither sum nor moment.  A bond has springs
drawn by T q0 at the beginning of a step.

(1) is solved by Newton's method with the symmetric matrix M + h/2 C + h^2/4 K(q1), a contact
problem of impulses in every iteration, until its residual is rounding.  What couples change
between the prediction and q_h is taken from the last iterate, so that H stays in it.

[ST] J. C. Simo, N. Tarnow, "The discrete energy-momentum method. Conserving algorithms for
nonlinear elastodynamics", ZAMP 43 (1992) 757-792.
[G] see `discrete_gradient`.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ...core.clock import NEVER, Deadline
from ...core.errors import InvertedCells, NotConverged
from ...problem.friction import FrictionProblem
from ...problem.law import Law
from ...problem.solution import FrictionSolution
from ...solvers.contract import Iterate
from ..elements.corotational import CorotationalBody
from ..elements.discrete_gradient import DiscreteBody
from ..elements.elasticity import materials_by_region
from ..model import Model
from ..model.faced import Faced
from ..model.nonlinear_parts import nonlinear_parts
from ..model.reactions import support_forces
from .energy import Energies
from .impulses import Shifts
from .rubbing import rubbed
from .springs import Springs
from .state import State, TimeStep
from .system import Inertia, Motion
from .turning import InFrames, Turning, check_turning

Array = NDArray[np.float64]
Index = NDArray[np.int64]
ITERATIONS = 40  # of Newton's method
ROUNDING = 1e-13  # residual, of the sizes of what it sums up, at which it ends
GOOD = 1e-8  # residual that is still taken where it falls no more
BLUR = 1e-14  # strain that rounding makes of positions: what it stresses is no residual
TOUCHING = 1e-9  # gaps below this part of the size of a contact's area count as closed


@dataclass
class _Trial:
    """An iterate: velocities and impulses, and what (1) misses there, (dofs,).

    turned (dofs, k d): what couples at q_h add to H of the active contacts; None: nothing.
    """

    turned: sparse.csr_array | None
    velocity: Array
    impulse: Array
    missing: Array
    error: float
    good: float  # error that is still taken


class LargeMovingModel:
    """A model in large deformations with inertia; `advance` makes one step."""

    def __init__(self, method: Any, model: Model, tolerance: float) -> None:
        check_turning(method, model)
        self.method, self.motion, self.tolerance = method, Motion(model), tolerance
        body = self.motion.body
        self.parts = nonlinear_parts(body).without_fading()
        self._all = self.motion.parts
        inertia = Inertia(body, method.mass_damping, 0.0, method.lumped)
        self.M, self.C = inertia.M, inertia.C  # without viscosity, which bodies have
        viscous = method.stiffness_damping / method.step
        self._bodies: list[Any] = [
            Turning(own, viscous) if isinstance(own, CorotationalBody)
            else DiscreteBody(b.mesh, materials_by_region(b.mesh, b.material))  # type: ignore[arg-type]
            for b, own in zip(body.bodies, self.parts.bodies, strict=True)
        ]  # fmt: skip
        self.frames = InFrames.of(self.parts, inertia, method)
        weights = self._all.sites.weights
        self._closed = TOUCHING * weights ** (1 / (model.dimension - 1))
        self.springs = Springs.of(body.law, model.dimension)
        self.fixed = np.setdiff1d(np.arange(self._all.dofs), self.parts.free)

    def springs_on(self, grown: Array) -> tuple[Law, Springs]:
        """The law of forces, and its springs, on areas grown (nc,) times; none: undeformed."""
        law = self.motion.body.law.scaled(grown if grown.size else 1.0)
        return law, Springs.of(law, self.parts.dimension)

    def begin(self, state: State) -> State:
        """The state before the first step: as it is."""
        return state

    def explained(self, solution: FrictionSolution) -> FrictionSolution:
        """The same record: inertia balances any load."""
        return solution

    def advance(
        self, state: State, time: float, solve: Any, limit: Deadline = NEVER
    ) -> TimeStep:
        """One step from a state to a time; solve(problem, start, None) solves contacts."""
        step = _Step(self, state, time)
        solve_one = step.solver(solve)
        while True:
            trial, solution = step.solved(solve_one, limit)
            energies, held = step.energies(trial)
            size = energies.total + abs(energies.loads) + abs(energies.supports)
            excess = energies.contact - self.tolerance * size
            shifts = excess > 0 and step.shifted(trial).changed(
                solution.r, step.after(trial)[step.active], excess
            )
            if not shifts:
                return step.done(trial, solution, energies, held)
            step.shifts = shifts

    def between(self, before: Array, after: Array) -> Array:
        """Inner forces (dofs,) of a way between displacements (dofs,)."""
        shape, ends = self.parts.X.shape, self.parts.ends
        both = (np.split(q.reshape(shape), ends) for q in (before, after))
        parts = zip(self._bodies, *both, strict=True)
        return np.concatenate([body.between(a, b).ravel() for body, a, b in parts])

    def lost(self, before: Array, after: Array) -> float:
        """Energy that viscosity takes on a way between displacements (dofs,)."""
        shape, ends = self.parts.X.shape, self.parts.ends
        both = (np.split(q.reshape(shape), ends) for q in (before, after))
        parts = zip(self._bodies, *both, strict=True)
        return sum(body.lost(a, b) for body, a, b in parts if isinstance(body, Turning))


class _Step:
    """What does not change within one step."""

    def __init__(self, model: LargeMovingModel, state: State, time: float) -> None:
        self.model, self.state, self.time = model, state, time
        parts, method, motion = model.parts, model.method, model.motion
        h, shape = method.step, parts.X.shape
        q0, v0 = state.displacement, state.velocity
        parts = parts.divided(q0.reshape(shape)) if parts.folds else parts
        self.parts = parts
        start = parts.meet(q0.reshape(shape))
        self.meeting = meeting = parts.meet((q0 + h / 2 * v0).reshape(shape))
        # forces on all of the slave's side, and mean motions, where nodes leave their share
        self._axes = meeting.frames / meeting.passed[:, None, None]
        self.H = sparse.csc_array(meeting.columns(self._axes))
        u0 = self.local(v0)
        closing = start.gap + method.prediction * h * u0[:, 0] <= model._closed
        springs, tied = model.springs, motion.body.law.tied
        self.active = np.flatnonzero((closing | springs.presses | tied) & meeting.met)
        stressed = motion.body.law.has_stresses
        whole = meeting.growth * meeting.passed
        self.growth = whole if stressed else np.zeros(0)
        law, self.springs = model.springs_on(whole)
        self.law = self.springs.of_impulses(law, h, method.theta).at(self.active)
        # forces that draw springs as far on areas of now, which who dropped out has none of
        grown = np.where(meeting.met, whole / (state.growth if state.growth.size else 1), 0.0)
        self.drawn = state.force * grown[:, None] if stressed else state.force
        self.load = 0.5 * (motion.load(state.time) + motion.load(time))
        self.held = (motion.prescribed(time) - motion.prescribed(state.time)) / h
        gap, pulled = start.gap.copy(), self.drawn.copy()
        if tied.any():  # as far as bonds are drawn, in the frames of this step
            drawn = np.einsum("pkc,pc->pk", meeting.frames, start.distances())
            gap[tied], give = drawn[tied, 0], self.springs.C
            pulled[tied] = (-drawn / np.where(give > 0, give, np.inf))[tied]
        self.shifts = Shifts.of(u0[self.active], gap[self.active], method,
                                self.springs.at(self.active), pulled[self.active],
                                tied[self.active])  # fmt: skip
        d = u0.shape[1]
        columns = (self.active[:, None] * d + np.arange(d)).ravel()
        self._columns = sparse.csc_array(self.H[:, columns])  # type: ignore[index]
        self._before = u0

    def local(self, v: Array) -> Array:
        """Local values of motions (dofs,), (nc, d)."""
        return (self.H.T @ v).reshape(-1, self.model.parts.dimension)

    def after(self, trial: _Trial) -> Array:
        """Local velocities at the end, (nc, d)."""
        return self.local(trial.velocity) + self._whole(self._more(trial, trial.velocity))

    def _more(self, trial: _Trial, v: Array) -> Array:
        """What couples at q_h add to local values (k d,) of motions (dofs,)."""
        if trial.turned is None:
            return np.zeros(self._columns.shape[1])
        return trial.turned.T @ v

    def shifted(self, trial: _Trial) -> Shifts:
        """The law's shifts with couples at q_h."""
        more = self._more(trial, self.state.velocity)
        before = self._before[self.active]
        return replace(self.shifts, before=before + more.reshape(before.shape))

    def _turned_at(self, q: Array) -> sparse.csr_array | None:
        """`turned` of a trial with displacements q (dofs,) halfway."""
        if self.meeting.turned_here is None or not len(self.active):
            return None
        here = self.meeting.turned(self.parts.X + q.reshape(self.parts.X.shape))
        assert here is not None
        nc, d = self._before.shape
        axes = (self._axes.swapaxes(1, 2), np.arange(nc), np.arange(nc + 1))
        axes = sparse.csc_array(sparse.bsr_array(axes, shape=(nc * d, nc * d)))
        columns = (self.active[:, None] * d + np.arange(d)).ravel()
        return sparse.csr_array((here - self.meeting.turned_here) @ axes[:, columns])

    def _pushed(self, turned: sparse.csr_array | None, impulse: Array) -> Array:
        """Impulses (dofs,) on all nodes."""
        out = self._columns @ impulse
        return out if turned is None else out + turned @ impulse

    def _whole(self, impulse: Array) -> Array:
        """Impulses (nc, d) of all contacts, of those (k d,) of the active ones."""
        out = np.zeros_like(self._before)
        out[self.active] = impulse.reshape(-1, out.shape[1])
        return out

    def _moved(self, v1: Array) -> Array:
        return self.state.displacement + self.model.method.step / 2 * (self.state.velocity + v1)

    def _trial(self, v1: Array, impulse: Array) -> _Trial:
        """(1) at velocities v1 (dofs,) and impulses (k d,) of the active contacts."""
        m, h = self.model, self.model.method.step
        q0, v0 = self.state.displacement, self.state.velocity
        q1 = self._moved(v1)
        inertia, inner = m.M @ (v1 - v0), h * m.between(q0, q1)
        damped = h / 2 * (m.C @ (v0 + v1))
        load = h * self.load.at(((q0 + q1) / 2).reshape(m.parts.X.shape))
        turned = self._turned_at((q0 + q1) / 2)
        pushed = self._pushed(turned, impulse)
        missing = inertia + damped + inner - load - pushed
        free = m.parts.free
        terms = (m.M @ v0, m.M @ v1, inner, damped, load, pushed)
        size = sum(float(np.linalg.norm(term[free])) for term in terms) or 1.0
        error = float(np.linalg.norm(missing[free])) / size
        blur = BLUR * m.parts.unit_forces(q1.reshape(m.parts.X.shape))
        return _Trial(turned, v1, impulse, missing, error, max(GOOD, h * blur / size))

    def solver(self, solve: Any) -> Any:
        """solve of a linearised step: (trial, matrix) -> (velocities, solution)."""
        m, free = self.model, self.model.parts.free
        kept: dict[int, FrictionProblem] = {}

        def lagging(trial: _Trial) -> tuple[Array, Array]:
            """Forces (dofs,) and shifts (k, d) with what couples change, of the last trial."""
            shifts = self.shifted(trial).values
            more = self._more(trial, trial.velocity).reshape(shifts.shape)
            return trial.missing + self._columns @ trial.impulse, shifts + more

        def in_frames(trial: _Trial, T: Any) -> tuple[Array, FrictionSolution]:
            assert m.frames is not None
            rest, shifts = lagging(trial)
            known = m.frames.product(T, trial.velocity) - rest
            problem = m.frames.problem(
                T, self._columns, known, shifts, self.law, m.motion.body.name
            )
            start = Iterate(trial.impulse.reshape(-1, m.parts.dimension))
            solution = solve(problem, start, None)
            assert solution.v is not None
            return T @ solution.v, solution

        def solved(trial: _Trial, matrix: Any) -> tuple[Array, FrictionSolution]:
            rest, shifts = lagging(trial)
            known = matrix @ (trial.velocity - self._full(self.held)) - rest
            w = (self._columns.T @ self._full(self.held)).reshape(-1, m.parts.dimension)
            w = w + shifts
            if id(matrix) not in kept:
                kept.clear()
                kept[id(matrix)] = FrictionProblem.from_global(
                    sparse.csr_array(matrix.tocsr()[free][:, free]),
                    sparse.csc_array(self._columns.tocsr()[free]), known[free], w, self.law,
                    name=m.motion.body.name,
                )  # fmt: skip
            problem = replace(kept[id(matrix)], f=known[free], w=w)
            start = Iterate(trial.impulse.reshape(-1, m.parts.dimension))
            solution = solve(problem, start, None)
            assert solution.v is not None
            v1 = self._full(self.held)
            v1[free] = solution.v
            return v1, solution

        return solved if m.frames is None else in_frames

    def _full(self, held: Array) -> Array:
        """Velocities (dofs,) of the supports, zero on free dofs."""
        out = np.zeros_like(held)
        out[self.model.fixed] = held[self.model.fixed]
        return out

    def _matrix(self, v1: Array) -> Any:
        """The matrix of Newton's step; frames halfway where these tell it."""
        m, h = self.model, self.model.method.step
        if m.frames is not None:
            return m.frames.at(0.5 * (self.state.displacement + self._moved(v1)))
        q1 = self._moved(v1).reshape(m.parts.X.shape)
        blocks = m.parts.tangent(q1)[1]
        n = len(m.parts.X) * m.parts.dimension
        K = sparse.bsr_array((blocks, m.parts.columns, m.parts.pointers), shape=(n, n))
        factor = h**2 / 4 + h / 2 * m.method.stiffness_damping
        return sparse.csr_array(m.M + h / 2 * m.C + factor * K.tocsr())

    def solved(self, solve: Any, limit: Deadline) -> tuple[_Trial, FrictionSolution]:
        """The state at which (1) holds; raises NotConverged where it is not found."""
        first = self._full(self.held)
        first[self.model.parts.free] = self.state.velocity[self.model.parts.free]
        impulse = self.model.method.step * self.state.force[self.active].ravel()
        why = "cells would be inverted within it"
        try:
            trial, best, matrix = self._trial(first, impulse), np.inf, None
            solution: FrictionSolution | None = None
            for k in range(ITERATIONS):
                if k < 3 or k % 5 == 0:
                    matrix = self._matrix(trial.velocity)
                v1, solution = solve(trial, matrix)
                trial = self._trial(v1, solution.r.ravel())
                stalled = trial.error > 0.5 * best
                ends = trial.error <= ROUNDING or (stalled and trial.error <= trial.good)
                if ends or limit.passed:
                    break
                best = min(best, trial.error)
            if solution is not None and trial.error <= trial.good:
                return trial, solution
            why = f"its balance of momentum is left with {trial.error:.1e}"
        except InvertedCells:
            solution = None
        raise NotConverged(
            f"step {self.state.index + 1}: no state at its end is found: {why}. Take a smaller "
            f"step than {self.model.method.step:g}", solution,
        )  # fmt: skip

    def energies(self, trial: _Trial) -> tuple[Energies, Array]:
        """The balance of the step, and the impulses (dofs,) left to supports."""
        m, h = self.model, self.model.method.step
        v0, q0, v1 = self.state.velocity, self.state.displacement, trial.velocity
        q1, shape = self._moved(trial.velocity), m.parts.X.shape
        dq = q1 - q0
        held = np.zeros_like(dq)
        held[m.fixed] = trial.missing[m.fixed]
        kinetic, elastic = 0.5 * v1 @ (m.M @ v1), m.parts.energy(q1.reshape(shape))
        gain = kinetic + elastic - 0.5 * v0 @ (m.M @ v0) - m.parts.energy(q0.reshape(shape))
        load = self.load.at(((q0 + q1) / 2).reshape(shape))
        stored = self.springs.energy(self._whole(trial.impulse) / h)
        taken = stored - self.springs.energy(self.drawn)
        before = m.springs_on(self.state.growth)[1].energy(self.state.force)
        return Energies(
            kinetic=float(kinetic), elastic=float(elastic) + stored,
            gain=float(gain) + stored - before, loads=float(load @ dq),
            supports=float(held @ dq) / h,
            contact=float(self._pushed(trial.turned, trial.impulse) @ dq) / h + taken,
            damping=float(dq @ (m.C @ dq)) / h + m.lost(q0, q1),
            numerical=before - self.springs.energy(self.drawn),
        ), held  # fmt: skip

    def done(
        self, trial: _Trial, solution: FrictionSolution, energies: Energies, held: Array
    ) -> TimeStep:
        """The step with its state."""
        m, h, state = self.model, self.model.method.step, self.state
        q1, impulse = self._moved(trial.velocity), self._whole(trial.impulse)
        mean = 0.5 * (self._before + self.after(trial))
        mean += 0.5 * self._whole(self._more(trial, self.state.velocity))
        slip = self.springs.slipped(h * mean, self.drawn, impulse / h)
        mean = mean[:, 1:]
        work = (impulse[:, 1:] * mean).sum(axis=1) + self.springs.taken(self.drawn, impulse / h)
        sliding = np.zeros(len(mean), dtype=bool)
        sliding[self.active] = solution.sliding
        new = State(state.index + 1, self.time, q1, trial.velocity, impulse / h,
                    state.slip + h * mean,
                    **rubbed(state, slip, sliding, np.minimum(work, 0.0)),
                    growth=self.growth)  # fmt: skip
        meeting = self.parts.meet(q1.reshape(m.parts.X.shape))
        force = np.einsum("pkc,pk->pc", meeting.frames, impulse / h)
        load = self.load.at(((state.displacement + q1) / 2).reshape(m.parts.X.shape))
        return TimeStep(m.motion.body, new, solution, self.active, energies, meeting.gap,
                        support_forces(m._all, held / h), load, meeting.frames,
                        faced=Faced.whole(self.meeting, m._all.sites.weights, force))
