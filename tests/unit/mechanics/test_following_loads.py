"""Loads that follow the body: integrals, exact tangents, steps, paths, energy, case files."""

import numpy as np
import pytest
from scipy.optimize import brentq
from tangent_checker import checked_tangents

import amontons as am
from amontons.mechanics.meshes import second_order
from amontons.mechanics.model.large_deformation import large_deformation
from amontons.mechanics.model.nodal_forces import NodalForces, nodal_forces

NEO = am.NeoHookean(1.0, 0.3)
GROUND = {2: am.Plane((0, 1), (0, -5)), 3: am.Plane((0, 0, 1), (0, 0, -5))}
MESHES = {
    "quad": lambda: am.box((2, 1), cells=(3, 2)),
    "tri6": lambda: second_order(am.box((2, 1), cells=(2, 1), kind="tri")),
    "hex": lambda: am.box((2, 1, 1), cells=(2, 1, 2)),
    "tet": lambda: am.box((2, 1, 1), cells=(1, 1, 1), kind="tet"),
    "tet10": lambda: second_order(am.box((2, 1, 1), cells=(1, 1, 1), kind="tet")),
}


def waves(x):
    """A density that depends on the place: (d,)."""
    return 0.3 + np.sin(np.arange(1, len(x) + 1) * x.sum()) * 0.2


LOADS = {
    "pressure": am.Pressure("right", 0.3),
    "pressure of x": am.Pressure("right", lambda x: 0.2 + 0.1 * x[0] * x[1]),
    "traction": am.Traction("right", waves, configuration="current"),
    "body force": am.BodyForce(waves, configuration="current"),
}


def model(mesh, loads, law=NEO, **contact):
    """A body held at its left, far above the ground."""
    contact = {"mu": 0.3} | contact
    return am.Model([am.Body(mesh, law)], [am.Fix("left", 0)],
                    [am.Contact("bottom", GROUND[mesh.dim], **contact)], loads)  # fmt: skip


@pytest.mark.parametrize("load", LOADS)
@pytest.mark.parametrize("kind", MESHES)
def test_slopes_are_those_of_the_forces(kind, load):
    mesh = MESHES[kind]()
    forces = nodal_forces(model(mesh, [LOADS[load]]), [LOADS[load]])
    rng = np.random.default_rng(2)
    u, direction = 0.1 * rng.standard_normal((2, *mesh.points.shape))
    here, blocks = forces.slopes(u)
    assert np.array_equal(here, forces.at(u))
    found, d, h = np.zeros_like(here), mesh.dim, 1e-5
    for nodes, slopes in blocks:
        change = np.einsum("kabce,kbe->kac", slopes, direction[nodes])
        np.add.at(found, nodes[:, :, None] * d + np.arange(d), change)
    difference = (forces.at(u + h * direction) - forces.at(u - h * direction)) / (2 * h)
    assert np.abs(difference).max() > 1e-3
    assert np.abs(found - difference).max() < 1e-7 * np.abs(difference).max()


@pytest.mark.parametrize("law", [NEO, am.LinearElastic(1.0, 0.3)], ids=["neo", "linear"])
@pytest.mark.parametrize("dim", [2, 3])
def test_the_tangent_of_the_whole_problem_is_exact(dim, law):
    mesh = am.box((1,) * dim, cells=2)
    body = am.Body(mesh, law)
    ball = am.Sphere(np.r_[0.3 * np.ones(dim - 1), -1.0], 1.0)
    contact = am.Contact("bottom", ball, mu=0.5, configuration="current")
    problem = large_deformation(
        am.Model([body], [am.Fix("top", 0)], [contact], list(LOADS.values()))
    )
    rng = np.random.default_rng(dim)
    draws = (
        rng.standard_normal((2, problem.unknowns)) * [[0.03], [1.0]] for _ in range(8)
    )
    assert checked_tangents(problem, draws) > 2


