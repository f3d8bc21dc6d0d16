"""The API reference: a page for each public name, in groups, made from the docstrings."""

import inspect
import re
from pathlib import Path

import docstrings

import amontons

ENUM = re.compile(r"<(\w+\.\w+): [^<>]*>")  # as its repr has it
OPAQUE = re.compile(r" = (<[^<>]*>|\w+\([^()]*(\([^()]*\)[^()]*)*\))")  # no literals
PAGES = Path(__file__).parents[1] / "api"
GROUPS = {
    "Solve": (
        "The verb, what it takes and what it returns.",
        "solve drive FrictionProblem Form FrictionSolution ModelSolution ContactStatus "
        "Convergence Outcome Criterion Iterate ResultWarning DoubtWarning warn_of threads",
    ),
    "Models": (
        "Bodies on meshes, supports, loads and contacts.",
        "Model Body LinearElastic OrthotropicElastic NeoHookean CiarletGeymonat Rigid Fix "
        "Traction Pressure BodyForce NodalForce Temperature Contact ContactFields Nitsche "
        "Plane Sphere LevelSet distributed DistributedSolution",
    ),
    "Constraints": (
        "Linear constraints between nodes, surfaces and bodies; bolts and springs.",
        "Equation Coupling Reference Pretension opened Axes Spring",
    ),
    "Meshes": (
        "Meshes that are built in, read from files, or made from shapes.",
        "Mesh Cells Facets box ring mesh_shape read_mesh read_cad refined",
    ),
    "Friction laws": (
        "Laws of contact as values, one for all contacts or one each.",
        "Coulomb Tresca CappedCoulomb Cohesive Orthotropic Compliant Tied VaryingFriction "
        "FrictionCurve VaryingCompliance OverclosureCurve ExponentialOverclosure Mixed",
    ),
    "Questions": (
        "Is it the only solution, which others are there, and where do they go?",
        "uniqueness Uniqueness Verdict Witness critical_friction CriticalFriction "
        "p_matrix_friction full_contact_friction CriterionFriction existence Existence Opening "
        "all_solutions multistart Solutions LargeSolutions PieceSolution basins Basins "
        "BasinMethod BasinRun Claim",
    ),
    "Following": (
        "Solution curves over a load, over friction, or over a parameter of your own.",
        "follow Branch diagram Diagram first_order FirstOrder Tangent TangentCone "
        "Continuation Event EventKind Stop Switch IndexSets ContactRates PathProblem "
        "PathCrossing StepPath RateEquation ThetaMethod MidpointRule",
    ),
    "Evolution": (
        "Steps in time: quasi-static ones, and dynamics with impacts.",
        "evolve QuasiStatic MoreauJean TimeStep State Passage at_rest save_state load_state "
        "load_start export_fclib",
    ),
    "Files": ("What is read and written.", "read_case write_deck read_fclib write_fclib "
              "export_xdmf"),
    "Ready-made problems": (
        "Walls of blocks and packings of spheres.", "Wall Bond SpherePacking",
    ),
    "Solvers": (
        "`Auto` chooses; these are what it chooses from, and what you can choose yourself.",
        "Auto Hybrid GaussSeidel Jacobi ProximalPoint Uzawa AcceleratedGradient "
        "SemismoothNewton SmoothingNewton InexactNewton InteriorPoint NonlinearNewton "
        "FrictionlessInteriorPoint ActiveSet ContactMultigrid CompressedDelassus",
    ),
    "Parts of solvers": (
        "Options of the solvers that are more than numbers.",
        "AlartCurnier JeanMoreau NaturalMap FischerBurmeister FrictionFunction FullStep Armijo "
        "NonMonotone GoldsteinPrice RhoStrategy Batch LocalSolver SweepOrder Restart Metric "
        "ChangeNorm FrictionBound Modification InnerStart MultigridCycle CycleShape",
    ),
    "Linear solvers": (
        "How the stiffness is solved with.", "Direct GeometricMultigrid Petsc",
    ),
    "Comparing methods": (
        "Races of methods over many problems.", "performance_profile graded",
    ),
    "Errors": (
        "All are kinds of `AmontonsError`; each says what to do.",
        "AmontonsError InvalidInput FileFormatError UnsupportedForm UnsupportedLaw "
        "NotConverged Interrupted TimeUp InvertedCells SingularOperator MissingDependency "
        "NotWritten",
    ),
}  # fmt: skip


