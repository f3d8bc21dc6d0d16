"""Figures: of one solution, of several, of convergence, of steps in time, of many methods."""

from .basins import basins_figure
from .branch import branch_figure, draw_branch
from .convergence import convergence_figure
from .energies import energy_figure
from .profiles import profile_figure
from .saving import picture, save_figure
from .scene import Frame
from .several import solutions_figure
from .solution import status_figure
from .steps import draw_film, series_figure, step_figure
from .style import COLOURS, SI, Units

__all__ = [
    "COLOURS",
    "SI",
    "Frame",
    "Units",
    "basins_figure",
    "branch_figure",
    "convergence_figure",
    "draw_branch",
    "draw_film",
    "energy_figure",
    "picture",
    "profile_figure",
    "save_figure",
    "series_figure",
    "solutions_figure",
    "status_figure",
    "step_figure",
]
