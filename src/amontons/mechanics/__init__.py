"""From meshes to discrete problems: elements, contact, models, steps in time."""
