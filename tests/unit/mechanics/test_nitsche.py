"""Nitsche's contact: exact solutions whatever kappa, tangents, invariance, honest refusals."""

import json
from dataclasses import replace

import meshio
import numpy as np
import pytest
from click.testing import CliRunner

import amontons as am
from amontons.app.cli import main
from amontons.core.errors import InvalidInput, UnsupportedForm
from amontons.io.case import read_case
from amontons.mechanics.elements import stiffness
from amontons.mechanics.elements.traces import gauss_points, surface_points
from amontons.mechanics.ready.hild import free_displacement, hild_triangle, stick_displacement
from amontons.solvers.contract import Iterate

STEEL = am.LinearElastic(young=200, poisson=0.3)
VARIANTS = [{}, {"theta": 1.0}, {"theta": -1.0}, {"kappa": 1e5}, {"points": 2}]


def by_nitsche(model, **options):
    return replace(
        model, contacts=[replace(c, method=am.Nitsche(**options)) for c in model.contacts]
    )


def block(cells=(4, 2), mu=0.5, kind=None, order=1, **changes):
    parts = {
        "bodies": [am.Body(am.box((2, 1), cells, kind), STEEL, order=order)],
        "supports": [am.Fix("top", (0.02, -0.01))],
        "contacts": [am.Contact("bottom", am.Plane((0, 1)), mu=mu, method="nitsche")],
    }
    return am.Model(**(parts | changes))


def cube(cells=2, kind=None, **law):
    return am.Model(
        [am.Body(am.box((1, 1, 1), cells, kind), STEEL)],
        supports=[am.Fix("top", lambda x: (0, 0.2, 0.06 - 0.15 * x[0]))],
        contacts=[
            am.Contact("bottom", am.Plane((0, 0, 1)), method="nitsche", **(law or {"mu": 0.5}))
        ],
    )


# ------------------------------------------------------------------ displacement and stress
@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("kind", ["tri", "quad", "tet", "hex"])
def test_traces_are_exact_for_linear_fields(kind, order):
    d = 2 if kind in ("tri", "quad") else 3
    rng = np.random.default_rng(1)
    body = am.Body(am.box((2, 1.5, 1)[:d], (3, 2, 2)[:d], kind), STEEL, order=order)
    slope, shift = rng.normal(size=(d, d)), rng.normal(size=d)
    strain = (slope + slope.T) / 2
    stress = STEEL.lame_lambda(d) * np.trace(strain) * np.eye(d) + 2 * STEEL.shear * strain
    v = (body.mesh.points @ slope.T + shift).ravel()
    for name in body.mesh.surfaces:
        at = surface_points(body.mesh, name, STEEL, gauss_points(body.mesh, name, 3))
        axes = np.tile(np.linalg.qr(rng.normal(size=(d, d)))[0], (len(at.points), 1, 1))
        moved = np.einsum("qkc,qc->qk", axes, at.points @ slope.T + shift)
        pull = np.einsum("qkc,qc->qk", axes, at.normals @ stress)
        assert (at.displacement(axes, v.size).T @ v) == pytest.approx(moved.ravel())
        assert (at.traction(axes, v.size).T @ v) == pytest.approx(pull.ravel())


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("kind", ["tri", "quad", "tet", "hex"])
def test_trace_stiffness_bounds_every_displacement_of_a_cell(kind, order):
    """int_F |sigma nu|^2 <= c int_T sigma : epsilon, and c is not ten times too large."""
    d = 2 if kind in ("tri", "quad") else 3
    mesh = am.box((1.0, 0.8, 0.7)[:d], 1, kind)
    body = am.Body(mesh, STEEL, order=order)
    at = surface_points(body.mesh, "bottom", STEEL, gauss_points(body.mesh, "bottom", 4))
    size = body.mesh.points.size
    S = at.traction(np.tile(np.eye(d), (len(at.points), 1, 1)), size)
    K = stiffness(body.mesh, STEEL).toarray()
    first = len(at.points) // len(body.mesh.surface("bottom")[0].nodes)
    S = S[:, : first * d].toarray()  # the first facet; its cell is not alone in K
    work = (S * np.repeat(at.weights[:first], d)) @ S.T
    values, vectors = np.linalg.eigh(K)
    elastic = values > 1e-9 * values.max()
    basis = vectors[:, elastic] / np.sqrt(values[elastic])
    largest = np.linalg.eigvalsh(basis.T @ work @ basis).max()
    assert largest <= at.stiffness[0] * (1 + 1e-9)
    assert largest >= 0.1 * at.stiffness[0]


