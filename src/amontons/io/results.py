"""Solutions as files: VTK, HDF5, JSON and figures, each complete or not there at all."""

from __future__ import annotations

import json
import math
import os
import platform
from collections.abc import Callable, Iterable, Mapping
from contextlib import ExitStack
from dataclasses import asdict, dataclass, replace
from enum import Enum
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..core.errors import InvalidInput
from ..core.files import made, put, replacing
from ..core.warned import ResultWarning
from ..problem.solution import ContactStatus, Convergence, FrictionSolution
from ..solvers import METHODS

if TYPE_CHECKING:
    from h5py import File

    from ..analysis.certificates.verdict import Uniqueness
    from ..mechanics.model import ContactFields, Model
    from ..mechanics.steps import TimeStep

Array = NDArray[np.float64]
SCHEMA, RUN_SCHEMA = "amontons/solution/1", "amontons/run/1"
VERDICT_SCHEMA = "amontons/uniqueness/1"
LIBRARIES = ("amontons", "numpy", "scipy", "numba", "netgen-mesher")  # Netgen: CAD
MOST_SETS = 12  # changes of sets that a summary shows; solution.json has all
MOST_PAIRS = 8  # contact pairs that a summary tells one by one; solution.json has all
FIGURES = (".png", ".svg", ".pdf")


@dataclass(frozen=True, eq=False)
class Output:
    """A solution and what is known about where it comes from.

    model and fields go together; from_fclib: the HDF5 file is then an FCLib file as well.
    """

    solution: FrictionSolution
    model: Model | None = None
    fields: ContactFields | None = None
    title: str = ""
    method: str = ""  # as on the command line; empty: the name of the solver's class
    assemble_seconds: float = 0.0
    from_fclib: bool = False
    uniqueness: Uniqueness | None = None  # what is known about other solutions
    warnings: tuple[ResultWarning, ...] = ()
    notes: tuple[str, ...] = ()  # what its file says and the model leaves out
    fclib_error: bool = False  # evaluate it also where that takes a factorisation of M
    figures: str = "png"  # format of the figures that `save` writes; "" for none


Writer = Callable[[Output, Path], None]


# ------------------------------------------------------------------------------- choosing
def write(output: Output, path: str | os.PathLike[str]) -> None:
    """Write one file; the suffix decides: .vtu, .h5 (or .hdf5), .json, .csv, .frd, .dat."""
    writers = {".vtu": write_vtu, ".h5": write_h5, ".hdf5": write_h5, ".json": write_json,
               ".csv": write_csv, ".frd": write_frd, ".dat": write_frd}  # fmt: skip
    suffix = Path(path).suffix.lower()
    if suffix not in writers:
        raise InvalidInput(
            f"{path}: expected a name that ends in {', '.join(writers)}, got {suffix!r}"
        )
    with replacing(path) as temporary:
        writers[suffix](output, temporary)


def write_frd(output: Output, path: Path, labels: NDArray[np.int64] | None = None) -> None:
    """Write results as CalculiX does, .frd or .dat; labels (nodes,): numbers of nodes."""
    from .answers.write import Shown, write_answer

    write_answer(path, Shown.of(output, labels))


def expect_picture(path: str | os.PathLike[str]) -> None:
    """Raise InvalidInput unless the suffix is that of a picture."""
    suffix = Path(path).suffix.lower()
    if suffix not in FIGURES:
        raise InvalidInput(
            f"{path}: expected a name that ends in {', '.join(FIGURES)}, got {suffix!r}"
        )


def plot_status(output: Output, path: Path) -> None:
    """Write the figure of the statuses."""
    from .plots import picture, status_figure

    figure = status_figure(output.solution, output.fields, output.title, output.model)
    put(path, picture(figure, path.suffix))


def plot_convergence(output: Output, path: Path) -> None:
    """Write the figure of the errors."""
    from .plots import convergence_figure, picture

    figure = convergence_figure(output.solution.convergence, output.title)
    put(path, picture(figure, path.suffix))


def save(
    output: Output, folder: str | os.PathLike[str], copy: str | os.PathLike[str] | None = None,
    more: Mapping[str, Writer] | None = None,
) -> list[Path]:  # fmt: skip
    """Write all files of a solution into a folder, made if need be; returns their paths.

    copy: where a second solution.json goes.  more: further files by name.  Nothing is renamed
    before all is written, and a failure leaves no new folder.
    """
    text = to_json(summary(output))  # before the first folder: it evaluates the solution
    writers: dict[str, Writer] = {
        "solution.json": lambda output, path: _write_text(path, text), "solution.h5": write_h5,
    }  # fmt: skip
    if output.figures:
        writers[f"status.{output.figures}"] = plot_status
        writers[f"convergence.{output.figures}"] = plot_convergence
    if output.model is not None:
        writers |= {"solution.vtu": write_vtu, "pairs.csv": write_csv}
    writers |= more or {}
    folder = Path(folder)
    jobs = [(folder / name, writer) for name, writer in writers.items()]
    if copy is not None:
        jobs.append((Path(copy), writers["solution.json"]))
    with ExitStack() as stack:
        stack.enter_context(made(folder))
        for path, writer in jobs:
            writer(output, stack.enter_context(replacing(path)))
        _remove_others(folder, writers)
    return [path for path, _ in jobs]


