"""Stability of sliding states: complex modes, flutter and divergence over the friction."""
