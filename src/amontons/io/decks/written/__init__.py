"""Models written as decks of CalculiX and Abaqus."""

from .deck import DIALECTS, write_deck

__all__ = ["DIALECTS", "write_deck"]
