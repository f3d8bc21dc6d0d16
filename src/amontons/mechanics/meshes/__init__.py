"""Meshes: made, read, refined, written; parts and surfaces of them."""

from .box import box
from .cad import mesh_shape, read_cad
from .facets import Cells, Facets
from .mesh import Mesh
from .opened import opened
from .order import second_order
from .read import is_cad, read_mesh
from .refine import refined
from .ring import ring

__all__ = ["Cells", "Facets", "Mesh", "box", "is_cad", "mesh_shape", "opened", "read_cad",
           "read_mesh", "refined", "ring", "second_order"]  # fmt: skip
