"""Frictional contact mechanics: from a mesh, a case file or an FCLib problem to a solution.

Names load on first use, so that `amontons --help` and FCLib work never import a mesh library.
"""

from __future__ import annotations

import importlib
from typing import Any

__version__ = "0.1.0"

_HOME = {
    "errors": ("AmontonsError", "FileFormatError", "Interrupted", "InvalidInput",
               "MissingDependency", "NotConverged", "SingularOperator", "UnsupportedForm"),
    "cones": ("Coulomb", "Tresca"),
    "linear": ("AlgebraicMultigrid", "ConjugateGradient", "Direct"),
    "problem": ("Form", "FrictionProblem"),
    "solution": ("ContactStatus", "Convergence", "FrictionSolution", "Outcome"),
    "solvers": ("GaussSeidel",),
    "solve": ("drive",),
    "fclib": ("read_fclib", "write_fclib"),
    "fem": ("Mesh", "box", "read_mesh"),
    "contact": ("LevelSet", "Plane", "Sphere"),
    "model": ("Body", "BodyForce", "Contact", "ContactFields", "Fix", "LinearElastic", "Model",
              "Traction"),
}  # fmt: skip
_MODULE = {name: module for module, names in _HOME.items() for name in names}

__all__ = sorted(_MODULE)


def __getattr__(name: str) -> Any:
    if name in _MODULE:
        return getattr(importlib.import_module(f".{_MODULE[name]}", __name__), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted([*globals(), *__all__])
