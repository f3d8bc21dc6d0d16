"""Hybrid cells: no locking near incompressibility, exact where the fields are polynomials."""

import re
from dataclasses import replace
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path

import numpy as np
import pytest
from body_checker import check_energy_forces_and_tangent

import amontons as am
from amontons.core.errors import InvertedCells
from amontons.mechanics.elements import stiffness
from amontons.mechanics.elements.hybrid import averaged, element_formulation, volume_modes
from amontons.mechanics.elements.hyperelasticity import HyperelasticBody
from amontons.mechanics.elements.nodal_stress import stress_of
from amontons.mechanics.elements.thermal import thermal_load
from amontons.mechanics.meshes import second_order
from amontons.mechanics.meshes.cells import CELLS
from amontons.mechanics.model.assembly import GRID_FROM, _grid

KINDS = ["quad", "tri6", "quad8", "quad9", "hex", "tet10", "hex20", "hex27"]
BENT = ["quad incompatible", "hex incompatible"]  # with bending modes, too
FIRST = {"tri6": "tri", "quad8": "quad", "quad9": "quad", "tet10": "tet", "hex20": "hex",
         "hex27": "hex"}  # fmt: skip


def mesh_of(kind, integration="hybrid", axisymmetric=False):
    """A small box of one kind of cells, its inside distorted."""
    if kind in BENT:
        kind = kind.split()[0]
        integration = "hybrid-incompatible" if integration == "hybrid" else integration
    first = FIRST.get(kind, kind)
    dim = 2 if first in ("tri", "quad") else 3
    box = am.box((2.0, 1.5, 1.0)[:dim], (2, 2, 2)[:dim], first)
    moved = box.points + 0.05 * np.sin(3 * box.points[:, ::-1])
    mesh = am.Mesh(moved, box.cells, box.surfaces)
    if first != kind:
        mesh = second_order(mesh, serendipity=kind in ("quad8", "hex20"))
    cells = tuple(replace(block, integration=integration) for block in mesh.cells)
    return replace(mesh, cells=cells, axisymmetric=axisymmetric)


@pytest.mark.parametrize("kind", KINDS + BENT)
def test_uniform_strains_are_those_of_full_integration(kind):
    law = am.LinearElastic(2.0, 0.4999)
    mesh = mesh_of(kind)
    u = mesh.points @ np.random.default_rng(0).normal(size=(mesh.dim, mesh.dim))
    K, full = stiffness(mesh, law), stiffness(mesh_of(kind, "full"), law)
    size = abs(full.data).max()
    np.testing.assert_allclose(K @ u.ravel(), full @ u.ravel(), atol=1e-9 * size)
    assert abs((K - K.T).data).max(initial=0.0) == 0.0
    for mine, other in zip(stress_of(mesh, law, u), stress_of(mesh_of(kind, "full"), law, u),
                           strict=True):  # fmt: skip
        np.testing.assert_allclose(mine, other, atol=1e-9 * law.lame_lambda())


@pytest.mark.parametrize("kind", ["quad", "hex", "quad9", "tet10", *BENT])
def test_only_rigid_motions_are_free(kind):
    mesh = mesh_of(kind)
    values = np.linalg.eigvalsh(stiffness(mesh, am.LinearElastic(1.0, 0.3)).toarray())
    rigid = 3 if mesh.dim == 2 else 6
    assert abs(values[:rigid]).max() < 1e-12 < 1e-3 < values[rigid]


@pytest.mark.parametrize("kind", ["quad8", "quad9", "hex20", "hex27"])
def test_polynomials_of_the_volume_are_orthonormal_and_linear(kind):
    mesh = mesh_of(kind)
    (cells,) = mesh.cells
    cell = CELLS[kind]
    modes, volumes = volume_modes(mesh, cells, cell.stiffness)
    gram = np.einsum("kmq,kq,knq->kmn", modes, volumes, modes)
    np.testing.assert_allclose(gram - np.eye(mesh.dim + 1), 0, atol=1e-12)
    x = np.einsum("qa,kac->kqc", cell.shape(cell.stiffness[0]), mesh.points[cells.nodes])
    linear = 1 + x @ np.arange(1.0, 1 + mesh.dim)
    np.testing.assert_allclose(averaged(modes, volumes, linear), linear, rtol=1e-11)
    there, _ = volume_modes(mesh, cells, cell.stiffness, cell.corners)
    corners = 1 + mesh.points[cells.nodes] @ np.arange(1.0, 1 + mesh.dim)
    np.testing.assert_allclose(averaged(modes, volumes, linear, there), corners, rtol=1e-11)


