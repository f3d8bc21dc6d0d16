"""The measure that decides whether something is a solution."""