@pytest.mark.parametrize("kind", MESHES)
def test_resultants_under_one_gradient(kind):
    """Eq. (22) for a uniform F: h det F |F^-T n| A, -p det F F^-T n A, f det F V."""
    mesh = MESHES[kind]()
    d = mesh.dim
    F = np.eye(d) + 0.3 * np.random.default_rng(d).uniform(-1, 1, (d, d))
    u = mesh.points @ (F - np.eye(d)).T + 0.3
    h, J, n = np.arange(1.0, d + 1), np.linalg.det(F), np.eye(d)[0]
    area = J * np.linalg.inv(F).T @ n
    for load, wanted in (
        (am.Pressure("right", 0.7), -0.7 * area),
        (am.Traction("right", h, "current"), h * np.linalg.norm(area)),
        (am.BodyForce(h, configuration="current"), 2 * h * J),
    ):
        forces = nodal_forces(model(mesh, [load]), [load])
        assert forces.at(u).reshape(u.shape).sum(axis=0) == pytest.approx(wanted, rel=1e-12)
        dead = am.Traction("right", [-0.7] + [0] * (d - 1)) if load.__class__ is am.Pressure \
            else type(load)(**{**vars(load), "configuration": "reference"})  # fmt: skip
        at_rest = nodal_forces(model(mesh, [dead]), [dead]).at(0 * u)
        assert np.abs(forces.at(0 * u) - at_rest).max() < 1e-14


def test_forces_can_be_added_and_scaled():
    mesh = MESHES["quad"]()
    one = nodal_forces(model(mesh, [LOADS["pressure"]]), [LOADS["pressure"]])
    other = nodal_forces(model(mesh, [LOADS["traction"]]), [LOADS["traction"]])
    u, dead = 0.1 * mesh.points, np.ones(mesh.points.size)
    total = np.float64(0.5) * one - other / 4 + dead
    wanted = 0.5 * one.at(u) - other.at(u) / 4 + dead
    assert np.abs(total.at(u) - wanted).max() < 1e-15
    assert np.abs((dead - one).at(u) - (dead - one.at(u))).max() < 1e-15
    assert len((one + one).following) == 1
    assert not (one - one).following
    assert np.array_equal(NodalForces.of(dead).at(u), dead)


@pytest.mark.parametrize("dim", [2, 3])
def test_a_pressed_block_has_the_uniform_stress_of_the_pressure(dim):
    """On a frictionless ground, its top pressed: P = -p cof F there, one stretch everywhere."""
    p, law = 0.4, am.NeoHookean(1.0, 0.3)
    sides = [am.Fix("left", [0] + [None] * (dim - 1))]
    if dim == 3:
        sides.append(am.Fix("front", (None, 0, None)))
    mesh = am.box((1,) * dim, cells=2)
    block = am.Model([am.Body(mesh, law)], sides,
                     [am.Contact("bottom", am.Plane(np.eye(dim)[-1]), mu=0.0)],
                     [am.Pressure("top", p)])  # fmt: skip
    solution = am.solve(block, tolerance=1e-12)

    def cauchy(across, down):
        lengths = np.array([across, across if dim == 3 else 1.0, down])
        J = lengths.prod()
        return (law.shear * (lengths**2 - 1) + law.lame_lambda() * np.log(J)) / J

    def pressed(across):
        return brentq(lambda s: cauchy(across, s)[2] + p, 0.3, 1.2, xtol=1e-15)

    across = brentq(lambda s: cauchy(s, pressed(s))[0], 1.0, 1.5, xtol=1e-15)
    stretch = np.r_[np.full(dim - 1, across), pressed(across)]
    assert np.abs(solution.displacement[0] - mesh.points * (stretch - 1)).max() < 1e-9
    assert solution.resultant[-1] == pytest.approx(p * across ** (dim - 1), rel=1e-9)


