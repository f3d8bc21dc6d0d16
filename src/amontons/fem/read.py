"""Mesh files."""

from __future__ import annotations

from .mesh import Mesh


def read_mesh(path: str) -> Mesh:
    raise NotImplementedError
