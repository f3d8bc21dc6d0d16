"""Figures: of one solution, of several, of convergence, of steps in time, of many methods."""

from .branch import branch_figure, draw_branch
from .several import solutions_figure
from .solution import COLOURS, convergence_figure, profile_figure, status_figure
from .steps import SI, Frame, Units, draw_film, energy_figure, series_figure, step_figure

__all__ = [
    "COLOURS",
    "SI",
    "Frame",
    "Units",
    "branch_figure",
    "convergence_figure",
    "draw_branch",
    "draw_film",
    "energy_figure",
    "profile_figure",
    "series_figure",
    "solutions_figure",
    "status_figure",
    "step_figure",
]
