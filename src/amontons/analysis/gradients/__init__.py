"""Derivatives of verified solutions with respect to what a problem is made of."""
