"""Laws of friction: cones, projections, a single contact."""
