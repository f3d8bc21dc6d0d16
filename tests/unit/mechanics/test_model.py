"""Models: assembly against the definition of the problem, variants, recovery, bad input."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import sparse

import amontons as am
from amontons.mechanics.elements.elasticity import cell_stress, stiffness
from amontons.mechanics.meshes.facets import Cells
from amontons.mechanics.model.assembly import external_load
from amontons.mechanics.model.rigid import describe
from amontons.mechanics.model.values import scalar_at, vector_at

STEEL = am.LinearElastic(young=200, poisson=0.3)
FLOOR3 = am.Plane((0, 0, 1))
FLOOR2 = am.Plane((0, 1))


def cube(cells=3, kind=None, **changes):
    parts = {
        "bodies": [am.Body(am.box((1, 1, 1), cells, kind), STEEL)],
        "supports": [am.Fix("top", lambda x: (0, 0.2, 0.06 - 0.15 * x[0]))],
        "contacts": [am.Contact("bottom", FLOOR3, mu=0.5)],
    }
    return am.Model(**(parts | changes))


def block(cells=(4, 2), **changes):
    parts = {
        "bodies": [am.Body(am.box((2, 1), cells), STEEL)],
        "supports": [am.Fix("top", (0, -0.01))],
        "contacts": [am.Contact("bottom", FLOOR2, mu=0.5)],
    }
    return am.Model(**(parts | changes))


def solve(model, **options):
    return am.drive(model.assemble(), tolerance=1e-10, **options)


# ------------------------------------------------------------------ assembly
def test_the_discrete_problem_is_that_of_the_definition():
    model = cube(loads=[am.Traction("left", (1, 2, 3)), am.BodyForce((0, 0, -4))])
    p = model.assemble()
    mesh = model.bodies[0].mesh
    K = stiffness(mesh, STEEL).toarray()
    top = mesh.surface_nodes("top")
    fixed = (3 * top[:, None] + np.arange(3)).ravel()
    free = np.setdiff1d(np.arange(len(K)), fixed)
    prescribed = np.zeros(len(K))
    prescribed[3 * top + 1], prescribed[3 * top + 2] = 0.2, 0.06 - 0.15 * mesh.points[top, 0]
    np.testing.assert_allclose(p.M.toarray(), K[np.ix_(free, free)])
    lifted = -(K @ prescribed)[free]
    loads = p.f - lifted
    total = np.zeros(len(K))
    total[free] = loads
    sums = total.reshape(-1, 3).sum(axis=0)  # what acts on fixed nodes is gone
    assert sums[0] == pytest.approx(1 * 5 / 6)
    assert sums[2] == pytest.approx(3 * 5 / 6 - 4 * 5 / 6)
    bottom = mesh.surface_nodes("bottom")
    assert p.contacts == len(bottom)
    np.testing.assert_allclose(p.w, 0)
    v = np.random.default_rng(0).normal(size=p.unknowns)
    whole = prescribed.copy()
    whole[free] = v
    np.testing.assert_allclose(p.local_velocity(v), whole.reshape(-1, 3)[bottom][:, [2, 0, 1]])
    assert p.load_scale == pytest.approx(np.linalg.norm(p.f))


def test_rigid_modes_are_a_near_nullspace():
    model = cube(supports=[am.Fix("top", (0, None, None)), am.Fix("left", (None, 0, 0))])
    p = model.assemble()
    modes = p.near_nullspace
    assert modes.shape == (p.unknowns, 6)
    full = cube().discretisation
    K = stiffness(cube().bodies[0].mesh, STEEL)
    assert abs(K @ full.parts[0].modes).max() < 1e-12


def test_contact_nodes_fixed_by_supports_leave_and_partly_fixed_ones_stay():
    model = block(supports=[am.Fix("left", (0, 0)), am.Fix("right", (0.1, None))])
    p = model.assemble()
    mesh = model.bodies[0].mesh
    assert p.contacts == len(mesh.surface_nodes("bottom")) - 1
    fields = model.recover(am.drive(p))
    corner = np.flatnonzero(fields.points[:, 0] == 2)[0]
    assert p.w[corner, 1] == pytest.approx(0.1)
    assert fields.slip[corner, 0] == pytest.approx(0.1)


def test_two_bodies_are_assembled_side_by_side():
    lower = am.Body(am.box((1, 1), 2), STEEL, name="lower")
    upper = am.Body(am.box((1, 1), 3, origin=(5, 0)), am.LinearElastic(7, 0.2), name="upper")
    one = am.Model([lower], [am.Fix("top", (0, -0.1))], [am.Contact("bottom", FLOOR2, mu=0.3)])
    two = am.Model([upper], [am.Fix("top", (0, -0.2))], [am.Contact("bottom", FLOOR2, mu=0.6)])
    both = am.Model(
        [lower, upper],
        [am.Fix("lower.top", (0, -0.1)), am.Fix("upper.top", (0, -0.2))],
        [
            am.Contact("lower.bottom", FLOOR2, mu=0.3),
            am.Contact("upper.bottom", FLOOR2, mu=0.6),
        ],
    )
    p, a, b = both.assemble(), one.assemble(), two.assemble()
    np.testing.assert_allclose(p.M.toarray(), sparse.block_diag([a.M, b.M]).toarray())
    np.testing.assert_allclose(p.H.toarray(), sparse.block_diag([a.H, b.H]).toarray())
    np.testing.assert_allclose(p.mu, [0.3] * 3 + [0.6] * 4)
    fields = both.recover(solve(both))
    assert [x.shape for x in fields.displacement] == [(9, 2), (16, 2)]
    np.testing.assert_array_equal(fields.body, [0] * 3 + [1] * 4)
    alone = two.recover(solve(two))
    np.testing.assert_allclose(fields.pressure[3:], alone.pressure, rtol=1e-6)
    assert np.allclose(fields.displacement[1], alone.displacement[0], atol=1e-8)


def test_unnamed_bodies_get_numbers_and_ambiguous_surfaces_are_errors():
    bodies = [am.Body(am.box((1, 1), 1), STEEL), am.Body(am.box((1, 1), 1), STEEL)]
    with pytest.raises(am.InvalidInput, match=r"one of body 1\.top, body 2\.top"):
        am.Model(bodies, [am.Fix("top", 0)], [am.Contact("body 1.bottom", FLOOR2, mu=0)])
    twins = [replace(body, name="twin") for body in bodies]
    with pytest.raises(am.InvalidInput, match="distinct names"):
        am.Model(twins, (), [am.Contact("twin.bottom", FLOOR2, mu=0)])


# ------------------------------------------------------------------ variants
def test_variants_share_the_matrices_and_scale_what_they_should():
    model = cube(
        contacts=[am.Contact("bottom", am.Plane((0, 0, 1), (0, 0, -0.01)), mu=0.5)],
        loads=[am.Traction("left", (1, 0, 0))],
    )
    p = model.assemble()
    assert model.assemble() is p
    half, rough = model.with_load(0.5), model.with_mu(2.0)
    np.testing.assert_allclose(half.assemble().f, 0.5 * p.f)
    np.testing.assert_allclose(half.assemble().w, p.w)  # the gap stays
    np.testing.assert_allclose(rough.assemble().mu, 2.0)
    assert half.discretisation is model.discretisation
    assert rough.with_load(0.5).discretisation is model.discretisation
    assert half.with_load(1).assemble().f == pytest.approx(p.f)
    assert half.assemble().factor() is p.factor()
    fields = half.recover(solve(half))
    top = model.bodies[0].mesh.surface_nodes("top")
    np.testing.assert_allclose(fields.displacement[0][top, 1], 0.1)


def test_a_changed_model_is_assembled_anew():
    model = cube()
    other = replace(model, supports=[am.Fix("top", (0, 0, -1))])
    assert other.discretisation is not model.discretisation
    assert not np.allclose(other.assemble().f, model.assemble().f)


def test_friction_as_number_array_or_function():
    bottom = cube().bodies[0].mesh
    nodes = bottom.surface_nodes("bottom")
    x = bottom.points[nodes]
    slope = lambda x: x[:, 0]  # noqa: E731
    for mu, expected in ((0.3, 0.3), (x[:, 0] + 1, x[:, 0] + 1), (slope, x[:, 0])):
        p = cube(contacts=[am.Contact("bottom", FLOOR3, mu=mu)]).assemble()
        np.testing.assert_allclose(p.mu, expected)
    p = cube(contacts=[am.Contact("bottom", FLOOR3, tresca=slope)]).assemble()
    fields = cube().discretisation.placed[0].rows
    np.testing.assert_allclose(p.law.limit, x[:, 0] * fields.weights)
    with pytest.raises(am.UnsupportedForm):
        _ = p.mu


# ------------------------------------------------------------------ recovery
@pytest.mark.parametrize("kind", ["hex", "tet"])
def test_uniform_pressure_comes_back(kind):
    """A cube pressed by 3 % between frictionless plates: pressure E * 0.03."""
    model = cube(
        4, kind,
        supports=[am.Fix("left", (0, None, None)), am.Fix("front", (None, 0, None)),
                  am.Fix("top", (None, None, -0.03))],
        contacts=[am.Contact("bottom", FLOOR3, mu=0)],
    )  # fmt: skip
    fields = model.recover(solve(model))
    np.testing.assert_allclose(fields.pressure, 6, rtol=1e-7)
    np.testing.assert_allclose(fields.resultant, [0, 0, 6], atol=1e-7)
    np.testing.assert_allclose(fields.gap, 0, atol=1e-8)
    stress = cell_stress(model.bodies[0].mesh, STEEL, fields.displacement[0])
    np.testing.assert_allclose(
        stress, np.tile(np.diag([0, 0, -6.0]), (len(stress), 1, 1)), atol=1e-6
    )


def test_resultant_balances_supports_and_loads():
    model = cube(loads=[am.Traction("right", (-1, 0.5, 2)), am.BodyForce((3, 0, 0))])
    solution = solve(model)
    fields = model.recover(solution)
    K = stiffness(model.bodies[0].mesh, STEEL)
    inner = (K @ fields.displacement[0].ravel()).reshape(-1, 3)
    top = model.bodies[0].mesh.surface_nodes("top")
    external = np.array([2.0, 0.5, 2])
    loads = external_load(model.bodies, model.loads, model.beside).reshape(
        -1, 3
    )
    np.testing.assert_allclose(loads.sum(axis=0), external)
    support = (inner - loads)[top].sum(axis=0)
    np.testing.assert_allclose(fields.resultant + support + external, 0, atol=1e-6)


def test_frames_follow_the_obstacle_and_results_do_not_depend_on_axes():
    """The same block, once upright and once turned by 30 degrees with its floor and load."""
    upright = block(supports=[am.Fix("top", (0.02, -0.01))])
    a = np.pi / 6
    R = np.array([[np.cos(a), -np.sin(a)], [np.sin(a), np.cos(a)]])
    mesh = upright.bodies[0].mesh
    turned = am.Model(
        [am.Body(am.Mesh(mesh.points @ R.T, mesh.cells, mesh.surfaces), STEEL)],
        [am.Fix("top", tuple(R @ (0.02, -0.01)))],
        [am.Contact("bottom", am.Plane(R @ (0, 1)), mu=0.5)],
    )
    one, other = upright.recover(solve(upright)), turned.recover(solve(turned))
    np.testing.assert_allclose(other.pressure, one.pressure, atol=1e-6)
    np.testing.assert_allclose(other.shear, one.shear, atol=1e-6)
    np.testing.assert_allclose(other.resultant, R @ one.resultant, atol=1e-6)


def test_recover_refuses_foreign_solutions():
    solution = am.drive(block().assemble())
    with pytest.raises(am.InvalidInput, match="another model"):
        block((6, 2)).recover(solution)
    local = am.drive(block().assemble().condensed(), am.GaussSeidel())
    with pytest.raises(am.InvalidInput, match="no displacements"):
        block().recover(local)


# ------------------------------------------------------------------ bodies that are not held
def test_a_body_that_nothing_holds_is_named_with_its_modes():
    bodies = [am.Body(am.box((1, 1), 1), STEEL, name="held"),
              am.Body(am.box((1, 1), 1), STEEL, name="lost")]  # fmt: skip
    model = am.Model(
        bodies, [am.Fix("held.top", 0)], [am.Contact("held.bottom", FLOOR2, mu=0.3)]
    )
    words = "'lost' is free to move: translation along x, translation along y, rotation in the"
    with pytest.raises(am.SingularOperator, match=words):
        model.assemble()


def test_without_friction_sliding_is_free():
    loose = block(supports=[am.Fix("top", (None, -0.1))])
    loose.assemble()  # friction can hold it
    with pytest.raises(
        am.SingularOperator, match="'body' is free to move: translation along x;"
    ):
        loose.with_mu(0).assemble()
    with pytest.raises(
        am.SingularOperator, match="along x, translation along y, rotation about z"
    ):
        cube(supports=[], contacts=[am.Contact("bottom", FLOOR3, mu=0)]).assemble()


def test_modes_in_words():
    mode = np.array([[0.5], [0.0], [np.sqrt(0.75)]])
    assert describe(mode) == "1 combination of translation along x and rotation in the plane"
    assert describe(np.eye(3)[:, :1]) == "translation along x"


def test_parts_of_one_mesh_are_told_apart():
    a, b = am.box((1, 1), 1), am.box((1, 1), 1, origin=(3, 0))
    mesh = am.Mesh(
        np.vstack([a.points, b.points]),
        (a.cells[0], Cells("quad", b.cells[0].nodes + len(a.points), "other")),
        a.surfaces,
    )
    model = am.Model(
        [am.Body(mesh, STEEL)], [am.Fix("top", 0)], [am.Contact("bottom", FLOOR2, mu=1)]
    )
    with pytest.raises(am.SingularOperator, match=r"part 2 of 2"):
        model.assemble()


# ------------------------------------------------------------------ bad input
@pytest.mark.parametrize(("make", "words"), [
    (lambda: am.Fix("top", ...), "fix on 'top': got '...'.*None for a component that is free"),
    (lambda: am.Fix("top", (..., 0)), "fix on 'top': got '...'"),
    (lambda: am.Traction("top", (0, ...)), "axis, or 0 for all"),
    (lambda: am.Fix("top", {"y": 0}), "fix on 'top': expected 0, a vector"),
    (lambda: am.Pressure("top", (0, -1)), "against the normal.*is a Traction"),
    (lambda: am.Pressure("top", np.ones(3)), "is a Traction"),
    (lambda: am.Pressure("top", "1"), "pressure on 'top': expected a number, got '1'"),
])  # fmt: skip
def test_what_is_no_value_is_refused_where_it_is_given(make, words):
    with pytest.raises(am.InvalidInput, match=words):
        make()


MESH2 = am.box((2, 1), (4, 2))


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"bodies": []}, "at least one"),
        ({"bodies": ["cube"]}, "bodies: expected Body"),
        ({"bodies": 3}, "bodies: expected a list"),
        ({"supports": [am.Fix("tpo", 0)]}, "bottom, left, right, top; did you mean 'top'"),
        ({"contacts": [am.Contact("floor", FLOOR2, mu=1)]}, "surface 'floor'"),
        ({"loads": [am.Traction("side", (0, 1))]}, "surface 'side'"),
        ({"supports": [am.Fix("top", (0, 0, 0))]}, "'top': expected 2 components, got 3"),
        ({"supports": [am.Fix("top", "free")]}, "2 components or a function"),
        ({"supports": [am.Fix("top", lambda x: 1 / x[0])]}, "finite|components|zero"),
        ({"supports": [am.Fix("top", (0, 1)), am.Fix("left", (0.5, 0))]}, "another support"),
        ({"supports": [am.Fix(s, 0) for s in MESH2.surfaces], "bodies": [
            am.Body(am.box((2, 1), 1), STEEL)]}, "every degree of freedom"),
        ({"supports": [am.Fix("bottom", 0)]}, "every slave node is fixed"),
        ({"loads": [am.Traction("left", (0, None))]}, "None"),
        ({"loads": [am.Traction("left", (0, 1, 2))]}, "expected 2 components"),
        ({"loads": [am.BodyForce((0, 1), region="wood")]}, "region 'wood'"),
        ({"contacts": [am.Contact("bottom", FLOOR3, mu=1)]}, "3D, the mesh in 2D"),
        ({"contacts": [am.Contact("bottom", FLOOR2, mu=lambda x: -x[:, 0])]},
         "mu on 'bottom': .*>= 0, got -"),
        ({"bodies": am.Body(MESH2, STEEL)}, "bodies: expected a list of Body"),
        ({"supports": am.Fix("top", 0)}, "supports: expected a list of Fix"),
        ({"supports": [am.Fix("top", lambda x: -0.1)]}, "2 components of the function"),
        ({"loads": [am.Traction(3, (0, 1))]}, "surface: expected a name, got 3"),
        ({"load_factor": "twice"}, "load_factor: expected a finite number, got 'twice'"),
        ({"contacts": [am.Contact("bottom", FLOOR2, mu=[1, 2])]}, "one per slave node"),
        ({"contacts": [am.Contact("bottom", FLOOR2, mu=lambda x: x[0])]}, r"x\[:, 0\]"),
        ({"load_factor": np.inf}, "load_factor"),
    ],
)  # fmt: skip
def test_bad_models_are_rejected(change, words):
    with (
        pytest.raises((am.InvalidInput, ZeroDivisionError), match=words),
        np.errstate(all="ignore"),
    ):
        block(**change).assemble()


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: am.Fix("top", (0, "x")), "expected a number, got 'x'; None leaves"),
        (lambda: am.Fix("top", (0, np.nan)), "finite"),
        (lambda: am.Contact("bottom", FLOOR2, tresca=np.inf), "finite"),
        (lambda: am.Contact("bottom", FLOOR2, mu=1, cap=np.inf), "finite"),
        (lambda: am.Contact("bottom", FLOOR2), "either mu or tresca"),
        (lambda: am.Contact("bottom", FLOOR2, mu=1, tresca=1), "either mu or tresca"),
        (lambda: am.Contact("bottom", FLOOR2, tresca=1, cap=1), "cap goes with mu"),
        (lambda: am.Contact("bottom", FLOOR2, mu=1, law=am.Coulomb(1)), "got both"),
        (lambda: am.Contact("bottom", FLOOR2, law=0.3), "law: expected Coulomb"),
        (lambda: am.Contact("bottom", FLOOR2, mu=1, cohesion=-1), "cohesion on 'bottom'"),
        (lambda: am.Contact("bottom", mu=1), "obstacle or a master"),
        (lambda: am.Contact("bottom", "floor", mu=1), "Plane, Sphere or LevelSet"),
        (lambda: am.Contact("bottom", am.Plane, mu=1), "Plane, Sphere or LevelSet"),
        (lambda: am.Contact("bottom", FLOOR2, mu=-0.3), "mu on 'bottom': .*>= 0, got -0.3"),
        (lambda: am.Contact("bottom", FLOOR2, mu=[1, -2]), ">= 0, got -2"),
        (lambda: am.Contact("bottom", FLOOR2, tresca=-5), "tresca on 'bottom': .*>= 0, got -5"),
        (lambda: am.Fix("top", -0.1), r"fix on 'top': .* \(0, 0, -0.1\), or \(0, -0.1\) in 2D"),
        (lambda: am.Fix("top", np.float64(-0.1)), r"\(None, None, -0.1\) leaves"),
        (lambda: am.Traction("top", -1), r"traction on 'top': .* write \(0, 0, -1\)"),
        (lambda: am.BodyForce(-9.81), r"body force: .* write \(0, 0, -9.81\)"),
        (lambda: am.Contact("bottom", FLOOR2, mu=1, method="magic"), "method"),
        (lambda: am.Body("mesh", STEEL), "box, read_mesh"),
        (lambda: am.Body(MESH2, "steel"), "LinearElastic"),
        (lambda: am.Body(MESH2, {"wood": STEEL}), "region 'wood'"),
        (lambda: am.Model([am.Body(MESH2, STEEL), am.Body(am.box((1, 1, 1), 1), STEEL)],
                          (), [am.Contact("front", FLOOR3, mu=1)]), "2D or all in 3D"),
    ],
)  # fmt: skip
def test_bad_parts_are_rejected(make, words):
    with pytest.raises(am.InvalidInput, match=words):
        make()


def test_values_of_all_kinds():
    x = np.array([[1.0, 2.0], [3.0, 4.0], [5.0, 6.0]])
    np.testing.assert_array_equal(
        vector_at((1, lambda p: p[1]), x, "v"), [[1, 2], [1, 4], [1, 6]]
    )
    np.testing.assert_array_equal(vector_at(lambda p: p * 2, x, "v"), 2 * x)
    np.testing.assert_array_equal(vector_at(7, x, "v"), np.full((3, 2), 7.0))
    free = vector_at(lambda p: (None, p[0]), x, "v", free=True)
    np.testing.assert_array_equal(free, [[np.nan, 1], [np.nan, 3], [np.nan, 5]])
    np.testing.assert_array_equal(scalar_at(lambda p: p[:, 0], x, "s"), [1, 3, 5])
    np.testing.assert_array_equal(scalar_at(lambda p: 4, x, "s"), [4, 4, 4])
    with pytest.raises(am.InvalidInput, match=r"x\[:, 0\]"):
        scalar_at(lambda p: p[0], x[:2], "s")  # two points in 2D: shapes agree by chance
