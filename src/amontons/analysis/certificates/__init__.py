"""Is a solution the only one: for this load, for every load, and the verdict."""
