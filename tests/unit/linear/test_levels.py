"""Levels: uniform refinement, boxes, prolongations of the free unknowns."""

import dataclasses

import numpy as np
import pytest
from scipy import sparse

import amontons as am
from amontons.core.errors import FileFormatError, InvalidInput
from amontons.io.case import read_case
from amontons.linear.levels import free_levels
from amontons.mechanics.elements import stiffness
from amontons.mechanics.meshes import second_order
from amontons.mechanics.meshes.cells import CELLS
from amontons.mechanics.meshes.facets import Cells
from amontons.mechanics.meshes.surfaces import facet_areas

KINDS = ["tri", "quad", "tet", "hex", "wedge", "pyramid"]
LAW = am.LinearElastic(200, 0.3)


def volume(mesh):
    """Volume of all cells, by Gauss points."""
    return sum(
        weight * np.abs(np.linalg.det(CELLS[b.kind].jacobians(mesh.points[b.nodes], at))).sum()
        for b in mesh.cells
        for at, weight in zip(*CELLS[b.kind].gauss, strict=True)
    )


def single(kind):
    """One distorted cell with its whole boundary as a surface."""
    corners = CELLS[kind].corners.astype(float)
    slope = np.eye(corners.shape[1]) + 0.2 * np.random.default_rng(3).normal(
        size=(corners.shape[1],) * 2
    )
    mesh = am.Mesh(corners @ slope.T, (Cells(kind, np.arange(len(corners))[None], "part"),))
    return am.Mesh(mesh.points, mesh.cells, {"skin": mesh.boundary})


def linear(points):
    return points @ np.arange(1.0, points.shape[1] + 1) - 3


@pytest.mark.parametrize("kind", KINDS)
def test_refined_keeps_volume_area_region_and_linear_functions(kind):
    mesh = single(kind)
    fine = am.refined(mesh, 2)
    assert volume(fine) == pytest.approx(volume(mesh), rel=1e-12)
    areas = [
        sum(facet_areas(m.points, f).sum() for f in m.surface("skin")) for m in (mesh, fine)
    ]
    assert areas[1] == pytest.approx(areas[0], rel=1e-12)
    assert fine.regions == ("part",)
    assert sum(len(b.nodes) for b in fine.boundary) == sum(
        len(b.nodes) for b in fine.surface("skin")
    )
    first, second = fine.levels
    assert second.shape[1] == len(mesh.points) and first.shape[0] == len(fine.points)
    np.testing.assert_allclose(first @ second @ linear(mesh.points), linear(fine.points))


@pytest.mark.parametrize("kind", KINDS[:4])
def test_refined_box_is_the_finer_box(kind):
    dim = CELLS[kind].dim
    fine, other = am.refined(am.box((1,) * dim, 2, kind)), am.box((1,) * dim, 4, kind)
    assert fine.cell_count == other.cell_count and len(fine.points) == len(other.points)
    assert len(fine.levels) == len(other.levels) == 2  # the box of 2 has a level of its own


@pytest.mark.parametrize("kind", KINDS[:4])
@pytest.mark.parametrize("make", ["box", "refined"])
def test_galerkin_equals_the_stiffness_of_the_coarse_mesh(kind, make):
    dim = CELLS[kind].dim
    size = (1.0, 1.3, 0.7)[:dim]
    coarse = am.box(size, 2, kind)
    fine = am.box(size, 4, kind) if make == "box" else am.refined(coarse)
    P = sparse.kron(fine.levels[0], np.eye(dim))
    galerkin = (P.T @ stiffness(fine, LAW) @ P).toarray()
    np.testing.assert_allclose(galerkin, stiffness(coarse, LAW).toarray(), atol=1e-9)


