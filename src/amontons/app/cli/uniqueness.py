"""`amontons uniqueness`: whether there is one solution, and from which friction on not."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import click

from ...analysis.certificates.critical_friction import CriticalFriction
from ...analysis.certificates.uniqueness import Uniqueness, Verdict
from ...core.errors import InvalidInput
from ...io.results import to_json, versions
from ..questions import uniqueness
from .sources import open_source
from .terminal import check_writable, deliver_json, say_when, shortened

SCHEMA = "amontons/uniqueness/1"
UNSETTLED = 1  # exit code


def run(
    source: str, overrides: Sequence[str], mu: float | None, time_limit: float | None,
    json_copy: str | None,
) -> int:  # fmt: skip
    """Assess, show; the exit code."""
    check_writable(json_copy, "--json")
    if time_limit is not None and not time_limit > 0:
        raise InvalidInput(f"--time-limit: expected seconds > 0, got {time_limit}")
    opened = open_source(source, overrides)
    found = uniqueness(opened.target_with(mu), time_limit=time_limit)
    if json_copy != "-":
        click.echo(f"{opened.title}\n{describe(found)}")
        say_when(opened.target)
    if json_copy is not None:
        deliver_json(to_json(record(found)), json_copy)
    return UNSETTLED if found.verdict is Verdict.UNDECIDED else 0


def describe(found: Uniqueness) -> str:
    """The verdict in a few lines."""
    lines = [
        f"{found.verdict.value.replace('_', ' ')}: {found.verdict.meaning}",
        found.reason,
        f"friction {found.friction:g}",
    ]
    if found.criterion == "given friction":
        return "\n".join(lines[:2])
    if math.isinf(found.lower):
        lines.append("every load has one solution at any friction")
    else:
        lines.append(
            f"every load has one solution below {found.lower:.5g} (proved by {found.criterion})"
            if found.lower > 0
            else "no friction is proved to be safe for every load"
        )
    if found.witness is not None:
        lines.append(
            f"some loads have several from {found.upper:.5g} on: the linear piece of pattern "
            f"{shortened(found.witness.pattern)} is singular there"
        )
    lines += _comparison(found.critical)
    if found.other is not None:
        lines.append(f"another solution: {shortened(found.other.pattern)}, error "
                     f"{found.other.error:.1e}")  # fmt: skip
    return "\n".join(lines)


def brief(found: Uniqueness | None) -> str:
    """One line with the cheap part of the verdict."""
    if found is None:
        return (
            "uniqueness: not examined, the problem is large or contact alone holds a body; "
            "ask with --uniqueness"
        )
    if found.verdict is Verdict.UNIQUE_EVERY_LOAD:
        return f"uniqueness: one solution for every load. {found.reason}"
    return f"uniqueness: not settled. {found.reason} Ask with --uniqueness"


def _comparison(bounds: CriticalFriction | None) -> list[str]:
    if bounds is None:
        return []
    lines = []
    if bounds.p_matrix is not None and math.isfinite(bounds.p_matrix):
        lines.append(f"for comparison, the P-matrix criterion: {bounds.p_matrix:.5g}")
    if bounds.full_contact is not None and math.isfinite(bounds.full_contact):
        lines.append(
            f"for comparison, full contact only: {bounds.full_contact:.5g}, which is not safe"
        )
    return lines


def record(found: Uniqueness) -> dict[str, Any]:
    """What the JSON file holds; a bound that is infinite is null."""
    witness = other = comparison = None
    if found.witness is not None:
        w = found.witness
        witness = {"friction": w.friction, "pattern": w.pattern,
                   "coefficients": w.coefficients.tolist(),
                   "null_vector": w.null_vector.tolist(), "residual": w.residual}  # fmt: skip
    if found.other is not None:
        s = found.other
        other = {"pattern": s.pattern, "r": s.r.tolist(), "u": s.u.tolist(), "error": s.error,
                 "distance": s.distance}  # fmt: skip
    if found.critical is not None:
        comparison = {"p_matrix": found.critical.p_matrix,
                      "full_contact": found.critical.full_contact}  # fmt: skip
    return {"schema": SCHEMA, "verdict": found.verdict.value, "reason": found.reason,
            "friction": found.friction, "lower": found.lower, "upper": found.upper,
            "criterion": found.criterion, "witness": witness, "other": other,
            "comparison": comparison, "resolution": found.resolution,
            "seconds": found.seconds,
            "versions": versions()}  # fmt: skip
