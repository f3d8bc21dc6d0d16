"""A solve in words and tables: how it was found, how it was judged, what is known of others."""

from __future__ import annotations

from typing import Any

import numpy as np

from ...analysis.certificates.verdict import Uniqueness, Verdict
from ...mechanics.model.pairs import pair_results
from ...problem.judge.measures import Measure
from ...problem.solution import TELLING, Convergence
from ..results import Output, method_name, versions
from ..units import Units
from .page import Table

TITLES = {
    Verdict.UNIQUE_EVERY_LOAD: "Yes: one solution, whatever the load",
    Verdict.UNIQUE_THIS_LOAD: "Yes: one solution for this load",
    Verdict.NOT_UNIQUE: "No: there is another solution for the same load",
    Verdict.UNDECIDED: "Not settled",
}
MEASURES = {
    Measure.EXACT: "the law of every contact, with displacements that solve M v = H r + f",
    Measure.RESIDUAL: "the law of every contact, and the balance of forces",
    Measure.NITSCHE: "the residual of Nitsche's equations",
    Measure.NATURAL: "|F_nat(r)| / |q|, as papers have it",
}
ASK = ("Ask with “amontons solve … --uniqueness”, “amontons uniqueness …”, or in Python with "
       "am.uniqueness(model).")  # fmt: skip

UNPROVED = ("Nothing is proved of other solutions of this kind of model. At large strains "
            "am.multistart(model) looks for some, am.follow(model) traces the curve of this "
            "one over the load.")  # fmt: skip


def verdict_words(found: Uniqueness | None) -> tuple[str, str]:
    """Title and text of a verdict; None: not asked."""
    if found is None:
        return "Not asked", f"Whether there are other solutions has not been examined. {ASK}"
    ask = f" {ASK}" if found.verdict is Verdict.UNDECIDED else ""
    return TITLES[found.verdict], f"{found.reason}{ask}"


def outcome_words(record: Convergence) -> str:
    """How a solve ended, in words."""
    return record.outcome.name.capitalize().replace("_", " ")


def result_table(output: Output, units: Units) -> Table:
    """Contacts by status, resultant, largest pressure and penetration."""
    found, fields = output.solution, output.fields
    total = found.problem.contacts
    rows = [["contacts", str(total)]]
    rows += [[name, _share(count, total)] for name, count in found.counts.items()]
    if fields is not None:
        force = ", ".join(f"{value:.5g}" for value in _rounded(fields.resultant))
        rows.append(["resultant on the slaves", with_unit(f"({force})", units.force)])
        largest = fields.pressure.max(initial=0.0)
        rows.append(["largest pressure", with_unit(f"{largest:.5g}", units.stress)])
        moved = max(np.linalg.norm(u, axis=1).max(initial=0.0) for u in fields.displacement)
        rows.append(["largest displacement", with_unit(f"{moved:.5g}", units.length)])
        depth = f"{found.max_penetration + 0.0:.2g}"  # no -0
        rows.append(["largest penetration", with_unit(depth, units.length)])
    return Table("Result", ("", ""), rows)


def pairs_table(output: Output, units: Units) -> list[Table]:
    """Force, area, largest pressure, slip and friction work of every contact pair."""
    if output.model is None or output.fields is None:
        return []
    rows = [
        [name, ", ".join(f"{value:.5g}" for value in _rounded(pair.force)), f"{pair.area:.5g}",
         f"{pair.largest_pressure:.5g}", f"{pair.friction_work:.4g}",
         f"{100 * pair.share_sticking:.3g} %"]
        for name, pair in pair_results(output.model, output.fields).items()
    ]  # fmt: skip
    names = (("force on the slave", units.force), ("area in contact", ""),
             ("largest pressure", units.stress), ("friction work", ""))  # fmt: skip
    columns = ("pair", *(f"{name}, {unit}" if unit else name for name, unit in names),
               "sticking")  # fmt: skip
    return [Table("Contact pairs", columns, rows)]


def judged_table(output: Output) -> Table:
    """Method, errors against their tolerances, weakest contact."""
    record = output.solution.convergence
    rows = [
        ["outcome", outcome_words(record)],
        ["advice", record.advice] if record.stamp else ["", ""],
        ["method", output.method or method_name(record.solver)],
        ["ended by", method_name(record.detail)] if record.detail else ["", ""],
        ["error", f"{_error(record.error)} of {record.tolerance:.0e} allowed"],
        ["measured by", MEASURES[record.measure]],
    ]
    if record.contact_error is not None:
        limit = record.contact_tolerance
        allowed = f" of {limit:.0e} allowed" if np.isfinite(limit) else ""
        which = "" if record.weakest is None else f"contact {record.weakest}: "
        rows.append(["weakest contact", f"{which}{_error(record.contact_error)}{allowed}, "
                     "on its own scale"])  # fmt: skip
    rows += [["iterations", str(record.iterations)]]
    if record.linear_iterations:
        rows.append(["linear iterations", str(record.linear_iterations)])
    return Table("How it was judged", ("", ""), [row for row in rows if row[0]])


def cost_table(output: Output) -> Table:
    """Sizes, times, versions."""
    found, record = output.solution, output.solution.convergence
    setup = record.history[0].seconds if record.history else 0.0
    rows = [
        ["unknowns", str(found.problem.unknowns)],
        ["dimension", f"{found.problem.dimension}D"],
        ["assembling", _seconds(output.assemble_seconds)],
        ["setup", _seconds(setup)],
        ["solving", _seconds(record.seconds - setup)],
    ]
    if record.compiling >= TELLING:
        rows.append(["preparing kernels", _seconds(record.compiling)])
    rows += version_rows()
    return Table("How it was solved", ("", ""), rows)


def version_rows() -> list[list[str]]:
    """Names and versions of the libraries that made the numbers."""
    return [[name, text] for name, text in versions().items()]


def with_unit(text: str, unit: str) -> str:
    """A number with its unit, where one is known."""
    return f"{text} {unit}" if unit else text


def _error(value: float) -> str:
    return f"{value:.2e}" if value else "0"


def _share(count: int, total: int) -> str:
    return f"{count} ({100 * count / total:.3g} %)" if total else str(count)


def _rounded(values: Any) -> Any:
    """Components that are rounding against the largest as 0."""
    return np.where(np.abs(values) > 1e-8 * np.abs(values).max(initial=0.0), values, 0.0)


def _seconds(value: float) -> str:
    return f"{1e3 * value:.3g} ms" if value < 1 else f"{value:.3g} s"
