"""Contact: obstacles, local frames, and the matrices that tie contacts to nodes."""

from .current_rows import current_contact
from .geometry import LevelSet, Obstacle, Plane, Sphere, frames
from .mismatch import Mismatch, mismatch
from .mortar import mortar_contact, mortar_nodes, mortar_obstacle
from .nitsche import Nitsche, NitscheTerms, nitsche_obstacle, nitsche_pair
from .nodal import ContactRows, contact_nodes, forces, nodal_contact
from .pairs import pair_contact
from .profiles import Cylinder, Extrusion, Profile, Revolution

__all__ = ["ContactRows", "Cylinder", "Extrusion", "LevelSet", "Mismatch", "Nitsche",
           "NitscheTerms", "Obstacle", "Plane", "Profile", "Revolution", "Sphere",
           "contact_nodes", "current_contact", "forces", "frames", "mismatch", "mortar_contact",
           "mortar_nodes", "mortar_obstacle", "nitsche_obstacle", "nitsche_pair",
           "nodal_contact", "pair_contact"]  # fmt: skip
