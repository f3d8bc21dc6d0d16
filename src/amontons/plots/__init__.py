"""Figures: of one solution, of several, of convergence, of steps in time, of many methods."""

from .several import solutions_figure
from .solution import COLOURS, convergence_figure, profile_figure, status_figure
from .steps import SI, Frame, Units, draw_film, energy_figure, series_figure, step_figure

__all__ = [
    "COLOURS",
    "SI",
    "Frame",
    "Units",
    "convergence_figure",
    "draw_film",
    "energy_figure",
    "profile_figure",
    "series_figure",
    "solutions_figure",
    "status_figure",
    "step_figure",
]
