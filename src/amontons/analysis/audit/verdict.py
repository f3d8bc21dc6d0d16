"""What an audit finds, question by question, in words and numbers."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from enum import Enum
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...core.faces import Shown
from .laws import Seen

Array = NDArray[np.float64]
NAMED = 10  # nodes that are named at most


class Judgement(Enum):
    """right, wrong, or undecided: what is asked can not be known from the answer."""

    RIGHT = "right"
    WRONG = "wrong"
    UNDECIDED = "undecided"


RIGHT, WRONG, UNDECIDED = Judgement.RIGHT, Judgement.WRONG, Judgement.UNDECIDED


@dataclass(frozen=True, eq=False)
class Finding:
    """One question's answer: a sentence, numbers by name, and the nodes (k,) where it fails."""

    verdict: Judgement
    text: str
    numbers: dict[str, Any] = field(default_factory=dict)
    nodes: tuple[str, ...] = ()

    @property
    def record(self) -> dict[str, Any]:
        """Plain data."""
        return {"verdict": self.verdict.value, "text": self.text, **self.numbers,
                "nodes": list(self.nodes)}  # fmt: skip


@dataclass(frozen=True, eq=False)
class PairAudit:
    """One contact pair: what it transmits as the slave and as the master see it, and findings.

    seen: as the slave sees it, and as the master does, where that can be.
    """

    name: str
    slave: str
    master: str | None
    seen: tuple[Seen, ...]
    findings: dict[str, Finding]
    approach: float

    @property
    def force(self) -> Array:
        """On the slave, (d,), global axes."""
        return self.seen[0].side.force

    @property
    def record(self) -> dict[str, Any]:
        """Plain data, with the names that `pairs` of solution.json has."""
        side, first = self.seen[0].side, self.seen[0]
        obstacle = side.contact.obstacle
        other = None if len(self.seen) < 2 else self.seen[1].side.force.tolist()
        pressed = first.pressed
        traction = side.r[:, 0] / side.weight
        return {
            "name": self.name, "slave": self.slave, "master": self.master,
            "obstacle": None if obstacle is None else type(obstacle).__name__.lower(),
            "force": self.force.tolist(), "moment": side.moment().tolist(),
            "point": [0.0] * side.points.shape[1], "master_force": other,
            "area": float(side.weight[pressed].sum()),
            "largest_pressure": float(traction.max(initial=0.0)),
            "contacts": len(traction), "pressed": int(pressed.sum()),
            "sliding": int(first.slides.sum()), "approach": self.approach,
            **{name: found.record for name, found in self.findings.items()},
        }  # fmt: skip


QUESTIONS = ("balance", "penetration", "cone", "status", "geometry")


@dataclass(frozen=True, eq=False)
class Audit(Shown):
    """The verdict on displacements of a model as the answer of its contact problem.

    findings: of the questions balance, penetration, cone, status, geometry, and time where an
    answer has one; rounding_bound: part of the largest nodal force that the digits of the
    displacements leave open; notes: what was assumed.
    """

    title: str
    findings: dict[str, Finding]
    pairs: tuple[PairAudit, ...]
    rounding_bound: float
    displacement: tuple[Array, ...]
    model: Any = field(repr=False)
    notes: tuple[str, ...] = ()
    own: Any = field(default=None, repr=False)

    @property
    def verdict(self) -> str:
        """right, wrong or undecided."""
        return worst(found.verdict for found in self.findings.values()).value

    @property
    def hard_model(self) -> Any:
        """The model with contact hard and sticking rigid, for a solution beside."""
        contacts = tuple(
            replace(contact, stiffness=None, stick_stiffness=None)
            for contact in self.model.contacts
        )
        return replace(self.model, contacts=contacts)

    @property
    def is_right(self) -> bool:
        """True for the verdict right alone."""
        return self.verdict == RIGHT.value

    @property
    def lines(self) -> list[str]:
        """The verdict in words, a line for each question and pair."""
        out = [f"{self.title}: {self.verdict}"]
        for name, found in self.findings.items():
            where = f" (nodes {', '.join(found.nodes)})" if found.nodes else ""
            out.append(f"  {name:<12}{found.verdict.value:<10} {found.text}{where}")
        for pair in self.pairs:
            force = ", ".join(f"{f:.6g}" for f in pair.force)
            with_what = pair.master or pair.record["obstacle"]
            out.append(f"  pair {pair.name} with {with_what}: force on the slave ({force}), "
                       f"{int(pair.seen[0].pressed.sum())} of {len(pair.seen[0].pressed)} "
                       "contacts carry load")  # fmt: skip
        return out + [f"  note: {note}" for note in self.notes]

    def __str__(self) -> str:
        return "\n".join(self.lines)

    def __repr__(self) -> str:
        return f"<Audit of {self.title}: {self.verdict}>"

    @property
    def record(self) -> dict[str, Any]:
        """Plain data: what audit.json holds but for schema and versions."""
        return {
            "title": self.title, "verdict": self.verdict,
            **{name: found.record for name, found in self.findings.items()},
            "rounding_bound": self.rounding_bound,
            "pairs": [pair.record for pair in self.pairs], "notes": list(self.notes),
        }  # fmt: skip


def worst(verdicts: Any) -> Judgement:
    """wrong before undecided before right."""
    given = set(verdicts)
    return WRONG if WRONG in given else UNDECIDED if UNDECIDED in given else RIGHT


def joined(found: list[Finding], names: list[str]) -> Finding:
    """The finding of all pairs: the texts of those that are as bad as the worst."""
    if not found:
        return Finding(RIGHT, "there are no contact pairs")
    verdict = worst(f.verdict for f in found)
    chosen = [k for k, f in enumerate(found) if f.verdict is verdict]
    several = len(found) > 1
    text = "; ".join(f"{names[k]}: {found[k].text}" if several else found[k].text
                     for k in chosen[:3])  # fmt: skip
    if len(chosen) > 3:
        text += f"; and {len(chosen) - 3} more pairs"
    numbers: dict[str, Any] = {}
    for f in found:
        for name, value in f.numbers.items():
            known = numbers.get(name)
            is_more = isinstance(value, int | float) and (known is None or value > known)
            if known is None or is_more:
                numbers[name] = value
    nodes = tuple(dict.fromkeys(n for k in chosen for n in found[k].nodes))[:NAMED]
    return Finding(verdict, text, numbers, nodes)
