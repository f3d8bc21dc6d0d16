"""Multigrid for problems with contact on the finest level."""
