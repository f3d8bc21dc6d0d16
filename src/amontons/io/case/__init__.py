"""Case files: a model and its solver settings as TOML.

Values are data: numbers, or expressions of `amontons.expressions`.  Unknown keys are errors.
"""

from ..readers import Case
from .build import DATA, example_file, read_case
from .identity import SOLVER, differences, identity
from .settings import Settings, make_solver, method_class

__all__ = ["DATA", "SOLVER", "Case", "Settings", "differences", "example_file", "identity",
           "make_solver", "method_class", "read_case"]  # fmt: skip
