"""Case files: a model and its solver settings as TOML.

Values are data: numbers, or expressions of `amontons.expressions`.  Unknown keys are errors.
"""

from .blame import key_of
from .build import DATA, Case, example_file, read_case
from .identity import SOLVER, differences, identity
from .settings import Settings, in_words, make_solver, method_class

__all__ = ["DATA", "SOLVER", "Case", "Settings", "differences", "example_file", "identity",
           "in_words", "key_of", "make_solver", "method_class", "read_case"]  # fmt: skip
