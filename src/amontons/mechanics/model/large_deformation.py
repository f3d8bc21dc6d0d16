"""Bodies in large deformations against obstacles: the discrete nonlinear problem.

With f_int the nodal forces of the bodies, hyperelastic or linear, at displacements v, and f the
loads, which may follow the body, the force that a contact has to supply is lambda = f_int - f
at its node.  The displacements v of the free dofs are all the unknowns of

    F(v) = f_int(v) - f(v)        on free dofs that are no contact,                         (1)
         = law(lambda(v), X + v)  at contacts, (2) of `contact.current`,

which is continuous and piecewise smooth; all its entries are forces.  Friction speaks of the
motion since `before`, the displacements at the end of the last step: [LR] section 3.
With two bodies that deform (1) has the forces of contacts on other nodes, see `moved_pairs`.
`linearised`, the tangent problem at a state, is all that statuses, files and pictures need.
Friction on components that supports hold is that of `contact.dragged`.

[LR] T. Ligurský, Y. Renard, "A continuation problem for computing solutions of discretised
evolution problems with application to plane quasi-static contact problems with friction",
Comput. Methods Appl. Mech. Engrg. 280 (2014).
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ...core.errors import InvertedCells
from ...problem.friction import FrictionProblem
from ...problem.judge import measures as judge
from ...problem.judge.measures import Measure, Weakest
from ...problem.law import Law
from ...problem.protocol import Problem
from ...solvers.newton.nonlinear import NonlinearProblem
from ...solvers.newton.states import PlainStates, States
from ..contact.current import STICK, ContactPoint, Pieces
from ..contact.current_pairs import Meetings
from ..elements.linear_body import LinearBody
from .after_jumps import led_astray
from .given_forces import balanced, balanced_law, with_held
from .held_parts import HeldParts
from .moved_pairs import PairLinearisation
from .nodal_forces import NodalForces, nodal_forces
from .nonlinear_parts import NonlinearParts, nonlinear_parts
from .obstacle_linearisation import Linearisation
from .places_of_failure import places_of_failure
from .pressure_states import PressureStates
from .rubbed_between import hearing, rubbed_between
from .rubbed_states import RubbedStates
from .tangent_problem import moved_on, tangent_problem

if TYPE_CHECKING:
    from .model import Model

Array = NDArray[np.float64]
SLIDING = 0.1  # least part of a Newton step: F has a kink wherever two nodes pass each other
TOUCHING = 1e-9  # gaps up to this part of the size count as closed where nothing holds a body


@dataclass(frozen=True, eq=False)
class LargeDeformation(NonlinearProblem):
    """One static problem, or one step, of large deformations.

    load, prescribed (dofs,): nodal forces, also as an array of dead ones, and values on the
    fixed dofs, zero on the free ones; before (dofs,): displacements of all nodes since which
    friction counts; drift (nc, d): added to the motion of contacts since then; drawn
    (nc, d-1): of springs, see `framed_point`; play (nc,): `contact.closing`; known: load,
    prescribed (dofs,) and state v (n,) where load steps may begin; None: the undeformed one.
    """

    parts: NonlinearParts
    load: NodalForces
    prescribed: Array
    before: Array
    drift: Array
    known: tuple[NodalForces | Array, Array, Array] | None = None
    name: str = ""
    drawn: Array | None = None
    play: Array | None = None
    _last: list[Array] = field(default_factory=list, init=False, repr=False)  # of `_local`
    _kept: list[Array] = field(default_factory=list, init=False, repr=False)  # of `_balanced`

    def __post_init__(self) -> None:
        object.__setattr__(self, "load", NodalForces.of(self.load))

    measure = Measure.RESIDUAL

    @property
    def law(self) -> Law:  # type: ignore[override]  # read only
        """Friction law of all contacts."""
        return self.parts.contact.law

    @property
    def rho(self) -> Array:  # type: ignore[override]  # read only
        """Augmentation parameter, (nc,), force per length."""
        return self.parts.contact.rho

    @property
    def unknowns(self) -> int:  # type: ignore[override]  # read only
        """Free dofs n."""
        return len(self.parts.free)

    @property
    def contacts(self) -> int:
        """Number of contacts nc."""
        return len(self.parts.at)

    @property
    def dimension(self) -> int:  # type: ignore[override]  # read only
        """2 or 3."""
        return self.parts.dimension

    def with_law(self, law: Law) -> LargeDeformation:
        """The same problem under another law of its contacts."""
        contact = replace(self.parts.contact, law=law)
        return replace(self, parts=replace(self.parts, contact=contact))

    def growth(self, v: Array | None) -> Array | float:
        """Areas that stresses of the law act on at a state, over the undeformed ones."""
        return 1.0 if v is None else self.parts.growth(self.displacement(v))

    # ---------------------------------------------------------------- states
    def displacement(self, v: Array) -> Array:
        """Displacements of all nodes, (nodes, d), of those of the free dofs v (n,)."""
        out = self.prescribed.copy()
        out[self.parts.free] = v
        return out.reshape(self.parts.X.shape)

    @cached_property
    def earlier(self) -> Meetings:
        """Where the contacts met at the end of the last step."""
        return self.parts.meet(self.before.reshape(self.parts.X.shape))

    def _meeting(self, u: Array) -> tuple[Array, Meetings]:
        """Motions of the contacts since the last step, (nc, d), and where they meet now."""
        meeting = self.parts.meet(u)
        before = self.before.reshape(u.shape), self.earlier
        return meeting.motion(u, *before) + self.drift, meeting

    def _balanced(self, u: Array, meeting: Meetings) -> Array:
        """f_int - f, balanced (dofs,), at displacements u (nodes, d); the last one is kept."""
        kept = tuple(self._kept)  # other threads may put theirs
        if not (kept and np.array_equal(kept[0], u)):
            self._kept[:] = kept = u.copy(), balanced(self.parts, meeting, self._needed(u))
        return kept[1].copy()

    def _point(
        self, u: Array, pieces: Pieces | None = None, needed: Array | None = None,
        held: Array | None = None,
    ) -> tuple[ContactPoint, Array]:  # fmt: skip
        """The law at displacements u (nodes, d), and f_int - f, balanced.

        By the active or given pieces; needed (dofs,): f_int - f at given pressures; held
        (nc, d): forces along held components between bodies, else those of u.
        """
        known = *self._meeting(u), self.drawn, self.play, held
        if needed is not None:
            rest = balanced(self.parts, known[1], needed)
        else:
            needed, rest = self._needed(u), self._balanced(u, known[1])
        return balanced_law(self.parts, needed, rest, known, pieces)

    def _needed(self, u: Array, pressures: Array | None = None) -> Array:
        """f_int - f (dofs,) at displacements u (nodes, d), or at given pressures, too."""
        return self.parts.forces(u, pressures) - self.load.at(u)

    def _needed_slopes(self, u: Array, pressures: Array | None = None) -> tuple[Array, Array]:
        """The same with its derivative in node blocks (m, d, d)."""
        inner, blocks = self.parts.tangent(u, pressures)
        load, slopes = self.load.slopes(u)
        for nodes, part in slopes:
            self.parts.subtract_inplace(blocks, nodes, part)
        return inner - load, blocks

    def contact_point(
        self, v: Array, held: Array | None = None, pieces: Pieces | None = None
    ) -> ContactPoint:
        """The contact law at a state; held and pieces as in `_point`."""
        return self._point(self.displacement(v), pieces, held=held)[0]

    def residual(
        self, v: Array, pieces: Pieces | None = None, pressures: Array | None = None
    ) -> Array:
        """F(v), (n,), unit of force, or the selection function of given pieces.

        pressures: of hybrid cells, else those of v.  Raises InvertedCells where it has none.
        """
        u = self.displacement(v)
        needed = None if pressures is None else self._needed(u, pressures)
        point, rest = self._point(u, pieces, needed)
        rest[self.parts.at] = point.residual(pieces)
        return rest[self.parts.free]

    def tangent(self, v: Array, pieces: Pieces | None = None) -> sparse.csc_array:
        """dF/dv, (n, n), of the active piece of the law or of the given one, (nc,)."""
        return self.linearisation(v, pieces).matrix

    def linearisation(  # type: ignore[override]  # a cached matrix serves as well
        self, v: Array, pieces: Pieces | None = None, pressures: Array | None = None,
        held: Array | None = None,
    ) -> Linearisation | PairLinearisation:  # fmt: skip
        """F and its derivatives at a state; pressures as in `residual`, held in `_point`."""
        parts, u = self.parts, self.displacement(v)
        needed, blocks = self._needed_slopes(u, pressures)
        point, rest = self._point(u, pieces, None if pressures is None else needed, held)
        if self.law.has_stresses or not point.meeting.only_obstacles:
            return PairLinearisation(parts, u, rest, blocks, point, self.earlier, pieces)
        return Linearisation(parts, u, rest, blocks, point, *point.derivatives(pieces))

    def pieces(self, v: Array) -> Pieces:
        """The active piece of the law at every contact, see `ContactPoint.pieces`."""
        return self.contact_point(v).pieces

    # ---------------------------------------------------------------- what the driver asks
    def reactions(self, v: Array, held: Array | None = None) -> Array:
        """Contact forces r (nc, d) in the frames at the state v; held as in `_point`."""
        return self._local(v, held)[0]

    def _local(self, v: Array, held: Array | None = None) -> tuple[Array, ...]:
        """r, u, frames of `CurrentContact.local`, and f_int - f, balanced (dofs,).

        The last state is kept: it is asked for its reactions, then for its error.
        """
        key = np.append(v, [] if held is None else held)
        if not (self._last and np.array_equal(self._last[0], key)):
            u, contact = self.displacement(v), self.parts.contact
            motion, meeting = self._meeting(u)
            rest = self._balanced(u, meeting)
            known = motion, meeting, self.drawn, self.play, held
            if contact.rubbed is not None:
                rest = with_held(self.parts, self._needed(u), rest, known)
            local = contact.local(rest[self.parts.at], *known)
            self._last[:] = key.copy(), *local, rest
        return tuple(part.copy() for part in self._last[1:])

    def _held(self, r: Array, v: Array) -> Array | None:
        """Forces along held components between bodies of reactions r, (nc, d); None: none."""
        if (rubbed := self.parts.contact.rubbed) is None:
            return None
        axes = self.parts.meet(self.displacement(v)).frames
        return np.where(rubbed, np.einsum("pkc,pk->pc", axes, r), 0.0)

    def local_velocity(self, v: Array, held: Array | None = None) -> Array:
        """u = [gap, slip since the last step], (nc, d), in the frames at the state v."""
        try:
            return self._local(v, held)[1]
        except InvertedCells:  # of forces, which only what fades asks for
            s, meeting = self._meeting(self.displacement(v))
            return self.parts.contact.local(0 * s, s, meeting, self.drawn, self.play)[1]

    def motion(self, r: Array, v: Array | None = None) -> tuple[Array, Array]:
        """([gap, slip], v) at the state v, without one at 0."""
        v = np.zeros(self.unknowns) if v is None else v
        return self.local_velocity(v, self._held(r, v)), v

    def error(self, r: Array, v: Array | None = None) -> float:
        """The residual measure of `judge` at reactions r and state v; infinite if inverted.

        Forces are compared with those at supports, loads and contacts, the law at contacts with
        their gaps, slips and r / rho: sizes of linear elasticity would be those of rotations.
        """
        if v is None or not (np.isfinite(v).all() and np.isfinite(r).all()):
            return np.inf
        try:
            _, u, axes, rest = self._local(v, self._held(r, v))
        except InvertedCells:
            return np.inf
        load, length = self._sizes(v, r, u, rest)
        rest[self.parts.at] -= np.einsum("pkc,pk->pc", axes, r)
        balance = float(np.linalg.norm(rest[self.parts.free]))
        if not self.contacts:
            return balance / load
        law = self.parts.contact.law_at(self.parts.meet(self.displacement(v)))
        return max(balance / load, judge.scaled_residual(r, u, law, self.rho) / length)

    def _sizes(self, v: Array, r: Array, u: Array, rest: Array) -> tuple[float, float]:
        """Sizes of the forces and of u, at least what rounding can resolve."""
        held = rest.copy()
        held[self.parts.free] = self.load.at(self.displacement(v))[self.parts.free]
        load = np.hypot(np.linalg.norm(held), np.linalg.norm(rest[self.parts.at]))
        length = np.linalg.norm([u, r * self.parts.contact.softness[:, None]])
        least = self.parts.resolved(self.displacement(v))
        return max(float(load), least[0]), max(float(length), least[1])

    def weakest(self, r: Array, v: Array | None = None) -> Weakest:
        """The contact farthest from its law beside its own gap, slip and r / rho."""
        if v is None or not (np.isfinite(v).all() and np.isfinite(r).all()):
            return Weakest(np.inf, None)
        try:
            u = self._local(v, self._held(r, v))[1]
        except InvertedCells:
            return Weakest(np.inf, None)
        moved, contact = self.displacement(v), self.parts.contact
        own = np.linalg.norm(u, axis=1) + np.linalg.norm(r, axis=1) * contact.softness
        own += self.parts.resolved(moved)[1]
        return judge.weakest_of(r, u, contact.law_at(self.parts.meet(moved)), self.rho, own)

    # ---------------------------------------------------------------- load steps
    @property
    def known_state(self) -> Array:
        """The state v (n,) at share 0 of the load."""
        return self.known[2] if self.known else np.zeros(self.unknowns)

    @property
    def shortest(self) -> float:  # type: ignore[override]  # read only
        """Least part of a Newton step to take; 0: searched by |F|."""
        return SLIDING if self.parts.has_pairs else 0.0

    @property
    def meets_first(self) -> bool:
        """True where cells may be inverted by small strains, or see `RubbedStates`."""
        rubbed = self.parts.contact.rubbed is not None
        return rubbed or any(isinstance(body, LinearBody) for body in self.parts.bodies)

    def states(self, v: Array, known: Any = None) -> States:
        """What Newton's method moves: v, with hybrid pressures, with forces of supports."""
        if self.parts.contact.rubbed is not None:
            return RubbedStates(self, v, known)
        volumes = any(self.parts.keeps_volume)
        return PressureStates(self, v, known) if volumes else PlainStates(self, v)

    def held(self, v: Array, firmness: float) -> LargeDeformation:
        """The problem with springs of `held_parts`, relaxed at a state."""
        return replace(self, parts=HeldParts.of(self.parts, firmness, self.displacement(v)))

    def at_share(self, share: float) -> LargeDeformation:
        """The problem at a share of the way from the known load to this one."""
        if self.known is None:
            return replace(self, load=share * self.load, prescribed=share * self.prescribed)
        load, prescribed, _ = self.known
        moved = prescribed + share * (self.prescribed - prescribed)
        return replace(self, load=self.load * share + (1 - share) * NodalForces.of(load),
                       prescribed=moved)  # fmt: skip

    def predicted(  # type: ignore[override]  # as above
        self, share: float, goal: float, v: Array
    ) -> tuple[Linearisation | PairLinearisation, Array]:
        """The linearisation at a share, and the first-order change of F, (n,), to another."""
        now, then = self.at_share(share), self.at_share(goal)
        here = now.linearisation(v)
        return here, here.shifted(then.load - now.load, then.prescribed - now.prescribed)

    def towards(self, share: float, goal: float, v: Array) -> FrictionProblem:
        """The tangent problem at a share and state v, under the load of another share."""
        now, then = self.at_share(share), self.at_share(goal)
        u, moved = now.displacement(v), then.prescribed - now.prescribed
        needed, blocks = now._needed_slopes(u)
        force = (then.load - now.load).at(u) - self.parts.matrix(blocks) @ moved
        tangent = now._tangent_problem(v, (needed, blocks))
        return moved_on(tangent, self.parts, v, u, moved, force)

    def remark(self, v: Array) -> str:
        """Which slaves face nothing of their masters, leave or hang on edges; what is flat."""
        u, here = self.displacement(v), self.contact_point(v)
        first = self.at_share(0.0).contact_point(self.known_state).force if self.known else None
        return places_of_failure(self.parts, u, self.earlier, here.pieces % 4 > 0,
                                 None if first is None else (here.force, first))  # fmt: skip

    def astray(
        self, v: Array, known: tuple[LargeDeformation, Array], jumped: bool = True
    ) -> str:
        """Why no step leads from a known state to v, see `after_jumps`; "" for nothing."""
        return led_astray(self.parts, self.displacement(v), known[0].displacement(known[1]),
                          jumped)  # fmt: skip

    def closed_pieces(self, v: Array) -> list[Pieces]:
        """The active pieces with touching contacts stuck, then with all of them stuck."""
        point, size = self.contact_point(v), np.ptp(self.parts.X, axis=0).max()
        loose = (point.pieces % 4 == 0) & point.meeting.met
        return [np.where(loose & (point.meeting.gap <= limit), STICK, point.pieces)
                for limit in (TOUCHING * size, np.inf)]  # fmt: skip

    def recover(self, r: Array, v: Array | None = None) -> tuple[Problem, Array, Array]:
        """A solution is one of the tangent problem at its state unless cells are inverted."""
        u, v = self.motion(r, v)
        try:
            return self.linearised(v, self._held(r, v)), u, v
        except InvertedCells:
            return self, u, v

    def linearised(self, v: Array, held: Array | None = None) -> FrictionProblem:
        """At v: same reactions, gaps and slips there; frames and averages stay as there."""
        return self._tangent_problem(v, self._needed_slopes(self.displacement(v)), held)

    def _tangent_problem(
        self, v: Array, slopes: tuple[Array, Array], held: Array | None = None
    ) -> FrictionProblem:
        """The same; slopes: `_needed_slopes`, which are changed."""
        r, u, axes, rest = self._local(v, held)
        local, sizes, moved = (r, u, axes), self._sizes(v, r, u, rest), self.displacement(v)
        return tangent_problem(self.parts, moved, slopes, local, sizes, self.name)


