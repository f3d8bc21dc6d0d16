"""The numbers of contact pairs and supports as plain data: JSON records and flat tables."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from io import StringIO
from typing import TYPE_CHECKING, Any

from ..mechanics.model.pairs import PairResult, pair_results
from ..mechanics.model.reactions import SupportResult, support_results
from ..mechanics.model.references import reference_results

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from ..analysis.solutions.enumerate import PieceSolution
    from ..mechanics.model import ContactFields, Model

AXES = ("x", "y", "z")
STATUS = {"f": "open", "s": "stick", "+": "slip +", "-": "slip -", "l": "slip"}
SUPPORT = "fix "  # what stands before the name of a support in columns
SCALARS = ("area", "largest_pressure", "slip_net", "slip_accumulated", "friction_work",
           "share_sticking")  # fmt: skip


def records(model: Model, fields: ContactFields) -> dict[str, Any]:
    """`pairs`, `supports`, `load` and `references` of solution.json."""
    pairs, supports = pair_results(model, fields), support_results(model, fields)
    return {
        "pairs": [pair.record for pair in pairs.values()],
        "supports": [support.record for support in supports.values()],
        "load": fields.load.record,
        "references": [one.record for one in reference_results(model, fields).values()],
    }


def vector_columns(dimension: int) -> tuple[str, ...]:
    """force_x, …, moment_x, …; in 2D the moment about z alone."""
    turns = AXES if dimension == 3 else AXES[2:]
    return (*(f"force_{axis}" for axis in AXES[:dimension]), *(f"moment_{a}" for a in turns))


def pair_columns(dimension: int) -> tuple[str, ...]:
    """The columns of one pair."""
    return (*vector_columns(dimension), *SCALARS)


def vector_values(result: PairResult | SupportResult) -> list[float]:
    """The values of `vector_columns`."""
    return [*result.force.tolist(), *result.moment.tolist()]


def pair_values(pair: PairResult) -> list[float]:
    """The values of `pair_columns`."""
    return [*vector_values(pair), pair.area, pair.largest_pressure, pair.slip.net,
            pair.slip.accumulated, pair.friction_work, pair.share_sticking]  # fmt: skip


def flat_columns(
    dimension: int, pairs: Sequence[str], supports: Sequence[str]
) -> tuple[str, ...]:
    """NAME.force_x and so on of all pairs, then `fix NAME.force_x` of all supports."""
    names = [f"{name}.{column}" for name in pairs for column in pair_columns(dimension)]
    for name in supports:
        for column in vector_columns(dimension):
            new = f"{SUPPORT}{name}.{column}"
            while new in names:  # a pair may be called so
                new += "'"
            names.append(new)
    return tuple(names)


def flat_values(
    pairs: dict[str, PairResult], supports: dict[str, SupportResult]
) -> list[float]:
    """The values of `flat_columns`."""
    out = [value for pair in pairs.values() for value in pair_values(pair)]
    return out + [value for held in supports.values() for value in vector_values(held)]


def pairs_csv(model: Model, fields: ContactFields) -> bytes:
    """A table with a row for every contact pair and every support; moments about the origin."""
    d = model.dimension
    rows: list[Sequence[Any]] = [("kind", "name", "slave", "master", *pair_columns(d))]
    rows += [
        ("pair", pair.name, pair.slave, pair.master or pair.obstacle, *pair_values(pair))
        for pair in pair_results(model, fields).values()
    ]
    blank = [""] * len(SCALARS)
    rows += [
        ("fix", held.name, held.on, "", *vector_values(held), *blank)
        for held in support_results(model, fields).values()
    ]
    text = StringIO(newline="")
    csv.writer(text).writerows(rows)
    return text.getvalue().encode("utf-8")


def solutions_csv(
    solutions: Sequence[PieceSolution], dimension: int, model: Model | None = None
) -> bytes:
    """A table with a row for every solution and contact; with a model also where they are."""
    tangents = ("t",) if dimension == 2 else ("t1", "t2")
    columns = [f"{letter}_{axis}" for letter in "ru" for axis in ("n", *tangents)]
    places: list[Sequence[Any]] = []
    where: tuple[str, ...] = ()
    if model is not None:
        where, placed = ("pair", *AXES[:dimension]), model.discretisation.placed
        places = [(name, *point) for name, own in zip(model.pair_names, placed, strict=True)
                  for point in own.rows.points.tolist()]  # fmt: skip
    rows: list[Sequence[Any]] = [("solution", "contact", *where, "status", *columns)]
    for number, found in enumerate(solutions, 1):
        numbers = zip(found.pattern, found.r.tolist(), found.u.tolist(), strict=True)
        for k, (letter, r, u) in enumerate(numbers):
            place = places[k] if places else ()
            rows.append((number, k, *place, STATUS[letter], *r, *u))
    text = StringIO(newline="")
    csv.writer(text).writerows(rows)
    return text.getvalue().encode("utf-8")


def csv_of(columns: Sequence[str], table: NDArray) -> bytes:
    """A structured array as CSV, with nothing where a number is NaN."""
    text = StringIO(newline="")
    rows = [["" if value != value else value for value in row] for row in table.tolist()]
    csv.writer(text).writerows([columns, *rows])
    return text.getvalue().encode("utf-8")