# --------------------------------------------------------------------------- exact solutions
@pytest.mark.parametrize("options", VARIANTS)
@pytest.mark.parametrize("n", [1, 3])
def test_the_exact_fields_of_hild_solve_it(n, options):
    model = by_nitsche(hild_triangle(n, mu=3.5), **options)
    problem = model.discrete_problem()
    points, free = model.bodies[0].mesh.points, model.discretisation.free
    for field, letter in ((free_displacement, "f"), (stick_displacement, "s")):
        v = field(points).ravel()[free]
        assert problem.error(None, v) < 1e-12
        assert problem.error(None, v + 0.01 * np.cos(np.arange(v.size))) > 1e-4
        found = am.drive(problem, am.SemismoothNewton(), start=Iterate(None, v))
        assert set(found.pattern) == {letter}
        r = problem.reaction(v)
        assert problem.error(r, v) < 1e-12
        assert problem.error(r + 0.1, v) > 1e-3  # not the reactions of v
        assert problem.error(r * np.nan, v) == np.inf
    stick = hild_triangle(n, mu=2.9)  # 3 is needed
    below = by_nitsche(stick, **options).discrete_problem()
    assert below.error(None, stick_displacement(points).ravel()[free]) > 1e-3


@pytest.mark.parametrize("options", VARIANTS)
@pytest.mark.parametrize("kind", ["quad", "tri"])
@pytest.mark.parametrize("pull", [0.1, -0.1])
def test_patch_of_uniform_pressure_and_shear(kind, pull, options):
    """Held by contact alone, no strain along the floor; friction takes shear of either sign."""
    across = -0.3 / 0.7  # plane strain, poisson 0.3
    model = block(
        kind=kind, supports=[],
        loads=[am.Traction("top", (pull, -1.0)), am.Traction("left", (-across, -pull)),
               am.Traction("right", (across, pull))],
    )  # fmt: skip
    solution = am.solve(by_nitsche(model, **options), tolerance=1e-11)
    assert set(solution.pattern) == {"s"}
    assert solution.pressure == pytest.approx(np.ones(solution.problem.contacts))
    assert solution.shear[:, 0] == pytest.approx(-pull * np.ones(solution.problem.contacts))
    assert solution.resultant == pytest.approx([-2 * pull, 2.0])


@pytest.mark.parametrize("options", VARIANTS)
def test_patch_of_two_bodies_that_do_not_match(options):
    """A uniform pressure passes between meshes that share no node, slave and master loaded."""
    upper = am.box((1, 1), (3, 2))
    upper = am.Mesh(upper.points + [0, 1], upper.cells, upper.surfaces)
    model = am.Model(
        [am.Body(am.box((1, 1), (4, 3)), STEEL, "low"), am.Body(upper, STEEL, "up")],
        supports=[am.Fix("low.bottom", (None, 0)), am.Fix("low.left", (0, None)),
                  am.Fix("up.left", (0, None))],
        loads=[am.Traction("up.top", (0, -1))],
        contacts=[am.Contact("up.bottom", master="low.top", mu=0.0,
                             method=am.Nitsche(**options))],
    )  # fmt: skip
    solution = am.solve(model, tolerance=1e-11)
    assert solution.resultant == pytest.approx([0, 1])
    assert solution.pressure == pytest.approx(np.ones(solution.problem.contacts), abs=1e-11)


# ------------------------------------------------------------------------- residual, tangent
@pytest.mark.parametrize("theta", [0.0, 1.0, -0.5])
@pytest.mark.parametrize("law", [{"mu": 0.6}, {"tresca": 0.5}, {"mu": 0.0}])
def test_tangent_is_the_derivative_of_the_residual(law, theta):
    problem = by_nitsche(cube(2, **law), theta=theta).discrete_problem()
    rng = np.random.default_rng(3)
    v, dv = rng.normal(size=(2, problem.unknowns))
    h = 1e-7
    differences = (problem.residual(v + h * dv) - problem.residual(v - h * dv)) / (2 * h)
    assert problem.tangent(v) @ dv == pytest.approx(differences, rel=1e-5, abs=1e-5)


