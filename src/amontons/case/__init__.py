"""Case files: a model and its solver settings as TOML.

Values are data: numbers, or expressions of `amontons.expressions`.  Unknown keys are errors.
"""

from .build import Case, read_case
from .settings import Settings, make_solver, method_class

__all__ = ["Case", "Settings", "make_solver", "method_class", "read_case"]
