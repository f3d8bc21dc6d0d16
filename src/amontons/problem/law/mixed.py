"""Contacts of several laws in one problem: each obeys its own."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from ...core.arrays import read_only
from ...core.errors import InvalidInput, UnsupportedLaw, shown
from .capped import CappedCoulomb
from .changed import Stretched
from .cohesive import Cohesive
from .compliant import Compliant
from .coulomb import Coulomb
from .law import BOUND, MU, Array, Kind, Kinds, Law
from .overclosure import VaryingCompliance, joined_compliances
from .tied import Tied
from .tresca import Tresca
from .varying import VaryingFriction, joined_varying


@dataclass(frozen=True, eq=False)
class Mixed(Law):
    """Laws of kinds (nc,) with parameters (nc, 2), see `law`; `joined` makes it of others."""

    name: ClassVar[str] = "friction of several laws"
    kind: Kinds
    parameters: Array

    def _of(self, kind: Kinds, parameters: Array) -> Mixed:
        return Mixed(kind, parameters)


def joined(laws: Sequence[Law]) -> Law:
    """One law for the contacts of the first, then of the second, and so on.

    Of one class where all are; raises InvalidInput for what is no law.
    """
    for law in laws:
        if not isinstance(law, Law):
            raise InvalidInput(f"law: expected Coulomb, Tresca, …, got {shown(law)}")
    if any(isinstance(law, VaryingCompliance) for law in laws):
        if any(isinstance(law, VaryingFriction) for law in laws):
            raise UnsupportedLaw(
                "friction over pressure or speed and a curve of pressure over overclosure in "
                "one problem; expected curves of one of both"
            )
        inner = [law.inner if isinstance(law, VaryingCompliance) else law for law in laws]
        return joined_compliances(laws, joined(inner))
    if any(law.varies for law in laws):
        inner = [law.inner if isinstance(law, VaryingFriction) else law for law in laws]
        return joined_varying(laws, joined(inner))
    plain = [law.plain for law in laws]
    kind = np.concatenate([law.kind for law in plain]) if plain else np.zeros(0, np.int8)
    parameters = np.concatenate([law.parameters for law in plain] or [np.zeros((0, 2))])
    cohesion = np.concatenate([law.cohesion for law in laws] or [np.zeros(0)])
    out = of_kinds(kind, parameters)
    stretches = [_stretch(law) for law in laws if len(law)]
    if any(law.stretch is not None for law in laws):
        out = Stretched(out, read_only(np.concatenate(stretches)))
    if cohesion.any():
        out = Cohesive(out, cohesion)
    if all(law.give is None and not np.any(law.offset) for law in laws):
        return out
    give = [np.zeros((len(law), 3)) if law.give is None else law.give for law in laws]
    offset = np.concatenate([np.broadcast_to(law.offset, len(law)) for law in laws])
    return Compliant(out, *np.concatenate(give).T[:2], offset)


def _stretch(law: Law) -> Array:
    """T of a law, (nc, 2, 2)."""
    return np.tile(np.eye(2), (len(law), 1, 1)) if law.stretch is None else law.stretch


def of_kinds(kind: Kinds, parameters: Array) -> Law:
    """The law of kinds and parameters, of the simplest class."""
    mu, bound = parameters[:, MU], parameters[:, BOUND]
    if (kind == Kind.COULOMB).all():
        return Coulomb(mu)
    if (kind == Kind.TRESCA).all():
        return Tresca(bound)
    if (kind == Kind.CAPPED).all():
        return CappedCoulomb(mu, bound)
    if (kind == Kind.TIED).all():
        return Tied(len(kind))
    return Mixed(read_only(np.array(kind)), read_only(np.array(parameters)))
