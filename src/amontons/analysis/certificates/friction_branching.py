"""Branch and bound for one friction: whether all patterns have positive determinants.

A contact is decided (free, slip+, slip-, stick) and eliminated; multipliers on pairs of the
contacts that are left exclude all of their patterns at once, small rests are enumerated.  The
dual moments of multipliers that do not exist weigh the states of every contact against each
other; the contact with the most undecided weight comes next.  Multipliers found for one state
of a contact are tried for the others first.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from ...core.clock import Deadline
from ..statuses import FREE, States
from .determinant_search import POSITIVE, STOPPED, eliminate
from .exact_threshold import first_failure
from .pair_multipliers import FEW, STATES, PairMultipliers, find_pair_multipliers, proves
from .status_pieces import Pieces

Array = NDArray[np.float64]
Places = NDArray[np.int64]
ENUMERATED = 8  # contacts left whose patterns are enumerated: 4^8 take some milliseconds


@dataclass(frozen=True, eq=False)
class Leaf:
    """Patterns excluded at once: contacts (in the order decided) with states, all others any.

    left: the other contacts.  multipliers: on those, in that order; None where all of their
    patterns were enumerated.
    """

    contacts: tuple[int, ...]
    states: tuple[int, ...]
    left: tuple[int, ...]
    multipliers: PairMultipliers | None

    def of_problem(self, pieces: Pieces) -> Leaf:
        """The same with the contacts and in the units of the problem."""
        places, multipliers = pieces.places, self.multipliers
        if multipliers is not None:
            to_r = pieces.scale.reshape(-1, 2)[list(self.left)]
            z = np.hstack([to_r, 1 / to_r])
            pair, single = z[multipliers.pairs].reshape(-1, 8), z[multipliers.singles]
            multipliers = replace(
                multipliers,
                W=multipliers.W * pair[:, :, None] * pair[:, None, :],
                V=multipliers.V * single[:, :, None] * single[:, None, :],
            )
        named = (
            tuple(int(i) for i in places[list(part)]) for part in (self.contacts, self.left)
        )
        contacts, left = named
        return Leaf(contacts, self.states, left, multipliers)


@dataclass(frozen=True, eq=False)
class Rest:
    """What is left: contacts, u = (S + d) r with |d| <= rounding, and what was decided."""

    contacts: Places
    S: Array
    rounding: Array
    decided: tuple[int, ...] = ()
    states: tuple[int, ...] = ()
    undecided: Array | None = None  # weight of every contact, from the parent


@dataclass(eq=False)
class Branching:
    """Branch and bound at friction t shape until `deadline`.

    sign: POSITIVE when proved, NEGATIVE or UNKNOWN with the pattern that failed, STOPPED.
    """

    pieces: Pieces
    t: float
    deadline: Deadline
    leaves: list[Leaf] = field(default_factory=list)
    inequalities: int = 0
    patterns: int = 0
    failed: States | None = None

    def run(self) -> int:
        """Examine all patterns; the sign."""
        self.m = self.t * self.pieces.shape
        self.allowed = self.pieces.allowed()
        self.known: dict[tuple[int, ...], list[PairMultipliers]] = {}
        k = self.pieces.contacts
        W = self.pieces.W
        return self._examine(Rest(np.arange(k), W, np.zeros_like(W)))

    def _examine(self, rest: Rest) -> int:
        if len(rest.contacts) <= ENUMERATED:
            return self._enumerate(rest)
        if self.deadline.passed:
            return STOPPED
        for multipliers in self.known.get(tuple(rest.contacts), []):
            self.deadline.spend(10.0 * (4 * len(rest.contacts)) ** 3)
            if proves(multipliers, rest.S, rest.rounding):
                return self._leave(rest, multipliers)
        found, weights = self._multipliers(rest)
        if found is None and rest.undecided is None and len(rest.contacts) > FEW:
            found, weights = self._multipliers(replace(rest, undecided=_undecided(weights)))
        if found is not None:
            self.known.setdefault(tuple(rest.contacts), []).append(found)
            return self._leave(rest, found)
        return self._branch(rest, weights)

    def _multipliers(self, rest: Rest) -> tuple[PairMultipliers | None, Array]:
        self.inequalities += 1
        return find_pair_multipliers(rest.S, rest.rounding, self.m[rest.contacts],
                                     time_limit=self.deadline,
                                     undecided=rest.undecided)  # fmt: skip

    def _leave(self, rest: Rest, multipliers: PairMultipliers | None) -> int:
        left = tuple(int(i) for i in rest.contacts)
        self.leaves.append(Leaf(rest.decided, rest.states, left, multipliers))
        return POSITIVE

    def _enumerate(self, rest: Rest) -> int:
        sign, states, seen = first_failure(
            rest.S, self.m[rest.contacts], self.allowed[rest.contacts], self.deadline,
            rest.rounding,
        )  # fmt: skip
        self.patterns += seen
        if sign in (POSITIVE, STOPPED):
            return self._leave(rest, None) if sign == POSITIVE else sign
        return self._fail(sign, rest, states)

    def _fail(self, sign: int, rest: Rest, states: States) -> int:
        self.failed = np.full(self.pieces.contacts, FREE)
        self.failed[list(rest.decided)] = rest.states
        self.failed[rest.contacts[: len(states)]] = states
        return sign

    def _branch(self, rest: Rest, weights: Array) -> int:
        undecided = _undecided(weights)
        p = int(np.argmax(undecided))
        rest = replace(rest, undecided=undecided)
        for state, sign, child in self._children(rest, p, np.argsort(-weights[p])):
            if sign != POSITIVE:
                return self._fail(sign, Rest(rest.contacts[p : p + 1], rest.S, rest.rounding,
                                             rest.decided, rest.states),
                                  np.array([state]))  # fmt: skip
            sign = self._examine(child)
            if sign != POSITIVE:
                return sign
        return POSITIVE

    def _children(
        self, rest: Rest, p: int, order: NDArray[np.int64]
    ) -> Iterator[tuple[int, int, Rest]]:
        """(state, sign of its pivot, what is then left) for the contact at place p."""
        assert rest.undecided is not None
        k = len(rest.contacts)
        first = np.concatenate([[p], np.delete(np.arange(k), p)]).astype(np.int64)
        rows = (2 * first[:, None] + [0, 1]).ravel()
        S, rounding = rest.S[rows[:, None], rows], rest.rounding[rows[:, None], rows]
        contact = int(rest.contacts[p])
        others = np.delete(rest.contacts, p)
        for state in np.array(STATES)[order]:
            if self.allowed[contact, state]:
                self.deadline.spend(50.0 * (2 * k) ** 2)
                sign, T, C = eliminate(S, rounding, state, self.m[contact])
                yield int(state), sign, Rest(
                    others, T, C, (*rest.decided, contact), (*rest.states, int(state)),
                    np.delete(rest.undecided, p),
                )  # fmt: skip


def _undecided(weights: Array) -> Array:
    """Weight (k,) of all states of a contact but its strongest one."""
    return weights.sum(axis=1) - weights.max(axis=1)