def test_the_symmetric_variant_has_a_symmetric_tangent_without_friction():
    v = np.random.default_rng(4).normal(size=by_nitsche(cube()).discrete_problem().unknowns)

    def asymmetry(theta):
        T = by_nitsche(cube(mu=0.0), theta=theta).discrete_problem().tangent(v)
        return abs(T - T.T).max() / abs(T).max()

    assert asymmetry(1.0) < 1e-12
    assert asymmetry(0.0) > 1e-3


def test_rotation_of_the_model_rotates_the_solution():
    turn = np.array([[0.8, -0.6], [0.6, 0.8]])
    plain = block((4, 3), mu=0.3)
    mesh = plain.bodies[0].mesh
    turned = am.Model(
        [am.Body(am.Mesh(mesh.points @ turn.T, mesh.cells, mesh.surfaces), STEEL)],
        supports=[am.Fix("top", tuple(turn @ [0.02, -0.01]))],
        contacts=[am.Contact("bottom", am.Plane(tuple(turn @ [0, 1])), mu=0.3,
                             method="nitsche")],
    )  # fmt: skip
    a, b = am.solve(plain, tolerance=1e-11), am.solve(turned, tolerance=1e-11)
    assert b.displacement[0] == pytest.approx(a.displacement[0] @ turn.T, abs=1e-12)
    assert b.r == pytest.approx(a.r, abs=1e-9)
    assert b.pattern == a.pattern


@pytest.mark.parametrize(("length", "stress"), [(1e3, 1e-6), (1e-3, 1e9)])
def test_units_change_nothing(length, stress):
    a = am.solve(block(mu=0.2))
    other = am.Model(
        [am.Body(am.box((2 * length, length), (4, 2)), am.LinearElastic(200 * stress, 0.3))],
        supports=[am.Fix("top", (0.02 * length, -0.01 * length))],
        contacts=[am.Contact("bottom", am.Plane((0, 1)), mu=0.2, method="nitsche")],
    )
    b = am.solve(other)
    assert b.pattern == a.pattern
    assert b.convergence.iterations == a.convergence.iterations
    assert b.displacement[0] / length == pytest.approx(a.displacement[0])
    assert b.pressure / stress == pytest.approx(a.pressure)
    trial = a.v + 0.001 * np.cos(np.arange(a.v.size))
    assert b.problem.error(None, length * trial) == pytest.approx(a.problem.error(None, trial))


def test_mirrored_drag_gives_mirrored_shear():
    right = am.solve(block((6, 3), mu=0.3), tolerance=1e-11)
    left = am.solve(
        block((6, 3), mu=0.3, supports=[am.Fix("top", (-0.02, -0.01))]), tolerance=1e-11
    )
    assert "+" in left.pattern and "-" in right.pattern  # friction opposes the slip
    assert left.resultant == pytest.approx(right.resultant * [-1, 1])
    flip = {"+": "-", "-": "+"}
    assert sorted(left.pattern) == sorted(flip.get(c, c) for c in right.pattern)


# ----------------------------------------------------------------- against nodal contact
def test_refinement_brings_nitsche_and_nodal_contact_together():
    ball = am.Contact("bottom", am.Sphere((1, -2.0), 2.0), mu=0.3)
    gaps = []
    for n in (4, 8, 16):
        model = block((2 * n, n), contacts=[ball], supports=[am.Fix("top", (0.02, -0.03))])
        nodal, own = am.solve(model), am.solve(by_nitsche(model))
        gaps.append(np.abs(own.resultant / nodal.resultant - 1).max())
    assert gaps[0] > 2 * gaps[1] > 4 * gaps[2]
    assert gaps[2] < 0.011


@pytest.mark.parametrize("law", [{"mu": 0.3}, {"mu": 0.0}, {"tresca": 1.0}])
def test_three_dimensions_agree_with_nodal_contact(law):
    own = am.solve(cube(4, **law))
    nodal = am.solve(replace(
        cube(4), contacts=[am.Contact("bottom", am.Plane((0, 0, 1)), **law)]
    ))  # fmt: skip
    assert own.resultant == pytest.approx(nodal.resultant, rel=0.04, abs=1e-9)
    shear = np.linalg.norm(own.shear, axis=1)
    bound = law["mu"] * own.pressure if "mu" in law else law["tresca"]
    assert (shear <= bound + 1e-9).all()
    assert own.pressure.min() >= 0
    assert own.max_penetration < 2e-3