@pytest.mark.parametrize(
    ("kind", "size", "coarser"),
    [("quad", (4, 1), (4, 2)), ("hex", (1, 1, 3), (2, 2, 4)), ("hex", (8, 8, 1), (4, 4, 2))],
)
def test_stretched_cells_are_halved_along_their_short_sides(kind, size, coarser):
    fine, coarse = am.box(size, 4, kind), am.box(size, coarser, kind)
    P = sparse.kron(fine.levels[0], np.eye(len(size)))
    galerkin = (P.T @ stiffness(fine, LAW) @ P).toarray()
    np.testing.assert_allclose(galerkin, stiffness(coarse, LAW).toarray(), atol=1e-9)


@pytest.mark.parametrize("kind", ["tri", "tet"])
def test_first_order_is_a_level_of_second_order(kind):
    dim = CELLS[kind].dim
    coarse = am.refined(single(kind))
    fine = second_order(coarse)
    assert len(fine.levels) == 2
    P = sparse.kron(fine.levels[0], np.eye(dim))
    galerkin = (P.T @ stiffness(fine, LAW) @ P).toarray()
    np.testing.assert_allclose(galerkin, stiffness(coarse, LAW).toarray(), atol=1e-8)


def test_tetrahedra_do_not_degenerate_when_refined_again():
    mesh = am.box((1, 1, 1), 1, "tet")
    fine = am.refined(mesh, 3)
    (block,) = fine.cells
    points = fine.points[block.nodes]
    edges = np.linalg.norm(points[:, :, None] - points[:, None], axis=-1).max(axis=(1, 2))
    height = edges**3 / np.abs(np.linalg.det(points[:, 1:] - points[:, :1]))
    assert height.max() < 1.01 * 3**1.5  # as flat as the six that fill a cube


def model(cells=4, **changes):
    options = dict(
        supports=[am.Fix("top", (0, 0.2, -0.06)), am.Fix("left", (0, None, None))],
        contacts=[am.Contact("bottom", am.Plane((0, 0, 1)), mu=0.5)],
    )
    return am.Model([am.Body(am.box((1, 1, 1), cells), LAW)], **(options | changes))


def test_levels_of_a_problem_leave_out_what_supports_prescribe():
    problem, coarse = model(4).assemble(), model(2).assemble()
    assert [P.shape for P in problem.levels] == [
        (problem.unknowns, coarse.unknowns), (coarse.unknowns, model(1).assemble().unknowns),
    ]  # fmt: skip
    P = problem.levels[0]
    assert abs(P.T @ problem.M @ P - coarse.M).max() < 1e-9
    assert problem.with_mu(0.1).levels is problem.levels


def test_bodies_with_fewer_levels_stay_as_they_are():
    fine, plain = am.box((1, 1), 4), am.box((1, 1), 3)
    nodes = [len(m.points) for m in (fine, plain)]
    fixed = np.zeros(2 * sum(nodes), dtype=bool)
    first, second = free_levels([fine.levels, plain.levels], nodes, 2, fixed)
    assert first.shape == (2 * (25 + 16), 2 * (9 + 16))
    assert second.shape == (2 * (9 + 16), 2 * (4 + 16))
    np.testing.assert_array_equal(first[50:, 18:].toarray(), np.eye(32))
    fixed[:] = True
    assert free_levels([fine.levels, plain.levels], nodes, 2, fixed) == ()


def test_bad_levels_are_named():
    mesh = am.box((1, 1), 2)
    with pytest.raises(InvalidInput, match=r"levels\[0\].*16 rows"):
        am.Mesh(am.box((1, 1), 3).points, am.box((1, 1), 3).cells, levels=mesh.levels)
    problem = model(2).assemble()
    with pytest.raises(InvalidInput, match=r"levels\[1\]"):
        am.FrictionProblem.from_global(
            problem.M, problem.H, problem.f, problem.w, problem.law,
            levels=(problem.levels[0],) * 2,
        )  # fmt: skip
    with pytest.raises(InvalidInput, match="times"):
        am.refined(mesh, 1.5)
    with pytest.raises(InvalidInput, match="first order"):
        am.refined(second_order(mesh))
    with pytest.raises(InvalidInput, match="coarse node 0"):
        free_levels([(0.5 * mesh.levels[0],)], [9], 2, np.zeros(18, dtype=bool))


