"""Starts of a study of basins: named ways to choose reactions r and a motion v.

zero             r = 0 and v = 0
open             r = 0 and its motion: the bodies without contact
cone             r random in the cone (Tresca: within its bounds), r_N up to `reaction_size`
reactions        each component of r random, within plus and minus `reaction_size`: no r_N >= 0
displacements    r = 0, displacements of the contacts random within plus and minus
                 `displacement_size`; of all v with these the smallest
everywhere       r = 0, each component of v random within plus and minus `displacement_size`
both             reactions and displacements
perturbed        a solution, each component of r changed by up to SPREAD of its largest one
exact            r and v of each solution
exact-reactions      r of each solution, v = 0
exact-displacements  v of each solution, r = 0

Where nothing is said of v it is the motion of r.  The Delassus form has no v: what needs one
is refused there.  Each way has random numbers of its own, of seed and name alone.
"""

from __future__ import annotations

import zlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...core.arrays import real
from ...core.errors import InvalidInput, UnsupportedForm, shown
from ...problem.friction import Form, FrictionProblem
from ...problem.law import Tresca
from ...solvers import Iterate
from ...solvers.first_iterate import first_iterate
from .solutions import KnownSolution

Array = NDArray[np.float64]
SPREAD = 0.1  # of the largest reaction of a solution, by which perturbed ones differ
MOST = 1_000_000  # starts of one kind


@dataclass(frozen=True, eq=False)
class Start:
    """One start: kind names the way it was chosen, number counts those of its kind from 0."""

    kind: str
    number: int
    iterate: Iterate

    @property
    def label(self) -> str:
        """For tables and messages."""
        return self.kind if self.number == 0 else f"{self.kind} {self.number + 1}"


@dataclass(frozen=True, eq=False)
class Drawing:
    """What the ways to choose read: the problem, its known solutions, sizes and a seed."""

    problem: FrictionProblem
    known: Sequence[KnownSolution]
    reaction_size: float
    displacement_size: float
    seed: int
    random: np.random.Generator = field(default_factory=np.random.default_rng)

    @property
    def shape(self) -> tuple[int, int]:
        """(nc, d)."""
        return self.problem.contacts, self.problem.dimension

    def rest(self) -> Array:
        """r = 0."""
        return np.zeros(self.shape)

    def still(self) -> Array | None:
        """v = 0, None in the Delassus form."""
        return None if self.problem.form is Form.DELASSUS else np.zeros(self.problem.unknowns)

    def in_cone(self) -> Array:
        """Reactions in the cone, uniform over its cross sections."""
        nc, d = self.shape
        r = self.rest()
        r[:, 0] = self.random.uniform(0, self.reaction_size, nc)
        tangent = self.random.standard_normal((nc, d - 1))
        length = np.linalg.norm(tangent, axis=1, keepdims=True)
        share = self.random.random((nc, 1)) ** (1 / (d - 1))
        r[:, 1:] = share * self.problem.law.bound(r)[:, None] * tangent / length
        if not isinstance(self.problem.law, Tresca):
            return r
        return np.where(np.isfinite(r), r, 0.0)

    def in_box(self) -> Array:
        """Reactions with any sign."""
        return self.random.uniform(-self.reaction_size, self.reaction_size, self.shape)

    def of_contacts(self) -> Array:
        """The smallest v, (n,), with random displacements of the contacts."""
        from scipy.sparse import linalg as sparse_linalg

        H = self.problem.H
        assert H is not None
        size = self.displacement_size
        moved = self.random.uniform(-size, size, H.shape[1])
        return sparse_linalg.lsqr(H.T.tocsr(), moved, atol=1e-14, btol=1e-14)[0]

    def of_all(self) -> Array:
        """Random v, (n,)."""
        size = self.displacement_size
        return self.random.uniform(-size, size, self.problem.unknowns)

    def near(self, one: KnownSolution) -> Array:
        """Reactions near a solution."""
        size = SPREAD * (float(np.abs(one.r).max(initial=0.0)) or self.reaction_size)
        return one.r + self.random.uniform(-size, size, self.shape)


Way = Callable[[Drawing], Iterator[Iterate]]
RANDOM: dict[str, Callable[[Drawing], Iterate]] = {  # one draw each
    "cone": lambda d: Iterate(d.in_cone()),
    "reactions": lambda d: Iterate(d.in_box()),
    "displacements": lambda d: Iterate(d.rest(), d.of_contacts()),
    "everywhere": lambda d: Iterate(d.rest(), d.of_all()),
    "both": lambda d: Iterate(d.in_box(), d.of_contacts()),
}
FIXED: dict[str, Way] = {
    "zero": lambda d: iter([Iterate(d.rest(), d.still())]),
    "open": lambda d: iter([Iterate(d.rest())]),
    "exact": lambda d: (Iterate(one.r, one.v) for one in d.known),
    "exact-reactions": lambda d: (Iterate(one.r, d.still()) for one in d.known),
    "exact-displacements": lambda d: (Iterate(d.rest(), one.v) for one in d.known),
}
OF_MOTION = ("displacements", "everywhere", "both", "exact-reactions", "exact-displacements")
KINDS = (*FIXED, *RANDOM, "perturbed")
Starts = Sequence[str] | Mapping[str, Any]


