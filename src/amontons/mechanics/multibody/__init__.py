"""Rigid bodies that move far: shapes, contact, joints, steps in time."""

from .bodies import GROUND, Joint, RigidBodies, RigidBody
from .moving import at_start, evolve_rigid
from .shapes import Ball, Polyhedron, cuboid
from .states import RigidState, RigidStep

__all__ = ["GROUND", "Ball", "Joint", "Polyhedron", "RigidBodies", "RigidBody", "RigidState",
           "RigidStep", "at_start", "cuboid", "evolve_rigid"]  # fmt: skip
