"""Limits of load and friction: from when on a body is locked in, or gives way."""
