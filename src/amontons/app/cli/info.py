"""`amontons info`: what a problem is, and which methods fit it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ...analysis.certificates.opening import opening
from ...core.clock import Deadline, check_seconds, deadline_of
from ...core.errors import InvalidInput, SingularOperator, TimeUp
from ...io.results import to_json
from ...linear.dense import dense
from ...linear.rank import matrix_rank, semidefinite_rank
from ...problem.friction import Form, FrictionProblem
from ...problem.indefinite import negative_direction
from ...problem.law import Law
from ...problem.nitsche import NitscheProblem
from ...problem.protocol import Problem
from ...solvers import METHODS
from ...solvers.contract import taken_by
from .info_mesh import FIGURES, assembly, draw, is_mesh
from .info_mesh import run as run_mesh
from .sources import open_source
from .terminal import check_writable, deliver_json, say_notes, show_table

if TYPE_CHECKING:
    from ...mechanics.model import Model
    from ...mechanics.model.large_deformation import LargeDeformation

RANK_LIMIT = 2000  # rows of W up to which its singular values are computed
SECONDS = 20.0  # whose work ranks and existence may take without a time limit
RANKS = 0.5  # part of it that the ranks may take


def run(
    source: str, overrides: Sequence[str], json_copy: str | None,
    time_limit: float | None = None, picture: str | None = None, size: float | None = None,
    no_glue: bool = False,
) -> None:  # fmt: skip
    """Print the table, or the JSON, and draw all bodies; of a mesh or CAD file its surfaces."""
    if is_mesh(source):
        run_mesh(source, size, picture, json_copy, glue=not no_glue)
        return
    for name, given in {"--size": size is not None, "--no-glue": no_glue}.items():
        if given:
            raise InvalidInput(f"{name}: only for CAD files, which are meshed on reading")
    check_writable(json_copy, "--json")
    check_writable(picture, "--picture", FIGURES)
    if time_limit is not None:
        check_seconds(time_limit)
    opened = open_source(source, overrides)
    if picture is not None and not opened.has_model:
        raise InvalidInput(f"--picture: {source} has no bodies whose surfaces it could show")
    problem = opened.solvable()
    facts = {"name": opened.name, **describe(problem)}
    if opened.has_model:
        facts["elements"] = _elements(opened.model)
    if isinstance(problem, FrictionProblem) and problem.contacts:
        deadline = deadline_of(time_limit, SECONDS)
        facts |= _ranks(problem.assembled(), deadline.share(RANKS))
        facts["existence"] = _existence(problem.assembled(), deadline)
    if json_copy != "-":
        show_table(opened.title, ["", ""], [[k, _text(v)] for k, v in facts.items()], "left")
        say_notes(opened.notes)
    if picture is not None:
        draw(assembly(opened.model.bodies), picture)
    if json_copy is not None:
        told = {"notes": list(opened.notes)} if opened.notes else {}
        deliver_json(to_json(facts | told), json_copy)


def describe(problem: Any) -> dict[str, Any]:
    """Facts about a problem by name; W is looked at only where it is cheap to form."""
    if isinstance(problem, NitscheProblem):
        return _describe_nitsche(problem)
    if not isinstance(problem, FrictionProblem):
        return _describe_large(problem)
    problem = problem.assembled()
    facts: dict[str, Any] = {
        "form": problem.form.value, "dimension": problem.dimension,
        "contacts": problem.contacts, "unknowns": problem.unknowns,
    }  # fmt: skip
    if problem.form is Form.GLOBAL:
        assert problem.M is not None and problem.H is not None
        facts |= {"entries of M": problem.M.nnz, "entries of H": problem.H.nnz,
                  "asymmetry of M": _asymmetry(problem.M)}  # fmt: skip
    facts |= _law_facts(problem.law)
    facts |= _delassus_facts(problem)
    facts |= _sign(problem)
    if problem.contacts:
        facts["scales (a guess)"] = _scales(problem)
    facts["methods that fit"] = fitting_methods(problem)
    return facts


def _elements(model: Model) -> list[str]:
    """How many cells there are of each kind and integration of the stiffness, in words."""
    found: Counter[str] = Counter()
    for body in model.bodies:
        for block in body.mesh.cells:
            modes = block.integration == "incompatible"
            how = "incompatible modes" if modes else f"{block.integration} integration"
            found[f"{block.kind} ({how})"] += len(block.nodes)
    return [f"{count} {kind}" for kind, count in found.items()]


def _law_facts(law: Law) -> dict[str, list[float]]:
    """Smallest and largest of each number of the law."""
    if not len(law):
        return {}
    return {name: [float(x.min()), float(x.max())] for name, x in law.facts.items()}


def _ranks(problem: FrictionProblem, deadline: Deadline) -> dict[str, Any]:
    """Rank of H, or of a W that is too large for singular values, and hyperstaticity.

    The degree of hyperstaticity is the number of independent reactions r with H r = 0, which
    hold each other: d nc - rank.
    """
    name = "H" if problem.form is Form.GLOBAL else "W"
    matrix = problem.H if problem.form is Form.GLOBAL else problem.W
    assert matrix is not None
    columns = matrix.shape[1]
    try:
        if name == "H":
            assert not isinstance(matrix, np.ndarray)  # H is stored with its zeros left out
            rank = matrix_rank(matrix, deadline)
        else:
            rank = semidefinite_rank(matrix, deadline)
    except (TimeUp, InvalidInput) as error:
        return {f"rank of {name}": f"not computed: {error}"}
    found: dict[str, Any] = {}
    if name == "H" or columns > RANK_LIMIT:
        found[f"rank of {name}"] = str(rank)
    return found | {"degree of hyperstaticity": columns - rank.value}


def _existence(problem: FrictionProblem, deadline: Deadline) -> dict[str, Any]:
    """The verdict of `opening`; v and r are its certificates."""
    found = opening(problem, time_limit=deadline)
    facts = {"verdict": found.verdict.value, "meaning": found.verdict.meaning,
             "reason": found.reason, "margin": found.margin, "residual": found.residual,
             "work": found.work}  # fmt: skip
    return facts | {
        name: None if value is None else value.tolist()
        for name, value in (("v", found.v), ("r", found.r))
    }


def _describe_nitsche(problem: NitscheProblem) -> dict[str, Any]:
    """The facts that a problem without reactions has."""
    m = problem.matrices
    ends = (m.kappa, m.kappa / m.stiffness)
    kappa, safety = ([float(x.min()), float(x.max())] for x in ends)
    return {
        "form": problem.form.value, "dimension": problem.dimension,
        "contacts": problem.contacts, "unknowns": problem.unknowns, "entries of M": m.M.nnz,
        **_law_facts(problem.law), "kappa": kappa, "kappa / stiffness of the cells": safety,
        "methods that fit": _solving(NitscheProblem),
    }  # fmt: skip


def _describe_large(problem: LargeDeformation) -> dict[str, Any]:
    """The facts that a nonlinear problem has."""
    stiffness = [float(problem.rho.min()), float(problem.rho.max())]
    return {
        "form": "large deformation", "dimension": problem.dimension,
        "contacts": problem.contacts, "unknowns": problem.unknowns,
        "entries of the tangent": problem.parts.taken.nnz, **_law_facts(problem.law),
        "stiffness at contacts": stiffness, "methods that fit": _solving(type(problem)),
    }  # fmt: skip


def _solving(kind: type[Problem]) -> list[str]:
    """Names of the methods for a type of problem."""
    return [name for name, known in METHODS.items() if issubclass(kind, taken_by(known).solves)]


def _delassus_facts(problem: FrictionProblem) -> dict[str, Any]:
    """Density, asymmetry and rank of W."""
    if not problem.contacts:
        return {}
    try:
        if not problem.condensing_is_cheap:
            return {"W": "not formed, too large"}
        local = problem.condensed()
    except SingularOperator:
        return {"W": "none, contact alone holds a body"}
    except InvalidInput as reason:
        return {"W": str(reason)}
    assert local.W is not None
    facts: dict[str, Any] = {
        "density of W (blocks)": local.blocks.density,
        "asymmetry of W": _asymmetry(local.W),
    }
    m = local.W.shape[0]
    if m <= RANK_LIMIT:
        values = np.linalg.svd(dense(local.W), compute_uv=False)
        rank = int((values > m * np.finfo(float).eps * values[0]).sum()) if values.size else 0
        facts["rank of W"] = f"{rank} of {m}"
    return facts


def _sign(problem: FrictionProblem) -> dict[str, Any]:
    """The direction in which W or M is negative, where one is found."""
    try:
        found = negative_direction(problem)
    except (SingularOperator, InvalidInput):
        return {}
    return {} if found is None else {"sign": str(found)}


def _asymmetry(matrix: Any) -> float:
    """max |A - A^T| / max |A|."""
    size = abs(matrix).max() if matrix.shape[0] else 0.0
    return float(abs(matrix - matrix.T).max() / size) if size else 0.0


def _scales(problem: FrictionProblem) -> str:
    """What the sizes suggest; files do not record units."""
    rho = problem.rho[problem.rho > 0]
    if not rho.size:
        return "no contact can react"
    stiffness = f"1/|W_ii| from {rho.min():.2g} to {rho.max():.2g}"
    if problem.form is Form.GLOBAL and (problem.is_mesh or not _has_small_blocks(problem)):
        return f"elastic bodies, u probably displacements; local stiffness {stiffness}"
    if problem.form is Form.GLOBAL:
        return f"rigid bodies, u probably velocities and r impulses; effective mass {stiffness}"
    return f"u probably velocities and r impulses; effective mass {stiffness}"


def _has_small_blocks(problem: FrictionProblem) -> bool:
    try:
        return problem.small_blocks is not None
    except SingularOperator:  # contact alone holds a small body
        return False


def fitting_methods(problem: FrictionProblem) -> list[str]:
    """Methods of this form, or that this command line reaches by condensing."""
    names = []
    try:
        condenses = problem.condensing_is_cheap
    except SingularOperator:  # contact alone holds a body
        condenses = False
    for name, kind in METHODS.items():
        fits = kind.form in (Form.ANY, problem.form)
        if fits or (kind.form is Form.DELASSUS and condenses):
            names.append(name if fits else f"{name} (after condensing)")
    return names


def _text(value: Any) -> str:
    if isinstance(value, dict):
        return f"{value['verdict'].replace('_', ' ')}: {value['meaning']} {value['reason']}"
    if isinstance(value, float):
        return f"{value:.3g}"
    if isinstance(value, list):
        if all(isinstance(item, float) for item in value):
            low, high = value
            return f"{low:.4g}" if low == high else f"{low:.4g} to {high:.4g}"
        return ", ".join(map(str, value))
    return str(value)