def groups() -> dict[str, tuple[str, list[str]]]:
    """Names by group; what no group has comes last, so that none is ever missing."""
    public = set(amontons.__all__)
    found = {
        title: (text, [name for name in names.split() if name in public])
        for title, (text, names) in GROUPS.items()
    }
    grouped = {name for _, names in found.values() for name in names}
    if rest := sorted(public - grouped):
        found["More"] = ("Other public names.", rest)
    return found


def page_of(name: str) -> str:
    """The page of one public name."""
    thing = getattr(amontons, name)
    kind = (
        "autoclass" if inspect.isclass(thing)
        else "autofunction" if inspect.isroutine(thing)
        else "autodata"
    )  # fmt: skip
    lines = [name, "=" * len(name), "", f".. {kind}:: amontons.{name}"]
    if kind == "autoclass":
        lines += ["   :members:"]
        if issubclass(thing, BaseException):
            lines += ["   :show-inheritance:"]
        else:
            lines += ["   :inherited-members: tuple, int, str, Enum, Protocol, Exception"]
    return "\n".join([*lines, ""])


def index() -> str:
    """The page of all groups."""
    lines = [
        "API reference", "=============", "",
        "All public names, imported by ``import amontons as am``. Everything else is an inner "
        "part and may change.", "",
    ]  # fmt: skip
    for title, (text, names) in groups().items():
        lines += [title, "-" * len(title), "", text, ""]
        lines += [".. autosummary::", "   :nosignatures:"]
        lines += ["", *(f"   amontons.{name}" for name in names), ""]
        lines += [".. toctree::", "   :hidden:", "", *(f"   names/{n}" for n in names), ""]
    return "\n".join(lines)


def write(app) -> None:
    """Write the pages that have changed."""
    pages = {PAGES / "index.rst": index()}
    for _, names in groups().values():
        pages |= {PAGES / "names" / f"{name}.rst": page_of(name) for name in names}
    for old in set(PAGES.rglob("*.rst")) - set(pages):
        old.unlink()
    for path, text in pages.items():
        path.parent.mkdir(parents=True, exist_ok=True)
        if not path.exists() or path.read_text() != text:
            path.write_text(text)


def resolve(app, env, node, contnode):
    """Let types in signatures lead to the page of the public name; others are words."""
    if node.get("refdomain") != "py":
        return None
    name = node.get("reftarget", "").rpartition(".")[2]
    if name in amontons.__all__:
        for domain_type in ("class", "function"):
            found = env.domains["py"].resolve_xref(
                env, node.get("refdoc"), app.builder, domain_type, f"amontons.{name}", node,
                contnode,
            )  # fmt: skip
            if found is not None:
                return found
    return contnode


def signature(app, what, name, obj, options, given, returned):
    """Parameters with their types as the code has them: names, not what they stand for."""
    if what not in ("class", "function", "method") or not callable(obj):
        return None
    try:
        found = inspect.signature(obj)
    except (TypeError, ValueError):
        return None
    parameters = [
        p.replace(annotation=p.empty) if not isinstance(p.annotation, str) else p
        for p in found.parameters.values()
    ]
    if what == "method" and parameters and parameters[0].name in ("self", "cls"):
        del parameters[0]
    words = str(found.replace(parameters=parameters, return_annotation=found.empty))
    for parameter in parameters:
        if isinstance(parameter.annotation, str):
            quoted = inspect.formatannotation(parameter.annotation)
            words = words.replace(f": {quoted}", f": {parameter.annotation}", 1)
    answer = found.return_annotation if isinstance(found.return_annotation, str) else ""
    words = OPAQUE.sub("", ENUM.sub(r"\1", words))
    return words, answer if what != "class" else None


def setup(app):
    """Write the pages before a build, and resolve what they name."""
    app.connect("builder-inited", write)
    app.connect("missing-reference", resolve)
    app.connect("autodoc-process-signature", signature)
    docstrings.setup(app)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