# ------------------------------------------------------------------------------- refusals
def test_what_needs_multipliers_says_so():
    model = block()
    with pytest.raises(UnsupportedForm, match="nodal"):
        model.assemble()
    with pytest.raises(UnsupportedForm, match="nodal"):
        am.all_solutions(model)
    with pytest.raises(UnsupportedForm, match="nodal"):
        am.solve(model, am.GaussSeidel())
    with pytest.raises(UnsupportedForm, match="ActiveSet"):
        am.solve(model, am.ActiveSet())


def test_an_end_before_convergence_is_named():
    solution = am.solve(cube(4, mu=1.0), max_iterations=1, check=False)
    assert not solution.converged
    assert solution.convergence.outcome is am.Outcome.MAX_ITERATIONS
    assert solution.convergence.error > 1e-8
    assert solution.fclib_error is None


def test_without_line_search_a_failure_has_a_name():
    plain = am.SemismoothNewton(line_search=am.FullStep())
    model = by_nitsche(cube(4, mu=1.0), scale=20.0)
    solution = am.solve(model, plain, max_iterations=40, check=False)
    assert not solution.converged
    assert am.solve(model).converged


@pytest.mark.parametrize(
    ("options", "name"),
    [({"kappa": 0.0}, "kappa"), ({"kappa": np.nan}, "kappa"), ({"scale": -1}, "scale"),
     ({"theta": 2.0}, "theta"), ({"points": 0}, "points"), ({"points": 2.5}, "points"),
     ({"kappa": "big"}, "kappa"), ({"points": True}, "points")],
)  # fmt: skip
def test_bad_options_are_named(options, name):
    with pytest.raises(InvalidInput, match=name):
        am.Nitsche(**options)


def test_methods_can_not_be_mixed():
    with pytest.raises(InvalidInput, match="Nitsche"):
        block(contacts=[
            am.Contact("bottom", am.Plane((0, 1)), mu=0.5, method="nitsche"),
            am.Contact("left", am.Plane((1, 0)), mu=0.5),
        ])  # fmt: skip


def test_contact_alone_holds_a_body_or_nothing_does():
    held = block(supports=[], loads=[am.BodyForce((0.1, -1))])
    solution = am.solve(held)
    assert solution.resultant == pytest.approx([-0.2, 2.0])
    with pytest.raises(am.SingularOperator, match="translation along x"):
        am.solve(block(mu=0.0, supports=[], loads=[am.BodyForce((0.0, -1))]))


def test_start_takes_displacements_of_another_method():
    model = block((4, 3), mu=0.3)
    nodal = am.solve(replace(
        model, contacts=[am.Contact("bottom", am.Plane((0, 1)), mu=0.3)]
    ))  # fmt: skip
    solution = am.solve(model, start=nodal)
    assert solution.displacement[0] == pytest.approx(am.solve(model).displacement[0], abs=1e-9)
    with pytest.raises(InvalidInput, match="start"):
        am.solve(model, start=Iterate(np.zeros((1, 2)), np.zeros(3)))


# ------------------------------------------------------------------------ files and commands
CASE = """
title = "dragged"
[mesh]
box = [1, 1, 1]
cells = 2
[material.default]
young = 200.0
poisson = 0.3
[[fix]]
on = "top"
value = [0.0, 0.02, "-0.01 - 0.01*x"]
[[contact]]
slave = "bottom"
obstacle = { plane = { normal = [0, 0, 1] } }
friction = { coulomb = 0.4 }
method = METHOD
"""


