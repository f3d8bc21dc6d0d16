"""Contact where the nodes are now: the law, and its exact derivative.

Per contact, at position x with the normal n(x) and gap g(x) of its pair, lambda the force on
the node in global axes, and s = x - x_before + drift the motion since the last step:

    y = lambda - rho s,   z_N = lambda . n + c - rho (g + C lambda . n + o),
    z_T = (I - n n^T) y                                                                     (1)
    law(lambda, x) = lambda - (max(z_N, 0) - c) n - P(z_T),  P: |.| <= mu max(z_N, 0) or a  (2)
                                                                bound

which is zero exactly where g >= 0, lambda . n >= 0, one of them zero, and friction opposes the
motion along the tangent plane at x: [AC], [LR] problem (P) with the other sign of lambda.
Forces in global axes leave the choice of tangents free, so that (2) turns with the frame.
c is a cohesion, C a compliance and o an offset of the law (`problem.law.changed`), zero else.
Who meets nobody has no cohesion and no bound of his own.
rho > 0 has the unit of force over length.  drift is (1 - gamma) V_T of [LR], else zero.

Where a contact may have slid by a length a while it was open in this step, see `closing`, that
much is no slip: z_T (1 - rho a / |z_T|), zero where negative, is in the place of z_T.  Then
(2) is zero where friction opposes what is left of the motion, s_T (1 - a / |s_T|), and none is
up to there: the proximal map of mu N max(|s_T| - a, 0) in the place of that of mu N |s_T|.

Of components that supports prescribe the law says lambda, which the support takes (`dragged`);
where both bodies are held in one, as at planes of symmetry, lambda and s, with what springs
were drawn by, count as zero there.  Orthotropic friction, and springs along the surface, are
`framed_point`.

[AC] P. Alart, A. Curnier, CMAME 92 (1991).
[LR] T. Ligurský, Y. Renard, CMAME 280 (2014).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ...problem.law import Law
from ...problem.law.law import MU, TRESCA
from ...problem.law.states import SLIP, STICK
from .closing import left, slope_of_left
from .current_pairs import Meetings, ObstaclePair, Pair
from .dragged import GIVE, GIVE_BETWEEN, dragged, softened, without_held
from .fading import Mixture
from .pieces import (
    BACK,
    Pieces,
    active,
    friction_slopes,
    margins,
    slides,
    tangents,
    turned_slip,
)
from .surface_axes import still_drawn
from .tied_law import gives, tie_inplace

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Partials = tuple[Array, Array, Array, Array, Array | None]


@dataclass(frozen=True, eq=False)
class CurrentContact:
    """The law of nc contacts, pair after pair.

    rho (nc,), force per length; free (nc, d), bool: components without a support; rubbed
    (nc, d): held ones between bodies that the law hears, None for none.
    """

    pairs: Sequence[Pair]
    law: Law
    rho: Array
    free: Mask
    rubbed: Mask | None = None

    @cached_property
    def at_obstacles(self) -> Mask:
        """Contacts with an obstacle, (nc,)."""
        known = [np.full(len(p.slaves), isinstance(p, ObstaclePair)) for p in self.pairs]
        return np.concatenate(known)

    @cached_property
    def heard(self) -> Mask:
        """Components of motions that the law hears, (nc, d): with obstacles all of them."""
        out = self.free | self.at_obstacles[:, None]
        return out if self.rubbed is None else out | self.rubbed

    @cached_property
    def rho_along(self) -> Array:
        """rho in z_T, (nc,), see `dragged`."""
        return softened(self)

    @cached_property
    def giving(self) -> Array:
        """GIVE of `dragged`, (nc, 1), of `rho_along`."""
        give = np.where(self.at_obstacles, GIVE, GIVE_BETWEEN) * self.rho_along / self.rho
        return give[:, None]

    def over(self, meeting: Meetings) -> CurrentContact:
        """The contact whose stresses act on the areas of a meeting, see `grown_areas`."""
        if not self.law.has_stresses:
            return self
        grown = meeting.growth
        return replace(self, law=self.law.scaled(grown), rho=self.rho * grown)

    def law_at(self, meeting: Meetings) -> Law:
        """The law on areas of now, without what holds contacts that meet nobody any more."""
        law = self.over(meeting).law
        return law if meeting.met.all() else law.lost(~meeting.met)

    @cached_property
    def framed(self) -> bool:
        """True where the law speaks of tangents that the surface carries."""
        law, give = self.law, self.law.give
        return law.stretch is not None or (
            give is not None and bool(((give[:, 1] > 0) & ~law.tied).any())
        )

    @cached_property
    def softness(self) -> Array:
        """Length per force, (nc,): 1 / rho, with that of springs along the surface."""
        give = self.law.give
        return 1 / self.rho if give is None or not self.framed else 1 / self.rho + give[:, 1]

    @cached_property
    def give(self) -> Array:
        """C and C_T, (nc, 2), length per force."""
        give = self.law.give
        return np.zeros((len(self.rho), 2)) if give is None else give[:, :2]

    def meet(self, positions: Array) -> Meetings:
        """Where the pairs meet at the positions (nodes, d) of all nodes."""
        return Meetings([pair.at(positions) for pair in self.pairs])

    def local(
        self, force: Array, motion: Array, meeting: Meetings, drawn: Array | None = None,
        play: Array | None = None, given: Array | None = None,
    ) -> tuple[Array, Array, Array]:  # fmt: skip
        """(r, u, frames): reactions and [gap, slip], (nc, d), in the frames (nc, d, d) there.

        force lambda and motion s, (nc, d), in global axes; drawn (nc, d-1): how far springs
        were drawn at the end of the last step, in the frames, a part of the slip; play (nc,):
        a, which is none.
        """
        own, axes, force = self.over(meeting), meeting.frames, force * self.free
        motion = motion * self.heard
        if (self.heard & ~self.free).any():
            point = self.at(force, motion, meeting, drawn, play, given)
            force, motion, mixed = point.force, point.motion + point.given_way, point.mixed
        else:
            mixed = meeting.mixture(own, force, motion, drawn)
            motion = motion if mixed is None else mixed.motion
        r, u = (np.einsum("pkc,pc->pk", axes, part) for part in (force, motion))
        if play is not None:
            rho = own.rho_along
            z = r[:, 1:] - rho[:, None] * u[:, 1:]
            u[:, 1:] += (1 - left(z, rho * play))[:, None] * z / rho[:, None]
        u[:, 0] = meeting.gap if mixed is None else mixed.told_gap
        if drawn is not None:
            part = 1.0 if mixed is None else mixed.weights[:, None]
            u[:, 1:] += part * still_drawn(drawn, axes, self.heard)
        return r, u, axes

    def at(
        self, force: Array, motion: Array, meeting: Meetings, drawn: Array | None = None,
        play: Array | None = None, given: Array | None = None, pieces: Pieces | None = None,
    ) -> ContactPoint:  # fmt: skip
        """The law at forces lambda and motions s, (nc, d); given and pieces: of `dragged`."""
        own, force, motion = self.over(meeting), force * self.free, motion * self.heard
        mixed = meeting.mixture(own, force, motion, drawn)
        if mixed is not None:
            motion = mixed.motion
        known = own, force, motion, meeting, mixed
        if not self.framed:
            return dragged(ContactPoint(*known, play), given, pieces)
        from .framed_point import FramedPoint  # which is a ContactPoint

        return dragged(FramedPoint(*known, drawn=drawn), given, pieces)


@dataclass(frozen=True, eq=False)
class ContactPoint:
    """Where (2) is evaluated; arrays are made when they are asked for.

    motion (nc, d): s, or what `mixed` has in its place; play (nc,): a; held (nc, d): H of
    `dragged`, whose forces are the law's, None for none, on pieces chosen (nc,) or active ones.
    """

    contact: CurrentContact
    force: Array
    motion: Array
    meeting: Meetings
    mixed: Mixture | None = None
    play: Array | None = None
    held: Mask | None = None
    chosen: Pieces | None = None

    @property
    def gap(self) -> Array:
        """g, (nc,), or what `fading` has in its place."""
        return self.meeting.gap if self.mixed is None else self.mixed.gap

    @property
    def n(self) -> Array:
        """Normals, (nc, d)."""
        return self.meeting.normals

    @cached_property
    def cohesion(self) -> Array:
        """c, (nc,)."""
        return np.where(self.meeting.met, self.contact.law.cohesion, 0.0)

    @cached_property
    def _stiffness_left(self) -> Array:
        """1 - rho C, (nc,): z_N by lambda . n."""
        return 1.0 - self.contact.rho * self.contact.give[:, 0]

    @property
    def tied(self) -> Mask:
        """Contacts that neither part nor slip, (nc,): their law is rho (s + C lambda)."""
        return self.contact.law.tied

    def _with_ties(self, out: Array) -> Array:
        """The law (nc, d) of the others, with that of ties."""
        if not self.tied.any():
            return out
        given = self.motion + np.einsum("pij,pj->pi", gives(self), self.force)
        return np.where(self.tied[:, None], self.contact.rho[:, None] * given, out)

    @property
    def slip(self) -> Array:
        """What friction speaks of, (nc, d): s."""
        return self.motion

    @cached_property
    def counted(self) -> Array:
        """Parts of lambda in z_T, (nc, d): 1 but for what `dragged` has."""
        held = np.zeros(self.n.shape, dtype=bool) if self.held is None else self.held
        return np.where(held, 1.0 - self.contact.giving, 1.0)

    @property
    def given_way(self) -> Array:
        """What is no slip of s, (nc, d): how far springs of `dragged` are drawn."""
        return (1.0 - self.counted) * self.force / self.contact.rho_along[:, None]

    @cached_property
    def y(self) -> Array:
        """lambda - rho s, (nc, d)."""
        return self.counted * self.force - self.contact.rho_along[:, None] * self.motion

    @cached_property
    def y_normal(self) -> Array:
        """n . y, (nc,)."""
        return (self.n * self.y).sum(axis=1)

    @cached_property
    def z_normal(self) -> Array:
        """z_N, (nc,): positive where closed; negative where nobody is met."""
        along = (self.n * self.force).sum(axis=1)
        apart = self.gap + self.contact.give[:, 0] * along + self.contact.law.offset
        apart = self.contact.rho * apart
        closed = along + self.cohesion - apart
        return np.where(self.meeting.met, closed, -np.abs(along) - np.abs(apart))

    @cached_property
    def _z(self) -> Array:
        """z_T without a, (nc, d)."""
        return self.y - self.n * self.y_normal[:, None]

    @cached_property
    def z_tangent(self) -> Array:
        """z_T, (nc, d), in global axes."""
        if self.play is None:
            return self._z
        return left(self._z, self.contact.rho_along * self.play)[:, None] * self._z

    @cached_property
    def bound(self) -> Array:
        """Largest friction force, (nc,)."""
        return self._bound(self.z_normal > 0)

    def _bound(self, closed: Mask) -> Array:
        law, z = self.contact.law.plain, np.where(closed, self.z_normal, 0.0)
        mu, bound = law.parameters.T
        bound = np.where(self.tied, 0.0, bound)  # infinite, of no use here
        return np.where(law.given(z[:, None]), bound, mu * z) * self.meeting.met

    @property
    def _without(self) -> Mask:
        """Contacts without friction, (nc,), that are not under Tresca's law."""
        law = self.contact.law
        return (law.parameters[:, MU] == 0) & (law.kind != TRESCA)

    @cached_property
    def along(self) -> Array:
        """2D: component of z_T along the tangent t of `frames`, (nc,); its length in 3D."""
        if self.n.shape[1] == 2:
            return (self.z_tangent * tangents(self.n)).sum(axis=1)
        return np.linalg.norm(self.z_tangent, axis=1)

    @cached_property
    def pieces(self) -> Pieces:
        """Which piece of the law is active, (nc,), see `pieces`."""
        alone = (self.contact.law.kind == TRESCA) & self.meeting.met
        closed, without = self.z_normal > 0, self._without
        return active(self.along, self.bound, closed, alone, without, self.tied)

    def residual(self, pieces: Pieces | None = None) -> Array:
        """(2), (nc, d), unit of force; or the selection functions of given pieces."""
        if pieces is not None:
            return self._selected(pieces)
        normal = (np.maximum(self.z_normal, 0.0) - self.cohesion)[:, None] * self.n
        length = np.linalg.norm(self.z_tangent, axis=1)
        scale = np.where(length > self.bound, self.bound / np.where(length > 0, length, 1), 1.0)
        friction = self._released(scale[:, None] * self.z_tangent)
        return self._with_ties(self.force - normal - friction)

    def _released(self, friction: Array) -> Array:
        """P as the friction force that it is, (nc, d)."""
        return friction

    def _selected(self, pieces: Pieces) -> Array:
        """(2) as if the given pieces were active."""
        closed, kind = (pieces > 0) & (pieces < 4), pieces % 4
        normal = (np.where(closed, self.z_normal, 0.0) - self.cohesion)[:, None] * self.n
        bound = self._bound(closed)
        if self.n.shape[1] == 2:
            sign = np.select([kind == SLIP, kind == BACK], [1.0, -1.0], 0.0)
            slip = (sign * bound)[:, None] * tangents(self.n)
        else:
            length = np.where(self.along > 0, self.along, 1.0)
            slip = (np.where(slides(kind), bound, 0.0) / length)[:, None] * self.z_tangent
        stuck = (kind == STICK)[:, None] * self.z_tangent
        return self._with_ties(self.force - normal - self._released(slip + stuck))

    def margins(self, pieces: Pieces) -> Array:
        """Distances to the borders of given pieces, (nc, 3), see `pieces`."""
        bound = self._bound((pieces > 0) & (pieces < 4))
        out = margins(pieces, self.z_normal, self.along, bound, self._without)
        return np.where(self.tied[:, None], np.inf, out)

    def derivatives(self, pieces: Pieces | None = None) -> tuple[Array, Array, Array]:
        """Derivatives of (2) by lambda, x and s, each (nc, d, d), on some (the active) pieces.

        With obstacles alone: x moves n and g only, its part in s is the third array.
        """
        by_force, by_normal, by_gap, by_motion, _ = self.partials(pieces)
        by_x = by_normal @ self.meeting.normal_slopes
        by_x += by_gap[:, :, None] * self.meeting.gap_slopes[:, None, :]
        return by_force, by_x * self.contact.free[:, None, :], by_motion

    def partials(self, pieces: Pieces | None = None) -> Partials:
        """Derivatives of (2) by lambda, n, g (nc, d), s and E; the others (nc, d, d).

        Of what is free of lambda and heard of s.
        """
        return without_held(self, pieces)

    @cached_property
    def slopes(self) -> Partials:
        """`of_all` of the pieces of lambda_H in `dragged`."""
        return self.of_all(self.chosen)

    def of_all(self, pieces: Pieces | None = None) -> Partials:
        """The same of all as if none were held; by E of `surface_axes`, unknown here: None."""
        pieces = self.pieces if pieces is None else pieces
        n, d = self.n, self.n.shape[1]
        closed = ((pieces > 0) & (pieces < 4)).astype(float)
        rho = self.contact.rho_along[:, None, None]
        eye = np.eye(d)
        tangential = eye - n[:, :, None] * n[:, None, :]
        in_z, in_bound = self._friction(pieces)
        if self.play is not None:
            in_z = in_z @ slope_of_left(self._z, self.contact.rho_along * self.play)
        law, z = self.contact.law.plain, np.where(closed > 0, self.z_normal, 0.0)[:, None]
        slope = np.where(law.given(z), 0.0, law.parameters[:, MU])
        in_bound = in_bound * (slope * closed)[:, None]
        normal = closed[:, None] * n + in_bound  # of the force, per z_N
        pressed = self._stiffness_left[:, None, None] * normal[:, :, None]
        by_force = eye - pressed * n[:, None, :] - in_z @ tangential * self.counted[:, None, :]
        # z_T by n at fixed y
        turned = -eye * self.y_normal[:, None, None] - n[:, :, None] * self.y[:, None, :]
        by_normal = -pressed * self.force[:, None, :] - in_z @ turned
        by_normal -= (closed * self.z_normal - self.cohesion)[:, None, None] * eye
        if d == 2:
            by_normal -= turned_slip(pieces % 4, n, self._bound(closed > 0))
        by_gap = normal * self.contact.rho[:, None]
        by_motion = rho * (in_z @ tangential)
        if self.tied.any():
            tie_inplace(self, by_force, by_normal, by_gap, by_motion)
        return by_force, by_normal, by_gap, by_motion, None

    def _friction(self, pieces: Pieces) -> tuple[Array, Array]:
        """Derivatives of P by z_T, (nc, d, d), and by the bound, (nc, d)."""
        bound = self._bound((pieces > 0) & (pieces < 4))
        return friction_slopes(pieces % 4, self.n, self.z_tangent, self.along, bound)
