"""Exact solution curves of 2D Coulomb problems under a load: from event to event, no step size.

On a piece of the law the curve is a straight line.  With x the free reactions (r_N along
(1, sign mu) of every closed contact, and r_T beside it of every sticking one),

    (W G x + p q1 + q0)_rows = 0,   one equation per u_N of a closed, u_T of a sticking contact,

and one condition of the law, the driver, grows along the line.  Where another one reaches zero
it takes the driver's place, and the piece behind it has one equation and one unknown more or
less: the inverse of the bordered matrix follows by one rank-one update.  The parameter is an
unknown like the others, so folds, and pieces at constant parameter, are nothing special
(Lemke's scheme for complementarity problems, with both signs of friction).

Where several conditions vanish at once, all one-sided branches come from the first-order
system (`first_order`); a curve with three or more has a branch point there.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from ...core.errors import InvalidInput, SingularOperator
from .friction_path import FrictionPath
from .path import Event, EventKind, Point, Stop, weight_of
from .straight import TIE, check_straight, leaving
from .tangents import Tangent

Array = NDArray[np.float64]
NONE = 1e-13  # rate of a condition, relative to the largest, that counts as zero
EXACT = 1e-11  # rest of the equations above which the inverse is made anew
ROUNDING = 1e-13  # scaled condition at an event that is one of rounding
RENEWAL = 100  # events after which it is made anew in any case
SIGN = {"+": 1.0, "-": -1.0}


class Line:
    """The straight line of one pattern through a point, and its inverse bordered matrix."""

    def __init__(self, path: FrictionPath, tangent: Tangent, y: Array, p: float) -> None:
        self.path = path
        self.mu = path.coefficient(0.0)
        self.letters = list(str(tangent.piece))
        self.sign = np.array([SIGN.get(letter, 1.0) for letter in self.letters])
        closed = [i for i, letter in enumerate(self.letters) if letter != "f"]
        stuck = [i for i in closed if self.letters[i] == "s"]
        # of unknown x_j: its contact, and 0 for r_N along the bound or 1 for r_T beside it
        self.contact = np.array(closed + stuck, dtype=np.int64)
        self.beside = np.repeat([False, True], [len(closed), len(stuck)])
        self.rows = 2 * self.contact + self.beside
        # any functional that grows along the tangent can drive
        along = self.coordinates(tangent.direction, tangent.rate)
        along /= np.linalg.norm(along)
        self.driver, self.level = along, float(along @ self.coordinates(y, p))
        self.driver_row = -1
        self.age = 0
        self.renew()

    def coordinates(self, y: Array, p: float) -> Array:
        """(p, x) of a state."""
        N, T = y[2 * self.contact], y[2 * self.contact + 1]
        return np.append(p, np.where(self.beside, T - self._slope * N, N))

    def state(self, z: Array) -> tuple[Array, float]:
        """(y, p) of coordinates (p, x)."""
        y = np.zeros(len(self.path.q0))
        x, normal = z[1:], ~self.beside
        y[2 * self.contact[normal]] = x[normal]
        y[2 * self.contact[normal] + 1] = (self._slope * x)[normal]
        y[2 * self.contact[~normal] + 1] += x[~normal]
        return y, float(z[0])

    @property
    def _slope(self) -> Array:
        """r_T / r_N on the bound from which a contact is measured, per unknown."""
        return (self.sign * self.mu)[self.contact]

    def _row(self, row: int) -> Array:
        """Derivatives of u in that row by (p, x)."""
        return self._matrix(np.array([row]))[0]

    def _matrix(self, rows: NDArray[np.int64]) -> Array:
        W, T = self.path.W, 2 * self.contact + 1
        out = np.empty((len(rows), len(T) + 1))
        out[:, 0] = self.path.q1[rows]
        along = np.where(self.beside, 0.0, W[rows[:, None], T - 1])
        out[:, 1:] = along + np.where(self.beside, 1.0, self._slope) * W[rows[:, None], T]
        return out

    def _column(self, i: int, k: int, rows: NDArray[np.int64]) -> Array:
        W, T = self.path.W, 2 * i + 1
        return W[rows, T] if k else W[rows, 2 * i] + self.sign[i] * self.mu[i] * W[rows, T]

    def renew(self) -> None:
        """The inverse from scratch; raises SingularOperator where there is none."""
        try:
            matrix = np.vstack([self.driver, self._matrix(self.rows)])
            self.inverse: Array = np.linalg.inv(matrix)  # type: ignore[assignment]  # float64
        except np.linalg.LinAlgError as reason:
            raise SingularOperator(
                f"{''.join(self.letters)}: the equations of this piece are singular, its "
                "solutions are not isolated"
            ) from reason
        self.age = 0

    def point(self) -> tuple[Array, float, Array]:
        """(y, p, u) where the driver has its present level, refined once."""
        right = np.concatenate([[self.level], -self.path.q0[self.rows]])
        z: Array = self.inverse @ right
        worst = np.inf
        for _ in range(2):
            y, p = self.state(z)
            u = self.path.W @ y + self.path.free(p)
            rest = np.concatenate([[self.driver @ z - self.level], u[self.rows]])
            worst = float(np.abs(rest).max())
            if worst < 1e-15:
                break
            z = z - self.inverse @ rest
        if worst > EXACT * max(1.0, float(np.abs(z).max())) and self.age:
            self.renew()
            return self.point()
        y, p = self.state(z)
        return y, p, self.path.W @ y + self.path.free(p)

    def direction(self) -> tuple[Array, float, Array]:
        """(y', p', u') per unit of the driver."""
        y, p = self.state(self.inverse[:, 0])
        return y, p, self.path.W @ y + p * self.path.q1

    def conditions(self, y: Array, u: Array) -> Array:
        """What must stay >= 0, (nc, 2), infinite where there is none.

        Free: u_N.  Slip: r_N, and the slip against the force.  Stick: the distances of r_T to
        the bound on the side of `sign`, and to the other one.
        """
        y, u = y.reshape(-1, 2), u.reshape(-1, 2)
        letters = np.array(self.letters)
        free, stick, slack = letters == "f", letters == "s", self.mu > 0
        out = np.full(y.shape, np.inf)
        bound, along = self.mu * y[:, 0], self.sign * y[:, 1]
        out[:, 0] = np.where(free, u[:, 0], np.where(stick, bound - along, y[:, 0]))
        out[:, 1] = np.where(
            stick, bound + along, np.where(free | ~slack, np.inf, -self.sign * u[:, 1])
        )
        return out

    # ---------------------------------------------------------------- pivots
    def cross(self, contact: int, which: int, u: Array) -> None:
        """Go over the border at which a condition of a contact vanishes."""
        letter, i = self.letters[contact], contact
        self.age += 1
        if letter == "f":
            self.sign[i] = 1.0 if self.mu[i] == 0 or u[2 * i + 1] < 0 else -1.0
            self.letters[i] = "+" if self.sign[i] > 0 else "-"
            self._lengthen(i, 0, 1.0)
        elif letter == "s":
            if which == 1:  # the bound on the other side
                self._turn(i)
            self._shorten(i, 1, -self.sign[i])
            self.letters[i] = "+" if self.sign[i] > 0 else "-"
        elif which == 0:
            self._shorten(i, 0, 1.0)
            self.letters[i] = "f"
        else:
            self._lengthen(i, 1, -self.sign[i])
            self.letters[i] = "s"
        if self.age >= RENEWAL:
            self.renew()

    def _replace_driver(self, row: Array) -> None:
        inverse = self.inverse
        a = row @ inverse
        pivot = a[0]
        a[0] -= 1.0
        inverse -= np.outer(inverse[:, 0] / pivot, a)

    def _lengthen(self, i: int, k: int, sign: float) -> None:
        """The velocity that vanished becomes an equation, a new unknown times sign drives."""
        row = 2 * i + k
        self._replace_driver(self._row(row))
        column = self._column(i, k, np.append(row, self.rows))
        old = self.inverse
        size = len(old)
        new = np.zeros((size + 1, size + 1))
        new[:size, 0] = -sign * (old @ column)
        new[:size, 1:size] = old[:, 1:]
        new[:size, size] = old[:, 0]
        new[size, 0] = sign
        self.inverse = new
        self.rows = np.append(self.rows, row)
        self.contact, self.beside = np.append(self.contact, i), np.append(self.beside, bool(k))
        self.driver = np.zeros(size + 1)
        self.driver[size] = sign
        self.level = 0.0

    def _shorten(self, i: int, k: int, sign: float) -> None:
        """The unknown that vanished goes; its equation, times sign, drives."""
        row, j = 2 * i + k, self._place(i, k)
        unit = np.zeros(len(self.contact) + 1)
        unit[j] = 1.0
        self._replace_driver(unit)
        at = int(np.flatnonzero(self.rows == row)[0]) + 1
        keep = [at, *(c for c in range(1, len(self.inverse)) if c != at)]
        self.inverse = np.delete(self.inverse, j, axis=0)[:, keep]
        self.inverse[:, 0] *= sign
        self.rows = np.delete(self.rows, at - 1)
        self.contact, self.beside = (
            np.delete(self.contact, j - 1),
            np.delete(self.beside, j - 1),
        )
        self.driver = sign * self._row(row)
        self.level = -sign * self.path.q0[row]

    def _place(self, i: int, k: int) -> int:
        """Where an unknown of a contact is among (p, x)."""
        return int(np.flatnonzero((self.contact == i) & (self.beside == bool(k)))[0]) + 1

    def _turn(self, i: int) -> None:
        """Measure r_T of a sticking contact from its other bound."""
        normal, beside = self._place(i, 0), self._place(i, 1)
        change = 2 * self.sign[i] * self.mu[i]
        self.inverse[beside] += change * self.inverse[normal]
        self.driver[normal] -= change * self.driver[beside]
        self.sign[i] = -self.sign[i]


def track(
    path: FrictionPath, y: Array, p: float, tangent: Tangent, interval: tuple[float, float]
) -> Iterator[tuple[Point, Event | None]]:
    """From a solution along a tangent: every event, and the point where the next line begins.

    Ends with an event END.  y must solve the problem at p to rounding; see `leaving`.  Raises
    SingularOperator where the equations at the start are singular.
    """
    check_straight(path)
    low, high = interval
    if not low <= p <= high:
        raise InvalidInput(f"start: expected a parameter in {low:g} … {high:g}, got {p:g}")
    walk = _Walk(path, y, p, tangent, interval)
    yield walk.here(), None
    while walk.stop is None:
        path.deadline.check()
        event = walk.advance()
        yield walk.here(), event


class _Walk:
    """Where the walk along the lines is."""

    def __init__(
        self, path: FrictionPath, y: Array, p: float, tangent: Tangent,
        interval: tuple[float, float],
    ) -> None:  # fmt: skip
        self.path, self.interval = path, interval
        self.weight = weight_of(path, len(y))
        self.line = Line(path, tangent, y, p)
        self.y, self.p, self.u = y, p, path.W @ y + path.free(p)
        self.travelled = 0.0
        self.stop: Stop | None = None
        self.began: str | None = self.pattern
        self.turn = 0  # last sense in which the parameter moved
        self._aim()
        self.turn = self.sense

    @property
    def pattern(self) -> str:
        return "".join(self.line.letters)

    @property
    def sense(self) -> int:
        """Sense in which the parameter moves, 0 where it stands still."""
        return int(np.sign(self.dp)) if abs(self.dp) > 1e-11 * self.speed else 0

    def _aim(self) -> None:
        self.dy, self.dp, self.du = self.line.direction()
        self.speed = float(np.sqrt(self.weight * self.dy @ self.dy + self.dp**2))

    def here(self) -> Point:
        """The present point."""
        return Point(self.p, self.y, self.dy / self.speed, self.dp / self.speed, self.pattern,
                     self.travelled, problem=self.path)  # fmt: skip

    def advance(self) -> Event:
        """To the next event, and over it."""
        try:
            return self._advanced()
        except SingularOperator as reason:
            return self._end(Stop.SINGULAR, str(reason))

    def _advanced(self) -> Event:
        step, border = self._next()
        before = self.pattern
        if border is None and not np.isfinite(step):
            return self._end(Stop.UNBOUNDED)
        y, p, u = self.y + step * self.dy, self.p + step * self.dp, self.u + step * self.du
        self.travelled += step * self.speed
        if border is None:
            self.y, self.p, self.u = y, self.interval[int(self.sense > 0)], u
            self.line.level += step * float(self.line.driver @ self.line.inverse[:, 0])
            self.y, _, self.u = self.line.point()
            return self._end(Stop.INTERVAL)
        tied = self._tied(y, u)
        if len(tied) > 1:
            return self._corner(y, p, before, max(tied))
        self.line.cross(*border, u)
        self.y, self.p, self.u = self.line.point()
        self._aim()
        return self._event(before)

    def _next(self) -> tuple[float, tuple[int, int] | None]:
        """Distance to the next border, and that border; None at the end of the interval."""
        values = self.line.conditions(self.y, self.u)
        rates = self.line.conditions(self.dy, self.du)
        finite = np.isfinite(values)
        floor = NONE * max(1e-300, float(np.abs(rates[finite]).max(initial=0)))
        falling = finite & (np.where(finite, rates, 0.0) < -floor)
        steps = np.full(values.shape, np.inf)
        steps[falling] = np.maximum(values[falling], 0.0) / -rates[falling]
        step = float(steps.min(initial=np.inf))
        if self.sense:
            bound = self.interval[int(self.sense > 0)]
            end = max(0.0, (bound - self.p) / self.dp)
            if end <= step:
                return end, None
        if not np.isfinite(step):
            return step, None
        contact, which = np.unravel_index(int(steps.argmin()), steps.shape)
        return step, (int(contact), int(which))

    def _tied(self, y: Array, u: Array) -> list[float]:
        """Sizes of conditions that vanish at an event; closing without slip counts twice."""
        size = max(1.0, float(np.abs(y).max(initial=0)))
        values = np.abs(self.line.conditions(y, u))
        zero = values <= TIE * size
        closing = [
            abs(float(u[2 * i + 1])) for i in np.flatnonzero(zero[:, 0])
            if self.line.letters[i] == "f" and self.line.mu[i] > 0
        ]  # fmt: skip
        return [*values[zero].tolist(), *(slip for slip in closing if slip <= TIE * size)]

    def _corner(self, y: Array, p: float, before: str, apart: float) -> Event:
        """Over a point where several conditions vanish: by the first-order system.

        apart: the largest of them.
        """
        self.y, self.p = y, p
        self.u = self.path.W @ y + self.path.free(p)
        system = leaving(self.path, y, p)
        back = (-self.dy / self.speed, -self.dp / self.speed)
        others = system.others(*back, self.weight, before)
        if not system.complete and not others:
            return self._end(Stop.SINGULAR, system.reason)
        if not others:
            return self._end(Stop.DEAD_END)
        came = self._orientation(before, self.dp)
        chosen = self._straightest(others, came)
        self.line = Line(self.path, chosen, y, p)
        self.y, self.p, self.u = self.line.point()
        self._aim()
        if len(others) > 1 or system.sets:
            rows = np.array([np.append(t.direction, t.rate) for t in system.tangents])
            turns = self._note_turn()
            detail = system.told(apart, ROUNDING * max(1.0, float(np.abs(y).max(initial=0))))
            return Event(EventKind.BRANCH, self.p, self.y, self.travelled, before, self.pattern,
                         turns=turns, directions=rows, detail=detail,
                         problem=self.path)  # fmt: skip
        return self._event(before)

    def _orientation(self, pattern: str, rate: float) -> int:
        J, _ = self.path.jacobian_of(pattern, self.y, self.p)
        return int(np.sign(rate) * np.linalg.slogdet(J)[0])

    def _straightest(self, others: list[Tangent], came: int) -> Tangent:
        """The tangent that keeps the orientation and turns least."""

        def rank(t: Tangent) -> tuple[bool, float]:
            cosine = self.weight * float(t.direction @ self.dy) + t.rate * self.dp
            return self._orientation(str(t.piece), t.rate) != came, -cosine

        return min(others, key=rank)

    def _note_turn(self) -> bool:
        """Remember the sense of the parameter; True where it turned."""
        turned = self.sense != 0 and self.turn != 0 and self.sense != self.turn
        self.turn = self.sense or self.turn
        return turned

    def _event(self, before: str) -> Event:
        kind = EventKind.FOLD if self._note_turn() else EventKind.STATUS
        return Event(kind, self.p, self.y, self.travelled, before, self.pattern,
                     problem=self.path)  # fmt: skip

    def _end(self, stop: Stop, detail: str = "") -> Event:
        self.stop = stop
        return Event(EventKind.END, self.p, self.y, self.travelled, self.pattern, stop=stop,
                     detail=detail, problem=self.path)  # fmt: skip
