"""Whether a solution is the only one for its load."""