def _remove_others(folder: Path, written: Iterable[str]) -> None:
    """Figures of an earlier solution in other formats would be taken for those of this one."""
    for name in ("status", "convergence"):
        for suffix in FIGURES:
            if f"{name}{suffix}" not in written:
                (folder / f"{name}{suffix}").unlink(missing_ok=True)


def _write_text(path: Path, text: str) -> None:
    put(path, text.encode("utf-8"))


# ----------------------------------------------------------------------------------- JSON
def summary(output: Output) -> dict[str, Any]:
    """The record of a solve, schema amontons/solution/1; None for what is not finite."""
    found, record = output.solution, output.solution.convergence
    problem = found.problem
    setup = record.history[0].seconds if record.history else 0.0
    contacts = {"total": problem.contacts, **found.counts, "sliding": int(found.sliding.sum())}
    asked = output.fclib_error or problem.knows_q
    resultant = None if output.fields is None else output.fields.resultant.tolist()
    numbers: dict[str, Any] = {
        "pairs": None, "supports": None, "load": None, "references": None,
    }  # fmt: skip
    if output.model is not None and output.fields is not None:
        from .numbers import records

        numbers = records(output.model, output.fields)
    verdict = None if output.uniqueness is None else verdict_record(output.uniqueness)
    data = {
        "schema": SCHEMA,
        "title": output.title or problem.name,
        "outcome": record.outcome.name.lower(),
        "advice": record.advice,
        "detail": record.detail,
        "stopped_by": _word(record.stopped_by),
        "obstruction": _word(record.obstruction),
        "method": output.method or method_name(record.solver),
        "error": record.error,
        "contact_error": record.contact_error,
        "weakest": record.weakest,
        "fclib_error": found.fclib_error if asked else None,
        "measure": record.measure.value,
        "tolerance": record.tolerance,
        "contact_tolerance": record.contact_tolerance,
        "iterations": record.iterations,
        "linear_iterations": record.linear_iterations,
        "flops": record.flops,
        "seconds": {
            "assemble": output.assemble_seconds,
            "setup": setup,  # factorisation and all else before the first judgement
            "solve": record.seconds - setup,
            "total": output.assemble_seconds + record.seconds,  # without compiling
            "compiling": record.compiling,
        },
        "dimension": problem.dimension,
        "unknowns": problem.unknowns,
        "contacts": contacts,
        "active_sets": _active_sets(record),
        "resultant": resultant,
        **numbers,
        "max_penetration": found.max_penetration,
        "max_cone_violation": found.max_cone_violation,
        "uniqueness": verdict,
        "warnings": [warning.record for warning in output.warnings],
        "notes": list(output.notes),
        "versions": versions(),
    }
    return finite(data)


def verdict_record(found: Uniqueness) -> dict[str, Any]:
    """The record of a verdict on other solutions, schema amontons/uniqueness/1."""
    return {"schema": VERDICT_SCHEMA, **found.record, "versions": versions()}


def step_record(step: TimeStep, title: str, works: dict[str, float]) -> dict[str, Any]:
    """The record of a run after a step, schema amontons/run/1.

    works: sums over all steps so far.  Without times of the clock: a run that was stopped and
    goes on ends with the same record.
    """
    from .numbers import records

    record, state = step.solution.convergence, step.state
    counts = {s.name.lower(): int((step.status == s).sum()) for s in ContactStatus}
    return finite({
        "schema": RUN_SCHEMA,
        "title": title or step.model.name,
        "outcome": record.outcome.name.lower(),
        "steps": state.index,
        "time": step.time,
        "error": record.error,
        "tolerance": record.tolerance,
        "dimension": step.model.dimension,
        "contacts": {"total": len(step.gap), **counts, "sliding": int(step.sliding.sum())},
        "works": works,
        "kinetic": step.energies.kinetic,
        "elastic": step.energies.elastic,
        "resultant": step.fields.resultant.tolist(),
        **records(step.model, step.fields),
        "warnings": [warning.record for warning in step.warnings],
        "versions": versions(),
    })  # fmt: skip


def _active_sets(record: Convergence) -> dict[str, Any] | None:
    """What an active set method did step by step; None for other methods.

    normal, tangential: |A_n| and |A_tau|; change: of u; settled: the first iteration with the
    final sets, kept from then on.
    """
    steps = [
        {"iteration": step.iteration, "error": step.error,
         "linear_iterations": step.linear_iterations, **asdict(step.sets)}
        for step in record.history if step.sets is not None
    ]  # fmt: skip
    return {"settled": record.sets_settled, "steps": steps} if steps else None