@pytest.mark.parametrize(
    "method", ['"nitsche"', '{ kind = "nitsche", kappa = 900, theta = -1 }']
)
def test_case_file_to_results(method, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "case.toml").write_text(CASE.replace("METHOD", method))
    done = CliRunner().invoke(main, ["solve", "case.toml"])
    assert done.exit_code == 0, done.output
    record = json.loads((tmp_path / "case-results" / "solution.json").read_text())
    assert record["measure"] == "nitsche"
    assert record["fclib_error"] is None
    assert record["contacts"]["total"] == 4 * 16
    model = read_case("case.toml").model
    solution = am.solve(model)
    assert record["resultant"] == pytest.approx(solution.resultant)
    assert {p.name for p in (tmp_path / "case-results").iterdir()} == {
        "solution.json", "solution.h5", "solution.vtu", "pairs.csv", "status.png",
        "convergence.png",
    }  # fmt: skip
    options = model.contacts[0].nitsche
    assert (options.kappa, options.theta) == (
        (None, 0.0) if "k" not in method[:3] else (900, -1)
    )
    facts = CliRunner().invoke(main, ["info", "case.toml", "--json", "-"])
    assert json.loads(facts.output)["form"] == "nitsche"
    for command in (["enumerate", "case.toml"], ["convert", "case.toml", "case.hdf5"],
                    ["solve", "case.toml", "--uniqueness"], ["uniqueness", "case.toml"],
                    ["follow", "case.toml"]):  # fmt: skip
        refused = CliRunner().invoke(main, command)
        assert refused.exit_code == 2
        assert "nodal" in refused.stderr


def test_nodes_of_the_picture_take_means_of_their_points(tmp_path):
    across = -0.3 / 0.7
    model = block(
        (3, 2), supports=[],
        loads=[am.Traction("top", (0, -1.0)), am.Traction("left", (-across, 0)),
               am.Traction("right", (across, 0))],
    )  # fmt: skip
    solution = am.solve(model, tolerance=1e-11)
    solution.write(tmp_path / "a.vtu")
    solution.plot(tmp_path / "a.png")
    data = meshio.read(tmp_path / "a.vtu").point_data
    bottom = model.bodies[0].mesh.surface_nodes("bottom")
    assert data["CPRESS"][bottom] == pytest.approx(np.ones(4))
    assert data["CSTATUS"][bottom] == pytest.approx(2 * np.ones(4))
    assert data["CFORCE"][bottom].sum(axis=0) == pytest.approx([0, 2, 0], abs=1e-9)


def test_quasi_static_steps_remember_the_slip():
    """Dragged forth and back: the shear comes back with the other sign."""
    model = block((6, 3), mu=0.3, supports=[
        am.Fix("top", lambda x, t: (0.03 * np.sin(np.pi * t), -0.01))
    ])  # fmt: skip
    shears = [
        step.solution.r[:, 1].sum()
        for step in am.evolve(model, am.QuasiStatic(0.25), until=1.0)
    ]
    assert shears[0] < 0 < shears[-1]
    nodal = replace(model, contacts=[am.Contact("bottom", am.Plane((0, 1)), mu=0.3)])
    other = [
        step.solution.r[:, 1].sum()
        for step in am.evolve(nodal, am.QuasiStatic(0.25), until=1.0)
    ]
    assert shears == pytest.approx(other, rel=0.05)


def test_dynamics_and_exchange_files_refuse(tmp_path):
    moving = block(
        bodies=[am.Body(am.box((2, 1), (4, 2)), am.LinearElastic(200, 0.3, density=1))]
    )
    with pytest.raises(UnsupportedForm, match="nodal"):
        next(am.evolve(moving, am.MoreauJean(0.1), until=0.2))
    with pytest.raises(UnsupportedForm, match="nodal"):
        am.write_fclib(block().discrete_problem(), tmp_path / "a.hdf5")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("poisson", [0.45, 0.48, 0.49])
@pytest.mark.parametrize("options", VARIANTS)
def test_friction_alone_holds_a_block_that_wants_to_spread(poisson, options):
    """Points slip to both sides of one that sticks: Newton's tangents are nearly singular."""
    model = am.Model(
        [am.Body(am.box((1.3, 0.9), (5, 7), "tri"), am.LinearElastic(200, poisson))],
        loads=[am.Traction("top", (0.18, -2.0))],
        contacts=[am.Contact("bottom", am.Plane((0, 1)), mu=0.2, method="nitsche")],
    )
    solution = am.solve(by_nitsche(model, **options))
    assert solution.resultant == pytest.approx([-0.18 * 1.3, 2.0 * 1.3])
    assert {"+", "-"} <= set(solution.pattern)


def test_overload_is_not_called_converged():
    """More shear than friction can carry: no solution, and the reason is named."""
    model = block(mu=0.2, supports=[], loads=[am.Traction("top", (0.3, -1.0))])
    solution = am.solve(model, check=False, max_iterations=100)
    assert not solution.converged
    assert "no solution" in solution.convergence.detail