def test_cells_are_hybrid_where_the_material_is_nearly_incompressible():
    auto = am.box((1, 1), 1)
    full, triangles = mesh_of("quad", "full"), am.box((1, 1), 1, "tri")
    soft, stiff = am.LinearElastic(1.0, 0.4999), am.LinearElastic(1.0, 0.3)
    thin = am.LinearElastic(1.0, 0.4999, plane="stress")
    wood = am.OrthotropicElastic((1.0,) * 3, (0.3,) * 3, (0.4,) * 3)
    for mesh, law, wanted in (
        (auto, soft, "hybrid-incompatible"), (auto, stiff, "full"), (auto, thin, "full"),
        (mesh_of("quad"), soft, "hybrid"), (mesh_of("tet10", "auto"), soft, "hybrid"),
        (replace(auto, axisymmetric=True), soft, "hybrid"),
        (full, soft, "full"), (triangles, soft, "full"), (mesh_of("quad"), stiff, "hybrid"),
        (auto, wood, "full"), (mesh_of("quad"), thin, "full"),
    ):  # fmt: skip
        assert element_formulation(mesh, mesh.cells[0], law) == wanted


# ------------------------------------------------------------------ Cook's membrane
def cook(n, kind, poisson, integration="auto"):
    """Deflection of the corner of Cook's tapered panel, clamped left, sheared right."""
    first = FIRST.get(kind, kind)
    box = am.box((1, 1), n, first)
    s, t = box.points.T
    points = np.stack([48 * s, 44 * s + t * (44 - 28 * s)], axis=1)
    mesh = am.Mesh(points, tuple(replace(b, integration=integration) for b in box.cells),
                   box.surfaces)  # fmt: skip
    away = am.Contact("bottom", am.Plane((0, 1), (0, -99)), mu=0.0)
    body = am.Body(mesh, am.LinearElastic(1.0, poisson), order=1 if kind == first else 2)
    pull = am.Traction("right", (0, 1 / 16))
    solution = am.solve(am.Model([body], [am.Fix("left", (0, 0))], [away], [pull]))
    corner = np.abs(body.mesh.points - (48, 60)).sum(axis=1).argmin()
    return solution.displacement[0][corner, 1]


@pytest.mark.parametrize(("kind", "share"), [("quad", 0.03), ("quad9", 0.01), ("tri6", 0.006)])
def test_cooks_membrane_converges_as_fast_near_incompressibility(kind, share):
    """Errors at poisson 0.4999 on 8 x 8 cells; full integration misses 72, 6 and 9 percent."""
    reference = 19.408  # 64 x 64 quad9, hybrid; 32 x 32 tri6 gives the same four digits
    assert abs(cook(8, kind, 0.4999) / reference - 1) < share
    assert abs(cook(8, kind, 0.4999, "full") / reference - 1) > 5 * share


# ------------------------------------------------------------------ a pressed block
def pressed(cells, poisson=0.4999, integration="auto", order=1, **options):
    """Force on a block of 2 x 1 between a bonded and a rubbing side, pressed by 2 percent."""
    mesh = am.box((2, 1), cells)
    mesh = replace(mesh, cells=tuple(replace(b, integration=integration) for b in mesh.cells))
    body = am.Body(mesh, am.LinearElastic(1.0, poisson), order=order, **options)
    floor = am.Contact("bottom", am.Plane((0, 1)), mu=0.5)
    return am.solve(am.Model([body], [am.Fix("top", (0, -0.02))], [floor])).resultant[1]


@pytest.mark.parametrize(("axisymmetric", "reference"), [(False, 0.100492), (True, 0.635103)])
def test_a_pressed_block(axisymmetric, reference):
    """Against 64 x 32 quad9; 16 x 8 cells with full integration are five times too stiff."""
    options = {"axisymmetric": axisymmetric}
    assert pressed((16, 8), **options) == pytest.approx(reference, rel=0.02)
    assert pressed((8, 4), order=2, **options) == pytest.approx(reference, rel=0.005)
    assert pressed((16, 8), integration="full", **options) > 4 * reference


