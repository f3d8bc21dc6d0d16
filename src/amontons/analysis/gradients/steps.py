"""Gradients through steps in time: the adjoint of an evolution, step by step from its end.

J is a sum over steps of numbers whose slopes in displacements, velocities and forces are given.
A step is a friction problem whose load and gaps come from the state before it, so that its
adjoint (`systems`, one solve with the transposed system) tells the slopes of J in that state:

quasi-static, w = H^T prescribed + gap - (H^T q_0 + C r_0)_T,                            (1)

    q~_0 += -H (0, z_T),    r~_0 += -C (0, z_T);

Moreau-Jean with the letters of `mechanics.steps.moreau_jean`,                           (2)

    v~ = v~_1 + h theta q~_1,   r~ = f~_1 / h
    q~_0 = q~_1 - h K L
    v~_0 = h (1 - theta) q~_1 + (M - h (1 - theta) C - h^2 theta (1 - theta) K) L + H s(z),

s being what the law adds of u_0: restitution times its normal part, or (1 - theta) / theta of
all of it where the law is on the mean.  Which contacts take part is not differentiated.

States are kept at every root of the number of steps and steps made again from there, so that
memory grows like that root while all steps are made twice.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...core.errors import InvalidInput, UnsupportedForm, UnsupportedLaw
from ...core.faces import Told
from ...core.warned import ResultWarning
from ...mechanics.model import Model
from ...mechanics.model.fields import by_body
from ...mechanics.steps import MoreauJean, QuasiStatic, State, TimeStep, evolve
from ...mechanics.steps.moreau_jean import MovingModel
from ...mechanics.steps.schedule import Schedule
from ...mechanics.steps.slow_model import SlowModel
from ...problem.friction import FrictionProblem
from .gradient import Differentiable, Gradient
from .model_gradient import STENCIL, Make, numbers_of, of_bodies, step_of
from .systems import rows

Array = NDArray[np.float64]
Slopes = Mapping[str, Any] | None
NAMES = ("displacement", "velocity", "force")
SAME = 1e-12  # difference of shifts, relative, up to which they are the same
TOLERANCE = 1e-10  # of the solves: derivatives speak of exact statuses


@dataclass(frozen=True, eq=False)
class _Made:
    """A step, the state before it and its adjoint; motion (dofs,): slopes in all v."""

    before: State
    step: TimeStep
    gradient: Gradient
    L: Array  # (dofs,)
    z: Array  # (nc, d)
    motion: Array


@dataclass(frozen=True, eq=False, repr=False)
class EvolutionGradient(Told):
    """The gradient of J with respect to what an evolution is made of.

    times (steps,); loads, prescribed: of nodal forces and prescribed displacements at the end
    of every step, (nodes, dim) per body; in dynamics loads are those of the mean over it.  gap,
    mu, bound (nc,): sums over all steps.  displacement, velocity: of the state at the start, a
    body each.  weak (steps,): contacts on the border of their status.  along: dJ/dp of every
    family of models that was asked for, by its name.
    """

    model: Model
    times: Array
    loads: tuple[tuple[Array, ...], ...]
    prescribed: tuple[tuple[Array, ...], ...]
    gap: Array
    mu: Array
    bound: Array
    displacement: tuple[Array, ...]
    velocity: tuple[Array, ...]
    weak: NDArray[np.int64]
    along: dict[str, float]

    @cached_property
    def warnings(self) -> tuple[ResultWarning, ...]:
        """What may be doubted."""
        steps = np.flatnonzero(self.weak)
        if not len(steps):
            return ()
        return (ResultWarning(
            "weak-contacts",
            f"in {len(steps)} of {len(self.weak)} steps contacts are on the border of their "
            f"status (first at t = {self.times[steps[0]]:.6g}): there are one-sided "
            "derivatives, and this is that of the statuses which were told",
        ),)  # fmt: skip

    def __str__(self) -> str:
        text = f"gradient through {len(self.times)} steps to t = {self.times[-1]:.6g}"
        return "\n".join([text, *map(str, self.warnings)])


def evolution_gradient(
    model: Model, method: MoreauJean | QuasiStatic, slopes: Callable[[TimeStep], Slopes], *,
    until: float, start: State | None = None, solver: Any = None, tolerance: float = TOLERANCE,
    along: Mapping[str, tuple[Make, float]] | None = None,
) -> EvolutionGradient:  # fmt: skip
    """The gradient of J = sum over steps of j(step) through an evolution, by its adjoint.

    slopes(step): those of j, {"displacement": (nodes, dim) per body, "velocity": the same,
    "force": (nc, d)}, each left out where it is zero; None for nothing.  along: {name: (make,
    at)}, families of models make(p) with make(at) the model, by differences of assembled
    arrays; the state at the start is the same for all p.  Others as of `evolve`.  Raises
    NotConverged where a step does, UnsupportedForm for large deformations, bodies that yield,
    Nitsche's method, locked bolts and schedules of several models, UnsupportedLaw for laws that
    follow the state, and for springs of contacts in dynamics.
    """
    if model.kind is not FrictionProblem or isinstance(method, Schedule):
        raise UnsupportedForm(
            "evolution_gradient: expected linear elastic or rigid bodies in contact of small "
            "kinematics, and QuasiStatic or MoreauJean without stages"
        )
    options: dict[str, Any] = {"solver": solver, "tolerance": tolerance}
    adjoint = _Adjoint(model, method, tolerance, along or {})
    kept, count = _checkpoints(model, method, until, start, options)
    if not count:
        raise InvalidInput(f"until: expected a time after the start, got {until!r}")
    return adjoint.gradient(kept, count, slopes, options)


def _checkpoints(
    model: Model, method: Any, until: float, start: State | None, options: dict[str, Any]
) -> tuple[list[tuple[int, State | None]], int]:
    """(steps done, state) at every root of the number of steps, and how many there are."""
    first = 0.0 if start is None else start.time
    every = max(1, int(np.sqrt(max((until - first) / method.step, 1.0))))
    kept: list[tuple[int, State | None]] = [(0, start)]
    count = 0
    for step in evolve(model, method, until=until, start=start, **options):
        count += 1
        if count % every == 0:
            kept.append((count, step.state))
    return kept, count


class _Adjoint:
    """The adjoints of the steps of one evolution."""

    def __init__(
        self, model: Model, method: Any, tolerance: float,
        along: Mapping[str, tuple[Make, float]],
    ) -> None:  # fmt: skip
        self.model, self.method, self.tolerance = model, method, tolerance
        self.prepared: Any = method.prepare(model, tolerance)
        self.slow = isinstance(self.prepared, SlowModel)
        if not isinstance(self.prepared, SlowModel | MovingModel):
            raise UnsupportedForm("evolution_gradient: bolts that are locked have no adjoint")
        self.parts = self.prepared.motion.parts
        if not self.slow:
            springs = self.prepared.springs
            if springs.presses.any() or springs.sticks.any() or method.reach:
                raise UnsupportedLaw(
                    "evolution_gradient: dynamics with springs of contacts, or with reach, "
                    "have no adjoint; expected hard contact"
                )
        self.families = {name: self._family(*given) for name, given in along.items()}
        self.along = dict.fromkeys(along, 0.0)

    def gradient(
        self, kept: list[tuple[int, State | None]], count: int,
        slopes: Callable[[TimeStep], Slopes], options: dict[str, Any],
    ) -> EvolutionGradient:  # fmt: skip
        """From the last step to the first."""
        parts, nc = self.parts, self.parts.carried.shape[0]
        state: dict[str, Array] = {
            "displacement": np.zeros(parts.dofs), "velocity": np.zeros(parts.dofs),
            "force": np.zeros(parts.carried.shape),
        }  # fmt: skip
        found: list[tuple[float, int, tuple[Array, ...]]] = []
        held: dict[int, Array] = {}
        sums = {name: np.zeros(nc) for name in ("gap", "mu", "bound")}
        factor = 1.0 if self.slow else self.method.step
        last = count
        for done, from_ in reversed(kept):
            for before, step in reversed(self._steps(from_, last - done, options)):
                for name, value in self._given(slopes(step)).items():
                    state[name] = state[name] + value
                one, state, at = self._back(before, step, state)
                for index, value in at.items():
                    held[index] = held.get(index, 0.0) + value
                self._add(one, sums, factor)
                load = by_body(self.model.bodies, parts, factor * one.L)
                found.append((step.time, len(one.gradient.weak), load))
            last = done
        found.reverse()
        bodies, times = self.model.bodies, np.array([time for time, _, _ in found])
        return EvolutionGradient(
            self.model, times, tuple(load for _, _, load in found),
            tuple(by_body(bodies, parts, held[k]) for k in sorted(held)[-count:]),
            sums["gap"], sums["mu"], sums["bound"],
            by_body(bodies, parts, state["displacement"]),
            by_body(bodies, parts, state["velocity"]),
            np.array([weak for _, weak, _ in found]), self.along,
        )  # fmt: skip

    def _add(self, one: _Made, sums: dict[str, Array], factor: float) -> None:
        """The part of a step in what all steps share."""
        own, g = one.step.active, one.gradient
        sums["mu"][own] += g.mu
        sums["bound"][own] += factor * g.bound
        if self.slow:
            sums["gap"][own] += g.gap
        for name, family in self.families.items():
            for share, prepared in family:
                pair = self._slow_pair if self.slow else self._moving_pair
                numbers = numbers_of(prepared.motion.body.law)
                self.along[name] += share * pair(one, prepared, *numbers)

    def _family(self, make: Make, at: float) -> list[tuple[float, Any]]:
        """(share in the derivative, prepared model) of the models of a difference."""
        h, out = step_of(at, None), []
        for k, share in STENCIL:
            prepared: Any = self.method.prepare(make(at + k * h), self.tolerance)
            parts = prepared.motion.parts
            if (parts.dofs, parts.carried.shape) != (self.parts.dofs, self.parts.carried.shape):
                raise InvalidInput("make: expected models with the same unknowns and contacts")
            out.append((share / h, prepared))
        return out

    def _steps(
        self, start: State | None, count: int, options: dict[str, Any]
    ) -> list[tuple[State, TimeStep]]:
        """The next steps from a state, each with the state before it."""
        from ...mechanics.steps import at_rest

        out: list[tuple[State, TimeStep]] = []
        before = at_rest(self.model) if start is None else start
        before = self.prepared.begin(before)
        if not count:
            return out
        end = before.time + (count + 0.5) * self.method.step
        for step in evolve(self.model, self.method, until=end, start=start, **options):
            out.append((before, step))
            before = step.state
            if len(out) == count:
                break
        return out

    def _given(self, given: Slopes) -> dict[str, Array]:
        """Slopes of J in the state after a step."""
        out = {}
        for name, value in (given or {}).items():
            if name not in NAMES:
                raise InvalidInput(f"slopes: expected {', '.join(NAMES)}, got {name!r}")
            if name == "force":
                out[name] = rows("slopes: force", value, self.parts.carried.shape)
            else:
                out[name] = of_bodies(name, value, self.model)
        return out

    def _back(
        self, before: State, step: TimeStep, state: dict[str, Array]
    ) -> tuple[_Made, dict[str, Array], dict[int, Array]]:
        """The step with its adjoint, the slopes before it, those of what supports prescribe."""
        parts, method = self.parts, self.method
        h = 1.0 if self.slow else method.step
        theta = 1.0 if self.slow else method.theta
        of_v = state["displacement"].copy()
        if not self.slow:
            of_v = state["velocity"] + h * theta * of_v
        elif state["velocity"].any():  # dq over the step
            span = step.time - before.time
            of_v += state["velocity"] / span
        r = state["force"][step.active] / h
        g = Differentiable(step.solution).vjp(r, None, parts.gathered(of_v))
        L = parts.spread(g.load, np.zeros(parts.dofs))
        z = np.zeros(parts.carried.shape)
        z[step.active] = g.w
        one = _Made(before, step, g, L, z, of_v)
        back, shift = self._slow_back if self.slow else self._moving_back, before.index
        new = back(one, state)
        fixed = parts.is_fixed
        stiffness = parts.K if self.slow else self.prepared.M_hat
        whole = of_v - stiffness @ L + parts.whole_H @ z.ravel()
        whole = np.where(fixed, whole, 0.0)
        if self.slow:
            return one, new, {shift + 1: whole}
        return one, new, {shift + 1: whole / h, shift: -whole / h}

    def _slow_back(self, one: _Made, state: dict[str, Array]) -> dict[str, Array]:
        """(1)."""
        remembered = one.z.copy()
        remembered[:, 0] = 0.0
        C = self.prepared.springs.C
        q = -(self.parts.whole_H @ remembered.ravel())
        if state["velocity"].any():
            q -= state["velocity"] / (one.step.time - one.before.time)
        return {"displacement": q, "velocity": np.zeros_like(q), "force": -C * remembered}

    def _moving_back(self, one: _Made, state: dict[str, Array]) -> dict[str, Array]:
        """(2)."""
        p, h, theta, L = self.prepared, self.method.step, self.method.theta, one.L
        q1 = state["displacement"]
        KL = p.K @ L
        v = h * (1 - theta) * q1 + p.M @ L - h * (1 - theta) * (p.C @ L)
        v -= h * h * theta * (1 - theta) * KL
        v += self.parts.whole_H @ (self._share(one) * one.z).ravel()
        return {"displacement": q1 - h * KL, "velocity": v, "force": np.zeros_like(one.z)}

    def _share(self, one: _Made) -> Array:
        """Which part of u_0 the law of every contact adds, (nc, d), read from the problem."""
        parts, method, active = self.parts, self.method, one.step.active
        motion = self.prepared.motion
        held = motion.prescribed(one.step.time) - motion.prescribed(one.before.time)
        carried = parts.local(held / method.step)[active]
        added = one.step.solution.problem.w - carried  # type: ignore[attr-defined]
        u0 = parts.local(one.before.velocity)[active]
        plain, mean = np.zeros_like(u0), (1 - method.theta) / method.theta
        plain[:, 0] = method.restitution
        size = SAME * float(np.abs([u0, added]).max(initial=0.0))
        share = np.full_like(u0, np.nan)
        for form in (np.full_like(u0, mean), plain, np.zeros_like(u0)):
            same = (np.abs(form * u0 - added) <= size).all(axis=1)
            if form is not plain and not form.any():
                same &= self.prepared.law.tied[active]
            share[same] = form[same]
        own = (np.abs(plain * u0 - added) <= size).all(axis=1)
        share[own] = plain[own]  # where both hold, u_0 = 0, the usual one
        if np.isnan(share).any():
            raise UnsupportedForm(
                f"evolution_gradient: at t = {one.step.time:.6g} restitution was made smaller "
                "so that impacts create no energy, and that has no adjoint; take smaller steps "
                "or restitution = 0"
            )
        out = np.zeros(parts.carried.shape)
        out[active] = share
        return out

    # ---------------------------------------------------------------- parameters
    # what J would be by first order with the arrays of another model, up to a constant
    def _slow_pair(
        self, one: _Made, prepared: Any, mu: Array, bound: Array
    ) -> float:
        parts = prepared.motion.parts
        load, prescribed = prepared.motion.applied(one.step.time)
        q0 = self._of(prepared, one.before.displacement, one.before.time, one.before.index)
        v = one.step.solution.v
        q = parts.spread(v, prescribed)
        w = (parts.whole_H.T @ q).reshape(one.z.shape)
        w[:, 0] += parts.gap
        w[:, 1:] -= (parts.whole_H.T @ q0).reshape(one.z.shape)[:, 1:]
        force = load + parts.whole_H @ one.step.solution.r.ravel() - parts.K @ q
        out = one.L @ force + (one.z * w).sum()
        out += one.gradient.mu @ mu + one.gradient.bound @ bound
        return float(out + one.motion @ prescribed)

    def _moving_pair(self, one: _Made, p: Any, mu: Array, bound: Array) -> float:
        parts = p.motion.parts
        h, theta, before = self.method.step, self.method.theta, one.before
        held = (p.motion.prescribed(one.step.time) - p.motion.prescribed(before.time)) / h
        force = theta * p.motion.load(one.step.time) + (1 - theta) * p.motion.load(before.time)
        v0, q0 = before.velocity, before.displacement
        v1 = parts.spread(one.step.solution.v, held)
        r = np.zeros(one.z.shape)
        r[one.step.active] = one.step.solution.r
        rest = p.M @ v0 + h * (
            force - (1 - theta) * (p.C @ v0) - p.K @ (q0 + h * theta * (1 - theta) * v0)
        )
        rest = rest - p.M_hat @ v1 + parts.whole_H @ r.ravel()
        w = (parts.whole_H.T @ v1).reshape(one.z.shape)
        w += self._share(one) * (parts.whole_H.T @ v0).reshape(one.z.shape)
        active, g = one.step.active, one.gradient
        out = one.L @ rest + (one.z * w).sum() + g.mu @ mu[active]
        out += h * (g.bound @ bound[active])
        return float(out + one.motion @ held)

    @staticmethod
    def _of(prepared: Any, q0: Array, time: float, index: int) -> Array:
        """The state before a step with what another model prescribes then."""
        if not index:
            return q0
        parts = prepared.motion.parts
        return np.where(parts.is_fixed, prepared.motion.applied(time)[1], q0)
