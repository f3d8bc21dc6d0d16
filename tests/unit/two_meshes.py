"""Two meshes as one, and as a file of gmsh: what tests of contact between bodies share."""

import numpy as np

import amontons as am
from amontons.mechanics.meshes.facets import Cells, Facets

GMSH = {"line": 1, "tri": 2, "quad": 3, "tet": 4, "hex": 5}


def joined(low, high):
    """Two meshes as one, with surfaces "floor", "low", "high", "roof" from below."""
    n = len(low.points)

    def moved(facets):
        return tuple(Facets(f.kind, f.nodes + n) for f in facets)

    surfaces = {
        "floor": low.surfaces["bottom"], "low": low.surfaces["top"],
        "high": moved(high.surfaces["bottom"]), "roof": moved(high.surfaces["top"]),
    }  # fmt: skip
    cells = (*low.cells, *(Cells(b.kind, b.nodes + n, b.region) for b in high.cells))
    return am.Mesh(np.concatenate([low.points, high.points]), cells, surfaces)


def write_gmsh(path, mesh, *, repeat=False):
    """A mesh in gmsh's format 2.2 with its named surfaces."""
    blocks = [("solid", mesh.dim, b.kind, b.nodes) for b in mesh.cells]
    blocks += [(name, mesh.dim - 1, b.kind, b.nodes)
               for name, facets in mesh.surfaces.items() for b in facets]  # fmt: skip
    if repeat:
        blocks.append((*blocks[0][:3], blocks[0][3][:1]))
    names = {name: (k + 1, dim) for k, (name, dim, *_) in enumerate(blocks)}
    lines = ["$MeshFormat", "2.2 0 8", "$EndMeshFormat", "$PhysicalNames", str(len(names))]
    lines += [f'{dim} {k} "{name}"' for name, (k, dim) in names.items()]
    lines += ["$EndPhysicalNames", "$Nodes", str(len(mesh.points))]
    points = np.pad(mesh.points, ((0, 0), (0, 3 - mesh.dim)))
    lines += [f"{k + 1} {x} {y} {z}" for k, (x, y, z) in enumerate(points.tolist())]
    rows = [(GMSH[kind], names[name][0], row + 1)
            for name, _, kind, nodes in blocks for row in nodes]  # fmt: skip
    lines += ["$EndNodes", "$Elements", str(len(rows))]
    for k, (kind, label, nodes) in enumerate(rows):
        lines.append(f"{k + 1} {kind} 2 {label} {label} " + " ".join(map(str, nodes)))
    path.write_text("\n".join([*lines, "$EndElements", ""]))