@pytest.mark.parametrize("timed", [True, False])
@pytest.mark.parametrize("dim", [2, 3])
def test_books_of_energy(dim, timed):
    """The loads work by p times the loss of volume, and the books of every step balance."""
    mesh = am.box((1,) * dim, cells=2)
    sides = [am.Fix("left", [0] + [None] * (dim - 1)), am.Fix("top", [None] * (dim - 1) + [0])]
    if dim == 3:
        sides.append(am.Fix("front", (None, 0, None)))
    p = am.Pressure("right", (lambda x, t: 0.2) if timed else 0.2)
    ground = am.Contact("bottom", am.Plane(np.eye(dim)[-1]), mu=0.3)
    block = am.Model([am.Body(mesh, NEO)], sides, [ground], [p])
    steps = list(am.evolve(block, am.QuasiStatic(0.5), until=1.0, tolerance=1e-12))
    for step in steps:
        assert abs(step.energies.defect) < 1e-10 * step.energies.turnover
    volume = [_volume(mesh, step.displacement[0]) for step in steps]
    if timed:  # all of it acts in the second step
        work = 0.2 * (volume[0] - volume[1])
        assert steps[1].energies.loads == pytest.approx(work, abs=1e-12)
        assert abs(steps[1].energies.loads) < 1e-10
    assert steps[0].energies.loads > 1e-3


def _volume(mesh, u):
    """Volume after displacements u (n, d)."""
    from amontons.mechanics.meshes.cells import CELLS

    total = 0.0
    for cells in mesh.cells:
        cell = CELLS[cells.kind]
        for at, weight in zip(*cell.gauss, strict=True):
            jac = cell.jacobians((mesh.points + u)[cells.nodes], at)
            total += weight * np.linalg.det(jac).sum()
    return total


def test_paths_and_steps_lead_where_solve_does():
    """A bar in 2D bent by a pressure that grows: along the path, in steps, at once."""
    mesh = am.box((4, 1), cells=(6, 1))
    ground = am.Contact("bottom", am.Plane((0, 1), (0, -0.3)), mu=0.4)
    body = am.Body(mesh, NEO)

    def bar(value):
        return am.Model([body], [am.Fix("left", 0)], [ground], [am.Pressure("top", value)])

    solution = am.solve(bar(0.01), tolerance=1e-12)
    assert set(solution.pattern) > {"f"}
    branch = am.follow(bar(0.01))
    timed = am.follow(bar(lambda x, t: 0.01 * t))
    *_, step = am.evolve(bar(0.01), am.QuasiStatic(1.0), until=1.0, tolerance=1e-12)
    for found in (branch.solutions[-1].v, timed.solutions[-1].v):
        assert np.abs(found - solution.solution.v).max() < 1e-8
    assert np.abs(step.displacement[0] - solution.displacement[0]).max() < 1e-8
    dead = am.solve(am.Model([body], [am.Fix("left", 0)], [ground],
                             [am.Traction("top", (0, -0.01))]))  # fmt: skip
    assert np.abs(dead.displacement[0] - solution.displacement[0]).max() > 1e-3
    with pytest.raises(am.InvalidInput, match="no straight line"):
        am.follow(bar(lambda x, t: 0.01 * t**2))
    crossed = am.QuasiStatic(0.5, crossing=am.PathCrossing())
    *_, step = am.evolve(bar(lambda x, t: 0.01 * t), crossed, until=1.0, tolerance=1e-11)
    assert step.passage.arrived


def test_in_small_strains_a_pressure_acts_along_the_undeformed_normal():
    mesh = MESHES["quad"]()
    linear = am.LinearElastic(1.0, 0.3)
    ground = am.Contact("bottom", am.Plane((0, 1)), mu=0.3)
    both = [
        am.solve(am.Model([am.Body(mesh, linear)], [am.Fix("left", 0)], [ground], [load]))
        for load in (am.Pressure("top", 0.1), am.Traction("top", (0, -0.1)))
    ]
    assert np.abs(both[0].displacement[0] - both[1].displacement[0]).max() < 1e-14
    *_, step = am.evolve(
        am.Model([am.Body(mesh, linear)], [am.Fix("left", 0)], [ground],
                 [am.Pressure("top", lambda x, t: 0.1 * t)]),
        am.QuasiStatic(0.5), until=1.0,
    )  # fmt: skip
    assert np.abs(step.displacement[0] - both[0].displacement[0]).max() < 1e-8
    empty = am.Model([am.Body(mesh, linear)], [am.Fix("left", 0)], [ground],
                     [am.Pressure("top", 0)])  # fmt: skip
    (warning,) = am.solve(empty).warnings
    assert "add a Traction, Pressure" in str(warning)


