"""Frictional contact mechanics: from a mesh, a case file or an FCLib problem to a solution.

Names load on first use, so that `amontons --help` and FCLib work never import a mesh library.
"""

from __future__ import annotations

import importlib
import sys
from types import ModuleType
from typing import Any

__version__ = "0.1.0"

_HOME = {
    "errors": ("AmontonsError", "FileFormatError", "Interrupted", "InvalidInput",
               "InvertedCells", "MissingDependency", "NotConverged", "NotWritten",
               "SingularOperator", "TimeUp", "UnsupportedForm"),
    "cones": ("Coulomb", "Tresca"),
    "judge": ("Criterion",),
    "linear": ("AlgebraicMultigrid", "ConjugateGradient", "Direct", "GeometricMultigrid",
               "Petsc"),
    "problem": ("Form", "FrictionProblem"),
    "solution": ("ContactStatus", "Convergence", "FrictionSolution", "Outcome"),
    "solvers": ("AcceleratedGradient", "ActiveSet", "AlartCurnier", "Armijo", "Auto",
                "Batch", "ChangeNorm", "CompressedDelassus", "ContactMultigrid",
                "CycleShape", "FischerBurmeister", "FrictionBound", "FrictionFunction",
                "FullStep", "GaussSeidel", "GoldsteinPrice", "Hybrid", "InexactNewton",
                "InnerStart", "InteriorPoint", "Iterate", "Jacobi", "JeanMoreau",
                "LocalSolver", "Metric", "Modification", "MultigridCycle", "NaturalMap",
                "NonMonotone", "ProximalPoint", "Restart", "RhoStrategy",
                "SemismoothNewton", "SmoothingNewton", "SweepOrder", "Uzawa"),
    "solvers.nonlinear_newton": ("NonlinearNewton",),
    "analysis.paths.path_crossing": ("PathCrossing",),
    "solve": ("drive",),
    "fclib": ("read_fclib", "write_fclib"),
    "masonry": ("Bond", "Wall"),
    "granular": ("SpherePacking",),
    "evolution": ("MoreauJean", "Passage", "QuasiStatic", "State", "TimeStep", "at_rest",
                  "evolve"),
    "checkpoint": ("export_fclib", "load_start", "load_state", "save_state"),
    "case": ("read_case",),
    "results": ("ModelSolution",),
    "warned": ("ResultWarning",),
    "api": ("all_solutions", "basins", "critical_friction", "diagram", "existence",
            "first_order", "follow", "full_contact_friction", "multistart",
            "p_matrix_friction", "solve", "uniqueness"),
    "analysis": ("BasinMethod", "BasinRun", "Basins", "Branch", "Claim", "ContactRates",
                 "Continuation", "CriterionFriction", "CriticalFriction", "Diagram", "Event",
                 "EventKind",
                 "Existence", "FirstOrder", "IndexSets", "MidpointRule", "Opening",
                 "PathProblem", "PieceSolution", "RateEquation", "Solutions", "StepPath",
                 "Stop", "Switch", "Tangent", "TangentCone", "ThetaMethod", "Uniqueness",
                 "Verdict", "Witness", "graded", "performance_profile"),
    "fem": ("Cells", "Facets", "Mesh", "box", "mesh_shape", "read_cad", "read_mesh",
            "refined"),
    "contact": ("LevelSet", "Nitsche", "Plane", "Sphere"),
    "model": ("Body", "BodyForce", "CiarletGeymonat", "Contact", "ContactFields", "Fix",
              "LinearElastic", "Model", "NeoHookean", "Pressure", "Rigid", "Traction",
              "distributed"),
}  # fmt: skip
_MODULE = {name: module for module, names in _HOME.items() for name in names}

__all__ = sorted(_MODULE)


class _Package(ModuleType):
    """Keeps `amontons.solve` the verb, also when the module of that name is imported."""

    def __setattr__(self, name: str, value: Any) -> None:
        if not (name in _MODULE and isinstance(value, ModuleType)):
            super().__setattr__(name, value)


sys.modules[__name__].__class__ = _Package


def __getattr__(name: str) -> Any:
    if name in _MODULE:
        return getattr(importlib.import_module(f".{_MODULE[name]}", __name__), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted([*globals(), *__all__])