# ------------------------------------------------------------------ as benchmarks/locking.py
spec = spec_from_file_location(
    "locking", Path(__file__).parents[3] / "benchmarks" / "locking.py"
)
LOCKING = module_from_spec(spec)
spec.loader.exec_module(LOCKING)
BAR = [  # problem, cells, order, their number: what is within 1 percent of the reference
    ("cook", "quad", 2, 8), ("cook", "tri", 2, 8), ("cook", "hex", 2, 8),
    ("block", "quad", 2, 4), ("block", "tri", 2, 4), ("block", "quad", 1, 16),
    ("cook", "quad", 1, 32), ("cook", "hex", 1, 32),
    ("block", "hex", 2, 4), ("block", "tet", 2, 4),
]  # fmt: skip


@pytest.mark.parametrize("law", ["linear", "rubber"])
@pytest.mark.parametrize(("problem", "kind", "order", "n"), BAR)
def test_cells_taken_by_default_are_within_one_percent(problem, kind, order, n, law):
    """Cook's membrane in plane strain, a pressed block; 2D and 3D, small and finite strains."""
    flat = problem == "cook" or kind in ("quad", "tri")
    reference = LOCKING.REFERENCE[problem, law, 2 if flat else 3]
    found = getattr(LOCKING, problem)(n, LOCKING.LAWS[law], kind, order)
    assert found == pytest.approx(reference, rel=0.01)


@pytest.mark.parametrize("law", ["linear", "rubber"])
def test_a_slice_between_two_planes_is_plane_strain(law):
    """Quads and hexahedra of first order have the same deflection."""
    flat, slice_ = (LOCKING.cook(4, LOCKING.LAWS[law], kind, 1) for kind in ("quad", "hex"))
    assert slice_ == pytest.approx(flat, rel=1e-7)  # two solves to 1e-8


@pytest.mark.parametrize("law", ["linear", "rubber"])
@pytest.mark.parametrize("kind", ["tri", "tet"])
def test_simplices_of_first_order_lock_and_say_so(kind, law):
    """The factor that is told is within a third of the true one; planes of symmetry, which are
    taken for free sides, have it too large."""
    solution = LOCKING.solved_block(4, LOCKING.LAWS[law], kind, 1)
    (warning,) = solution.warnings
    assert warning.name == "volumetric-locking"
    factor = float(re.search(r"about ([\d.e+]+) times", str(warning)).group(1))
    reference = LOCKING.REFERENCE["block", law, 2 if kind == "tri" else 3]
    true = solution.resultant[-1] / reference
    assert true > 10
    assert 0.75 < factor / true < (1.5 if kind == "tri" else 6)


# ------------------------------------------------------------------ heat
@pytest.mark.parametrize("kind", KINDS + BENT)
@pytest.mark.parametrize("axisymmetric", [False, True])
def test_heat_that_may_spread_leaves_no_stress(kind, axisymmetric):
    mesh = mesh_of(kind, axisymmetric=False)
    if axisymmetric and mesh.dim == 3:
        pytest.skip("axisymmetric meshes are in 2D")
    mesh = replace(mesh, points=mesh.points + 1.0, axisymmetric=axisymmetric)
    law, change = am.LinearElastic(1.0, 0.4999, expansion=1e-3), np.full(len(mesh.points), 7.0)
    u = 7e-3 * mesh.points
    if mesh.dim == 2 and not axisymmetric:
        u *= 1 + law.poisson  # plane strain
    load = thermal_load(mesh, law, change)
    np.testing.assert_allclose(stiffness(mesh, law) @ u.ravel(), load.ravel(),
                               atol=1e-10 * abs(load).max())  # fmt: skip
    for stress in stress_of(mesh, law, u, change):
        assert abs(stress[:, :2, :2]).max() < 1e-10 * law.lame_lambda()


# ------------------------------------------------------------------ finite strains
LAWS = (am.NeoHookean(1.0, 0.4999), am.CiarletGeymonat(1.0, 0.49))


def deformed(mesh, size=0.1):
    """Displacements of an admissible deformation that is not uniform."""
    x = mesh.points
    return size * np.sin(x[:, ::-1] * 2) + 0.5 * size * x[:, :1] * x


@pytest.mark.parametrize("law", LAWS, ids=repr)
@pytest.mark.parametrize("kind", KINDS + BENT)
def test_forces_and_tangent_at_finite_strains_are_derivatives(kind, law):
    mesh = mesh_of(kind)
    check_energy_forces_and_tangent(HyperelasticBody(mesh, law), deformed(mesh))


