"""Finite elements: meshes and elasticity.  Only this folder loads NGSolve, and only on use."""

from .box import box
from .elasticity import LinearElastic, cell_stress, stiffness, von_mises
from .facets import Cells, Facets
from .mesh import Mesh
from .read import read_mesh

__all__ = ["Cells", "Facets", "LinearElastic", "Mesh", "box", "cell_stress", "read_mesh",
           "stiffness", "von_mises"]  # fmt: skip
