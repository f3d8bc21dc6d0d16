"""The page of an audit: the verdict, its questions, and the pairs."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np

from ...analysis.audit import Audit
from ...mechanics.model.fields import recover_fields
from ...mechanics.model.supports import locate
from ..plots.audit import statuses
from ..units import Units
from .page import Page, Table
from .skin import Skin
from .states import Stage, State
from .words import version_rows

OUTCOMES = {"right": "Right", "wrong": "Wrong", "undecided": "Undecided"}


def audit_page(found: Audit, title: str, units: Units) -> Page:
    """The bodies as the answer has them, and what the judge says."""
    rows = [[name, one.verdict.value, one.text, ", ".join(one.nodes)]
            for name, one in found.findings.items()]  # fmt: skip
    pairs = [
        [pair.name, pair.slave, pair.master or pair.record["obstacle"],
         ", ".join(f"{f:.6g}" for f in pair.force),
         f"{int(pair.seen[0].pressed.sum())} of {len(pair.seen[0].pressed)}",
         ", ".join(f"{name} {one.verdict.value}" for name, one in pair.findings.items())]
        for pair in found.pairs
    ]  # fmt: skip
    numbers = [[f"{name}: {key}", _shown(value)] for name, one in found.findings.items()
               for key, value in one.numbers.items()]  # fmt: skip
    stage = Stage(Skin(found.model))
    return Page(
        "audit", title or found.title, headline=_headline(found),
        outcome=OUTCOMES[found.verdict], stamp="" if found.is_right else found.verdict,
        facts=[Table("Numbers", ("", ""), numbers), Table("Judged by", ("", ""),
                                                          version_rows())],
        tables=[Table("Questions", ("question", "verdict", "why", "nodes"), rows),
                Table("Contact pairs", ("pair", "slave", "other side", "force on the slave",
                                        "carry load", "verdicts"), pairs)],
        warnings=found.notes, stage=stage, states=[_state(found, stage)], units=units,
    )  # fmt: skip


def _headline(found: Audit) -> str:
    """The verdict, and the questions that make it."""
    worst = found.verdict
    failed = [name for name, one in found.findings.items() if one.verdict.value == worst]
    why = "" if found.is_right else f": {', '.join(failed)}"
    return f"This answer is {found.verdict}{why}."


def _shown(value: Any) -> str:
    if isinstance(value, tuple):
        return " to ".join(_shown(v) for v in value)
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def _state(found: Audit, stage: Stage) -> State:
    """The answer as one state: its displacements, and the contact forces that these need."""
    model = found.model
    parts = model.discretisation
    u = np.concatenate([part.ravel() for part in found.displacement])
    sides = [pair.seen[0].side for pair in found.pairs]
    status = np.concatenate([statuses(pair) for pair in found.pairs])
    answer: Any = SimpleNamespace(
        r=np.concatenate([side.r for side in sides]),
        u=np.concatenate([np.column_stack([side.gap, side.slip]) for side in sides]),
        v=u[parts.free], status=status, sliding=status == 1,
        problem=SimpleNamespace(law=model.law), convergence=SimpleNamespace(stamp=""),
        counts={},
    )  # fmt: skip
    surfaces = tuple(locate(model.bodies, contact.slave) for contact in model.contacts)
    return stage.state(recover_fields(model, surfaces, answer), answer)
