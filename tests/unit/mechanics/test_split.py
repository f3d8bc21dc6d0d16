"""Regions of a mesh taken apart: nodes, names of the sides, what is refused."""

import numpy as np
import pytest

import amontons as am
from amontons.core.errors import InvalidInput
from amontons.mechanics.meshes.split import split


def halves(size=(2, 1), cells=(4, 2), joint=True, kind=None):
    """A box whose left and right half are regions, with the surface "joint" between them."""
    mesh = am.box(size, cells, kind)
    blocks = []
    for block in mesh.cells:
        left = mesh.points[block.nodes, 0].mean(axis=1) < 1
        blocks += [am.Cells(block.kind, block.nodes[left], "left"),
                   am.Cells(block.kind, block.nodes[~left], "right")]  # fmt: skip
    both = am.Mesh(mesh.points, tuple(blocks), mesh.surfaces)
    if not joint:
        return both
    apart = split(both, False)
    middle = np.flatnonzero(mesh.points[:, 0] == 1)
    inner = [f for f in apart.surfaces["left-right"]]
    where = {tuple(p): k for k, p in enumerate(mesh.points)}
    facets = tuple(
        am.Facets(f.kind, np.array([[where[tuple(apart.points[n])] for n in row]
                                    for row in f.nodes]))
        for f in inner
    )  # fmt: skip
    assert set(np.concatenate([f.nodes.ravel() for f in facets])) == set(middle)
    return am.Mesh(mesh.points, tuple(blocks), {**mesh.surfaces, "joint": facets})


CASES = [((2, 1), (4, 2), None), ((2, 1), (4, 2), "tri"), ((2, 1, 1), (4, 2, 2), "hex"),
         ((2, 1, 1), (2, 1, 1), "tet")]  # fmt: skip


@pytest.mark.parametrize(("size", "cells", "kind"), CASES)
def test_regions_share_no_node_any_more(size, cells, kind):
    glued = halves(size, cells, kind=kind)
    mesh = split(glued, False)
    left, right = (
        np.unique(np.concatenate([b.nodes.ravel() for b in mesh.cells if b.region == name]))
        for name in ("left", "right")
    )
    assert not np.intersect1d(left, right).size
    assert len(mesh.points) == len(glued.points) + len(glued.surface_nodes("joint"))
    for name, own in (("joint-left", left), ("joint-right", right)):
        nodes = mesh.surface_nodes(name)
        assert np.isin(nodes, own).all()
        assert (mesh.points[nodes, 0] == 1).all()
    assert len(mesh.surface_nodes("bottom")) > len(glued.surface_nodes("bottom"))


def test_sides_without_a_surface_are_called_after_both_regions():
    mesh = split(halves(joint=False), False)
    assert {"left-right", "right-left"} <= set(mesh.surfaces)
    for name, sign in (("left-right", 1), ("right-left", -1)):
        (facets,) = mesh.surfaces[name]
        a, b = mesh.points[facets.nodes[0]]
        assert np.sign((b - a)[1]) == sign  # the outward normal (dy, -dx) leaves the region


def test_a_crack_that_ends_inside_keeps_its_tip():
    """Half of the joint is cut: the node at its end stays one."""
    glued = halves(cells=(4, 4))
    (joint,) = glued.surfaces["joint"]
    low = glued.points[joint.nodes, 1].max(axis=1) <= 0.5
    part = am.Mesh(glued.points, glued.cells,
                   {"joint": (am.Facets(joint.kind, joint.nodes[low]),)})  # fmt: skip
    mesh = split(part, {"joint": False})
    assert len(mesh.points) == len(glued.points) + 2  # y = 0 and 0.25, not the tip at 0.5
    assert {"joint-left", "joint-right"} == set(mesh.surfaces)


def test_nothing_to_do():
    mesh = halves()
    assert split(mesh, True) is mesh
    assert split(mesh, {}) is mesh
    assert split(mesh, {"joint": True}) is mesh


@pytest.mark.parametrize(
    ("glue", "words"),
    [
        ("no", "glue: expected True, False, or"), ({"joint": 0}, "glue: expected True"),
        (["joint"], "glue: expected True"),
        ({"join": False}, "surface 'join': not found.*did you mean 'joint'"),
        ({"bottom": False}, "'bottom' does not lie between two regions.*left, right"),
    ],
)  # fmt: skip
def test_bad_glue(glue, words):
    with pytest.raises(InvalidInput, match=words):
        split(halves(), glue)


def write_gmsh(path, mesh):
    """Quadrilaterals and edges in gmsh 2.2."""
    names = [*((2, r) for r in mesh.regions), *((1, s) for s in mesh.surfaces)]
    tags = {key: k for k, key in enumerate(names, 1)}
    rows = [(3, tags[2, b.region], row) for b in mesh.cells for row in b.nodes]
    rows += [(1, tags[1, name], row) for name, parts in mesh.surfaces.items()
             for f in parts for row in f.nodes]  # fmt: skip
    text = ["$MeshFormat", "2.2 0 8", "$EndMeshFormat", "$PhysicalNames", str(len(tags))]
    text += [f'{dim} {k} "{name}"' for (dim, name), k in tags.items()]
    text += ["$EndPhysicalNames", "$Nodes", str(len(mesh.points))]
    text += [f"{k} {x} {y} 0" for k, (x, y) in enumerate(mesh.points, 1)]
    text += ["$EndNodes", "$Elements", str(len(rows))]
    text += [f"{k} {kind} 2 {tag} {tag} {' '.join(str(n + 1) for n in row)}"
             for k, (kind, tag, row) in enumerate(rows, 1)]  # fmt: skip
    path.write_text("\n".join([*text, "$EndElements", ""]))


def test_read_mesh_takes_apart(tmp_path):
    path = tmp_path / "two.msh"
    write_gmsh(path, halves())
    mesh = am.read_mesh(path, glue=False)
    assert {"joint-left", "joint-right"} <= set(mesh.surfaces)
    model = am.Model(
        [am.Body(mesh, am.LinearElastic(100, 0.0))],
        supports=[am.Fix("left", (0, 0)), am.Fix("right", (-0.02, 0))],
        contacts=[am.Contact("joint-left", master="joint-right", mu=0.2)],
    )
    force = am.solve(model).fields.resultant
    assert force[0] == pytest.approx(-100 * 0.02 / 2)  # E A strain, as in one piece
