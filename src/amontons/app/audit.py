"""`audit`: whether what somebody gives for the displacements of a model is true."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..analysis.audit import Answer, Audit, audit_answer
from ..core.errors import InvalidInput
from .model_solution import ModelSolution

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from ..io.readers import Case
    from ..mechanics.model import Model


def audit(
    model: Model | str | os.PathLike[str],
    displacements: ModelSolution | NDArray | Sequence[NDArray] | str | os.PathLike[str],
    *, time: float | None = None, law: str | None = None, digits: int | None = None,
    overrides: Sequence[str] = (),
) -> Audit:  # fmt: skip
    """The verdict on displacements: right, wrong or undecided, with the reasons.

    model: a Model, or the file of one (a deck, a case).  displacements: (nodes, d), one array
    for each body, a solution of ours, or a file: .frd or .dat of CalculiX, .vtu, solution.h5
    or the folder with it.  time: the state to judge in a file with several, by default the
    last.  law: "hard", contact neither overlaps nor creeps while it sticks, or "own", it may
    give way as its stiffness says; by default "hard" for decks, whose stiffness is a penalty,
    and "own" for models.  digits: how many the displacements have, by default all or those of
    the file.  overrides: as --set of the command line, of a file of a model.

    Raises InvalidInput and FileFormatError for displacements that do not belong to the model,
    UnsupportedForm for large deformations and Nitsche's method.
    """
    if law not in (None, "hard", "own"):
        raise InvalidInput(f"law: expected 'hard' or 'own', got {law!r}")
    case = None
    if isinstance(model, str | os.PathLike):
        from ..io.readers import read

        case = read(Path(model), [*overrides, *_small(Path(model))])
        target = case.model
    else:
        target = model
    if isinstance(displacements, str | os.PathLike):
        target, answer = _from_file(Path(displacements), case, target, time)
    else:
        answer = _given(displacements, target)
    if digits is not None:
        answer = replace(answer, blur=_rounded(answer.displacement, digits))
    own = law == "own" or (law is None and (case is None or case.about is None))
    return audit_answer(target, answer, deck_law=own)


def _small(path: Path) -> list[str]:
    """What has a deck read with small strains: those of an answer are judged by them."""
    is_deck = path.name.lower().endswith((".inp", ".inp.gz"))
    return ["deck.small=true"] if is_deck else []


def _from_file(
    path: Path, case: Case | None, model: Model, time: float | None
) -> tuple[Model, Answer]:  # fmt: skip
    from ..io.answers.read import read_answer
    from ..io.case import Settings
    from ..io.readers import Case

    opened = Case(model, Settings("auto"), model.name, None) if case is None else case
    return read_answer(path, opened, time)


def _given(displacements: Any, model: Model) -> Answer:
    """An answer of arrays, or of a solution."""
    if isinstance(displacements, ModelSolution):
        return Answer(displacements.displacement, reactions=displacements.r)
    if isinstance(displacements, np.ndarray) and displacements.ndim == 2:
        ends = np.cumsum([len(body.mesh.points) for body in model.bodies])
        if len(displacements) != ends[-1]:
            raise InvalidInput(
                f"displacements: expected ({ends[-1]}, {model.dimension}), a row for each node "
                f"of all bodies, got {displacements.shape}"
            )
        return Answer(tuple(np.split(displacements, ends[:-1])))
    return Answer(tuple(np.asarray(part, dtype=float) for part in displacements))


def _rounded(displacement: Sequence[NDArray], digits: int) -> tuple[NDArray, ...]:
    from ..io.answers.read import half_units

    if digits < 1:
        raise InvalidInput(f"digits: expected at least 1, got {digits}")
    return tuple(half_units(values, digits) for values in displacement)
