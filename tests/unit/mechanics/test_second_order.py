"""Second order: nodes, exactness for quadratic fields, loads, contact, output, case files."""

from itertools import product
from math import factorial

import meshio
import numpy as np
import pytest
from scipy.sparse.linalg import spsolve

import amontons as am
from amontons.core.errors import FileFormatError, InvalidInput
from amontons.io.case import read_case
from amontons.mechanics.contact import contact_nodes
from amontons.mechanics.elements import cell_stress, stiffness
from amontons.mechanics.elements.elasticity import body_load
from amontons.mechanics.meshes import second_order
from amontons.mechanics.meshes.cells import CELLS, FIRST
from amontons.mechanics.meshes.facets import Cells
from amontons.mechanics.meshes.surfaces import nodal_weights, surface_load

KINDS = [("tri", 2), ("quad", 2), ("tet", 3), ("hex", 3)]
LAW = am.LinearElastic(200, 0.3)
WEDGE = am.Mesh(CELLS["wedge"].corners, (Cells("wedge", np.arange(6)[None]),))


def sheared(kind, dim, cells=2):
    """A box under an affine map, which keeps quadratic fields exact on quadrilaterals."""
    mesh = am.box((1,) * dim, cells, kind)
    slope = np.eye(dim) + 0.2 * np.random.default_rng(0).normal(size=(dim, dim))
    points = mesh.points
    if kind in ("tri", "tet"):  # these may be distorted as well
        inner = ((points > 0) & (points < 1)).all(axis=1)
        points = points + 0.06 * inner[:, None] * np.sin(7 * points)
    return am.Mesh(points @ slope.T, mesh.cells, mesh.surfaces)


class Quadratic:
    """A quadratic displacement A x x + G x and what Hooke's law makes of it."""

    def __init__(self, dim, law, seed=1):
        rng = np.random.default_rng(seed)
        A = rng.normal(size=(dim, dim, dim))
        self.A, self.G = A + A.swapaxes(1, 2), rng.normal(size=(dim, dim))
        self.lame, self.shear = law.lame_lambda(dim), law.shear
        laplace, divergence = np.einsum("ijj->i", self.A), np.einsum("jji->i", self.A)
        self.force = -2 * (self.shear * (laplace + divergence) + self.lame * divergence)

    def __call__(self, x):
        return np.einsum("ijk,nj,nk->ni", self.A, x, x) + x @ self.G.T

    def stress(self, x):
        slope = 2 * np.einsum("ijk,nk->nij", self.A, x) + self.G
        trace = np.trace(slope, axis1=1, axis2=2)[:, None, None]
        twice_strain = slope + slope.swapaxes(1, 2)
        return self.shear * twice_strain + self.lame * trace * np.eye(len(self.G))


def outer_nodes(mesh):
    return np.unique(np.concatenate([block.nodes.ravel() for block in mesh.boundary]))


def solved(mesh, law, exact, force):
    """Displacement with the exact one prescribed on the whole boundary."""
    K = stiffness(mesh, law).tocsr()
    fixed = np.zeros(mesh.points.shape, dtype=bool)
    fixed[outer_nodes(mesh)] = True
    fixed = fixed.ravel()
    u = np.where(fixed, exact.ravel(), 0.0)
    rest = body_load(mesh, force).ravel() - K @ u
    u[~fixed] = spsolve(K[~fixed][:, ~fixed].tocsc(), rest[~fixed])
    return u.reshape(exact.shape)