def large_deformation(model: Model) -> LargeDeformation:
    """The static problem of a model at its load factor; motion from the undeformed state."""
    nonlinear_parts(model)  # says what is not supported
    linear = model.discretisation
    load, factor = nodal_forces(model, model.loads), model.load_factor
    model.check_outside(factor * linear.prescribed)
    return large_step(model, factor * load, factor * linear.prescribed)


def large_step(
    model: Model, load: NodalForces | Array, prescribed: Array, before: Array | None = None,
    known: tuple[NodalForces | Array, Array, Array] | None = None, drawn: Array | None = None,
) -> LargeDeformation:  # fmt: skip
    """One step under nodal forces and prescribed values (dofs,), since displacements `before`.

    before (dofs,): of all nodes, zero by default; known, drawn: see `LargeDeformation`.
    """
    parts = nonlinear_parts(model)
    _ = model.rests_on_contact  # raises where nothing holds a body
    if before is None:
        before = np.zeros(parts.X.size)
    elif parts.folds:
        parts = nonlinear_parts(model.divided(before))
    parts = hearing(parts, rubbed_between(parts, before, prescribed))
    return LargeDeformation(parts, NodalForces.of(load), prescribed, before,
                            np.zeros(parts.at.shape), known, model.name, drawn)  # fmt: skip
