"""Audits of what another program, or our own, gives for displacements.

From displacements follow the forces that bodies need (`forces`), from these the forces of
contacts, seen from both sides (`sides`); they are held against the laws of hard contact
(`laws`), question by question (`questions`), and what comes out has words (`verdict`).
"""

from __future__ import annotations

from .judge import Answer, audit_answer
from .turning import Turning
from .verdict import Audit, Finding, Judgement, PairAudit

__all__ = ["Answer", "Audit", "Finding", "Judgement", "PairAudit", "Turning", "audit_answer"]