def drawn(starts: Starts | None, draws: int, drawing: Drawing) -> list[Start]:
    """All starts, in the order of their kinds.

    starts: names of kinds, each as it is or with a number of draws, "cone:20"; or a mapping of
    these to numbers of draws, and of other names to starts of your own: an Iterate, or several.
    """
    found: list[Start] = []
    for kind, wanted in _asked(starts, draws, drawing.problem).items():
        own = kind not in KINDS
        chosen = _own(kind, wanted, drawing.problem) if own else _of_kind(kind, wanted, drawing)
        found += [Start(kind, k, iterate) for k, iterate in enumerate(chosen)]
    if not found:
        raise InvalidInput("starts: expected at least one start, got none")
    return found


def _asked(starts: Starts | None, draws: int, problem: FrictionProblem) -> dict[str, Any]:
    """Kinds with their numbers of draws, own starts under their names."""
    if starts is None:
        motions = () if problem.form is Form.DELASSUS else ("displacements",)
        return dict.fromkeys(("zero", "cone", *motions, "perturbed", "exact"), draws)
    if isinstance(starts, Mapping):
        asked = dict(starts)
    else:
        words = [starts] if isinstance(starts, str) else list(starts)
        pairs = [_split(word, draws) for word in words]
        asked = dict(pairs)
        if len(asked) < len(pairs):
            raise InvalidInput(f"starts: expected each kind once, got {', '.join(words)}")
    for kind, wanted in asked.items():
        if not isinstance(kind, str):
            raise InvalidInput(f"starts: expected a name, got {shown(kind)}")
        if kind in KINDS:
            _check_count(f"starts: {kind}", wanted)
        elif isinstance(wanted, int):
            raise InvalidInput(
                f"starts: expected kinds among {', '.join(KINDS)}, got {kind!r}"
            )
    return asked


def _split(word: Any, draws: int) -> tuple[str, int]:
    """Kind and number of "cone:20"."""
    if not isinstance(word, str):
        raise InvalidInput(f"starts: expected the name of a kind, got {shown(word)}")
    kind, colon, count = word.strip().partition(":")
    if not colon:
        return kind, draws
    try:
        return kind, int(count)
    except ValueError:
        raise InvalidInput(f"starts: expected a number of draws, got {word!r}") from None


def _check_count(name: str, count: Any) -> None:
    if not isinstance(count, int) or isinstance(count, bool) or not 1 <= count <= MOST:
        raise InvalidInput(
            f"{name}: expected a number of draws from 1 to {MOST}, got {shown(count)}"
        )


def _of_kind(kind: str, draws: int, drawing: Drawing) -> list[Iterate]:
    """The starts of one of our ways."""
    if kind in OF_MOTION and drawing.problem.form is Form.DELASSUS:
        raise UnsupportedForm(
            f"starts: {kind!r} needs displacements, and the problem is in its local form, "
            "which has reactions only"
        )
    random = np.random.default_rng([drawing.seed, zlib.crc32(kind.encode())])
    own = Drawing(drawing.problem, drawing.known, drawing.reaction_size,
                  drawing.displacement_size, drawing.seed, random)  # fmt: skip
    if kind == "perturbed":
        return [Iterate(own.near(one)) for one in own.known for _ in range(draws)]
    if kind in RANDOM:
        return [RANDOM[kind](own) for _ in range(draws)]
    return list(FIXED[kind](own))


def _own(name: str, given: Any, problem: FrictionProblem) -> list[Iterate]:
    """Starts of the user, checked."""
    if hasattr(given, "r"):
        given = [given]
    if not isinstance(given, Sequence) or isinstance(given, str):
        raise InvalidInput(
            f"starts: {name}: expected an Iterate or several, got {shown(given)}"
        )
    try:
        return [first_iterate(problem, one) for one in given]
    except InvalidInput as reason:
        raise InvalidInput(f"starts: {name}: {reason}") from None


def size_of_reactions(problem: FrictionProblem, known: Sequence[KnownSolution]) -> float:
    """The largest component of a known solution, else what it takes to hold the contacts."""
    largest = max((float(np.abs(one.r).max(initial=0.0)) for one in known), default=0.0)
    q = np.abs(problem.free_velocity).max(axis=1)
    return largest or float((problem.rho * q).max(initial=0.0)) or 1.0


def size_of_displacements(problem: FrictionProblem, known: Sequence[KnownSolution]) -> float:
    """The largest component of the local displacements, with the known solutions and open."""
    fields = [problem.free_velocity, *[one.u for one in known]]
    return max(float(np.abs(real("u", u)).max(initial=0.0)) for u in fields) or 1.0