SQUARE = """$MeshFormat
2.2 0 8
$EndMeshFormat
$PhysicalNames
2
1 1 "bottom"
1 2 "top"
$EndPhysicalNames
$Nodes
4
1 0 0 0
2 1 0 0
3 1 1 0
4 0 1 0
$EndNodes
$Elements
4
1 1 2 1 1 1 2
2 1 2 2 2 3 4
3 2 2 3 3 1 2 3
4 2 2 3 3 1 3 4
$EndElements
"""
CASE = """
[mesh]
file = "square.msh"
refine = {refine}

[material.default]
young = 200
poisson = 0.3

[[fix]]
on = "top"
value = [0, -0.1]

[[contact]]
slave = "bottom"
friction.coulomb = 0.3
obstacle = {{ plane = {{ normal = [0, 1] }} }}
"""


def test_case_files_refine_mesh_files(tmp_path):
    path = tmp_path / "case.toml"
    (tmp_path / "square.msh").write_text(SQUARE)
    path.write_text(CASE.format(refine=2))
    (body,) = read_case(path).model.bodies
    assert body.mesh.cell_count == 32 and len(body.mesh.levels) == 2
    for wrong in (-1, 40):
        path.write_text(CASE.format(refine=wrong))
        with pytest.raises(FileFormatError, match=r"mesh\.refine"):
            read_case(path)


@pytest.mark.parametrize(("ratio", "geometric"), [(10, True), (1e3, False)])
def test_levels_heed_jumps_of_the_stiffness(ratio, geometric):
    """Soft layers between stiff ones, in no relation to the levels of the box.

    Levels that bridged the layers took 38 iterations, aggregates that did 46.
    """
    mesh = am.box((1, 1, 1), cells=8)
    nodes = mesh.cells[0].nodes
    stiff = np.floor(5 * mesh.points[nodes].mean(axis=1)[:, 2]) % 2 == 0
    cells = (Cells("hex", nodes[stiff], "stiff"), Cells("hex", nodes[~stiff], "soft"))
    laws = {"stiff": LAW, "soft": am.LinearElastic(200 / ratio, 0.3)}
    model = am.Model(
        [am.Body(dataclasses.replace(mesh, cells=cells, grid=None), laws)],
        [am.Fix("top", (0, 0, -0.01))],
        [am.Contact("bottom", am.Plane((0, 0, 1), (0, 0, 0)), mu=0.3)],
    )
    problem = model.assemble().assembled()
    free = np.asarray(abs(problem.H).sum(axis=1)).ravel() == 0
    clamped = sparse.csc_array(problem.M[free][:, free])
    modes = problem.near_nullspace
    factor = am.GeometricMultigrid(tolerance=1e-8).factor(clamped, modes[free])
    factor.solve(np.asarray(problem.f[free]))
    assert factor.iterations <= 20
    given = am.GeometricMultigrid(problem.levels).factor(problem.M, modes)
    assert (given.hierarchy.geometric > 1) == geometric


def test_a_flat_cell_is_no_jump_of_the_stiffness():
    """One node within a hundredth of its neighbour: couplings grow, levels of the mesh stay."""
    mesh = am.refined(am.box((1, 1, 1), cells=4, kind="tet"))
    near = np.linalg.norm(mesh.points - [0.375, 0.5, 0.5], axis=1).argmin()
    points = np.array(mesh.points)
    points[near] += 0.99 * (np.array([0.5, 0.5, 0.5]) - points[near])
    model = am.Model(
        [am.Body(dataclasses.replace(mesh, points=points), LAW)],
        [am.Fix("top", (0, 0, -0.01))],
        [am.Contact("bottom", am.Plane((0, 0, 1), (0, 0, 0)), mu=0.3)],
    )
    problem = model.assemble()
    A = problem.hierarchy.levels[0].A
    size = np.sqrt(np.einsum("kij,kij->k", A.data, A.data))
    assert size.max() > 50 * np.median(size)
    assert problem.hierarchy.geometric == len(problem.levels) + 1
