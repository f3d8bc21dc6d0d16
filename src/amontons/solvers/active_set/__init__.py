"""Active sets with their linear problems."""
