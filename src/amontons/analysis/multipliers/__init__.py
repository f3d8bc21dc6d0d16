"""Quadratic multipliers: matrix inequalities solved, and proved with rounding counted."""
