"""Frictional contact mechanics: from a mesh, a case file or an FCLib problem to a solution.

Names load on first use, so that `amontons --help` and FCLib work never import a mesh library.
"""

from __future__ import annotations

import importlib
from typing import Any

__version__ = "0.1.0"

_HOME = {
    "core.errors": ("AmontonsError", "FileFormatError", "Interrupted", "InvalidInput",
                    "InvertedCells", "MissingDependency", "NotConverged", "NotWritten",
                    "SingularOperator", "TimeUp", "UnsupportedForm", "UnsupportedLaw"),
    "core.threads": ("threads",),
    "problem.law": ("CappedCoulomb", "Cohesive", "Compliant", "Coulomb", "Mixed", "Orthotropic",
                    "ExponentialOverclosure", "FrictionCurve", "OverclosureCurve",
                    "RollingFriction", "Tied", "Tresca", "VaryingCompliance",
                    "VaryingFriction"),
    "problem.judge.measures": ("Criterion",),
    "linear": ("Direct", "GeometricMultigrid", "Petsc"),
    "problem.friction": ("Form", "FrictionProblem"),
    "problem.rolling": ("Regimes", "RollingProblem"),
    "problem.solution": ("ContactStatus", "Convergence", "FrictionSolution", "Outcome"),
    "solvers": ("AcceleratedGradient", "ActiveSet", "AlartCurnier", "Armijo", "Auto", "Batch",
                "ChangeNorm", "CompressedDelassus", "ContactMultigrid", "CycleShape",
                "FischerBurmeister", "FrictionBound", "FrictionFunction",
                "FrictionlessInteriorPoint", "FullStep", "GaussSeidel", "GoldsteinPrice",
                "Hybrid", "InexactNewton", "InnerStart", "InteriorPoint", "Iterate",
                "Jacobi", "JeanMoreau", "LocalSolver", "Metric",
                "Modification", "MultigridCycle", "NaturalMap", "NonMonotone", "ProximalPoint",
                "Restart", "RhoStrategy", "RollingSweeps", "SemismoothNewton",
                "SmoothingNewton", "SweepOrder", "Uzawa"),
    "solvers.newton.nonlinear": ("NonlinearNewton",),
    "analysis.paths.path_crossing": ("PathCrossing",),
    "analysis.gradients.gradient": ("Derivative", "Gradient", "OneSided"),
    "analysis.gradients.model_gradient": ("ModelDerivative", "ModelGradient"),
    "analysis.gradients.steps": ("EvolutionGradient", "evolution_gradient"),
    "analysis.gradients.with_jax": ("jax_function",),
    "analysis.gradients.with_torch": ("torch_function",),
    "solvers.driver": ("drive",),
    "solvers.many": ("solve_many",),
    "analysis.certificates.rates": ("RateVerdict", "Rates", "rates"),
    "analysis.solutions.second_start": ("Other", "Others", "maybe_others"),
    "io.decks.written": ("write_deck",),
    "io.certificates": ("check_certificate", "write_certificate"),
    "io.fclib": ("read_fclib", "write_fclib"),
    "mechanics.multibody": ("Ball", "Joint", "Polyhedron", "RigidBodies", "RigidBody",
                            "RigidState", "RigidStep", "cuboid", "evolve_rigid"),
    "mechanics.ready.walls": ("Bond", "Wall"),
    "mechanics.ready.packings": ("SpherePacking",),
    "mechanics.steps": ("MoreauJean", "Passage", "QuasiStatic", "State", "TimeStep", "at_rest",
                        "evolve"),
    "io.checkpoint": ("export_fclib", "load_start", "load_state", "save_state"),
    "io.readers": ("read_case",),
    "io.rigid_bodies": ("export_rigid", "write_rigid"),
    "io.series": ("export_xdmf",),
    "io.plots.film": ("film",),
    "app.model_solution": ("ModelSolution",),
    "core.warned": ("DoubtWarning", "ResultWarning", "warn_of"),
    "app.api": ("solve",),
    "app.audit": ("audit",),
    "analysis.audit.verdict": ("Audit",),
    "app.stability": ("modes",),
    "analysis.stability.modes": ("Modes",),
    "analysis.stability.coalescence": ("Flutter",),
    "app.limits": ("collapse_load", "jamming_friction"),
    "analysis.limits.collapse": ("Collapse",),
    "analysis.limits.jamming": ("Jamming",),
    "app.questions": ("all_solutions", "basins", "critical_friction", "diagram", "existence",
                      "first_order", "follow", "full_contact_friction", "multistart",
                      "p_matrix_friction", "uniqueness"),
    "analysis": ("BasinMethod", "BasinRun", "Basins", "Branch", "Claim", "ContactRates",
                 "Continuation", "CriterionFriction", "CriticalFriction", "Diagram", "Event",
                 "EventKind", "Existence", "FirstOrder", "IndexSets", "LargeSolutions",
                 "MidpointRule", "Opening", "PathProblem", "PieceSolution", "RateEquation",
                 "Solutions", "StepPath", "Stop", "Switch", "Tangent", "TangentCone",
                 "ThetaMethod", "Uniqueness", "Verdict", "Witness", "graded",
                 "performance_profile"),
    "mechanics.meshes": ("Cells", "Facets", "Mesh", "box", "mesh_shape", "opened",
                         "read_cad", "refined", "ring"),
    "io.matrices": ("StoredMatrices", "read_matrices"),
    "io.meshes": ("read_mesh",),
    "mechanics.contact": ("Cylinder", "Extrusion", "LevelSet", "Nitsche", "Plane", "Profile",
                          "Revolution", "Sphere"),
    "mechanics.model": ("Axes", "Body", "BodyForce", "CiarletGeymonat", "Contact",
                        "ContactFields", "Coupling", "DistributedSolution", "ElastoPlastic",
                        "Equation", "Fix", "FoundContacts", "FoundPair", "LinearElastic",
                        "Model",
                        "MooneyRivlin", "NeoHookean", "NodalForce", "Ogden",
                        "OrthotropicElastic", "Pressure", "Pretension", "ReducedPolynomial",
                        "Reference", "Rigid",
                        "SaintVenantKirchhoff", "Spring", "Temperature", "Traction",
                        "UserEnergy", "distributed", "find_contacts", "mean_tractions"),
}  # fmt: skip
_GONE = {
    "AlgebraicMultigrid": "GeometricMultigrid(levels=()), whose levels are then algebraic ones",
    "ConjugateGradient": "GeometricMultigrid(levels=()): conjugate gradients with algebraic "
    "levels, in a third of the time",
}
_MODULE = {name: module for module, names in _HOME.items() for name in names}

__all__ = sorted(_MODULE)


def __getattr__(name: str) -> Any:
    if name in _MODULE:
        value = getattr(importlib.import_module(f".{_MODULE[name]}", __name__), name)
        globals()[name] = value  # found at once from now on
        return value
    if name in _GONE:
        from .core.errors import InvalidInput

        raise InvalidInput(f"{name}: no longer there, use {_GONE[name]}")
    from .core.words import near

    meant = None if name.startswith("_") else near(name, __all__)
    hint = f"; did you mean {meant!r}?" if meant else ""
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}{hint}")


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
