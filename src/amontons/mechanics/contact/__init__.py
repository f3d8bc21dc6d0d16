"""Contact: obstacles, local frames, and the matrices that tie contacts to nodes."""

from .geometry import LevelSet, Obstacle, Plane, Sphere, frames
from .mismatch import Mismatch, mismatch
from .mortar import mortar_contact, mortar_nodes, mortar_obstacle
from .nitsche import Nitsche, NitscheTerms, nitsche_obstacle, nitsche_pair
from .nodal import ContactRows, contact_nodes, forces, nodal_contact
from .pairs import pair_contact

__all__ = ["ContactRows", "LevelSet", "Mismatch", "Nitsche", "NitscheTerms", "Obstacle",
           "Plane", "Sphere", "contact_nodes", "forces", "frames", "mismatch",
           "mortar_contact", "mortar_nodes", "mortar_obstacle", "nitsche_obstacle",
           "nitsche_pair", "nodal_contact", "pair_contact"]  # fmt: skip