CASE = """
[mesh]
box = [2, 1]
cells = [4, 2]
[material.default]
law = "neo-hookean"
young = 1.0
poisson = 0.3
[[fix]]
on = "left"
value = [0, 0]
[[pressure]]
on = "top"
value = "0.02 + 0.01*x"
[[traction]]
on = "right"
value = [0, "-0.01*y"]
configuration = "current"
[[body_force]]
value = [0, -0.01]
configuration = "current"
[[contact]]
slave = "bottom"
obstacle = { plane = { normal = [0, 1] } }
friction = { coulomb = 0.3 }
"""


def test_case_files(tmp_path):
    path = tmp_path / "case.toml"
    path.write_text(CASE)
    found = am.solve(am.read_case(path).model, tolerance=1e-11)
    loads = [am.Pressure("top", lambda x: 0.02 + 0.01 * x[0]),
             am.Traction("right", lambda x: (0, -0.01 * x[1]), configuration="current"),
             am.BodyForce((0, -0.01), configuration="current")]  # fmt: skip
    ground = am.Contact("bottom", am.Plane((0, 1)), mu=0.3)
    same = am.Model([am.Body(am.box((2, 1), cells=(4, 2)), NEO)], [am.Fix("left", 0)],
                    [ground], loads)  # fmt: skip
    wanted = am.solve(same, tolerance=1e-11)
    assert np.abs(found.displacement[0] - wanted.displacement[0]).max() < 1e-12
    for old, new, words in (
        ('value = "0.02 + 0.01*x"', "value = [1, 2]", r"pressure\[0\].value"),
        ('value = "0.02 + 0.01*x"', 'value = "1/(x-1)"', "is inf at the point"),
        ('on = "top"', 'on = "tops"', r"pressure\[0\].on.*top"),
        ('configuration = "current"', 'configuration = "now"', "configuration"),
        ('law = "neo-hookean"', 'law = "linear-elastic"', "current.*large deformations"),
    ):
        path.write_text(CASE.replace(old, new))
        with pytest.raises(am.AmontonsError, match=words):
            am.solve(am.read_case(path).model)
    path.write_text(CASE.replace("0.02 + 0.01*x", "1/(x-1)"))
    broken = am.read_case(path)
    with pytest.raises(am.InvalidInput) as reason:
        am.solve(broken.model)
    assert broken.key_of(reason.value.at) == "pressure[0].value"


def test_what_can_not_be_is_said():
    mesh = MESHES["quad"]()
    with pytest.raises(am.InvalidInput, match="configuration: expected one of"):
        am.Traction("top", (0, 1), configuration="deformed")
    with pytest.raises(am.InvalidInput, match="pressure on 'top': expected a number"):
        am.Pressure("top", (0, 1))
    with pytest.raises(am.InvalidInput, match="traction on 'right'.*large deformations"):
        model(mesh, [LOADS["traction"]], am.LinearElastic(1, 0.3))
    with pytest.raises(am.InvalidInput, match="body force.*large deformations"):
        model(mesh, [LOADS["body force"]], am.LinearElastic(1, 0.3))
    with pytest.raises(am.InvalidInput, match="Pressure, BodyForce, NodalForce or Temperature"):
        model(mesh, ["right"])
    with pytest.raises(am.InvalidInput, match="surface 'rigth'"):
        model(mesh, [am.Pressure("rigth", 1.0)])
    bad = model(mesh, [am.Pressure("right", lambda x: np.nan)])
    with pytest.raises(am.InvalidInput, match="pressure on 'right'"):
        am.solve(bad)
