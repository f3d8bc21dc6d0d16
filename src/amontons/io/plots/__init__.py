"""Figures: of one solution, of several, of convergence, of steps in time, of many methods.

Names load on first use: a picture costs the import of what is drawn in it, not of all others.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .basins import basins_figure
    from .branch import branch_figure, draw_branch
    from .camera import Camera
    from .convergence import convergence_figure
    from .energies import energy_figure
    from .profiles import profile_figure
    from .saving import picture, save_figure
    from .scene import Frame
    from .several import solutions_figure
    from .solution import status_figure
    from .steps import draw_film, series_figure, step_figure
    from .style import COLOURS, SI, Units

_HOME = {
    "basins": ("basins_figure",),
    "branch": ("branch_figure", "draw_branch"),
    "camera": ("Camera",),
    "convergence": ("convergence_figure",),
    "energies": ("energy_figure",),
    "profiles": ("profile_figure",),
    "saving": ("picture", "save_figure"),
    "scene": ("Frame",),
    "several": ("solutions_figure",),
    "solution": ("status_figure",),
    "steps": ("draw_film", "series_figure", "step_figure"),
    "style": ("COLOURS", "SI", "Units"),
}
_MODULE = {name: module for module, names in _HOME.items() for name in names}

__all__ = [
    "COLOURS",
    "SI",
    "Camera",
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


def __getattr__(name: str) -> Any:
    if name in _MODULE:
        return getattr(importlib.import_module(f".{_MODULE[name]}", __name__), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