# --------------------------------------------------------------------------------- meshes
@pytest.mark.parametrize(("kind", "dim"), KINDS)
def test_nodes_are_those_of_the_finer_box(kind, dim):
    coarse, fine = am.box((1,) * dim, 2, kind), am.box((1,) * dim, 4, kind)
    mesh = second_order(coarse)
    assert mesh.order == 2 and coarse.order == 1
    assert mesh.grid is None
    assert second_order(mesh) is mesh
    np.testing.assert_array_equal(mesh.points[: len(coarse.points)], coarse.points)
    np.testing.assert_allclose(
        np.unique(mesh.points.round(12), axis=0), np.unique(fine.points, axis=0)
    )
    assert len(mesh.points) == len(fine.points)
    assert FIRST[mesh.cells[0].kind] == kind
    for name in coarse.surfaces:
        on = mesh.points[mesh.surface_nodes(name)]
        there = fine.points[fine.surface_nodes(name)]
        np.testing.assert_allclose(np.unique(on, axis=0), np.unique(there, axis=0))
    named = sum(len(f.nodes) for s in mesh.surfaces.values() for f in s)
    assert sum(len(b.nodes) for b in mesh.boundary) == named


def test_touching_bodies_keep_their_own_nodes():
    box = am.box((1, 1), 1)
    both = am.Mesh(
        np.concatenate([box.points, box.points + [1, 0]]),
        (box.cells[0], Cells("quad", box.cells[0].nodes + 4, "right")),
    )
    mesh = second_order(both)
    assert len(mesh.points) == 18
    assert mesh.regions == ("default", "right")
    assert np.linalg.matrix_rank(stiffness(mesh, LAW).toarray(), tol=1e-9) == 36 - 6


def test_mixed_meshes():
    points = np.array([[0, 0], [1, 0], [1, 1], [0, 1], [2, 0.5]])
    mesh = am.Mesh(points, (Cells("tri", np.array([[1, 4, 2]])),
                            Cells("quad", np.array([[0, 1, 2, 3]]))))  # fmt: skip
    mesh = second_order(mesh)
    field = Quadratic(2, LAW)
    load = stiffness(mesh, LAW) @ field(mesh.points).ravel()
    inside = np.setdiff1d(np.arange(len(mesh.points)), outer_nodes(mesh))
    body = body_load(mesh, np.tile(field.force, (len(mesh.points), 1)))
    assert len(inside) == 2  # the shared edge and the centre
    np.testing.assert_allclose(load.reshape(-1, 2)[inside], body[inside], atol=1e-10)


def test_what_has_no_second_order():
    with pytest.raises(InvalidInput, match="wedge.*tri, quad, tet, hex"):
        second_order(WEDGE)
    with pytest.raises(InvalidInput, match="wedge"):
        am.Body(WEDGE, LAW, order=2)
    for order in (0, 3, 1.5, None, "2"):
        with pytest.raises(InvalidInput, match="order: expected 1 or 2"):
            am.Body(am.box((1, 1), 1), LAW, order=order)


def test_curved_sides_keep_uniform_strains():
    """Of the cells of first order with the same corners; a side that folds is refused."""
    mesh = second_order(am.box((1, 1), 2, "tri"))
    bent = mesh.points.copy()
    bent[-1] += 0.01
    curved = am.Mesh(bent, mesh.cells)
    slope = np.array([[1.0, 2.0], [-0.5, 3.0]]) * 1e-3
    force = stiffness(curved, LAW) @ (curved.points @ slope.T).ravel()
    inner = np.setdiff1d(np.arange(len(bent)), outer_nodes(curved))
    assert np.abs(force.reshape(-1, 2)[inner]).max() < 1e-13 * 200
    bent[-1, 1] -= 0.8
    with pytest.raises(InvalidInput, match="folded"):
        am.Mesh(bent, mesh.cells)


def test_cells_of_both_orders_share_no_nodes():
    mesh = second_order(am.box((1, 1), 1, "tri"))
    first = am.Mesh(mesh.points[:4], (Cells("quad", np.array([[0, 1, 3, 2]])),))
    with pytest.raises(InvalidInput, match=r"points\[0\]: .*first and of second order"):
        am.Mesh(mesh.points, (*mesh.cells, *first.cells))


