"""The examples and figures of ligursky2014, computed again: see `README.md`."""
