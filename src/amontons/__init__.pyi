"""The public names for type checkers and editors; `__init__.py` loads them on first use."""

from .analysis import (
    BasinMethod as BasinMethod, BasinRun as BasinRun, Basins as Basins, Branch as Branch,
    Claim as Claim, ContactRates as ContactRates, Continuation as Continuation,
    CriterionFriction as CriterionFriction, CriticalFriction as CriticalFriction,
    Diagram as Diagram, Event as Event, EventKind as EventKind, Existence as Existence,
    FirstOrder as FirstOrder, IndexSets as IndexSets, LargeSolutions as LargeSolutions,
    MidpointRule as MidpointRule, Opening as Opening, PathProblem as PathProblem,
    PieceSolution as PieceSolution, RateEquation as RateEquation, Solutions as Solutions,
    StepPath as StepPath, Stop as Stop, Switch as Switch, Tangent as Tangent,
    TangentCone as TangentCone, ThetaMethod as ThetaMethod, Uniqueness as Uniqueness,
    Verdict as Verdict, Witness as Witness, graded as graded,
    performance_profile as performance_profile,
)
from .analysis.audit.verdict import Audit as Audit
from .analysis.gradients.gradient import (
    Derivative as Derivative, Gradient as Gradient, OneSided as OneSided,
)
from .analysis.gradients.model_gradient import (
    ModelDerivative as ModelDerivative, ModelGradient as ModelGradient,
)
from .analysis.gradients.steps import (
    EvolutionGradient as EvolutionGradient, evolution_gradient as evolution_gradient,
)
from .analysis.gradients.with_jax import jax_function as jax_function
from .analysis.gradients.with_torch import torch_function as torch_function
from .analysis.paths.path_crossing import PathCrossing as PathCrossing
from .analysis.solutions.second_start import (
    Other as Other, Others as Others, maybe_others as maybe_others,
)
from .app.api import solve as solve
from .app.audit import audit as audit
from .analysis.stability.coalescence import Flutter as Flutter
from .analysis.stability.modes import Modes as Modes
from .app.stability import modes as modes
from .analysis.limits.collapse import Collapse as Collapse
from .analysis.limits.jamming import Jamming as Jamming
from .app.limits import collapse_load as collapse_load, jamming_friction as jamming_friction
from .app.model_solution import ModelSolution as ModelSolution
from .app.questions import (
    all_solutions as all_solutions, basins as basins, critical_friction as critical_friction,
    diagram as diagram, existence as existence, first_order as first_order, follow as follow,
    full_contact_friction as full_contact_friction, multistart as multistart,
    p_matrix_friction as p_matrix_friction, uniqueness as uniqueness,
)
from .analysis.certificates.rates import Rates as Rates, RateVerdict as RateVerdict
from .analysis.certificates.rates import rates as rates
from .core.errors import (
    AmontonsError as AmontonsError, FileFormatError as FileFormatError,
    Interrupted as Interrupted, InvalidInput as InvalidInput, InvertedCells as InvertedCells,
    MissingDependency as MissingDependency, NotConverged as NotConverged,
    NotWritten as NotWritten, SingularOperator as SingularOperator, TimeUp as TimeUp,
    UnsupportedForm as UnsupportedForm, UnsupportedLaw as UnsupportedLaw,
)
from .core.threads import threads as threads
from .core.warned import (
    DoubtWarning as DoubtWarning, ResultWarning as ResultWarning, warn_of as warn_of,
)
from .io.certificates import (
    check_certificate as check_certificate, write_certificate as write_certificate,
)
from .io.checkpoint import (
    export_fclib as export_fclib, load_start as load_start, load_state as load_state,
    save_state as save_state,
)
from .io.decks.written import write_deck as write_deck
from .io.fclib import read_fclib as read_fclib, write_fclib as write_fclib
from .io.matrices import StoredMatrices as StoredMatrices, read_matrices as read_matrices
from .io.meshes import read_mesh as read_mesh
from .io.readers import read_case as read_case
from .io.rigid_bodies import export_rigid as export_rigid
from .io.rigid_bodies import write_rigid as write_rigid
from .io.plots.film import film as film
from .io.series import export_xdmf as export_xdmf
from .linear import Direct as Direct, GeometricMultigrid as GeometricMultigrid, Petsc as Petsc
from .mechanics.contact import (
    Cylinder as Cylinder, Extrusion as Extrusion, LevelSet as LevelSet, Nitsche as Nitsche,
    Plane as Plane, Profile as Profile, Revolution as Revolution, Sphere as Sphere,
)
from .mechanics.meshes import (
    Cells as Cells, Facets as Facets, Mesh as Mesh, box as box, mesh_shape as mesh_shape,
    opened as opened, read_cad as read_cad, refined as refined, ring as ring,
)
from .mechanics.model import (
    Axes as Axes, Body as Body, BodyForce as BodyForce, CiarletGeymonat as CiarletGeymonat,
    Contact as Contact, ContactFields as ContactFields, Coupling as Coupling,
    ElastoPlastic as ElastoPlastic, Equation as Equation, Fix as Fix,
    LinearElastic as LinearElastic, Model as Model,
    MooneyRivlin as MooneyRivlin, NeoHookean as NeoHookean, NodalForce as NodalForce,
    Ogden as Ogden, SaintVenantKirchhoff as SaintVenantKirchhoff, UserEnergy as UserEnergy,
    OrthotropicElastic as OrthotropicElastic, Pressure as Pressure,
    Pretension as Pretension, ReducedPolynomial as ReducedPolynomial,
    Reference as Reference, Rigid as Rigid, Spring as Spring,
    Temperature as Temperature, Traction as Traction, distributed as distributed,
    DistributedSolution as DistributedSolution,
    FoundContacts as FoundContacts, FoundPair as FoundPair, find_contacts as find_contacts,
    mean_tractions as mean_tractions,
)
from .mechanics.ready.packings import SpherePacking as SpherePacking
from .mechanics.multibody import (
    Ball as Ball, Joint as Joint, Polyhedron as Polyhedron, RigidBodies as RigidBodies,
    RigidBody as RigidBody, RigidState as RigidState, RigidStep as RigidStep,
    cuboid as cuboid, evolve_rigid as evolve_rigid,
)
from .mechanics.ready.walls import Bond as Bond, Wall as Wall
from .mechanics.steps import (
    MoreauJean as MoreauJean, Passage as Passage, QuasiStatic as QuasiStatic, State as State,
    TimeStep as TimeStep, at_rest as at_rest, evolve as evolve,
)
from .problem.friction import Form as Form, FrictionProblem as FrictionProblem
from .problem.judge.measures import Criterion as Criterion
from .problem.law import (
    CappedCoulomb as CappedCoulomb, Cohesive as Cohesive, Compliant as Compliant,
    Coulomb as Coulomb, Mixed as Mixed,
    Orthotropic as Orthotropic, Tied as Tied, Tresca as Tresca,
    FrictionCurve as FrictionCurve, VaryingFriction as VaryingFriction,
    ExponentialOverclosure as ExponentialOverclosure, OverclosureCurve as OverclosureCurve,
    RollingFriction as RollingFriction, VaryingCompliance as VaryingCompliance,
)
from .problem.rolling import Regimes as Regimes, RollingProblem as RollingProblem
from .problem.solution import (
    ContactStatus as ContactStatus, Convergence as Convergence,
    FrictionSolution as FrictionSolution, Outcome as Outcome,
)
from .solvers import (
    AcceleratedGradient as AcceleratedGradient, ActiveSet as ActiveSet,
    AlartCurnier as AlartCurnier, Armijo as Armijo, Auto as Auto, Batch as Batch,
    ChangeNorm as ChangeNorm, CompressedDelassus as CompressedDelassus,
    ContactMultigrid as ContactMultigrid, CycleShape as CycleShape,
    FischerBurmeister as FischerBurmeister, FrictionBound as FrictionBound,
    FrictionFunction as FrictionFunction,
    FrictionlessInteriorPoint as FrictionlessInteriorPoint,
    FullStep as FullStep, GaussSeidel as GaussSeidel,
    GoldsteinPrice as GoldsteinPrice, Hybrid as Hybrid, InexactNewton as InexactNewton,
    InnerStart as InnerStart, InteriorPoint as InteriorPoint, Iterate as Iterate,
    Jacobi as Jacobi, JeanMoreau as JeanMoreau, LocalSolver as LocalSolver, Metric as Metric,
    Modification as Modification, MultigridCycle as MultigridCycle, NaturalMap as NaturalMap,
    NonMonotone as NonMonotone, ProximalPoint as ProximalPoint, Restart as Restart,
    RhoStrategy as RhoStrategy, RollingSweeps as RollingSweeps,
    SemismoothNewton as SemismoothNewton,
    SmoothingNewton as SmoothingNewton, SweepOrder as SweepOrder, Uzawa as Uzawa,
)
from .solvers.driver import drive as drive
from .solvers.many import solve_many as solve_many
from .solvers.newton.nonlinear import NonlinearNewton as NonlinearNewton

__version__: str
