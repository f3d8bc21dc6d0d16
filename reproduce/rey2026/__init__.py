"""The tables and figures of rey2026, computed again: see `README.md`."""
