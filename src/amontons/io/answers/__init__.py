"""Answers of other programs and our own: displacements read from files, and written.

`frd` and `dat` are the formats of CalculiX, `matching` finds the nodes of a model in them,
`read` is the door: the suffix decides.
"""
