"""Mesh the unit cube with gmsh and name its parts: `python make_mesh.py cube.msh 0.125`.

Names are gmsh's physical groups; the case file refers to them.  Needs `pip install gmsh`.
"""

import sys

import gmsh


def make_cube(path: str, size: float = 0.125) -> None:
    """Write tetrahedra of about `size`, with volume `cube` and surfaces `top`, `bottom`."""
    gmsh.initialize()
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.model.occ.addBox(0, 0, 0, 1, 1, 1)
        gmsh.model.occ.synchronize()
        gmsh.model.addPhysicalGroup(3, [1], name="cube")
        for name, z in (("bottom", 0.0), ("top", 1.0)):
            box = (-0.1, -0.1, z - 0.1, 1.1, 1.1, z + 0.1)
            faces = [tag for _, tag in gmsh.model.getEntitiesInBoundingBox(*box, dim=2)]
            gmsh.model.addPhysicalGroup(2, faces, name=name)
        gmsh.option.setNumber("Mesh.MeshSizeMax", size)
        gmsh.model.mesh.generate(3)
        gmsh.write(path)
    finally:
        gmsh.finalize()


if __name__ == "__main__":
    make_cube(
        sys.argv[1] if len(sys.argv) > 1 else "cube.msh",
        float(sys.argv[2]) if len(sys.argv) > 2 else 0.125,
    )
