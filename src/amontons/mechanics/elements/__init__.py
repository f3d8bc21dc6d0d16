"""Finite elements: stiffness, mass, stresses, large strains, traces on surfaces."""

from .elasticity import LinearElastic, cell_stress, stiffness, von_mises

__all__ = ["LinearElastic", "cell_stress", "stiffness", "von_mises"]
