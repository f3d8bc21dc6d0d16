"""Bodies whose stiffness another program has assembled."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import sparse
from scipy.sparse.linalg import LinearOperator

import amontons as am
from amontons.mechanics.elements import stiffness
from amontons.mechanics.elements.mass import mass
from amontons.mechanics.meshes import second_order

STEEL = am.LinearElastic(200.0, 0.3, density=2.0)


def pressed(body, **more):
    return am.Model(
        [body], [am.Fix("top", (0.02, -0.03))],
        [am.Contact("bottom", am.Plane((0, 1)), mu=0.4)], **more,
    )  # fmt: skip


@pytest.fixture(scope="module")
def plate():
    mesh = am.box((2, 1), (6, 3))
    return mesh, stiffness(mesh, STEEL).tocsr()


def components(mesh):
    """Row of each dof by node in a matrix by component."""
    n = len(mesh.points)
    return np.arange(2 * n).reshape(2, n).T.ravel()


@pytest.mark.parametrize("rows", ["nodes", "components", "table"])
def test_the_answer_is_that_of_our_own_element(plate, rows):
    mesh, K = plate
    order = np.arange(mesh.points.size)
    if rows == "components":
        order = components(mesh)
    if rows == "table":
        order = np.random.default_rng(0).permutation(mesh.points.size)
    back = np.argsort(order)
    theirs = K[back][:, back]
    given = order.reshape(-1, 2) if rows == "table" else rows
    ours = am.solve(pressed(am.Body(mesh, STEEL)))
    found = am.solve(pressed(am.Body.from_matrix(mesh, theirs, rows=given)))
    assert found.counts == ours.counts
    np.testing.assert_allclose(found.displacement[0], ours.displacement[0], atol=1e-12)
    np.testing.assert_allclose(found.resultant, ours.resultant, rtol=1e-10)


def test_its_load_acts_beside_those_of_the_model(plate):
    mesh, K = plate
    load = np.zeros(mesh.points.size)
    load[1::2] = -0.1
    found = am.solve(pressed(am.Body.from_matrix(mesh, K, load=load)))
    force = am.NodalForce("all", (0.0, -0.1))
    named = replace(mesh, node_sets={"all": np.arange(len(mesh.points))})
    ours = am.solve(pressed(am.Body(named, STEEL), loads=[force]))
    np.testing.assert_allclose(found.displacement[0], ours.displacement[0], atol=1e-12)


def test_steps_in_time_take_its_mass(plate):
    mesh, K = plate
    scheme = am.MoreauJean(0.01)
    last = []
    for body in (
        am.Body(mesh, STEEL), am.Body.from_matrix(mesh, K, mass=mass(mesh, STEEL))
    ):  # fmt: skip
        model = pressed(body)
        *_, step = am.evolve(model, scheme, until=0.05)
        last.append(step.displacement[0])
    np.testing.assert_allclose(last[1], last[0], atol=1e-10)
    with pytest.raises(am.InvalidInput, match="mass=M"):
        list(am.evolve(pressed(am.Body.from_matrix(mesh, K)), scheme, until=0.02))


def test_a_body_that_is_held_by_its_matrix(plate):
    """Springs on the upper nodes in K take the place of a support."""
    mesh, K = plate
    springs = np.zeros(mesh.points.size)
    top = mesh.surface_nodes("top")
    springs[2 * top] = springs[2 * top + 1] = 1e7
    grounded = K + sparse.diags_array(springs)
    load = springs * np.tile((0.02, -0.03), len(mesh.points))
    contact = am.Contact("bottom", am.Plane((0, 1)), mu=0.4)
    body = am.Body.from_matrix(mesh, grounded, load=load, held=True)
    found = am.solve(am.Model([body], [], [contact]))
    ours = am.solve(pressed(am.Body(mesh, STEEL)))
    np.testing.assert_allclose(found.displacement[0], ours.displacement[0], atol=1e-5)


def test_a_wrong_order_of_rows_is_found(plate):
    mesh, K = plate
    back = np.argsort(components(mesh))
    with pytest.raises(am.InvalidInput, match="rows='components' does fit"):
        am.Body.from_matrix(mesh, K[back][:, back])
    with pytest.raises(am.InvalidInput, match="held=True"):
        am.Body.from_matrix(mesh, K + sparse.eye_array(K.shape[0]))


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (lambda K: K[:-1, :-1], "K: expected shape"),
        (lambda K: K + sparse.triu(K, 1), "symmetric"),
        (lambda K: K * np.nan, "finite"),
        (lambda K: -K, "diagonal"),
    ],
)
def test_other_matrices_are_refused(plate, change, says):
    mesh, K = plate
    with pytest.raises(am.InvalidInput, match=says):
        am.Body.from_matrix(mesh, change(K))
    with pytest.raises(am.InvalidInput, match="load"):
        am.Body.from_matrix(mesh, K, load=[1.0])
    with pytest.raises(am.InvalidInput, match="every number"):
        am.Body.from_matrix(mesh, K, rows=np.zeros(mesh.points.shape, dtype=int))


def test_questions_are_answered(plate):
    mesh, K = plate
    ours = am.uniqueness(pressed(am.Body(mesh, STEEL)))
    assert am.uniqueness(pressed(am.Body.from_matrix(mesh, K))).verdict is ours.verdict


def test_what_needs_a_law_is_refused(plate):
    mesh, K = plate
    model = am.Model(
        [am.Body.from_matrix(mesh, K)], [am.Fix("top", (0.02, -0.03))],
        [am.Contact("bottom", am.Plane((0, 1)), mu=0.4, method="nitsche")],
    )  # fmt: skip
    with pytest.raises(am.UnsupportedForm, match="takes the stress"):
        am.solve(model)


def test_scikit_fem_gives_the_matrix():
    skfem = pytest.importorskip("skfem")
    from skfem.models.elasticity import lame_parameters, linear_elasticity

    mesh = am.box((1, 1, 1), (3, 3, 3))
    theirs = skfem.MeshHex(*_hex(mesh))
    basis = skfem.Basis(theirs, skfem.ElementVector(skfem.ElementHex1()))
    K = linear_elasticity(*lame_parameters(200.0, 0.3)).assemble(basis)
    body = am.Body.from_matrix(mesh, K, rows=basis.nodal_dofs.T)
    answers = [am.solve(_cube(b)) for b in (am.Body(mesh, STEEL), body)]
    assert answers[0].counts == answers[1].counts
    moved = [answer.displacement[0] for answer in answers]
    np.testing.assert_allclose(moved[1], moved[0], atol=1e-10 * np.abs(moved[0]).max())


def _hex(mesh):
    """Points and cells in scikit-fem's order of the corners of a cube."""
    import skfem

    wanted = skfem.ElementHex1().refdom.p.T  # (8, 3) of the unit cube
    first = mesh.points[mesh.cells[0].nodes[0]]
    low, size = first.min(axis=0), np.ptp(first, axis=0)
    places = (first - low) / size
    order = [int(np.abs(places - corner).sum(axis=1).argmin()) for corner in wanted]
    return mesh.points.T.copy(), mesh.cells[0].nodes[:, order].T.copy()


