"""Ready-made models: walls, packings, bodies with several solutions."""
