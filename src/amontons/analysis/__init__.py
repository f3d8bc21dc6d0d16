"""Questions about problems and solvers; sees discrete problems only."""

from .enumerate import PieceSolution, Solutions
from .profiles import performance_profile

__all__ = ["PieceSolution", "Solutions", "performance_profile"]