def _cube(body):
    return am.Model(
        [body], [am.Fix("top", lambda x: (0, 0.2, 0.06 - 0.15 * x[0]))],
        [am.Contact("bottom", am.Plane((0, 0, 1)), mu=1.0)],
    )  # fmt: skip


def test_ngsolve_gives_the_matrix():
    ngsolve = pytest.importorskip("ngsolve")
    from ngsolve.meshes import MakeHexMesh

    theirs = MakeHexMesh(nx=3, ny=3, nz=3)
    space = ngsolve.VectorH1(theirs, order=1)
    u, v = space.TnT()
    lame, shear = 200 * 0.3 / (1.3 * 0.4), 200 / 2.6
    form = ngsolve.BilinearForm(space, symmetric=False)

    def strain(w):
        return 0.5 * (ngsolve.Grad(w) + ngsolve.Grad(w).trans)

    form += 2 * shear * ngsolve.InnerProduct(strain(u), strain(v)) * ngsolve.dx
    form += lame * ngsolve.div(u) * ngsolve.div(v) * ngsolve.dx
    form.Assemble()
    values, columns, starts = form.mat.CSR()
    K = sparse.csr_array((np.array(values), np.array(columns), np.array(starts)))
    points = np.array([vertex.point for vertex in theirs.vertices])
    own = am.box((1, 1, 1), (3, 3, 3))
    number = np.array([int(np.abs(points - x).sum(axis=1).argmin()) for x in own.points])
    rows = number[:, None] + len(points) * np.arange(3)
    body = am.Body.from_matrix(own, K, rows=rows)
    answers = [am.solve(_cube(b)) for b in (am.Body(own, STEEL), body)]
    moved = [answer.displacement[0] for answer in answers]
    np.testing.assert_allclose(moved[1], moved[0], atol=1e-10 * np.abs(moved[0]).max())


