"""Published results, computed again: `python -m reproduce.PAPER` from the repository's root."""
