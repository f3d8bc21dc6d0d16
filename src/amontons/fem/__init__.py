"""Finite elements: meshes and elasticity.  Only this folder loads NGSolve, and only on use."""

from .box import box
from .cad import mesh_shape, read_cad
from .elasticity import LinearElastic, cell_stress, stiffness, von_mises
from .facets import Cells, Facets
from .mesh import Mesh
from .order import second_order
from .read import is_cad, read_mesh
from .refine import refined

__all__ = ["Cells", "Facets", "LinearElastic", "Mesh", "box", "cell_stress", "is_cad",
           "mesh_shape", "read_cad", "read_mesh", "refined", "second_order", "stiffness",
           "von_mises"]  # fmt: skip