def test_its_load_counts_once_beside_loads_in_time(plate):
    mesh, K = plate
    load = np.zeros(mesh.points.size)
    load[1::2] = -0.1
    found = []
    for body, more in (
        (am.Body.from_matrix(mesh, K, load=load), []),
        (am.Body(replace(mesh, node_sets={"all": np.arange(len(mesh.points))}), STEEL),
         [am.NodalForce("all", (0.0, -0.1))]),
    ):  # fmt: skip
        push = am.Traction("right", (lambda x, t: -t, 0.0))
        model = pressed(body, loads=[push, *more])
        *_, step = am.evolve(model, am.QuasiStatic(0.5), until=1.0)
        found.append(step.displacement[0])
    np.testing.assert_allclose(found[0], found[1], atol=1e-10)


@pytest.mark.parametrize("mesh", [
    am.box((2, 1), (6, 3)), am.box((2, 1), (6, 3), "tri"), am.box((1, 1, 1), (3, 4, 2)),
    am.box((1, 1, 1), 2, "tet"), second_order(am.box((1, 1, 1), 2), serendipity=True),
], ids=["quad", "tri", "hex", "tet", "hex20"])  # fmt: skip
@pytest.mark.parametrize("rows", ["nodes", "components"])
def test_an_operator_is_asked_for_its_entries(mesh, rows):
    K = stiffness(mesh, STEEL).tocsr()
    n, dim = mesh.points.shape
    order = np.arange(n * dim)
    if rows == "components":
        order = order.reshape(dim, n).T.ravel()
    back = np.argsort(order)
    theirs = K[back][:, back]
    products = []

    def product(x):
        products.append(1)
        return theirs @ x

    operator = LinearOperator(K.shape, matvec=product, dtype=float)
    given = am.Body.from_matrix(mesh, operator, rows=rows, mass=operator).material
    np.testing.assert_allclose(given.K.toarray(), K.toarray(), atol=1e-12 * abs(K).max())
    np.testing.assert_allclose(given.mass.toarray(), K.toarray(), atol=1e-12 * abs(K).max())
    assert len(products) <= 2 * (dim * n + 1)


def test_operators_that_have_no_such_entries_are_refused(plate):
    mesh, K = plate
    last, size = K.shape[0] - 1, abs(K).max()
    ends = sparse.csr_array(([size, size], ([0, last], [last, 0])), shape=K.shape)
    refused = {
        "no cell of the mesh in common": K + ends, "finite products": K * np.nan,
        "expected shape": K[:-1, :-1], "real numbers": K * 1j,
    }  # fmt: skip
    for says, matrix in refused.items():
        operator = LinearOperator(matrix.shape, matvec=lambda x, A=matrix: A @ x,
                                  dtype=matrix.dtype)  # fmt: skip
        with pytest.raises(am.InvalidInput, match=says):
            am.Body.from_matrix(mesh, operator)