@pytest.mark.parametrize("kind", ["quad", "tri"])
def test_parts_of_both_orders_in_one_mesh_are_as_in_two(kind):
    """A block of second order on one of first order, in one mesh or as two bodies."""
    upper = second_order(am.box((2, 1), (3, 2), kind, origin=(0, 1)))
    lower = am.box((2, 1), (4, 2), kind)
    n = len(lower.points)
    sides = {"on": lower.surfaces["top"], "floor": lower.surfaces["bottom"]}
    sides |= {
        name: tuple(type(f)(f.kind, f.nodes + n) for f in upper.surfaces[old])
        for name, old in (("under", "bottom"), ("push", "top"))
    }
    cells = (*lower.cells, *(Cells(c.kind, c.nodes + n, "upper") for c in upper.cells))
    one = am.Mesh(np.vstack([lower.points, upper.points]), cells, sides)
    assert one.order == 2

    def solved(bodies, under, on, floor, push):
        contact = am.Contact(under, master=on, mu=0.2)
        return am.solve(am.Model(bodies, [am.Fix(floor, 0.0)], [contact],
                                 [am.Traction(push, (0.1, -1.0))]))  # fmt: skip

    law = am.LinearElastic(100.0, 0.3)
    alone = solved([am.Body(one, law)], "under", "on", "floor", "push")
    two = solved(
        [am.Body(lower, law, name="low"), am.Body(upper, law, name="up")],
        "up.bottom", "low.top", "low.bottom", "up.top",
    )
    np.testing.assert_allclose(
        alone.displacement[0], np.vstack([*two.displacement]), rtol=0, atol=1e-9
    )


@pytest.mark.parametrize("kind", ["tri6", "tet10", "quad9", "hex27", "line3"])
def test_gauss_points_integrate_products_of_shape_functions(kind):
    cell = CELLS[kind]
    points, weights = cell.gauss
    simplex = kind in ("tri6", "tet10")
    for powers in product(range(5), repeat=cell.dim):
        if simplex and sum(powers) > 4:
            continue
        exact = (
            np.prod([factorial(p) for p in powers]) / factorial(sum(powers) + cell.dim)
            if simplex
            else np.prod([1 / (p + 1) for p in powers])
        )
        assert weights @ (points**powers).prod(axis=1) == pytest.approx(exact, rel=1e-13)


# ------------------------------------------------------------------------------ stiffness
@pytest.mark.parametrize(("kind", "dim"), KINDS)
@pytest.mark.parametrize("plane", ["strain", "stress"])
def test_quadratic_fields_are_exact(kind, dim, plane):
    law = am.LinearElastic(200, 0.3, plane=plane)
    mesh = second_order(sheared(kind, dim))
    field = Quadratic(dim, law)
    exact = field(mesh.points)
    u = solved(mesh, law, exact, np.tile(field.force, (len(mesh.points), 1)))
    assert len(outer_nodes(mesh)) < len(mesh.points)
    np.testing.assert_allclose(u, exact, atol=1e-11)
    centres = np.concatenate([mesh.points[b.nodes].mean(axis=1) for b in mesh.cells])
    stress = cell_stress(mesh, law, u)[:, :dim, :dim]
    np.testing.assert_allclose(stress, field.stress(centres), rtol=1e-11, atol=1e-10)


@pytest.mark.parametrize(("kind", "dim"), KINDS)
def test_stiffness_on_linear_fields_is_that_of_first_order(kind, dim):
    first = sheared(kind, dim)
    mesh = second_order(first)
    K = stiffness(mesh, LAW)
    assert abs(K - K.T).max() < 1e-12 * abs(K).max()
    interpolate = np.zeros((len(mesh.points), len(first.points)))
    for block in mesh.cells:
        cell = CELLS[block.kind]
        for k in range(cell.nodes):
            parents = ((k,), *cell.parents)[max(0, k - cell.corner_count + 1)]
            for p in parents:
                interpolate[block.nodes[:, k], block.nodes[:, p]] = 1 / len(parents)
    P = np.kron(interpolate, np.eye(dim))
    reference = stiffness(first, LAW).toarray()
    np.testing.assert_allclose(P.T @ K.toarray() @ P, reference, atol=1e-11 * abs(K).max())


