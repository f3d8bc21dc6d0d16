"""All solutions of a problem: exact search in 2D and 3D, and many starts."""
