"""What the steps of a deck prescribe, as values over time.

A value that a step gives is reached at its end along a straight line from what it was at its
beginning, or follows an amplitude, or, with AMPLITUDE=STEP, is there at once.  It stays until
another step says otherwise; OP=NEW takes all of its kind away that earlier steps gave.  Forces
at one node in one step add up; a force of a later step takes the place of the one before.  A
support that comes in a later step, or is FIXED, begins where its node is then, which is not
known here: NaN.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import partial

import numpy as np
from numpy.typing import NDArray

from .body_loads import Way, way_of
from .cards import Card, Row, is_whole, number, whole
from .course import Course
from .flat import Deck, Placed
from .heat import Heat
from .scopes import Index, Scope, missing

Array = NDArray[np.float64]
AT_ONCE = 1e-9  # share of a step in which a load that is there at once comes
FREE, COMPONENTS = -1, 6
TRANSLATIONS = 3
HELD = {"ENCASTRE": (1, 2, 3), "PINNED": (1, 2, 3), "XSYMM": (1,), "YSYMM": (2,),
        "ZSYMM": (3,), "XASYMM": (2, 3), "YASYMM": (1, 3), "ZASYMM": (1, 2)}  # fmt: skip


@dataclass(frozen=True)
class Span:
    """A step: from when to when, the first increment that it asks for, and its options.

    direct: all increments are as the first one.
    """

    begin: float
    end: float
    increment: float
    card: Card
    direct: bool = False

    @property
    def at_once(self) -> bool:
        """True where loads do not grow from step begin on."""
        return self.card.label("AMPLITUDE") == "STEP"


@dataclass
class Prescribed:
    """Courses of displacements or forces, by number: `at` (nodes, 6), FREE where none is.

    before: the same of supports before OP=NEW took them away, for where they go on from.
    """

    at: Index
    before: Index | None = None
    courses: list[Course] = field(default_factory=list)
    cards: list[Card] = field(default_factory=list)
    known: dict[tuple[Course, int], int] = field(default_factory=dict)

    def number(self, course: Course, card: Card) -> int:
        """The number of a course, the same for equal ones of one card."""
        key = course, id(card)
        if key not in self.known:
            self.known[key] = len(self.courses)
            self.courses.append(course)
            self.cards.append(card)
        return self.known[key]

    def of(
        self, node: int, components: Sequence[int], held: Index | None = None
    ) -> list[Course | None]:
        """The courses of some components of a node, at the end or those of `held`."""
        numbers = (self.at if held is None else held)[node, list(components)]
        return [None if c == FREE else self.courses[c] for c in numbers]

    def groups(self, dim: int, held: Index | None = None) -> list[Group]:
        """Nodes with the same courses, at the end or those of `held`, by their first node."""
        at = self.at if held is None else held
        rows = np.flatnonzero((at[:, :dim] != FREE).any(axis=1))
        if not len(rows):
            return []
        same, which = np.unique(at[rows, :dim], axis=0, return_inverse=True)
        out, which = [], which.ravel()
        for k, numbers in enumerate(same):
            courses = [None if c == FREE else self.courses[c] for c in numbers]
            card = self.cards[max(numbers)]
            out.append((rows[which == k], courses, card))
        return sorted(out, key=lambda group: int(group[0][0]))


Group = tuple[Index, list[Course | None], Card]  # nodes, their courses, where they stand


@dataclass
class History:
    """All that steps prescribe: supports, forces at nodes, loads on faces and in bodies.

    held: what `supports.at` is in each step.
    """

    supports: Prescribed
    forces: Prescribed
    faces: dict[tuple[str, str], tuple[Course, Card, Scope]] = field(default_factory=dict)
    bodies: dict[tuple[str, bytes], tuple[Course, Way, Card, Scope]] = field(
        default_factory=dict
    )
    spans: list[Span] = field(default_factory=list)
    heat: Heat | None = None
    held: list[Index] = field(default_factory=list)

    @property
    def corners(self) -> set[float]:
        """Times at which anything bends."""
        courses = [*self.supports.courses, *self.forces.courses]
        courses += [each[0] for each in (*self.faces.values(), *self.bodies.values())]
        courses += self.heat.courses if self.heat else []
        return {t for course in courses for t in course.times}

    @property
    def until(self) -> float:
        """The end of the last step."""
        return self.spans[-1].end


def read_history(deck: Deck, before: Sequence[Placed], steps: Sequence[Sequence[Placed]]
                 ) -> History:  # fmt: skip
    """Follow the steps; raises FileFormatError with the line of what can not be followed."""
    shape = (len(deck.points), COMPONENTS)
    history = History(Prescribed(np.full(shape, FREE)), Prescribed(np.full(shape, FREE)))
    history.heat = Heat.of(len(deck.points), before)
    amplitudes = _amplitudes([p.card for p in before])
    first = _span(steps[0], 0.0)
    for each in before:
        if each.card.keyword == "BOUNDARY":
            _boundary(history, each, first, amplitudes, step=0)
    for k, step in enumerate(steps):
        span = first if k == 0 else _span(step, history.until)
        history.spans.append(span)
        amplitudes |= _amplitudes([p.card for p in step])
        _follow(history, step, span, amplitudes, k)
        history.held.append(history.supports.at.copy())
    return history


def _span(step: Sequence[Placed], begin: float) -> Span:
    card = step[0].card
    static = [p.card for p in step if p.card.keyword == "STATIC"]
    if len(static) != 1:
        raise card.error(f"expected one procedure, *STATIC, got {len(static)}")
    increment = period = 1.0
    for row in static[0].rows():
        values = [number(text, row, "*STATIC") for text in row.fields]
        increment = values[0] or 1.0
        period = (values[1] if len(values) > 1 else 0.0) or 1.0
        if not (increment > 0 and period > 0):
            raise row.error(f"*STATIC: expected times > 0, got {increment:g}, {period:g}")
        break
    direct = "DIRECT" in static[0].options
    return Span(begin, begin + period, min(increment, period), card, direct)


def _amplitudes(cards: Sequence[Card]) -> dict[str, tuple[Array, Array, bool]]:
    """Tables over time: times, values, and whether the time is that of the whole deck."""
    found = {}
    for card in cards:
        if card.keyword != "AMPLITUDE":
            continue
        if (card.label("DEFINITION") or "TABULAR") != "TABULAR":
            raise card.error(
                f"DEFINITION={card.label('DEFINITION')}: is not read, expected TABULAR"
            )
        for option in ("SHIFTX", "SHIFTY", "USER"):
            if option in card.options:
                raise card.error(f"{option}: is not read")
        values = [number(text, row, "*AMPLITUDE") for row in card.rows() for text in row.fields]
        times = np.array(values[::2])
        if len(values) % 2 or not len(values) or (np.diff(times) <= 0).any():
            raise card.error("expected pairs of a time and a value, times growing")
        total = card.label("TIME") == "TOTALTIME" or card.label("TIME") == "TOTAL TIME"
        found[card.name("NAME")] = (times, np.array(values[1::2]), total)
    return found


Amplitudes = dict[str, tuple[Array, Array, bool]]


def _course(old: Course, value: float, span: Span, card: Card, known: Amplitudes) -> Course:
    """What was, and then `value` as the step has it."""
    name = card.label("AMPLITUDE")
    if name is None:
        begin = span.begin + (AT_ONCE * (span.end - span.begin) if span.at_once else 0.0)
        if span.at_once:
            return old.then((span.begin, begin, span.end), (old.at(span.begin), value, value))
        return old.then((span.begin, span.end), (old.at(span.begin), value))
    if name not in known:
        raise card.error(missing("amplitude", name, known))
    times, factors, total = known[name]
    delay = card.options.get("TIMEDELAY")
    shift = 0.0 if total else span.begin
    shift += number(delay, Row(card.file, card.number, []), "TIME DELAY") if delay else 0.0
    inside = (times + shift > span.begin) & (times + shift < span.end)
    at = np.unique([span.begin, *(times[inside] + shift), span.end])
    return old.then(tuple(at), tuple(value * np.interp(at - shift, times, factors)))


def _follow(history: History, step: Sequence[Placed], span: Span, known: Amplitudes, k: int
            ) -> None:  # fmt: skip
    """One step."""
    _cleared(history, step, span, k)
    given = np.zeros(history.forces.at.shape, dtype=bool)
    for each in step:
        key = each.card.keyword
        if key == "BOUNDARY":
            _boundary(history, each, span, known, step=k)
        elif key == "CLOAD":
            _forces(history, each, span, known, given)
        elif key == "TEMPERATURE" and history.heat is not None:
            history.heat.give(each, Course, partial(_course, span=span, known=known))
        elif key in ("DLOAD", "DSLOAD"):
            _distributed(history, each, span, known)


def _cleared(history: History, step: Sequence[Placed], span: Span, k: int) -> None:
    """What OP=NEW takes away; a load goes as it came, in a straight line."""
    new = {p.card.keyword: p.card for p in step if p.card.label("OP") == "NEW"}
    out = history.supports
    out.before = out.at.copy() if "BOUNDARY" in new else None
    if "BOUNDARY" in new:
        out.at[:] = FREE
    if "CLOAD" in new:
        out = history.forces
        for number_ in np.unique(out.at[out.at != FREE]):
            old = out.courses[number_]
            out.courses[number_] = _course(old, 0.0, span, span.card, {})
        out.known.clear()
    if {"DLOAD", "DSLOAD"} & new.keys():
        history.faces = {
            key: (_course(old, 0.0, span, span.card, {}), card, scope)
            for key, (old, card, scope) in history.faces.items()
        }
        history.bodies = {
            key: (_course(old, 0.0, span, span.card, {}), way, card, scope)
            for key, (old, way, card, scope) in history.bodies.items()
        }


def _boundary(
    history: History, each: Placed, span: Span, known: Amplitudes, *, step: int
) -> None:
    card, out = each.card, history.supports
    fixed = "FIXED" in card.options
    for option in ("USER", "SUBMODEL", "TYPE", "MASSFLOW"):
        if option in card.options and card.label(option) != "DISPLACEMENT":
            raise card.error(f"{option}: is not read, expected prescribed displacements")
    for row in card.rows():
        nodes = each.scope.acted_on(row.fields[0], row)
        for component, value in _held(row):
            old = out.at[nodes, component]
            if out.before is not None:
                old = np.where(old == FREE, out.before[nodes, component], old)
            for before in np.unique(old):
                if before != FREE:
                    course = out.courses[before]
                else:  # in the first step bodies are where they were made
                    course = Course((span.begin,), (np.nan,)) if step else Course()
                if fixed:
                    stays = course.at(span.begin)
                    course = course.then((span.begin, span.end), (stays, stays))
                else:
                    course = _course(course, value, span, card, known)
                out.at[nodes[old == before], component] = out.number(course, card)


def _held(row: Row) -> list[tuple[int, float]]:
    """Components from 0 that a line holds, and their value."""
    if len(row.fields) < 2:
        raise row.error("*BOUNDARY: expected nodes, first and last component, value")
    word = row.fields[1].upper()
    if word in HELD:
        return [(k - 1, 0.0) for k in HELD[word]]
    if word and not word.lstrip("+-").rstrip(".").isdigit():
        raise row.error(missing("*BOUNDARY: support", word, HELD))
    first = whole(row.fields[1], row, "*BOUNDARY: component")
    last = first
    if len(row.fields) > 2 and row.fields[2]:
        last = whole(row.fields[2], row, "*BOUNDARY: component")
    value = number(row.fields[3], row, "*BOUNDARY: value") if len(row.fields) > 3 else 0.0
    if not 1 <= first <= last <= COMPONENTS:
        raise row.error(f"*BOUNDARY: expected components from 1 to 6, got {first} to {last}")
    return [(k - 1, value) for k in range(first, last + 1)]


def _forces(history: History, each: Placed, span: Span, known: Amplitudes,
            given: NDArray[np.bool_]) -> None:  # fmt: skip
    """Forces at nodes; given: dofs that this step has loaded, where more is added."""
    card, out = each.card, history.forces
    for option in ("FOLLOWER", "USER", "SECTOR"):
        if option in card.options:
            raise card.error(f"{option}: is not read")
    for row in card.rows():
        nodes = each.scope.acted_on(row.fields[0], row)
        if len(row.fields) < 3:
            raise row.error("*CLOAD: expected nodes, component, value")
        component = whole(row.fields[1], row, "*CLOAD: component") - 1
        if not 0 <= component < COMPONENTS:
            raise row.error(f"*CLOAD: expected a component from 1 to 6, got {component + 1}")
        value = number(row.fields[2], row, "*CLOAD: value")
        old, more = out.at[nodes, component], given[nodes, component]
        for before, adds in {(int(b), bool(a)) for b, a in zip(old, more, strict=True)}:
            course = Course() if before == FREE else out.courses[before]
            if adds:
                _same_amplitude(row, card, out.cards[before])
                if card.label("AMPLITUDE") is not None:
                    raise row.error("*CLOAD: forces with an amplitude at one node add up twice")
                before_it = course.until(span.begin)
                course = _course(before_it, course.last + value, span, card, known)
            else:
                course = _course(course, value, span, card, known)
            chosen = nodes[(old == before) & (more == adds)]
            out.at[chosen, component] = out.number(course, card)
        given[nodes, component] = True


def _same_amplitude(row: Row, card: Card, other: Card) -> None:
    if card.label("AMPLITUDE") != other.label("AMPLITUDE"):
        raise row.error(
            f"*CLOAD: another amplitude than that of line {other.number} at the same node"
        )


def _distributed(history: History, each: Placed, span: Span, known: Amplitudes) -> None:
    """Pressures on faces, gravity and centrifugal loads; those along other axes add up."""
    card = each.card
    for row in card.rows():
        if len(row.fields) < 3:
            raise row.error(f"{card}: expected a name, the kind of the load, a value")
        name, label = row.fields[0].upper(), row.fields[1].upper()
        value = number(row.fields[2], row, str(card))
        if label in ("GRAV", "CENTRIF"):
            each.scope.acted_on(name, row, "element")
            way = way_of(row, label)
            one = (name, np.concatenate(way).tobytes())
            old = history.bodies.get(one)
            course = _course(old[0] if old else Course(), value, span, card, known)
            history.bodies[one] = (course, way, card, each.scope)
            continue
        if card.keyword == "DSLOAD" and label != "P":
            raise row.error(f"*DSLOAD {label}: is not read, expected P, a pressure")
        if card.keyword == "DLOAD" and not (label[:1] == "P" and is_whole(label[1:])):
            raise row.error(
                f"*DLOAD {label}: is not read, expected P1, P2, ..., GRAV or CENTRIF"
            )
        key = (name, label if card.keyword == "DLOAD" else "")
        before = history.faces.get(key)
        course = _course(before[0] if before else Course(), value, span, card, known)
        history.faces[key] = (course, card, each.scope)
