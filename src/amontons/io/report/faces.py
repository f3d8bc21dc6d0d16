"""Reports of results, by their class: a new class is registered here.

`core.faces.Shown` has the method that users call.
"""

from __future__ import annotations

import os
from functools import singledispatch
from pathlib import Path
from typing import Any

from ...analysis.audit import Audit
from ...analysis.paths.diagram import Diagram
from ...analysis.paths.path import Branch
from ...analysis.solutions.enumerate import Solutions
from ...core.errors import InvalidInput
from ...core.files import write_bytes
from ...problem.friction import FrictionProblem
from ...problem.solution import FrictionSolution
from ..results import Output
from ..units import Units
from .audits import audit_page
from .curves import curves_page
from .page import Page
from .pages import solutions_page, solve_page

SUFFIXES = (".html", ".htm")


def report(result: Any, path: str | os.PathLike[str], **options: Any) -> Path:
    """Write the report of a result as one HTML file, complete or not at all; returns its path.

    options: title; units, "mm,N,s" or a dict; model, of discrete results the model that they
    are of.  Raises InvalidInput for a name that is no page's, and NotWritten.
    """
    target = expect_page(path)
    page = page_of(result, **options)
    save_page(page, target)
    return target


def save_page(page: Page, path: str | os.PathLike[str]) -> None:
    """Write a page, complete or not at all."""
    write_bytes(path, page.html.encode("utf-8"))


def expect_page(path: str | os.PathLike[str]) -> Path:
    """The path; raises InvalidInput unless its suffix is that of a page."""
    target = Path(path)
    if target.suffix.lower() not in SUFFIXES:
        raise InvalidInput(
            f"{target}: expected a name that ends in {' or '.join(SUFFIXES)}, got "
            f"{target.suffix!r}"
        )
    return target


@singledispatch
def page_of(result: Any, *, title: str = "", units: Any = None) -> Page:
    """The page of a result; raises TypeError for what has none."""
    output = getattr(result, "output", None)  # of a solved model
    if not isinstance(output, Output):
        raise TypeError(f"{type(result).__name__} has no report")
    return page_of(output, title=title, units=units)


@page_of.register
def _(result: Output, *, title: str = "", units: Any = None) -> Page:
    return solve_page(result, Units.of(units), title)


@page_of.register
def _(result: FrictionSolution, *, title: str = "", units: Any = None,
      model: Any = None) -> Page:  # fmt: skip
    fields = None if model is None else model.recover(result)
    name = title or result.problem.name
    output = Output(result, model, fields, name, warnings=result.warnings)
    return solve_page(output, Units.of(units))


@page_of.register
def _(result: Solutions, *, title: str = "", units: Any = None, model: Any = None,
      problem: Any = None) -> Page:  # fmt: skip
    if problem is not None and not isinstance(problem, FrictionProblem):
        problem, model = None, problem
    if problem is None and model is not None:
        problem = model.assemble()
    name = title or getattr(model or problem, "name", "") or "all solutions"
    return solutions_page(result, name, Units.of(units), problem, model)


@page_of.register
def _(result: Branch, *, title: str = "", units: Any = None, model: Any = None) -> Page:
    return curves_page([result], title or "solution curve", Units.of(units), model)


@page_of.register
def _(result: Diagram, *, title: str = "", units: Any = None, model: Any = None) -> Page:
    return curves_page(result.branches, title or "solution curves", Units.of(units), model,
                       result.reason)  # fmt: skip


@page_of.register
def _(result: Audit, *, title: str = "", units: Any = None) -> Page:
    return audit_page(result, title, Units.of(units))
