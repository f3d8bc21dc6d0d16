"""Questions about problems and solvers; sees discrete problems only."""

from .profiles import performance_profile

__all__ = ["performance_profile"]
