"""All solutions in 3D: regions of statuses and slip directions."""
