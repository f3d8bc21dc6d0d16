"""Warnings of the steps of a run: each kind told once when it first appears, and at the end."""

from __future__ import annotations

from dataclasses import dataclass, field

import click

from ...core.warned import ResultWarning
from ...mechanics.steps import TimeStep


@dataclass
class Doubts:
    """The warnings of a run by name: when they first came, in how many steps, the last one."""

    first: dict[str, float] = field(default_factory=dict)
    steps: dict[str, int] = field(default_factory=dict)
    last: dict[str, ResultWarning] = field(default_factory=dict)

    def note(self, step: TimeStep, *, quiet: bool) -> None:
        """Take those of a step; print the kinds that are new."""
        told = {warning.name: warning for warning in step.warnings}
        for name, warning in told.items():
            if name not in self.first and not quiet:
                click.echo(f"t = {step.time:.6g}: {warning}")
            self.first.setdefault(name, step.time)
            self.steps[name] = self.steps.get(name, 0) + 1
        self.last |= told

    def lines(self) -> list[str]:
        """One line for each kind, with its last words, for the closing summary."""
        out = []
        for name, warning in self.last.items():
            count, since = self.steps[name], self.first[name]
            times = f"in {count} steps since" if count > 1 else "at"
            out.append(f"{warning} ({times} t = {since:.6g})")
        return out
