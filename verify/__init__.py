"""Cases with a number that theory gives or somebody else published: `python -m verify`."""