def test_error_falls_with_the_third_power():
    """A sine field on distorted triangles, forces by differentiation."""
    errors = []
    for cells in (4, 8):
        mesh = second_order(am.box((1, 1), cells, "tri"))
        x, y = np.pi * mesh.points.T
        exact = np.stack([np.sin(x) * np.sin(y), np.zeros_like(x)], axis=1)
        lame, shear = LAW.lame_lambda(2), LAW.shear
        force = np.pi**2 * np.stack([
            (lame + 3 * shear) * np.sin(x) * np.sin(y),
            -(lame + shear) * np.cos(x) * np.cos(y),
        ], axis=1)  # fmt: skip
        errors.append(abs(solved(mesh, LAW, exact, force) - exact).max())
    assert errors[1] < errors[0] / 7


# ---------------------------------------------------------------------------------- loads
@pytest.mark.parametrize(("kind", "dim"), KINDS)
def test_loads_do_the_work_of_quadratic_tractions(kind, dim):
    """Work on quadratic fields equals the integral of a polynomial of degree four."""
    mesh = second_order(am.box((1,) * dim, 2, kind))
    x = mesh.points[:, 0]
    traction = np.zeros_like(mesh.points)
    traction[:, 0] = x**2
    load = surface_load(mesh.points, mesh.surface("bottom"), traction)
    assert load[:, 0] @ x**2 == pytest.approx(1 / 5)
    assert not load[:, 1:].any()
    load = body_load(mesh, traction)
    assert load[:, 0] @ (x * mesh.points[:, 1]) == pytest.approx(1 / 8)


@pytest.mark.parametrize(("kind", "dim"), KINDS)
def test_contacts_sit_where_the_weight_is(kind, dim):
    mesh = second_order(am.box((1,) * dim, 3, kind))
    nodes, weights = contact_nodes(mesh, "bottom")
    assert weights.sum() == pytest.approx(1)
    assert (weights > 1e-3).all()
    corners = np.unique(np.concatenate([b.nodes[:, : CELLS[b.kind].corner_count].ravel()
                                        for b in mesh.cells]))  # fmt: skip
    assert np.isin(corners, nodes).any() == (kind != "tet")
    assert nodal_weights(mesh.points, mesh.surface("bottom")).min() == 0


# --------------------------------------------------------------------------------- models
def pressed(kind, dim, cells=2, mu=0.0, **changes):
    fix = (None,) * (dim - 1) + (-0.01,)
    body = am.Body(am.box((1,) * dim, cells, kind), LAW, order=2)
    supports = [am.Fix("top", fix), am.Fix("left", (0,) + (None,) * (dim - 1))]
    if dim == 3:
        supports.append(am.Fix("front", (None, 0, None)))
    contact = am.Contact("bottom", am.Plane(normal=np.eye(dim)[-1]), mu=mu)
    return am.Model([body], supports, [contact], **changes)


@pytest.mark.parametrize(("kind", "dim"), KINDS)
def test_constant_pressure_is_exact_at_every_contact(kind, dim):
    solution = am.solve(pressed(kind, dim), tolerance=1e-12)
    modulus = LAW.young if dim == 3 else LAW.young / (1 - LAW.poisson**2)
    np.testing.assert_allclose(solution.fields.pressure, modulus * 0.01, rtol=1e-8)
    assert solution.fields.resultant[-1] == pytest.approx(modulus * 0.01, rel=1e-9)
    (moved,) = solution.fields.displacement
    height = solution.model.bodies[0].mesh.points[:, -1]
    np.testing.assert_allclose(moved[:, -1], -0.01 * height, atol=1e-12)


