"""Cells of several meshes cut into parts of about equal size with short borders, by METIS."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ...core.errors import InvalidInput, MissingDependency
from .mesh import Mesh

Index = NDArray[np.int64]
FINENESS = 120  # METIS takes whole numbers: so many stand for one node


def partition(meshes: Sequence[Mesh], parts: int) -> list[Index]:
    """Part of every cell, 0 to parts - 1: per mesh (cells,), in the order of its blocks.

    All meshes are cut as one; parts have about as many nodes each.  Raises InvalidInput when
    there are too few cells for so many parts, MissingDependency without pymetis.
    """
    counts = [mesh.cell_count for mesh in meshes]
    if parts == 1:
        return [np.zeros(count, dtype=np.int64) for count in counts]
    of_node = sparse.block_diag([_nodes_of_cells(mesh) for mesh in meshes], format="csr")
    sharing = 1 / np.asarray(of_node.sum(axis=0)).ravel()
    weight = np.rint(FINENESS * (of_node @ sharing)).astype(np.int64)
    shared = (of_node @ of_node.T).tocsr()
    beside = shared.multiply(shared >= meshes[0].dim).tocsr()  # cells with a facet in common
    beside.setdiag(0)
    beside.eliminate_zeros()
    _, label = _pymetis().part_graph(
        parts, xadj=beside.indptr, adjncy=beside.indices, vweights=np.maximum(weight, 1)
    )
    label = np.asarray(label, dtype=np.int64)
    if np.bincount(label, minlength=parts).min() == 0:
        raise InvalidInput(
            f"parts: {sum(counts)} cells do not give {parts} parts; use fewer processes"
        )
    return np.split(label, np.cumsum(counts)[:-1])


def _nodes_of_cells(mesh: Mesh) -> sparse.csr_array:
    """Ones where a node belongs to a cell, (cells, nodes)."""
    tables = []
    for block in mesh.cells:
        count, size = block.nodes.shape
        starts = np.arange(0, count * size + 1, size)
        entries = (np.ones(count * size), block.nodes.ravel(), starts)
        tables.append(sparse.csr_array(entries, shape=(count, len(mesh.points))))
    return sparse.csr_array(sparse.vstack(tables, format="csr"))


def extract(mesh: Mesh, wanted: NDArray[np.bool_]) -> tuple[Mesh, Index]:
    """The mesh of some cells, (cells,), without surfaces, and the nodes (k,) it keeps."""
    blocks, first = [], 0
    for block in mesh.cells:
        last = first + len(block.nodes)
        blocks.append((block, block.nodes[wanted[first:last]]))
        first = last
    used = np.unique(np.concatenate([nodes.ravel() for _, nodes in blocks]))
    cells = tuple(
        replace(block, nodes=np.searchsorted(used, nodes))
        for block, nodes in blocks
        if len(nodes)
    )
    return Mesh(mesh.points[used], cells, axisymmetric=mesh.axisymmetric), used


def _pymetis() -> Any:
    try:
        import pymetis  # pyright: ignore[reportMissingImports]
    except ImportError as error:
        raise MissingDependency(
            "cutting a mesh into parts needs the package pymetis: "
            f'python -m pip install "amontons[distributed]" ({error})'
        ) from error
    return pymetis
