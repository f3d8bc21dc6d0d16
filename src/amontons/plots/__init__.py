"""Figures: of one solution, of a method's convergence, of steps in time, of many methods."""

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
    "status_figure",
    "step_figure",
]
