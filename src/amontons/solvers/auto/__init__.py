"""The choice of method: what `solve(problem)` runs."""
