"""Nitsche's contact in a study of basins: the same model and displacements, no multipliers."""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING, Any

from ...core.errors import InvalidInput
from ...solvers import SemismoothNewton
from .methods import BasinMethod, Maker

if TYPE_CHECKING:
    from ...mechanics.model import Model

NAME = "nitsche"
WITHIN = 0.1  # relative energy: its solutions are off by some 1 / kappa
FIELDS = ("kappa", "scale", "theta", "points")


def by_nitsche(model: Model) -> Maker:
    """Newton's method on a model with the fields of `Nitsche` as parameters."""

    def make(values: dict[str, Any]) -> BasinMethod:
        from ...mechanics.contact import Nitsche  # noqa: PLC0415

        try:
            options = Nitsche(**values)
        except InvalidInput as reason:
            raise InvalidInput(f"parameters: {NAME}: {reason}") from None
        contacts = [dataclasses.replace(one, method=options) for one in model.contacts]
        other = dataclasses.replace(model, contacts=contacts)
        return BasinMethod(
            SemismoothNewton(), NAME, values, problem=other.discrete_problem(), within=WITHIN
        )

    return Maker(FIELDS, make)
