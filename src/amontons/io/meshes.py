"""Mesh files of all formats: those that are decks here, others in `mechanics.meshes.read`."""

from __future__ import annotations

import os
from pathlib import Path

from ..mechanics.meshes import Mesh
from ..mechanics.meshes import read_mesh as read_plain
from ..mechanics.meshes.split import Glue

DECKS = (".inp", ".inp.gz")


def read_mesh(path: str | os.PathLike[str], *, glue: Glue = True) -> Mesh:
    """The mesh in a file: gmsh 2.2 or 4.1, a deck's (`.inp`), or any format that meshio reads.

    Of second order too, with sides curved as in the file.
    Groups of the highest dimension become regions, groups one dimension lower surfaces, also
    named node sets (NSET) and the SURFACEs of a deck.  Groups without a name go by their
    number.  A mesh of plane cells with constant z is a mesh in 2D.  Raises FileFormatError
    naming file and line.

    Regions that share nodes are bonded.  glue=False takes them apart where they meet, so that
    they can be in contact, glue={"joint": False} only along the surface joint; its sides are
    then called joint-steel and joint-copper after the regions, see `meshes.split.split`.
    """
    name = os.fspath(path)
    if name.lower().endswith(DECKS) and Path(name).is_file():
        from .decks.mesh_file import read_deck_mesh

        return read_deck_mesh(name, glue=glue)
    return read_plain(name, glue=glue)