@pytest.mark.parametrize("law", LAWS, ids=repr)
@pytest.mark.parametrize("kind", KINDS + BENT)
def test_uniform_finite_strains_are_those_of_full_integration(kind, law):
    mesh, full = mesh_of(kind), mesh_of(kind, "full")
    slope = 0.2 * np.random.default_rng(2).uniform(-1, 1, (mesh.dim, mesh.dim))
    u = mesh.points @ slope.T
    mine, other = HyperelasticBody(mesh, law), HyperelasticBody(full, law)
    size = law.lame_lambda()
    np.testing.assert_allclose(mine.forces(u), other.forces(u), atol=1e-11 * size)
    assert mine.energy(u) == pytest.approx(other.energy(u), rel=1e-11)
    for a, b in zip(stress_of(mesh, law, u), stress_of(full, law, u), strict=True):
        np.testing.assert_allclose(a, b, atol=1e-10 * size)


@pytest.mark.parametrize("kind", KINDS + BENT)
def test_turning_the_deformed_body_turns_its_forces(kind):
    mesh, law = mesh_of(kind), LAWS[0]
    body, u = HyperelasticBody(mesh, law), deformed(mesh)
    Q = np.linalg.qr(np.random.default_rng(3).normal(size=(mesh.dim, mesh.dim)))[0]
    Q[0] *= np.linalg.det(Q)
    forces, turned = body.forces(u), (mesh.points + u) @ Q.T - mesh.points
    size = 1e-10 * abs(forces).max()
    np.testing.assert_allclose(body.forces(turned), forces @ Q.T, atol=size)
    assert abs(body.forces(mesh.points @ (Q.T - np.eye(mesh.dim)))).max() < 1e-11


@pytest.mark.parametrize("law", LAWS, ids=repr)
@pytest.mark.parametrize("kind", KINDS + BENT)
def test_the_tangent_at_rest_is_that_of_small_strains(kind, law):
    mesh = mesh_of(kind)
    body = HyperelasticBody(mesh, law)
    linear = stiffness(mesh, am.LinearElastic(law.young, law.poisson)).tocsr()
    tangent = body.matrix(body.tangent(np.zeros_like(mesh.points))[1]).tocsr()
    # more points of integration at finite strains than the small ones of distorted cells
    share = 1e-12 if CELLS[kind.split()[0]].order == 1 else 2e-2
    assert abs(tangent - linear).max() < share * abs(linear).max()


@pytest.mark.parametrize("kind", ["quad", "quad9", "hex", *BENT])
def test_inverted_hybrid_cells_are_named(kind):
    mesh = mesh_of(kind)
    body, u = HyperelasticBody(mesh, LAWS[0]), np.zeros_like(mesh.points)
    u[:, -1] = -2 * mesh.points[:, -1]
    for ask in (body.forces, body.tangent, body.energy):
        with pytest.raises(InvertedCells, match="det F is -1"):
            ask(u)
        with pytest.raises(InvertedCells):
            ask(np.full_like(u, np.nan))


# ------------------------------------------------------------------ what is said and asked for
def test_a_body_says_how_its_cells_are_integrated():
    soft = am.LinearElastic(1.0, 0.4999)
    floor = [am.Contact("bottom", am.Plane((0, 1)), mu=0.5)]

    def said(**options):
        body = am.Body(am.box((1, 1), 2), soft, **options)
        return str(am.solve(am.Model([body], [am.Fix("top", (0, -0.01))], floor)))

    assert "quad hybrid-incompatible (pressure constant in the cell: no locking)" in said()
    assert "quad9 hybrid (pressure linear in the cell: no locking)" in said(order=2)
    assert "elements:" not in said(integration="full")
    with pytest.raises(am.InvalidInput, match="integration: expected auto or full"):
        am.Body(am.box((1, 1), 2), soft, integration="reduced")


def test_large_boxes_have_the_integration_of_their_cells():
    """Their stiffness is an operator made of one cell."""
    mesh = am.box((1, 1, 1), 2 * round((GRID_FROM / 3) ** (1 / 3) / 2 + 1))
    u = np.random.default_rng(0).normal(size=mesh.points.size)
    for integration in ("full", "hybrid", "hybrid-incompatible"):
        body = am.Body(mesh, am.LinearElastic(1.0, 0.49), integration=integration)
        force = stiffness(body.mesh, body.material) @ u
        np.testing.assert_allclose(_grid([body]) @ u, force, atol=1e-10 * abs(force).max())
