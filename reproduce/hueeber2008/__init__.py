"""The tables and figures of hueeber2008, computed again: see `README.md`."""