def _sets_in_words(record: Convergence) -> str:
    """A line with the iterations in which the active sets changed, "" without any."""
    new = [step for step in record.history if step.sets is not None and not step.sets.kept]
    if not new:
        return ""
    shown = [f"{step.iteration}: {step.sets}" for step in new]
    if len(shown) > MOST_SETS:
        shown = [*shown[: MOST_SETS - 1], "…", shown[-1]]
    return (
        f"active sets open/stick/slip, where they change: {', '.join(shown)} (of "
        f"{record.iterations} iterations)"
    )


def method_name(solver: str) -> str:
    """Name on the command line of a solver's class, the class itself if it has none."""
    return next((name for name, kind in METHODS.items() if kind.__name__ == solver), solver)


def versions() -> dict[str, str]:
    """Versions of Python and of the libraries that are installed."""
    found = {"python": platform.python_version()}
    for name in LIBRARIES:
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            continue
    return found


def finite(value: Any) -> Any:
    """The same data with None for numbers that JSON can not hold."""
    if isinstance(value, dict):
        return {key: finite(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [finite(item) for item in value]
    if isinstance(value, float | np.floating):
        return float(value) if math.isfinite(value) else None
    return value


def _word(member: Enum | None) -> str | None:
    return None if member is None else member.name.lower()


def to_json(data: Any) -> str:
    """JSON text, strict: no NaN."""
    return json.dumps(finite(data), indent=2, allow_nan=False) + "\n"


def write_json(output: Output, path: Path) -> None:
    """Write solution.json."""
    _write_text(path, to_json(summary(output)))


def describe(output: Output) -> str:
    """What a person wants to know, in a few lines."""
    text, record = output.solution.headline, output.solution.convergence
    if output.model is not None and not output.solution.problem.name:
        text = f"{output.title or 'model'}: {text.partition(': ')[2]}"
    if output.method:  # on the command line, methods have other names
        solver, detail = method_name(record.solver), method_name(record.detail)
        record = replace(record, solver=solver, detail=detail)
    lines = [text, str(record)]
    if output.solution.convergence.stamp:
        lines.append("NOT CONVERGED: what follows is no solution")
    if sets := _sets_in_words(output.solution.convergence):
        lines.append(sets)
    if output.fields is not None and output.solution.problem.contacts:
        total = output.fields.resultant
        total = np.where(np.abs(total) > 1e-8 * np.abs(total).max(), total, 0.0)
        force = ", ".join(f"{n} {value:.6g}" for n, value in zip("xyz", total, strict=False))
        lines += [f"resultant on the slave: {force}",
                  f"largest pressure: {output.fields.pressure.max(initial=0.0):.6g}"]
    elif output.fields is not None:
        moved = max(np.abs(u).max(initial=0.0) for u in output.fields.displacement)
        lines.append(f"largest displacement: {moved:.6g}")
    if output.fields is not None and output.model is not None:
        lines += _model_in_words(output.model, output.fields)
    lines += map(str, output.warnings)
    return "\n".join(lines)


def _model_in_words(model: Model, fields: ContactFields) -> list[str]:
    """A line for every contact pair, where there are few, and one about hybrid elements."""
    from ..mechanics.model import element_words, pairs

    few = 1 < len(model.contacts) <= MOST_PAIRS
    return element_words.in_words(model) + [
        f"  {pair.name}: force {', '.join(f'{value:.6g}' for value in pair.force)}; area "
        f"{pair.area:.6g}, {pair.share_sticking:.0%} of it sticks; largest pressure "
        f"{pair.largest_pressure:.6g}"
        for pair in (pairs.pair_results(model, fields).values() if few else ())
    ]


# ------------------------------------------------------------------------------ HDF5, VTK
def write_h5(output: Output, path: Path) -> None:
    """Write solution.h5: r, u, v, status, sliding, margin, and the contact fields of a model.

    The solution of an FCLib problem is written as an FCLib file, with the group /solution.
    Each array says in its attributes what it is, and in which unit.
    """
    from .arrays_h5 import notes_of, put_all
    from .fclib import hdf5_bytes, put_fclib

    found = output.solution
    notes = {"schema": SCHEMA, "outcome": found.convergence.outcome.name.lower(),
             "error": found.convergence.error, "converged": int(found.converged),
             **notes_of(output.title or found.problem.name, versions())}  # fmt: skip

    def fill(file: File) -> None:
        if output.from_fclib:
            put_fclib(file, found.problem, solution=found)  # type: ignore[arg-type]
        put_all(file, found, output.model, output.fields, notes)

    put(path, hdf5_bytes(fill))


def write_vtu(output: Output, path: Path) -> None:
    """Write solution.vtu; raises InvalidInput for a problem without geometry."""
    from .vtk import write_model

    model, fields = _of_model(output, "vtu")
    write_model(model, fields, output.solution, path, output.title)


def write_csv(output: Output, path: Path) -> None:
    """Write pairs.csv; raises InvalidInput for a problem without geometry."""
    from .numbers import pairs_csv

    put(path, pairs_csv(*_of_model(output, "csv")))


def _of_model(output: Output, suffix: str) -> tuple[Model, ContactFields]:
    if output.model is None or output.fields is None:
        raise InvalidInput(f"{suffix}: this solution has no mesh; write .h5 or .json")
    return output.model, output.fields
