"""Keyword decks of CalculiX and Abaqus: cards, flattened, as cases."""
