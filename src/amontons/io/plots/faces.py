"""What results look like, by their class: a new face of a class is registered here.

`core.faces.Shown` has the methods that users call.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from functools import singledispatch
from typing import Any

from matplotlib.figure import Figure

from ...analysis.audit import Audit
from ...analysis.basins.study import Basins
from ...analysis.paths.diagram import Diagram
from ...analysis.paths.path import Branch
from ...analysis.solutions.enumerate import Solutions
from ...analysis.stability.modes import Modes
from ...core.errors import InvalidInput, shown
from ...mechanics.steps import TimeStep
from ...problem.solution import Convergence, FrictionSolution
from ..results import Output, expect_picture
from .audit import audit_figure
from .basins import basins_figure
from .branch import branch_figure
from .convergence import convergence_figure
from .modes import modes_figure
from .saving import save_figure
from .scene import Frame, Scene, magnification
from .several import all_solutions_figure
from .solution import status_figure
from .steps import series_figure, step_figure


def plot(result: Any, path: str | os.PathLike[str] | None = None, **options: Any) -> Figure:
    """The figure of a result, written too where a path is given."""
    if path is not None:
        expect_picture(path)
    figure = figure_of(result, **options)
    if path is not None:
        save_figure(figure, path)
    return figure


@singledispatch
def figure_of(result: Any, **options: Any) -> Figure:
    """The figure of a result; raises TypeError for what has none."""
    raise TypeError(f"{type(result).__name__} has no figure")


@figure_of.register
def _(result: FrictionSolution, **options: Any) -> Figure:
    return status_figure(result, **options)


@figure_of.register
def _(result: Convergence, **options: Any) -> Figure:
    return convergence_figure(result, **options)


@figure_of.register
def _(result: Branch, **options: Any) -> Figure:
    return branch_figure(result, **options)


@figure_of.register
def _(result: Diagram, **options: Any) -> Figure:
    return branch_figure(result.branches, **options)


@figure_of.register
def _(result: Solutions, **options: Any) -> Figure:
    return all_solutions_figure(result, **options)


@figure_of.register
def _(result: Output, *, title: str = "") -> Figure:
    return status_figure(result.solution, result.fields, title or result.title, result.model)


@figure_of.register
def _(result: TimeStep, **options: Any) -> Figure:
    frame, scene = Frame.of(result), Scene.of(result.model)
    options.setdefault("magnify", magnification(scene, [frame]))
    return step_figure(scene, frame, **options)


@figure_of.register(list)
@figure_of.register(tuple)
def _(result: Sequence[TimeStep], **options: Any) -> Figure:
    """Several steps side by side."""
    if not result or not all(isinstance(step, TimeStep) for step in result):
        raise InvalidInput(f"plot: expected steps in time, got {shown(result)}")
    frames = [Frame.of(step) for step in result]
    return series_figure(result[0].model, frames, **options)


@figure_of.register
def _(result: Basins, **options: Any) -> Figure:
    return basins_figure(result, **options)


@figure_of.register
def _(result: Modes, **options: Any) -> Figure:
    return modes_figure(result, **options)


@figure_of.register
def _(result: Audit, **options: Any) -> Figure:
    return audit_figure(result, **options)
