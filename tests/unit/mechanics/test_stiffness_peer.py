"""Our stiffness against that of NGSolve, entry by entry, for all cells; needs the extra cad."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import sparse

import amontons as am
from amontons.mechanics.elements import stiffness
from amontons.mechanics.meshes import second_order
from amontons.mechanics.meshes.cells import CELLS
from amontons.mechanics.meshes.facets import Cells

ng = pytest.importorskip("ngsolve")

CORNERS = {  # of NGSolve's reference cells, in the order of the vertices of an element
    "tri": [(1, 0), (0, 1), (0, 0)],
    "quad": [(0, 0), (1, 0), (1, 1), (0, 1)],
    "tet": [(1, 0, 0), (0, 1, 0), (0, 0, 1), (0, 0, 0)],
    "hex": [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0),
            (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)],
    "wedge": [(1, 0, 0), (0, 1, 0), (0, 0, 0), (1, 0, 1), (0, 1, 1), (0, 0, 1)],
}  # fmt: skip
LAWS = [am.LinearElastic(200, 0.3), am.LinearElastic(200, 0.45, plane="stress")]
KINDS = [("tri", 2), ("quad", 2), ("tet", 3), ("hex", 3)]


def engine_mesh(mesh):
    """NGSolve's mesh with the same corners in the same order."""
    from netgen.meshing import Mesh as NetgenMesh

    out = NetgenMesh(dim=mesh.dim)
    tables = [b.nodes[:, : CELLS[b.kind].corner_count] for b in mesh.cells]
    points = mesh.points[: 1 + max(int(t.max()) for t in tables)]
    out.AddPoints(np.c_[points, np.zeros(len(points))][:, :3].copy())
    region = out.AddRegion("all", mesh.dim)
    for table in tables:
        nodes = np.ascontiguousarray(table, dtype=np.int32)
        out.AddElements(dim=mesh.dim, index=region, data=nodes, base=0)
    return ng.Mesh(out)


def theirs(mesh, law):
    """(stiffness in the basis of NGSolve, values of its functions at our nodes)."""
    inside = engine_mesh(mesh)
    space = ng.H1(inside, order=mesh.order, dim=mesh.dim)
    u, v = space.TnT()
    strain = 0.5 * (ng.Grad(u) + ng.Grad(u).trans)
    form = ng.BilinearForm(space)
    form += (
        2 * law.shear * ng.InnerProduct(strain, ng.Grad(v))
        + law.lame_lambda(mesh.dim) * ng.Trace(ng.Grad(u)) * ng.Trace(ng.Grad(v))
    ) * ng.dx
    form.Assemble()
    values, columns, pointers = (part.NumPy().copy() for part in form.mat.CSR())
    d = mesh.dim
    K = sparse.bsr_array(
        (values.reshape(-1, d, d), columns, pointers), shape=(mesh.points.size,) * 2
    )
    return K.toarray(), np.kron(values_at_nodes(mesh, inside), np.eye(d))


def values_at_nodes(mesh, inside):
    """Every function of NGSolve's scalar space at every node of ours, (n, n)."""
    space = ng.H1(inside, order=mesh.order)
    out = np.zeros((len(mesh.points), space.ndof))
    start = 0
    for block in mesh.cells:
        cell = CELLS[block.kind]
        corners = np.array(CORNERS[block.kind.rstrip("0123456789")], dtype=float)
        for k, nodes in enumerate(block.nodes):
            number = ng.ElementId(ng.VOL, start + k)
            vertices = [v.nr for v in inside[number].vertices]
            place = corners[[vertices.index(node) for node in nodes[: cell.corner_count]]]
            middles = [place[list(parents)].mean(axis=0) for parents in cell.parents]
            for node, at in zip(nodes, [*place, *middles], strict=True):
                shape = space.GetFE(number).CalcShape(*at, *[0.0] * (3 - mesh.dim))
                out[node, list(space.GetDofNrs(number))] = np.array(shape)
        start += len(block.nodes)
    return out


def distorted(kind, dim, how):
    """Boxes of 2 cells a side: as they are, sheared, or with all inner corners moved."""
    mesh = am.box((1, 0.7, 1.3)[:dim], 2, kind)
    points, rng = mesh.points, np.random.default_rng(4)
    if how == "sheared":
        points = points @ (np.eye(dim) + 0.3 * rng.uniform(-1, 1, (dim, dim)))
    if how == "distorted":
        points = points + rng.uniform(-0.1, 0.1, points.shape)
    return am.Mesh(points, mesh.cells, mesh.surfaces)


@pytest.mark.parametrize("how", ["straight", "sheared", "distorted"])
@pytest.mark.parametrize("law", LAWS, ids=["strain", "stress"])
@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize(("kind", "dim"), KINDS)
def test_entries_are_those_of_ngsolve(kind, dim, order, law, how):
    mesh = distorted(kind, dim, how)
    mesh = second_order(mesh) if order == 2 else mesh
    full = tuple(replace(c, integration="full") for c in mesh.cells)  # none of them hybrid
    mesh = replace(mesh, cells=full)
    K, values = theirs(mesh, law)
    ours = values.T @ stiffness(mesh, law).toarray() @ values
    assert np.abs(ours - K).max() < 1e-12 * np.abs(K).max()


def test_wedges_are_those_of_ngsolve():
    cell = CELLS["wedge"]
    points = cell.corners @ [[1, 0.2, 0], [0, 0.8, 0.1], [0.3, 0, 1.1]]
    mesh = am.Mesh(points, (Cells("wedge", np.arange(6)[None]),))
    K, values = theirs(mesh, LAWS[0])
    ours = values.T @ stiffness(mesh, LAWS[0]).toarray() @ values
    assert np.abs(ours - K).max() < 1e-12 * np.abs(K).max()
