"""Elements of scikit-fem and NGSolve against ours of the same kind, to rounding."""

import numpy as np
import pytest
from scipy import sparse
from scipy.sparse.linalg import aslinearoperator

import amontons as am
from amontons.mechanics.elements import stiffness

YOUNG, POISSON = 200.0, 0.3
STEEL = am.LinearElastic(YOUNG, POISSON)
AXES = np.linspace(0, 2, 5), np.linspace(0, 1, 3), np.linspace(0, 1, 4)
HEX = [0, 2, 4, 1, 3, 6, 7, 5]  # our order of its nodes


def assert_same(body, mesh):
    ours = stiffness(mesh, STEEL).tocsr()
    assert abs(body.material.K - ours).max() <= 1e-13 * abs(ours).max()


@pytest.mark.parametrize(
    ("grid", "element", "kind", "order"),
    [
        ("MeshTet", "ElementTetP1", "tet", slice(None)), ("MeshHex", "ElementHex1", "hex", HEX),
        ("MeshTri", "ElementTriP1", "tri", slice(None)),
        ("MeshQuad", "ElementQuad1", "quad", slice(None)),
    ],
)  # fmt: skip
@pytest.mark.parametrize("form", ["matrix", "operator"])
def test_scikit_fem(grid, element, kind, order, form):
    skfem = pytest.importorskip("skfem")
    from skfem.models.elasticity import lame_parameters, linear_elasticity

    flat = kind in ("tri", "quad")
    cells = getattr(skfem, grid).init_tensor(*AXES[: 2 if flat else 3])
    basis = skfem.Basis(cells, skfem.ElementVector(getattr(skfem, element)()), intorder=3)
    K = linear_elasticity(*lame_parameters(YOUNG, POISSON)).assemble(basis)
    mesh = am.Mesh(cells.p.T, [am.Cells(kind, cells.t.T[:, order])])
    given = K if form == "matrix" else aslinearoperator(K)
    assert_same(am.Body.from_matrix(mesh, given, rows=basis.nodal_dofs.T), mesh)


@pytest.mark.parametrize("kind", ["tri", "tet"])
def test_ngsolve(kind):
    ng = pytest.importorskip("ngsolve")
    from ngsolve import meshes

    flat = kind == "tri"
    grid = (meshes.MakeStructured2DMesh(quads=False, nx=4, ny=3) if flat
            else meshes.MakeStructured3DMesh(hexes=False, nx=3, ny=2, nz=2))  # fmt: skip
    space = ng.VectorH1(grid, order=1)
    u, v = space.TnT()
    mu, lam = YOUNG / (2 * (1 + POISSON)), YOUNG * POISSON / ((1 + POISSON) * (1 - 2 * POISSON))
    strains = ng.InnerProduct(ng.Sym(ng.Grad(u)), ng.Sym(ng.Grad(v)))
    form = ng.BilinearForm((2 * mu * strains + lam * ng.div(u) * ng.div(v)) * ng.dx).Assemble()
    row, column, value = (np.array(part) for part in form.mat.COO())
    K = sparse.coo_array((value, (row, column)), shape=(space.ndof, space.ndof))
    nodes = [[v.nr for v in each.vertices] for each in grid.Elements(ng.VOL)]
    mesh = am.Mesh([v.point for v in grid.vertices], [am.Cells(kind, nodes)])
    assert_same(am.Body.from_matrix(mesh, K, rows="components"), mesh)