def test_supports_and_loads_act_on_all_nodes():
    """A quadratic field by Fix, Traction and BodyForce, the contact far away."""
    field = Quadratic(2, LAW)
    body = am.Body(am.box((1, 1), 2, "tri"), LAW, order=2)
    loads = [am.BodyForce(tuple(field.force))]
    for name, normal in (("left", (-1, 0)), ("right", (1, 0)), ("bottom", (0, -1))):
        loads.append(am.Traction(name, lambda x, n=normal: field.stress(x[None])[0] @ n))
    model = am.Model(
        [body], [am.Fix("top", lambda x: field(x[None])[0])],
        [am.Contact("bottom", am.Plane(normal=(0, 1), point=(0, -1e3)), mu=0.3)], loads,
    )  # fmt: skip
    solution = am.solve(model)
    mesh = model.bodies[0].mesh
    np.testing.assert_allclose(solution.fields.displacement[0], field(mesh.points), atol=1e-11)
    assert solution.counts["open"] == len(contact_nodes(mesh, "bottom")[0])


def test_a_slave_of_second_order_on_a_master_of_first():
    lower = am.Body(am.box((2, 1), 2, "quad", origin=(-0.5, -1)), LAW)
    upper = am.Body(am.box((1, 1), 2, "tri"), LAW, order=2)
    supports = [am.Fix("body 1.bottom", 0), am.Fix("body 2.top", (0, -0.01))]
    mortar = am.Contact("body 2.bottom", master="body 1.top", mu=0.2)
    mean = am.solve(am.Model([lower, upper], supports, [mortar]))
    pair = am.Contact("body 2.bottom", master="body 1.top", mu=0.2, method="nodal")
    solution = am.solve(am.Model([lower, upper], supports, [pair]))
    assert solution.fields.resultant[1] == pytest.approx(mean.fields.resultant[1], rel=0.02)
    turned = am.Contact("body 1.top", master="body 2.bottom", mu=0.2, method="nodal")
    with pytest.raises(InvalidInput, match="first order"):
        am.Model([lower, upper], supports, [turned]).assemble()


@pytest.mark.parametrize(("kind", "dim"), KINDS)
def test_output(tmp_path, kind, dim):
    solution = am.solve(pressed(kind, dim))
    solution.write(tmp_path / "s.vtu")
    solution.plot(tmp_path / "s.png")
    found = meshio.read(tmp_path / "s.vtu")
    mesh = solution.model.bodies[0].mesh
    assert len(found.points) == len(mesh.points)
    (block,) = found.cells
    np.testing.assert_array_equal(block.data, mesh.cells[0].nodes)
    modulus = 0.01 * (LAW.young if dim == 3 else LAW.young / (1 - LAW.poisson**2))
    slave = found.point_data["CPRESS"][mesh.surface_nodes("bottom")]
    np.testing.assert_allclose(slave, modulus, rtol=1e-7)  # also where no contact is
    assert found.point_data["CSTATUS"].max() >= 0
    assert len(found.cell_data["von_mises"][0]) == mesh.cell_count
    assert (tmp_path / "s.png").stat().st_size > 1000


# ------------------------------------------------------------------------------ case files
CASE = """
[mesh]
box = [1, 1]
cells = 2
order = 2
[material.default]
young = 200
poisson = 0.3
[[fix]]
on = "top"
value = [0, -0.01]
[[contact]]
slave = "bottom"
obstacle = { plane = { normal = [0, 1] } }
friction = { coulomb = 0.3 }
"""


def test_order_in_case_files(tmp_path):
    path = tmp_path / "case.toml"
    path.write_text(CASE)
    assert read_case(path).model.assemble().contacts == 5
    assert read_case(path, ["mesh.order=1"]).model.assemble().contacts == 3
    for wrong in ("0", "3", "1.5", "true", "high"):
        with pytest.raises(FileFormatError, match=r"mesh\.order: expected"):
            read_case(path, [f"mesh.order={wrong}"])
